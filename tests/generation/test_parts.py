"""Ranges of scenes made apart: parts of a dataset, resumed, extended, refused, and joined."""

from __future__ import annotations

import json
import shutil

import pytest
from click.testing import CliRunner
from internav_cli.main import cli
from scene_stubs import CATALOGUE, InProcess, stub

from internav_data.core import storage
from internav_data.core.interrupts import InterruptedRunError
from internav_data.dataset import load_dataset, merge, read_manifest, shards
from internav_data.generation import run
from internav_data.generation.config import load_config
from internav_data.generation.run import generate
from internav_data.records.errors import CorruptDataError, UsageError
from internav_data.verification import validate

CONFIG = load_config(overrides=["episodes_per_scene=3"])
SCENES = 123
ORDERS = {"quarantine": [7, 63, 121]}
LINE = "missing or damaged: run the command that makes"


@pytest.fixture(autouse=True)
def few_scenes_a_shard(monkeypatch):
    monkeypatch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 24, "scenes": 50})
    monkeypatch.setattr(storage, "sync", lambda _: None)


class Forwards(InProcess):
    """Runs every task in this process, the first one first."""

    def run(self, recipe, tasks, tick):
        return super().run(recipe, list(tasks)[::-1], tick)


def made(out, scenes, executor="processes", workers=0, config=CONFIG, **orders):
    out.parent.mkdir(parents=True, exist_ok=True)
    (out.parent / "stub.json").write_text(json.dumps({**ORDERS, **orders}))
    executor = {"here": InProcess(), "forwards": Forwards()}.get(executor, executor)
    generate(out, config, scenes, workers, assets=CATALOGUE, executor=executor, setup=stub)
    return out


def content(out):
    return {
        path.relative_to(out).as_posix(): path.read_bytes() if path.is_file() else b""
        for path in sorted(out.rglob("*"))
    }


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 24, "scenes": 50})
        return content(made(tmp_path_factory.mktemp("whole") / "d", SCENES, "here"))


@pytest.mark.parametrize("ends", [[114, 123], [2, 61, 64, 121, 123]])
def test_ranges_merged_are_a_run_in_one_piece(tmp_path, whole, ends):
    parts, first = [], 0
    for number, end in enumerate(ends):
        short = number < 2 and end - first < 10
        where = ("processes", 1 + end % 2) if short else ("here", 0)
        parts.append(made(tmp_path / f"part-{number}", range(first, end), *where))
        assert validate(parts[-1], level="files").ok
        assert sum(1 for _ in load_dataset(parts[-1])) == len(load_dataset(parts[-1]))
        first = end
    merge(parts, tmp_path / "all")
    assert content(tmp_path / "all") == whole


def test_a_part_is_the_same_however_often_it_is_interrupted_and_extended(tmp_path, monkeypatch):
    once = content(made(tmp_path / "once", range(30, 80), "here"))
    out = tmp_path / "often"
    with monkeypatch.context() as patch:
        patch.setattr(run, "Interrupts", lambda: _Stop(20))
        with pytest.raises(InterruptedRunError, match="interrupted"):
            made(out, range(30, 60), "forwards")
    part = read_manifest(out).part
    assert (part.first_scene, part.end_scene) == (30, 60), "what it is to hold"
    assert 30 < read_manifest(out).scene_numbers.stop < 60
    with pytest.raises(CorruptDataError, match="the part is not finished"):
        merge([out], tmp_path / "all")
    made(out, range(30, 60), "here")
    made(out, range(30, 80), "here")
    assert content(out) == once
    made(out, range(30, 70), "here")
    assert content(out) == once, "a shorter range takes nothing away"


class _Stop:
    """Interrupt of a run once so many questions were asked."""

    signum = 2

    def __init__(self, questions):
        self.left = questions

    def __call__(self):
        self.left -= 1
        return self.left < 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


def test_a_damaged_part_is_made_again_by_its_command(tmp_path):
    out = made(tmp_path / "part", range(30), "here")
    before = content(out)
    victim = next((out / "data/episodes").iterdir())
    victim.unlink()
    with pytest.raises(CorruptDataError, match=LINE):
        merge([out], tmp_path / "all")
    made(out, range(30), "here")
    assert content(out) == before


