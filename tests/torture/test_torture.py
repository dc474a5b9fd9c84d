"""Some cases of each row of `make torture`, and the frame itself."""

from __future__ import annotations

import ast
import contextlib
import dataclasses
import itertools
import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from importlib import util
from pathlib import Path, PurePosixPath

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import bits
import digests
import faults
import fuzz
import kills
import memory
import mutant
import mutants
import states
from campaign import (
    Row,
    code_digest,
    lines_of,
    newest_code,
    run_row,
    run_rows,
    seconds_of,
    standing,
    summary,
    to_run,
)
from strategies import rng
from stub_runs import forked

from internav_data.records.errors import CorruptDataError

_spec = util.spec_from_file_location("torture_command", Path(__file__).with_name("__main__.py"))
command = util.module_from_spec(_spec)  # pytest's own is the __main__ that can be imported
_spec.loader.exec_module(command)


@pytest.mark.parametrize("fault", ["EIO", "ENOSPC", "SIGKILL"])
def test_a_fault_at_a_call_loses_nothing(tmp_path, fault):
    calls = faults.calls("extend")
    assert {kind for kind, _ in calls} >= {"open", "write", "fsync", "rename", "unlink", "mkdir"}
    first = {kind: calls.index((kind, path)) for kind, path in reversed(calls)}
    chosen = {"EIO": "fsync", "ENOSPC": "write", "SIGKILL": "rename"}[fault]
    for at in (first[chosen], calls.index((chosen, "d/.manifest.json"))):
        faults.run_one("extend", fault, at, tmp_path / str(at), f"{chosen} {at}")


@pytest.mark.parametrize("name", faults.SCENARIOS)
def test_a_file_and_its_folders_are_on_the_disk_before_a_manifest_names_it(name):
    """After a power cut, all that a manifest names is there."""
    written, entered = set(), set()  # files and folders that the disk does not hold yet
    for kind, path in faults.calls(name):
        folder = str(PurePosixPath(path).parent)
        if kind == "fsync":
            written.discard(path)
            entered.discard(path)
        elif kind in {"write", "truncate"}:
            written.add(path)
        elif kind == "mkdir":
            entered.add(folder)
        elif kind == "rename":
            assert path not in written
            if path.endswith("/.manifest.json"):
                assert not entered - {"."}
            entered.add(folder)
    assert not entered - {"."}  # not watched itself


def test_a_damaged_journal_is_noticed(tmp_path):
    assert bits.run("journal cuts", tmp_path)["unnoticed_but_right"] <= 1, "the last line break"
    assert bits.run("journal 0 40:72", tmp_path)["unnoticed_but_right"] == 0


@pytest.mark.slow
def test_a_group_killed_at_an_fsync_goes_on(tmp_path):
    assert kills.run("fsync 60", tmp_path)["runs"] == 1


def test_a_folder_is_what_a_model_of_it_says():
    totals = states.run_machine(seed=0, runs=2, steps=10)
    assert totals["runs"] == 2
    assert 0 < totals["steps"] <= 20


@pytest.mark.parametrize("name", ["journal", "staged", "parquet", "cache"])
def test_changed_bytes_are_read_or_refused(tmp_path, name):
    outcome = forked(lambda: fuzz.hammer(name, 0, 0.1, tmp_path / "place"))
    assert outcome.isdigit(), outcome
    assert int(outcome) > 0


def test_mutants_are_all_different():
    target = mutant.TARGETS["advantages"]
    _, _, count = mutant.mutated(target, None)
    texts = {ast.unparse(mutant.mutated(target, number)[0]) for number in range(count)}
    as_it_is = ast.unparse(ast.parse(mutant.source_of(target).read_text()))
    assert len(texts - {as_it_is}) == count > 10


def test_cases_of_digests_hold_every_pair_of_circumstances():
    cases = [dict(item.split("=") for item in key.split()) for key in digests.cases()]
    for a, b in itertools.combinations(digests.AXES, 2):
        pairs = {(case[a], case[b]) for case in cases}
        assert pairs == set(itertools.product(digests.AXES[a], digests.AXES[b]))


