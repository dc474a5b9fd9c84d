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
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from campaign import Row
from fault_points import FAULTS, FaultPoints
from stub_runs import InOrder, check_readable, contents, difference, forked, made, merged, plain
from system_calls import strace, system_calls

from internav_data.core.storage import write_atomically
from internav_data.generation.executors import ProcessExecutor
from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Callable

BLOCK = 10
"""Calls of one case."""
SCENES = 4
POINT = "INTERNAV_TORTURE_POINT"
"""Environment variable with folder, number and fault for workers."""
STRANGERS = {"notes.txt": b"precious", "data/mine.parquet": b"precious"}


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


def watching(payload):
    """Make plain scenes in a worker whose calls are fault points, as the environment says."""
    if POINT in os.environ:
        folder, at, fault = json.loads(os.environ[POINT])
        # A worker that takes the place of a killed one is well.
        with Path(folder, "workers").open("a") as file:
            file.write("one\n")
        if len(Path(folder, "workers").read_text().split()) == 1:
            points = FaultPoints(Path(folder, "d"), at, fault)
            points.install()
            _WATCHED.append(points)
    work = plain(payload)

    def make(scene):
        count = work(scene)
        for points in _WATCHED:  # `calls` reads how many there were
            with Path(points.folder).with_name("log").open("w") as file:
                json.dump(points.log, file)
        return count

    return make


_WATCHED: list[FaultPoints] = []

SCENARIOS = {
    "new": Scenario(lambda _: None, _whole),
    "extend": Scenario(_extended, _whole),
    "resume": Scenario(_half_made, _whole),
    "repair": Scenario(_damaged, _whole, damaged=True),
    "retry": Scenario(lambda f: made(f / "d", SCENES, executor=InOrder(dies=(2,))), _whole),
    "merge": Scenario(_parts, _merged),
    "worker": Scenario(
        lambda _: None,
        lambda f: made(f / "d", SCENES, executor=ProcessExecutor(1), setup=watching),
        in_worker=True,
    ),
}


@functools.cache
def _begun(name: str) -> Path:
    """Return a folder as a scenario begins in it; copied for each run."""
    folder = Path(tempfile.mkdtemp(prefix="torture-begun-"))
    SCENARIOS[name].begin(folder)
    return folder


@functools.cache
def _ended(name: str) -> Path:
    """Return a folder as it is after the command of a scenario without a fault."""
    folder = Path(tempfile.mkdtemp(prefix="torture-ended-"))
    shutil.copytree(_begun(name), folder, dirs_exist_ok=True)
    SCENARIOS[name].act(folder)
    return folder


@functools.cache
def calls(name: str) -> list[tuple[str, str]]:
    """Return the calls of a scenario that change the disk: kind, and path below its folder."""
    _ended(name)  # what is imported late is by now
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        shutil.copytree(_begun(name), folder, dirs_exist_ok=True)
        text = _faulty(name, Path(folder), None, "SIGKILL")
        return [tuple(call) for call in json.loads(text)]


def _faulty(name: str, folder: Path, at: int | None, fault: str) -> str:
    """Run a command with a fault in a copy of this process; without one, return its calls."""
    scenario = SCENARIOS[name]

    def watched():
        points = FaultPoints(folder, at, fault)
        points.install()
        scenario.act(folder)
        return json.dumps([(kind, _plain(path)) for kind, path in points.log])

    def in_worker():
        os.environ[POINT] = json.dumps([str(folder), at, fault])
        scenario.act(folder)
        log = json.loads((folder / "log").read_text()) if at is None else []
        return json.dumps([(kind, _plain(f"d/{path}")) for kind, path in log])

    return forked(in_worker if scenario.in_worker else watched)


def _plain(path: str) -> str:
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
    found = [
        (kind, _plain(path))
        for kind, path in system_calls(script, folder / "run")
        if path == "d" or path.startswith("d/")
    ]
    counted = [tuple(call) for call in json.loads((folder / "calls").read_text())]
    if SCENARIOS[name].in_worker:
        kinds = {"unlink", "rmdir"}  # of its parent alone
        counted, found = (
            [call for call in some if ".work/scenes/" in call[1] and call[0] not in kinds]
            for some in (counted, found)
        )
    assert found == counted, next(
        (k, pair)
        for k, pair in enumerate(itertools.zip_longest(found, counted))
        if len({*pair}) > 1
    )
    return {"runs": 1, "system_calls": len(found)}


def run_one(name: str, fault: str, at: int, folder: Path, where: str) -> None:
    """Run a scenario with one fault, then again without."""
    shutil.copytree(_begun(name), folder)
    said = _faulty(name, folder, at, fault)
    if fault == "SIGKILL" and not SCENARIOS[name].in_worker:
        assert said == "killed by SIGKILL", f"{where}: {said}"
    else:
        assert not said.startswith(("bug", "killed")), f"{where}: {said}"
    if said.startswith("error"):
        strerror = {"EIO": "Input/output error", "ENOSPC": "No space left on device"}[fault]
        assert "\n" not in said, f"{where}: {said}"
        assert str(folder) in said, f"{where}: no path: {said}"
        assert strerror in said, f"{where}: {said}"
        assert "space" in said, f"{where}: {said}"
    with contextlib.suppress(*((CorruptDataError,) if SCENARIOS[name].damaged else ())):
        check_readable(folder / "d", _ended(name) / "d")
    SCENARIOS[name].act(folder)
    for trace in ("workers", "log"):
        (folder / trace).unlink(missing_ok=True)
    wanted = contents(_ended(name))
    found = difference(contents(folder), wanted)
    assert not found, f"{where}: after the same command again: {found}"
    shutil.rmtree(folder)


ROW = Row("faults", cases, run)
