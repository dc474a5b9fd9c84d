"""EIO, ENOSPC and SIGKILL at every call that changes the disk: the same command goes on.

A case is a scenario, a fault and a range of calls: "extend ENOSPC 40:50". The cases "extend
complete" compare the calls that can fail with the system calls of the same run, where there is
strace.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import json
import os
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from campaign import Row
from fault_points import FAULTS, FaultPoints, mark_of
from stub_runs import (
    STRANGERS,
    InOrder,
    check_readable,
    contents,
    difference,
    forked,
    in_scratch,
    made,
    merged,
    scratch,
)
from system_calls import strace, system_calls
from worker_setups import POINT, with_fault_points

from internav_data.core.storage import write_atomically
from internav_data.generation.executors import ProcessExecutor
from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Callable

BLOCK = 10
"""Calls of one case."""
SCENES = 4
_STRERROR = {"EIO": "Input/output error", "ENOSPC": "No space left on device"}
_FREE = re.compile(r"\(\d[\d,]* bytes free\)")
"""What an error for a full disk says besides."""


@dataclass(frozen=True)
class Scenario:
    """A command, and the folder that it is run in."""

    begin: Callable[[Path], object]
    """Fills a folder."""
    act: Callable[[Path], object]
    """The command; it writes below `folder/d`."""
    damaged: bool = False
    """Whether readers may refuse the dataset until the command has ended."""
    in_worker: bool = False
    """Whether faults happen in a worker process."""

    def watched(self, folder: Path) -> Path:
        """Return the folder below which calls count."""
        return folder / "d" if self.in_worker else folder


def _extended(folder):
    made(folder / "d", 2)
    for name, data in STRANGERS.items():
        write_atomically(folder / "d" / name, data)


def _half_made(folder):
    """Leave what a kill leaves at the end of the first commit."""
    at = next(
        k for k, (kind, path) in enumerate(calls("new")) if (kind, path) == ("rename", _MANIFEST)
    )
    _faulty("new", folder, at - 6, "SIGKILL")


_MANIFEST = "d/.manifest.json"


def _damaged(folder):
    made(folder / "d", SCENES)
    for name in ("README.md", *sorted(p for p in contents(folder / "d") if "train-00001" in p)):
        path = folder / "d" / name
        path.write_bytes(path.read_bytes()[:-9])


def _parts(folder):
    for span in (range(2), range(2, 3), range(3, SCENES)):
        made(folder / f"part-{span.start}", span)


def _merged(folder):
    merged(sorted(folder.glob("part-*")), folder / "d")


def _whole(folder):
    return made(folder / "d", SCENES)


SCENARIOS = {
    "new": Scenario(lambda _: None, _whole),
    "extend": Scenario(_extended, _whole),
    "resume": Scenario(_half_made, _whole),
    "repair": Scenario(_damaged, _whole, damaged=True),
    "retry": Scenario(lambda f: made(f / "d", SCENES, executor=InOrder(dies=(2,))), _whole),
    "merge": Scenario(_parts, _merged),
    "worker": Scenario(
        lambda _: None,
        lambda f: made(f / "d", SCENES, executor=ProcessExecutor(1), setup=with_fault_points),
        in_worker=True,
    ),
}


@functools.cache
def _begun(name: str) -> Path:
    """Return a folder as a scenario begins in it; copied for each run."""
    folder = scratch("begun")
    SCENARIOS[name].begin(folder)
    return folder


@functools.cache
def _ended(name: str) -> Path:
    """Return a folder as it is after the command of a scenario without a fault."""
    folder = scratch("ended")
    shutil.copytree(_begun(name), folder, dirs_exist_ok=True)
    SCENARIOS[name].act(folder)
    return folder


@functools.cache
def _ended_contents(name: str) -> dict[str, bytes | None]:
    return contents(_ended(name))


@functools.cache
def calls(name: str) -> list[tuple[str, str]]:
    """Return the calls of a scenario that change the disk: kind, and path below its folder."""
    _ended(name)  # what is imported late is by now
    folder = scratch("calls")
    shutil.copytree(_begun(name), folder, dirs_exist_ok=True)
    text = _faulty(name, folder, None, "SIGKILL")
    shutil.rmtree(folder)
    return [tuple(call) for call in json.loads(text)]


def _faulty(name: str, folder: Path, at: int | None, fault: str) -> str:
    """Run a command with a fault in a copy of this process; without one, return its calls.

    Asserts that the fault has happened.
    """
    scenario = SCENARIOS[name]

    def here():
        points = FaultPoints(folder, at, fault)
        points.install()
        scenario.act(folder)
        return json.dumps([(kind, _without_process(path)) for kind, path in points.log])

    def in_worker():
        os.environ[POINT] = json.dumps([str(folder), at, fault])
        scenario.act(folder)
        log = json.loads((folder / "log").read_text()) if at is None else []
        return json.dumps([(kind, _without_process(f"d/{path}")) for kind, path in log])

    outcome = forked(in_worker if scenario.in_worker else here)
    mark = mark_of(scenario.watched(folder))
    assert mark.exists() == (at is not None), f"call {at} was not reached: {outcome}"
    mark.unlink(missing_ok=True)
    return outcome


def _without_process(path: str) -> str:
    """Return the path of a temporary file without the number of its process."""
    head, _, last = path.rpartition(".")
    return head.rpartition(".")[0] if last == "tmp" else path


def cases():
    """Yield blocks of all scenarios and faults, in turns."""
    yield from (f"{name} complete" for name in SCENARIOS if strace())
    rows = [
        [
            f"{name} {fault} {first}:{min(first + BLOCK, len(calls(name)))}"
            for first in range(0, len(calls(name)), BLOCK)
        ]
        for name in SCENARIOS
        for fault in FAULTS
    ]
    workers = rows[-len(FAULTS) :]  # a second for each run, as processes start
    for some in (rows[: -len(FAULTS)], workers):
        for blocks in itertools.zip_longest(*some):
            yield from filter(None, blocks)


def run(key: str, folder: Path):
    """Run a command with a fault at each of some calls, look at what is there, run it again."""
    if key.endswith("complete"):
        return _compared(key.removesuffix(" complete"), folder)
    name, fault, span = key.split()
    first, end = map(int, span.split(":"))
    kinds: dict[str, int] = {}
    for at in range(first, end):
        kind, path = calls(name)[at]
        kinds[kind] = kinds.get(kind, 0) + 1
        run_one(name, fault, at, folder / str(at), f"{kind} of {path}, call {at}")
    return {"runs": end - first, "calls": kinds}


def _compared(name: str, folder: Path):
    """Compare the calls that can fail with the system calls of a run without a fault."""
    shutil.copytree(_begun(name), folder / "run")
    script = (
        f"import sys; sys.path[:0] = [{str(Path(__file__).parent)!r}]\n"
        "import faults, pathlib\n"
        f"text = faults._faulty({name!r}, pathlib.Path({str(folder / 'run')!r}), None, '')\n"
        f"pathlib.Path({str(folder / 'calls')!r}).write_text(text)"
    )
    traced = [
        (kind, _without_process(path))
        for kind, path in system_calls(script, folder / "run")
        if path == "d" or path.startswith("d/")
    ]
    counted = [tuple(call) for call in json.loads((folder / "calls").read_text())]
    if SCENARIOS[name].in_worker:
        kinds = {"unlink", "rmdir"}  # of its parent alone
        counted, traced = (
            [call for call in some if ".work/scenes/" in call[1] and call[0] not in kinds]
            for some in (counted, traced)
        )
    assert traced == counted, next(
        (k, pair)
        for k, pair in enumerate(itertools.zip_longest(traced, counted))
        if len({*pair}) > 1
    )
    return {"runs": 1, "system_calls": len(traced)}


def run_one(name: str, fault: str, at: int, folder: Path, where: str) -> None:
    """Run a scenario with one fault, then again without."""
    scenario = SCENARIOS[name]
    shutil.copytree(_begun(name), folder)
    outcome = _faulty(name, folder, at, fault)
    if fault == "SIGKILL" and not scenario.in_worker:
        assert outcome == "killed by SIGKILL", f"{where}: {outcome}"
    else:
        assert not outcome.startswith(("bug", "killed")), f"{where}: {outcome}"
    if outcome.startswith("error"):
        _check_message(outcome, fault, folder, where)
    with contextlib.suppress(*((CorruptDataError,) if scenario.damaged else ())):
        check_readable(folder / "d", _ended(name) / "d")
    scenario.act(folder)
    for trace in ("workers", "log"):
        (folder / trace).unlink(missing_ok=True)
    differences = difference(contents(folder), _ended_contents(name))
    assert not differences, f"{where}: after the same command again: {differences}"
    shutil.rmtree(folder)


def _check_message(message: str, fault: str, folder: Path, where: str) -> None:
    """Check that an error of the disk is one line with its path, its cause and what to do."""
    assert "\n" not in message, f"{where}: {message}"
    assert str(folder) in message, f"{where}: no path: {message}"
    assert _STRERROR[fault] in message, f"{where}: {message}"
    assert "run the same command again" in message, f"{where}: {message}"
    assert bool(_FREE.search(message)) == (fault == "ENOSPC"), f"{where}: {message}"


ROW = Row("faults", cases, in_scratch(run))