def _tests_with_mutant(folder, number, test, first="pass"):
    """Run a test of a module of one function with a mutant of it; return the exit code."""
    for name in ("made/module.py", "tests/test_it.py"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / "made" / "module.py").write_text("def answer():\n    return 41\n")
    (folder / "tests" / "test_it.py").write_text(test)
    script = f"""import sys; sys.path[:0] = [{str(Path(__file__).parent)!r}, {str(folder)!r}]
import mutant, pathlib; {first}
mutant.ROOT, mutant.TARGETS["it"] = (
    pathlib.Path({str(folder)!r}), mutant.Target("made.module", ("test_it.py",)))
sys.exit(mutant.main())"""
    env = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    done = subprocess.run(
        [sys.executable, "-c", script, "it", number],
        cwd=folder,
        env=env,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout + done.stderr


def test_tests_import_the_mutant_or_it_does_not_count(tmp_path):
    test = "from made import module\ndef test_it():\n    assert module.answer() == 41\n"
    assert _tests_with_mutant(tmp_path, "none", test)[0] == 0
    assert mutants.how_it_ended(*_tests_with_mutant(tmp_path, "0", test)) == "tests failed"
    code, _ = _tests_with_mutant(tmp_path, "0", "def test_it():\n    assert False\n")
    assert code == mutant.NOT_LOADED
    _, text = _tests_with_mutant(tmp_path, "0", test, "import made.module")
    assert "made was imported before its mutant was there" in text


def test_only_ends_that_a_mutant_caused_count():
    ends = {
        (0, ""): "survived",
        (1, ""): "tests failed",
        (None, ""): "timeout",
        (2, "Interrupted: 1 error during collection"): "error during collection",
        (4, "ImportError while loading conftest"): "ImportError while loading conftest",
    }
    assert {end: mutants.how_it_ended(*end) for end in ends} == ends
    for code in (2, 3, 4, 5, -9, mutant.NOT_LOADED):
        with pytest.raises(AssertionError, match=r"code|never imported"):
            mutants.how_it_ended(code, "")


def test_mutants_do_not_count_where_tests_fail_without(tmp_path, monkeypatch):
    monkeypatch.setattr(mutants, "tests_with", lambda *_: (1, "broken"))
    with pytest.raises(AssertionError, match="fail without a mutant: code 1: broken"):
        mutants.run("manifest 0", tmp_path)


def test_mutants_of_a_module_that_has_changed_are_other_cases(tmp_path, monkeypatch):
    folder = tmp_path / "made"
    folder.mkdir()
    target = mutant.Target("made.module", ())
    monkeypatch.setattr(mutant, "ROOT", tmp_path)
    monkeypatch.setattr(mutants, "TARGETS", {"it": target})
    texts = ("x = a < 1", "x = a < 1  # a comment changes none", "x = a < 2")
    keys = []
    for text in texts:
        (folder / "module.py").write_text(f"def f(a):\n    {text}\n")
        mutants.drawn.cache_clear()
        keys.append(list(mutants.cases()))
    mutants.drawn.cache_clear()
    assert keys[0] == keys[1]
    assert set(keys[0]) & set(keys[2]) == {"it none"}


def test_a_target_whose_mutants_survive_falls_short(tmp_path):
    kills = {"a": [1] * 85 + [0] * 15, "b": [1] * 84 + [0] * 16}
    lines = [
        {"case": f"{name} {number}", "runs": 1, "killed": killed}
        for name, each in kills.items()
        for number, killed in enumerate(each)
    ]
    assert mutants.shortfalls([{"case": "a none", "runs": 0}, *lines]) == [
        "b: 84 of 100 mutants killed, 85% asked"
    ]
    row = Row("some", lambda: ["b 0"], lambda *_: {"runs": 1, "killed": 0}, mutants.shortfalls)
    run_row(row, time.monotonic() + 1000, results=tmp_path)
    state = standing(row, newest_code([row], tmp_path), tmp_path)
    assert not state.is_good
    assert "0 of 1 mutants killed" in summary(row, state)


def test_the_clock_of_digests_is_moved_in_processes_that_are_started():
    for clock in ("1970", "2040"):
        digests.check_clock(clock)


def test_a_clock_that_is_not_moved_is_noticed(monkeypatch):
    monkeypatch.setattr(digests, "_CLOCK", "")
    with pytest.raises(AssertionError, match="the clock of 2040 is not moved"):
        digests.check_clock.__wrapped__("2040")


@pytest.mark.parametrize(
    ("slope_kb", "noise_kb", "error"),
    [(0.0, 10.0, None), (8.0, 10.0, None), (11.0, 10.0, "grows"), (8.0, 20_000.0, "grows")],
)
def test_growth_is_bounded_by_the_upper_end_of_its_interval(slope_kb, noise_kb, error):
    noise = rng(0).normal(scale=noise_kb, size=100)
    done = np.arange(1, 101) * 20
    fills = np.minimum(done, 900) * 100.0  # caches, in the first half
    memory_kb = 500_000 + fills + slope_kb * done + noise
    figures = memory.figures([(at, kb, 5, 0, 1) for at, kb in zip(done, memory_kb, strict=True)])
    assert figures["low_kb"] <= figures["slope_kb"] <= figures["high_kb"]
    with pytest.raises(AssertionError, match=error) if error else contextlib.nullcontext():
        memory.check(figures)


@pytest.mark.parametrize("name", memory.CONSTANT)
def test_handles_shared_memory_and_threads_do_not_grow(name):
    column = 2 + memory.CONSTANT.index(name)
    rows = [[at, 500_000.0, 5, 0, 1] for at in range(100)]
    memory.check(memory.figures(rows))
    rows[-1][column] += 1
    with pytest.raises(AssertionError, match=f"{name} from"):
        memory.check(memory.figures(rows))


def test_memory_that_is_held_counts_and_freed_memory_does_not():
    before, *_ = memory.held()
    cycle = [[b"x" * 2000 + bytes([k % 256]) for k in range(20_000)]]
    last = cycle[0][-1]  # holds the end of the heap, which no allocator gives back by itself then
    during, *_ = memory.held()
    cycle.append(cycle)
    del cycle
    after, *_ = memory.held()
    assert last
    assert during - before > 30_000 > abs(after - before)


def test_a_campaign_goes_on_where_it_was_stopped(tmp_path):
    def run(key, folder):
        assert not list(folder.iterdir())
        assert key != "b" or (tmp_path / "mended").exists(), "broken"
        return {"runs": 2}

    row, later = Row("some", lambda: ["a", "b", "c"], run), time.monotonic() + 1000
    reports: list[str] = []
    options = {"results": tmp_path / "r", "report": reports.append, "code": "1"}
    assert run_row(row, time.monotonic() - 1, **options) == []
    assert run_row(row, later, **options) == ["b"]
    assert "broken" in reports[2]
    (tmp_path / "mended").touch()
    reports.clear()
    assert run_row(row, later, **options) == []
    assert reports == ["some: b: passed"]
    state = standing(row, "1", tmp_path / "r")
    assert summary(row, state).startswith("some: 3 of 3 cases (0 with older code), 6 runs, 0 cases")
    assert run_row(row, later, only="a", **options) == []
    assert len(lines_of(tmp_path / "r" / "some.jsonl")) == 3


def test_results_are_of_the_code_that_ran(tmp_path):
    def run(key, _):
        assert key != "broken"
        return {"runs": 1}

    cases = ["a", "b", "broken"]
    later, options = time.monotonic() + 1000, {"results": tmp_path, "report": lambda _: None}
    run_row(Row("some", lambda: cases, run), later, code="1", **options)
    run_row(Row("some", lambda: ["a"], run), later, code="2", **options)
    row = Row("some", lambda: [*cases, "new"], run)
    lines = lines_of(tmp_path / "some.jsonl")
    assert to_run(row.cases(), lines, "2") == ["new", "broken", "b"]
    assert to_run(row.cases(), lines, "1") == ["new", "a", "broken"]
    state = standing(row, "2", tmp_path)
    assert (state.cases, state.current, state.older, state.failed) == (4, 1, 1, ("broken",))
    assert not state.is_good
    gone = Row("some", lambda: ["b"], run)
    assert standing(gone, "2", tmp_path).is_good, "what is no case of the row does not count"


def test_the_digest_of_the_code_is_that_of_its_files_without_results(tmp_path):
    def digest():
        return code_digest.__wrapped__(tmp_path)

    (tmp_path / "tests" / "torture" / "results").mkdir(parents=True)
    digests_seen = [digest()]
    for name in ("tests/a.py", "tests/torture/results/a.jsonl"):
        (tmp_path / name).write_text("1")
        digests_seen.append(digest())
    assert digests_seen[0] != digests_seen[1] == digests_seen[2]


def test_a_line_that_a_kill_cut_is_no_result(tmp_path):
    row, options = Row("some", lambda: ["a", "b"], lambda *_: {}), {"results": tmp_path}
    path = tmp_path / "some.jsonl"
    run_row(row, time.monotonic() + 1000, **options)
    path.write_bytes(path.read_bytes()[:-20])
    assert [line["case"] for line in lines_of(path)] == ["a"]
    run_row(row, time.monotonic() + 1000, **options)
    assert [line["case"] for line in lines_of(path)] == ["a", "b"]
    assert len(path.read_text().splitlines()) == 2


def test_rows_share_the_time(tmp_path, monkeypatch):
    clock = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])

    def run(key, _):
        clock[0] += 1
        return {}

    many = [str(number) for number in range(99)]
    keys = {"a": ["0"], "b": many, "c": many}
    rows = [Row(name, lambda name=name: keys[name], run) for name in keys]
    run_rows(rows, 31, results=tmp_path, report=lambda _: None)
    ran = {row.name: len(lines_of(tmp_path / f"{row.name}.jsonl")) for row in rows}
    assert ran == {"a": 1, "b": 15, "c": 15}


