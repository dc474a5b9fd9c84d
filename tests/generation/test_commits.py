"""A run can be used while it goes on, and what it commits on the way changes no byte of its end."""

from __future__ import annotations

import functools
import json
import os
import random
import shutil
import signal
from dataclasses import dataclass, field, replace

import pytest
from scene_stubs import CATALOGUE, stub

from internav_data.core import storage
from internav_data.core.interrupts import InterruptedRunError
from internav_data.core.messages import Failed
from internav_data.core.worker import run_task
from internav_data.dataset import load_dataset, read_manifest, shards
from internav_data.generation import commits
from internav_data.generation.config import load_config
from internav_data.generation.progress import GenerationProgress
from internav_data.generation.run import generate
from internav_data.records.errors import InternavError, UsageError

CONFIG = load_config(overrides=["episodes_per_scene=2"])
SCENES = 30


@pytest.fixture(autouse=True)
def few_scenes_a_shard(monkeypatch):
    monkeypatch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 8, "scenes": 20})
    monkeypatch.setattr(storage, "sync", lambda _: None)


@dataclass
class Shuffled:
    """Runs tasks here, in an order of a seed; some of their workers die, and a signal may come."""

    seed: int = 0
    dying: frozenset[int] = frozenset()
    interrupted_after: int | None = None
    slots: int = 1
    begun: list[int] = field(default_factory=list)

    def run(self, recipe, tasks, tick):
        work = recipe.setup(recipe.payload)
        for task in random.Random(self.seed).sample(tasks, len(tasks)):  # noqa: S311
            if len(self.begun) == self.interrupted_after:
                os.kill(os.getpid(), signal.SIGTERM)
            if not tick():
                return
            self.begun.append(task)
            if task in self.dying:
                yield Failed(task, "its worker was killed by SIGKILL, 3 times", 3, died=True)
            else:
                yield run_task(work, task)


def made(out, executor=None, scenes=SCENES, progress=None, *, retry=False, **orders):
    out.parent.mkdir(parents=True, exist_ok=True)
    (out.parent / "stub.json").write_text(json.dumps(orders))
    return generate(
        out,
        CONFIG,
        scenes,
        progress=progress,
        assets=CATALOGUE,
        executor=executor or Shuffled(),
        setup=stub,
        retry_quarantined=retry,
    )


def contents(out):
    files = sorted(path for path in out.rglob("*") if path.is_file())
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in files}


@pytest.fixture(scope="module")
def in_one_go(tmp_path_factory):
    """Contents of datasets of which nothing was committed before the end."""

    @functools.cache
    def of(quarantine=()):
        out = tmp_path_factory.mktemp("one-go") / "d"
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(commits.PrefixCommits, "_commit", lambda *_: None)
            made(out, quarantine=quarantine)
        return contents(out)

    return of


def watched(monkeypatch, out):
    """Note what readers see after each commit: number of scenes, and episodes by scene."""
    real, seen = commits.commit_scenes, []

    def commit(*args, **keywords):
        manifest = real(*args, **keywords)
        seen.append((manifest.scenes, [e.episode_id for e in load_dataset(out)]))
        return manifest

    monkeypatch.setattr(commits, "commit_scenes", commit)
    return seen


@pytest.mark.parametrize("seed", range(2))
def test_commits_on_the_way_change_no_byte(tmp_path, monkeypatch, in_one_go, seed):
    out = tmp_path / "d"
    seen = watched(monkeypatch, out)
    made(out, Shuffled(seed), quarantine=(3, 17))
    assert contents(out) == in_one_go(quarantine=(3, 17))
    assert seen, "some scenes can be read before the end"
    whole = [e.episode_id for e in load_dataset(out)]
    for scenes, ids in seen:
        held = {f"scene-{k:06d}" for k in range(scenes)}
        assert ids == [i for i in whole if i.partition("/")[0] in held]


def test_scenes_in_order_are_committed_a_full_shard_at_a_time(tmp_path, monkeypatch):
    seen, progress = watched(monkeypatch, tmp_path / "d"), GenerationProgress()

    class InOrder(Shuffled):
        def run(self, recipe, tasks, tick):
            work = recipe.setup(recipe.payload)
            for task in sorted(tasks):
                tick()
                yield run_task(work, task)

    made(tmp_path / "d", InOrder(), progress=progress)
    assert [scenes for scenes, _ in seen] == [10, 18, 26], "8 train scenes each"
    assert "the first 26 can be read" in progress.line()


