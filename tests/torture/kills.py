"""SIGKILL of the group, the parent or a worker at random moments, and of the group at every fsync.

A case is "group 17", "parent 17" or "worker 17", a seed that draws the moment, or "fsync 17", the
call. Then another config is tried in the same folder, and the same command goes on.
"""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import tempfile
import time
from pathlib import Path

import psutil
from campaign import Row
from fault_points import FaultPoints
from strategies import rng
from stub_runs import CONFIG, OTHER, check_readable, contents, difference, made, plain

from internav_data.core.storage import LockedError
from internav_data.generation.executors import ProcessExecutor
from internav_data.records.errors import InternavError, UsageError

SCENES, WORKERS = 6, 2
MOMENTS = 200
"""Random moments of each target."""
_WAIT_S = 120.0


def noted(payload):
    """Make plain scenes; the process is noted beside the dataset."""
    with (payload.staging.store.root.parent / "workers").open("a") as file:
        file.write(f"{os.getpid()}\n")
    work = plain(payload)

    def make(scene):
        time.sleep(0.01 * (scene % 3))
        return work(scene)

    return make


def _run(out):
    made(out, SCENES, executor=ProcessExecutor(WORKERS), setup=noted)


def _started(out: Path, *, fsync: int | None = None) -> int:
    """Start a run in a process group of its own; return its process."""
    child = os.fork()
    if child:
        return child
    code = 1
    with contextlib.suppress(BaseException):
        os.setsid()
        if fsync is not None:
            FaultPoints(out, fsync, "SIGKILL of the group", only="fsync").install()
        _run(out)
        code = 0
    os._exit(code)


@functools.cache
def _whole(*, other: bool = False) -> Path:
    """Return a dataset of a run without kills."""
    folder = Path(tempfile.mkdtemp(prefix="torture-whole-"))
    made(folder / "d", SCENES, OTHER if other else CONFIG)
    return folder / "d"


@functools.cache
def _seconds() -> float:
    """Return the seconds of a run, from its first worker on."""
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        process = _started(Path(folder) / "d")
        _wait_for_workers(Path(folder))
        began = time.monotonic()
        os.waitpid(process, 0)
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


def _kill(target: str, process: int, folder: Path) -> None:
    if target == "group":
        os.killpg(process, signal.SIGKILL)
    elif target == "parent":
        os.kill(process, signal.SIGKILL)
    else:
        alive = [pid for pid in _workers(folder) if _runs(pid)]
        if alive:  # it may be before its first worker, or after its last
            os.kill(alive[-1], signal.SIGKILL)


def _another_config(out: Path) -> bool:
    """Try another config in the same folder; return whether its dataset is there now."""
    before = contents(out)
    try:
        made(out, SCENES, OTHER)
    except UsageError:
        assert not difference(contents(out), before), "a config that is refused changed something"
        return False
    found = difference(contents(out), contents(_whole(other=True)))
    assert not found, f"another config in the same folder: {found}"
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


def run(key: str, folder: Path):
    """Kill a run, try another config, run the same command again."""
    target, number = key.split()
    whole, seconds, out = _whole(), _seconds(), folder / "d"
    process = _started(out, fsync=int(number) if target == "fsync" else None)
    moment = 0.0
    if target != "fsync":
        if int(number) % 10:  # most of the time passes before there is one
            _wait_for_workers(folder)
        moment = float(rng([len(target), int(number)]).uniform(0.0, 1.05 * seconds))
        time.sleep(moment)
        _kill(target, process, folder)
    _, status = os.waitpid(process, 0)
    if target == "worker":
        assert status == 0, "a run ends well though a worker was killed"
    deadline = time.monotonic() + _WAIT_S
    while any(map(_runs, _workers(folder))):
        assert time.monotonic() < deadline, "workers outlive their run"
        time.sleep(0.02)
    readable = check_readable(out, whole)
    if out.exists() and int(number) % 2 and _another_config(out):
        return {"runs": 1, "at_s": round(moment, 3), "then": "another config"}
    _again(out)
    found = difference(contents(out), contents(whole))
    assert not found, f"after the same command again: {found}"
    return {"runs": 1, "at_s": round(moment, 3), "of_s": round(seconds, 3), "readable": readable}


def _fsyncs() -> int:
    """Return the number of times that the parent of a run waits for the disk."""
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        child = os.fork()
        if child == 0:
            with contextlib.suppress(InternavError):
                points = FaultPoints(Path(folder), None, only="fsync")
                points.install()
                made(Path(folder) / "d", SCENES, executor=ProcessExecutor(WORKERS), setup=noted)
                Path(folder, "count").write_text(str(len(points.log)))
            os._exit(0)
        os.waitpid(child, 0)
        return int(Path(folder, "count").read_text())


def cases():
    """Yield the four targets in turns."""
    fsyncs = _fsyncs()
    for number in range(max(MOMENTS, fsyncs)):
        if number < MOMENTS:
            yield from (f"{target} {number}" for target in ("group", "parent", "worker"))
        if number < fsyncs:
            yield f"fsync {number * 37 % fsyncs if fsyncs % 37 else number}"


ROW = Row("kills", cases, run)