def test_another_range_in_the_folder_of_a_part_is_refused(tmp_path, monkeypatch):
    part = made(tmp_path / "part", range(30, 40), "here")
    whole = made(tmp_path / "whole", 5, "here")
    before = content(part), content(whole)
    for out, scenes, message in (
        (part, 50, "holds the part 30:40 of a dataset: give --scene-range 30:40 to go on"),
        (part, range(20, 40), "holds the part 30:40 of a dataset"),
        (whole, range(10), "holds a dataset that is no part of one: leave --scene-range out"),
    ):
        with pytest.raises(UsageError, match=message):
            made(out, scenes, "here")
    monkeypatch.setattr(run, "source_digest", lambda: "b" * 64)
    with pytest.raises(UsageError, match="a part that other code of this version made"):
        made(part, range(30, 50), "here")
    assert (content(part), content(whole)) == before


def test_scenes_of_another_range_are_not_lost(tmp_path):
    out = tmp_path / "part"
    with pytest.raises(Exception, match="No space"):
        made(out, range(30, 40), "here", full=35)
    for numbers in (range(37, 40), range(30, 38)):
        with pytest.raises(UsageError, match=r"scenes 3\d to 39 are .* --scene-range 3[0-7]:40"):
            made(out, numbers, "here")
    made(out, range(30, 40), "here", full=None)
    assert read_manifest(out).scene_numbers == range(30, 40)


def test_a_part_may_hold_quarantined_scenes_alone(tmp_path):
    parts = [made(tmp_path / "a", range(7), "here"), made(tmp_path / "b", range(7, 8), "here")]
    assert merge(parts, tmp_path / "all").scenes == 8
    shutil.rmtree(tmp_path / "all")
    assert len(load_dataset(parts[1])) == 0


def test_ids_go_on_beyond_a_million(tmp_path):
    out = made(tmp_path / "part", range(999_998, 1_000_003), "here")
    assert validate(out, level="files").ok
    ids = load_dataset(out).scene_ids
    assert ids == tuple(f"scene-{k}" for k in (999_998, 999_999, 1_000_000, 1_000_001, 1_000_002))
    again = made(tmp_path / "again", range(999_998, 1_000_001), "here")
    made(again, range(999_998, 1_000_003), "here")
    assert content(again) == content(out), "staged, committed and extended by number"


def test_the_command_takes_a_range_and_refuses_what_is_none(tmp_path):
    for given, message in (
        ("5", "expected A:B, as in 0:6000"),
        ("-1:5", "expected A:B, as in 0:6000"),
        ("5:5", "scene range is 5:5: expected A:B with 0 <= A < B"),
        ("0:10000001", "scene range is 0:10000001"),
    ):
        found = CliRunner().invoke(
            cli, ["generate", "--out", str(tmp_path / "d"), f"--scene-range={given}"]
        )
        assert message in f"{found.output} {found.exception}"
    both = ["generate", "--out", str(tmp_path / "d"), "--scenes=5", "--scene-range=0:5"]
    assert "--scenes and --scene-range: give one of them" in CliRunner().invoke(cli, both).output
    assert not (tmp_path / "d").exists()


def test_commands_say_that_they_read_a_part(tmp_path):
    part = made(tmp_path / "part", range(30, 40), "here")
    found = CliRunner().invoke(cli, ["stats", str(part), "--json"])
    assert found.exit_code == 0, found.output
    assert f"dataset: {part}; part 30:40 of a dataset" in found.output


def test_the_command_merges_parts(tmp_path):
    parts = [made(tmp_path / "a", range(6), "here"), made(tmp_path / "b", range(6, 12), "here")]
    out = tmp_path / "all"
    given = ["merge", *map(str, parts), "--out", str(out), "--json"]
    found = CliRunner().invoke(cli, given)
    assert found.exit_code == 0, found.output
    assert json.loads(found.stdout.splitlines()[-1]) == {
        "out": str(out),
        "scenes": 12,
        "episodes": read_manifest(out).counts["train"].episodes
        + sum(read_manifest(out).counts[split].episodes for split in ("val", "test")),
        "parts": [str(part) for part in parts],
    }
