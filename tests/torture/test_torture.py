"""Some cases of each row of `make torture`, and the frame itself."""

from __future__ import annotations

import ast
import dataclasses
import itertools
import json
import sys
import time
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import bits
import digests
import faults
import fuzz
import kills
import mutants
import states
from campaign import Row, lines_of, run_row, seconds_of, summary
from stub_runs import forked


@pytest.mark.parametrize("fault", ["EIO", "ENOSPC", "SIGKILL"])
def test_a_fault_at_a_call_loses_nothing(tmp_path, fault):
    calls = faults.calls("extend")
    assert {kind for kind, _ in calls} >= {"open", "write", "fsync", "rename", "unlink", "mkdir"}
    first = {kind: calls.index((kind, path)) for kind, path in reversed(calls)}
    chosen = {"EIO": "fsync", "ENOSPC": "write", "SIGKILL": "rename"}[fault]
    for at in (first[chosen], calls.index((chosen, "d/.manifest.json"))):
        faults.run_one("extend", fault, at, tmp_path / str(at), f"{chosen} {at}")


def test_a_damaged_journal_is_noticed(tmp_path):
    assert bits.run("journal cuts", tmp_path)["unnoticed_but_right"] <= 1, "the last line break"
    assert bits.run("journal 0 40:72", tmp_path)["unnoticed_but_right"] == 0


@pytest.mark.slow
def test_a_group_killed_at_an_fsync_goes_on(tmp_path):
    assert kills.run("fsync 60", tmp_path)["runs"] == 1


def test_a_folder_is_what_a_model_of_it_says():
    states.run_machine(seed=0, runs=2, steps=10)


@pytest.mark.parametrize("name", ["journal", "staged", "parquet", "cache"])
def test_changed_bytes_are_read_or_refused(tmp_path, name):
    said = forked(lambda: fuzz.hammer(name, 0, 0.1, tmp_path / "place"))
    assert said.isdigit(), said
    assert int(said) > 0


def test_mutants_are_all_different():
    target = mutants.TARGETS["advantages"]
    _, _, count = mutants.mutated(target, None)
    texts = {ast.unparse(mutants.mutated(target, number)[0]) for number in range(count)}
    as_it_is = ast.unparse(ast.parse(mutants.place_of(target).read_text()))
    assert len(texts - {as_it_is}) == count > 10


def test_cases_of_digests_hold_every_pair_of_circumstances():
    cases = [dict(item.split("=") for item in key.split()) for key in digests.cases()]
    for a, b in itertools.combinations(digests.AXES, 2):
        pairs = {(case[a], case[b]) for case in cases}
        assert pairs == set(itertools.product(digests.AXES[a], digests.AXES[b]))


def test_a_campaign_goes_on_where_it_was_stopped(tmp_path):
    def run(key, folder):
        assert not list(folder.iterdir())
        assert key != "b" or (tmp_path / "mended").exists(), "broken"
        return {"runs": 2}

    row, later = Row("some", lambda: ["a", "b", "c"], run), time.monotonic() + 1000
    said: list[str] = []
    arguments = {"results": tmp_path / "r", "say": said.append}
    assert run_row(row, time.monotonic() - 1, **arguments) == []
    assert run_row(row, later, **arguments) == ["b"]
    assert "broken" in said[2]
    (tmp_path / "mended").touch()
    said.clear()
    assert run_row(row, later, **arguments) == []
    assert said == ["some: b: passed"]
    assert summary(row, tmp_path / "r").startswith("some: 3 cases, 6 runs, 0 cases failed")
    assert run_row(row, later, only="a", **arguments) == []
    assert len(lines_of(tmp_path / "r" / "some.jsonl")) == 3


def test_budgets():
    assert [seconds_of(text) for text in ("90s", "30m", "2h", "1.5h")] == [90, 1800, 7200, 5400]
    for text in ("2", "h", "2 days"):
        with pytest.raises(ValueError, match="expected a number"):
            seconds_of(text)


def test_results_are_lines_of_json():
    for path in (Path(__file__).parent / "results").glob("*.jsonl"):
        for line in map(json.loads, path.read_text().splitlines()):
            assert {"case", "ok", "seconds", "of", "machine"} <= line.keys()


@pytest.mark.parametrize("kind", ["manifest", "episodes", "identity", "cache", "weights"])
def test_damage_is_noticed_and_nothing_else(tmp_path, monkeypatch, kind):
    name = bits.KINDS[kind].begin(tmp_path)
    bits.check_undamaged(kind, tmp_path, name)
    blind = dataclasses.replace(
        bits.KINDS[kind], noticed=lambda *_: False, unread=lambda _: range(0)
    )
    monkeypatch.setitem(bits.KINDS, kind, blind)
    with pytest.raises(AssertionError, match=r"bit 0 of byte 8: .* not noticed"):
        bits.run(f"{kind} 0 8:9", tmp_path)
    monkeypatch.setitem(bits.KINDS, kind, dataclasses.replace(blind, noticed=lambda *_: True))
    with pytest.raises(AssertionError, match="refused undamaged"):
        bits.run(f"{kind} 0 8:9", tmp_path)
