"""SIGKILL of the group, the parent or a worker at random moments, and of the group at every fsync.

A case is "group 17", "parent 17" or "worker 17", a seed that draws the moment, or "fsync 17", the
call. Then another config is tried in the same folder, and the same command goes on. A random moment
may be one at which there is nobody to kill: `runs` counts the kills that happened.
"""

from __future__ import annotations

import functools
import os
import shutil
import signal
import time
import traceback
from typing import TYPE_CHECKING

import psutil
from campaign import Row
from fault_points import FaultPoints
from strategies import rng
from stub_runs import (
    OTHER,
    check_readable,
    contents,
    difference,
    forked,
    in_scratch,
    made,
    scratch,
    whole,
    whole_contents,
)
from worker_setups import recording_workers

from internav_data.core.storage import LockedError
from internav_data.generation.executors import ProcessExecutor
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path
    from typing import Any

SCENES, WORKERS = 6, 2
MOMENTS = 200
"""Random moments of each target."""
MIN_KILLED = 0.6
"""Least share of a target's cases that must kill: at a drawn moment nobody may be there."""
WORKERS_SHARE = 0.5
"""Share of a run in which it has workers, about: of 200 moments in 1.05 runs, 103 met one."""
_WAIT_S = 120.0


def _run(out):
    made(out, SCENES, executor=ProcessExecutor(WORKERS), setup=recording_workers)


def _started(out: Path, *, fsync: int | None = None) -> int:
    """Start a run in a process group of its own; return its process.

    An error of it goes into the file `error` beside the dataset, see `_ended`.
    """
    child = os.fork()
    if child:
        return child
    try:
        os.setsid()
        if fsync is not None:
            FaultPoints(out, fsync, "SIGKILL of the group", only="fsync").install()
        _run(out)
    except BaseException:  # noqa: BLE001 - it is the result
        out.with_name("error").write_text(traceback.format_exc())
        os._exit(1)
    os._exit(0)


def _ended(process: int, out: Path) -> bool:
    """Wait for a run; return whether it was killed. Asserts that else it ended well."""
    _, status = os.waitpid(process, 0)
    if os.WIFSIGNALED(status):
        assert os.WTERMSIG(status) == signal.SIGKILL, f"the run died of {os.WTERMSIG(status)}"
        return True
    error = out.with_name("error")
    assert status == 0, error.read_text() if error.exists() else f"the run ended with {status}"
    return False


@functools.cache
def _seconds() -> float:
    """Return the seconds of a run, from its first worker on."""
    folder = scratch("unkilled")
    process = _started(folder / "d")
    _wait_for_workers(folder)
    began = time.monotonic()
    assert not _ended(process, folder / "d")
    shutil.rmtree(folder)
    return time.monotonic() - began


def _wait_for_workers(folder: Path) -> None:
    deadline = time.monotonic() + _WAIT_S
    while not _workers(folder) and time.monotonic() < deadline:
        time.sleep(0.005)


def _workers(folder: Path) -> list[int]:
    path = folder / "workers"
    return [int(line) for line in path.read_text().split()] if path.exists() else []


def _runs(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def _kill(target: str, process: int, folder: Path) -> bool:
    """Kill what is the target; return whether a worker was killed."""
    if target == "group":
        os.killpg(process, signal.SIGKILL)
    elif target == "parent":
        os.kill(process, signal.SIGKILL)
    else:
        alive = [pid for pid in _workers(folder) if _runs(pid)]
        if alive:  # it may be before its first worker, or after its last
            os.kill(alive[-1], signal.SIGKILL)
            return True
    return False


def _another_config(out: Path) -> bool:
    """Try another config in the same folder; return whether its dataset is there now."""
    before = contents(out)
    try:
        made(out, SCENES, OTHER)
    except UsageError:
        assert not difference(contents(out), before), "a config that is refused changed something"
        return False
    differences = difference(contents(out), whole_contents(SCENES, other=True))
    assert not differences, f"another config in the same folder: {differences}"
    return True


def _again(out: Path) -> None:
    """Run the same command again, in this process; workers may hold the lock for a moment."""
    deadline = time.monotonic() + _WAIT_S
    while True:
        try:
            made(out, SCENES)
        except LockedError:
            assert time.monotonic() < deadline, "workers of a killed run keep the lock"
            time.sleep(0.1)
        else:
            return


def _killed(target: str, number: int, out: Path) -> tuple[bool, float]:
    """Run and kill; return whether a kill happened, and at which second after the first worker."""
    if target == "fsync":  # runs that commit less often on their way have fewer
        return _ended(_started(out, fsync=number), out), 0.0
    seconds = _seconds()
    process = _started(out)
    if number % 10:  # most of the time passes before there is one
        _wait_for_workers(out.parent)
    share = WORKERS_SHARE if target == "worker" else 1.05
    moment = float(rng([len(target), number]).uniform(0.0, share * seconds))
    time.sleep(moment)
    worker_killed = _kill(target, process, out.parent)
    run_killed = _ended(process, out)
    assert target != "worker" or not run_killed, "a run ends well though a worker was killed"
    return worker_killed or run_killed, moment


def run(key: str, folder: Path):
    """Kill a run, try another config, run the same command again."""
    target, text = key.split()
    number, out = int(text), folder / "d"
    happened, moment = _killed(target, number, out)
    figures = {"runs": int(happened), "killed": happened, "at_s": round(moment, 3)}
    deadline = time.monotonic() + _WAIT_S
    while any(map(_runs, _workers(folder))):
        assert time.monotonic() < deadline, "workers outlive their run"
        time.sleep(0.02)
    readable = check_readable(out, whole(SCENES))
    if out.exists() and number % 2 and _another_config(out):
        return {**figures, "then": "another config"}
    _again(out)
    differences = difference(contents(out), whole_contents(SCENES))
    assert not differences, f"after the same command again: {differences}"
    return {**figures, "readable": readable}


@functools.cache
def count_fsyncs() -> int:
    """Return the number of times that the parent of a run waits for the disk."""
    folder = scratch("fsyncs")

    def count():
        points = FaultPoints(folder, only="fsync")
        points.install()
        _run(folder / "d")
        return len(points.log)

    outcome = forked(count)
    assert outcome.isdigit(), outcome
    shutil.rmtree(folder)
    return int(outcome)


def cases():
    """Yield the four targets in turns."""
    fsyncs = count_fsyncs()
    for number in range(max(MOMENTS, fsyncs)):
        if number < MOMENTS:
            yield from (f"{target} {number}" for target in ("group", "parent", "worker"))
        if number < fsyncs:
            yield f"fsync {number * 37 % fsyncs if fsyncs % 37 else number}"


def shortfalls(lines: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a sentence for each target of which too few cases killed anything."""
    kills: dict[str, list[bool]] = {}
    for line in lines:
        kills.setdefault(line["case"].split()[0], []).append(line.get("killed", True))
    return [
        f"{target}: only {sum(some)} of {len(some)} cases killed anything"
        for target, some in kills.items()
        if sum(some) < MIN_KILLED * len(some)
    ]


ROW = Row("kills", cases, in_scratch(run), shortfalls)