def test_a_case_needs_its_row(capsys):
    assert command.arguments(["--row", "memory", "--case", "houses 2000"]).row == "memory"
    for words, error in {
        ("--case", "houses 2000"): "--case needs --row",
        ("--row", "memory", "--case", "houses"): "row memory has no case 'houses'",
        ("--budget", "2"): "BUDGET is '2'",
    }.items():
        with pytest.raises(SystemExit):
            command.arguments(list(words))
        assert error in capsys.readouterr().err


def test_the_table_counts_what_ran_with_the_newest_code():
    state = standing(Row("none", lambda: ["a"], lambda *_: {}), "")
    assert command.cells(state) == ["0 of 1 cases; 0 runs", "not run", "0"]
    state = replace(state, current=3, older=2, cases=9, runs=5, shortfalls=("b: too few",))
    assert command.cells(state)[:2] == [
        "3 of 9 cases, 2 more with older code; 5 runs",
        "none failed; b: too few",
    ]


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


def test_a_fault_that_does_not_happen_fails_its_case(tmp_path):
    beyond = len(faults.calls("extend"))
    with pytest.raises(AssertionError, match=f"call {beyond} was not reached"):
        faults.run_one("extend", "EIO", beyond, tmp_path / "run", "the end")


def test_a_run_that_fails_by_itself_or_is_not_killed_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(kills, "_run", lambda _: None)
    line = {"case": "fsync 0", **kills.run("fsync 0", tmp_path)}
    assert line["runs"] == 0
    assert kills.shortfalls([line]) == ["fsync: only 0 of 1 cases killed anything"]
    assert not kills.shortfalls([line, {**line, "killed": True}, {**line, "killed": True}])

    def broken(_):
        raise ValueError("a bug")

    monkeypatch.setattr(kills, "_run", broken)
    with pytest.raises(AssertionError, match="ValueError: a bug"):
        kills.run("fsync 0", tmp_path)
    kills.count_fsyncs.cache_clear()
    with pytest.raises(AssertionError, match="ValueError: a bug"):
        next(kills.cases())


@pytest.mark.parametrize("name", fuzz.READERS)
def test_fuzzing_begins_with_what_is_read(tmp_path, name):
    relative, valid, read = fuzz.reader_of(name)
    path = fuzz.beside(tmp_path / "place", relative)
    path.write_bytes(valid)
    assert fuzz.read_or_refused(read, path)


@pytest.mark.parametrize("error", [OSError("one line"), CorruptDataError("two\nlines"), KeyError()])
def test_fuzzing_takes_errors_for_users_alone(tmp_path, error):
    def read(_):
        raise error

    with pytest.raises((OSError, AssertionError, KeyError)):
        fuzz.read_or_refused(read, tmp_path)


def test_what_a_merge_leaves_is_looked_at(monkeypatch):
    folder = states.Folder()
    folder.begin()
    folder.generate(scenes=states.MAX_SCENES)
    folder.corrupt(number=0, cut=True, at=0.0)
    folder.merge(cut=2)
    assert folder.damaged, "it is refused, and nothing is changed"
    monkeypatch.setattr(states, "merged", lambda *_: None)
    with pytest.raises(AssertionError, match=r"expected the 5 scenes .* missing: README\.md"):
        folder.merge(cut=2)
    folder.teardown()