@pytest.mark.parametrize("after", [0, 9, 25])
def test_after_an_interrupt_the_first_scenes_can_be_read(tmp_path, in_one_go, after):
    out, stopped = tmp_path / "d", Shuffled(seed=after, interrupted_after=after)
    with pytest.raises(InterruptedRunError, match=f"interrupted after {after} of 30") as caught:
        made(out, stopped, quarantine=(3, 17))
    first = next(k for k in range(SCENES) if k not in stopped.begun)
    if first:
        assert f"the first {first} can be read in" in str(caught.value)
        assert read_manifest(out).scenes == first
        assert {e.scene_id for e in load_dataset(out)} == {
            f"scene-{k:06d}" for k in range(first) if k not in (3, 17)
        }
    else:
        assert not (out / "manifest.json").exists()
    go_on = Shuffled(seed=7)
    made(out, go_on, quarantine=(3, 17))
    assert sorted([*stopped.begun, *go_on.begun]) == list(range(SCENES)), "none is made twice"
    assert contents(out) == in_one_go(quarantine=(3, 17))


def test_fewer_scenes_than_are_finished_lose_none(tmp_path, in_one_go):
    class Gap(Shuffled):
        """Ends all scenes but number 20."""

        def run(self, recipe, tasks, tick):
            work = recipe.setup(recipe.payload)
            yield from (run_task(work, task) for task in sorted(tasks) if tick() and task != 20)
            os.kill(os.getpid(), signal.SIGTERM)

    out = tmp_path / "d"
    with pytest.raises(InterruptedRunError, match="the first 20 can be read"):
        made(out, Gap())
    before = contents(out)
    assert made(out, scenes=15).scenes == 20
    assert contents(out) == before
    with pytest.raises(UsageError, match=r"would be lost: ask for --scenes 30 or more"):
        made(out, scenes=25)
    assert contents(out) == before
    go_on = Shuffled()
    made(out, go_on)
    assert go_on.begun == [20]
    assert contents(out) == in_one_go()


@pytest.mark.parametrize("interrupted_after", [None, 20])
def test_scenes_whose_workers_died_are_tried_again(tmp_path, in_one_go, interrupted_after):
    out, disturbed = tmp_path / "d", Shuffled(3, frozenset({2, 11, 28}), interrupted_after)
    if interrupted_after is None:
        report = made(out, disturbed, quarantine=(5,))
        assert [report.died, len(report.quarantined), report.exit_code] == [3, 4, 4]
    else:
        with pytest.raises(InterruptedRunError):
            made(out, disturbed, quarantine=(5,))
    again = Shuffled(dying=frozenset({11}))
    report = made(out, again, quarantine=(5,))
    assert {2, 11, 28} <= set(again.begun), "not only what was never begun"
    assert [q.scene for q in read_manifest(out).quarantined if q.died] == [11]
    last = Shuffled()
    report = made(out, last, quarantine=(5,))
    assert last.begun == [11]
    assert (report.died, report.exit_code) == (0, 4)
    assert contents(out) == in_one_go(quarantine=(5,))
    assert made(out, last, quarantine=(5,)).new_scenes == 0


def test_all_quarantined_scenes_are_tried_again_on_demand(tmp_path, in_one_go):
    out, again = tmp_path / "d", Shuffled()
    made(out, Shuffled(1, frozenset({2})), quarantine=(5, 23))
    assert made(out, again, retry=True).exit_code == 0
    assert sorted(again.begun) == [2, 5, 23]
    assert contents(out) == in_one_go()


def test_the_command_hands_the_option_on(monkeypatch, tmp_path):
    from click.testing import CliRunner
    from internav_cli.generate import command

    report = made(tmp_path / "d", scenes=2)
    asked = []

    def generate(*_, retry_quarantined, **__):
        asked.append(retry_quarantined)
        return replace(report, died=3)

    monkeypatch.setattr("internav_data.generation.generate", generate)
    for options in ([], ["--retry-quarantined"]):
        result = CliRunner().invoke(command, ["--out", str(tmp_path / "d"), *options])
        assert "the workers of 3 quarantined scenes died" in result.output
    assert asked == [False, True]


def test_a_scene_that_fails_by_itself_is_not_tried_again(tmp_path):
    out, again = tmp_path / "d", Shuffled()
    made(out, quarantine=(5,))
    before = contents(out)
    assert made(out, again, quarantine=(5,)).new_scenes == 0
    assert again.begun == []
    assert contents(out) == before


@pytest.mark.parametrize("what", ["", ".work", ".work/scenes"])
def test_scenes_that_are_removed_before_they_are_committed_end_the_run_in_a_line(tmp_path, what):
    out = tmp_path / "d"

    class Removing(Shuffled):
        def run(self, recipe, tasks, tick):
            yield from super().run(recipe, tasks, tick)
            shutil.rmtree(out / what)

    with pytest.raises(InternavError, match="while this"):
        made(out, Removing(), 5)
    made(out, scenes=5)
    made(tmp_path / "whole" / "d", scenes=5)
    assert contents(out) == contents(tmp_path / "whole" / "d")
