"""Runs over scenes that cost nothing, in small shards, and what they leave in their folder."""

from __future__ import annotations

import atexit
import contextlib
import functools
import os
import shutil
import signal
import tempfile
import traceback
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

from scene_stubs import CATALOGUE, plain

from internav_data.core.messages import Failed, Fatal
from internav_data.core.worker import run_task
from internav_data.dataset import has_manifest, load_dataset, merge, read_manifest, shards
from internav_data.generation.config import load_config
from internav_data.generation.run import generate
from internav_data.records.errors import InternavError

CONFIG = load_config(overrides=["episodes_per_scene=1"])
OTHER = load_config(overrides=["episodes_per_scene=1", "seed=3"])
SHARDS = {"episodes": 1, "scenes": 2}
"""Scenes a shard: a run of four commits twice on its way."""
STRANGERS = {"notes.txt": b"precious", "data/mine.parquet": b"precious"}
"""Files of somebody else beside a dataset."""
_MEMORY = Path("/dev/shm")  # noqa: S108 - a folder of our own is made in it
_ROOM_BYTES = 2 << 30
"""Free space from which on a folder in memory is used."""


@functools.cache
def _scratch_root() -> Path:
    """Return this process's folder in memory, or of temporary files where there is no room.

    Faults are injected at calls, so that the file system below does not matter; in memory, waiting
    for the disk costs nothing.
    """
    roomy = os.access(_MEMORY, os.W_OK) and shutil.disk_usage(_MEMORY).free >= _ROOM_BYTES
    root = Path(tempfile.mkdtemp(prefix="torture-", dir=_MEMORY if roomy else None))
    atexit.register(shutil.rmtree, root, ignore_errors=True)
    return root


def scratch(name: str) -> Path:
    """Return a new folder for temporary files, which goes when this process ends."""
    return Path(tempfile.mkdtemp(prefix=f"{name}-", dir=_scratch_root()))


def in_scratch(run):
    """Let a row's cases run in a scratch folder each, instead of the campaign's."""

    @functools.wraps(run)
    def wrapped(key, _folder):
        folder = scratch("case")
        try:
            return run(key, folder)
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    return wrapped


@dataclass
class InOrder:
    """Runs every task in this process, one after the other; the workers of some die."""

    dies: tuple[int, ...] = ()
    slots: int = 1

    def run(self, recipe, tasks, tick):
        work = recipe.setup(recipe.payload)
        for task in sorted(tasks):
            if not tick():
                return
            if task in self.dies:
                yield Failed(task, "its worker was killed by SIGKILL, 3 times", 3, died=True)
                continue
            result = run_task(work, task)
            if isinstance(result, Fatal):
                raise result.error()
            yield result


def made(out, scenes, config=CONFIG, executor=None, setup=plain):
    """Generate stub scenes in small shards."""
    with mock.patch.object(shards, "SCENES_PER_SHARD", SHARDS):
        return generate(
            out, config, scenes, executor=executor or InOrder(), assets=CATALOGUE, setup=setup
        )


def merged(parts, out):
    """Join parts in small shards."""
    with mock.patch.object(shards, "SCENES_PER_SHARD", SHARDS):
        return merge(parts, out)


def contents(folder):
    """Return all that lies below a folder: bytes of files, None for folders."""
    return {
        path.relative_to(folder).as_posix(): None if path.is_dir() else path.read_bytes()
        for path in sorted(folder.rglob("*"))
    }


def difference(actual, expected):
    """Return in what two contents differ, in a line; empty if in nothing."""
    missing, left = expected.keys() - actual.keys(), actual.keys() - expected.keys()
    other = {name for name in expected.keys() & actual.keys() if expected[name] != actual[name]}
    kinds = {"missing": missing, "left over": left, "of other bytes": other}
    return "; ".join(f"{kind}: {', '.join(sorted(some))}" for kind, some in kinds.items() if some)


@functools.cache
def whole(scenes, *, other=False):
    """Return a dataset that was made in one piece, of either config."""
    folder = scratch("whole") / "d"
    made(folder, scenes, OTHER if other else CONFIG)
    return folder


@functools.cache
def whole_contents(scenes, *, other=False):
    """Return the contents of a dataset that was made in one piece."""
    return contents(whole(scenes, other=other))


@functools.cache
def _rows(folder):
    """Return the rows of a dataset that does not change, by episode."""
    return load_dataset(folder).to_table().sort_by("episode_id")


def check_readable(folder, complete):
    """Check that a folder holds no dataset, or one of the first scenes of a complete one.

    The complete one must stay as it is. Returns the number of scenes.
    """
    if not has_manifest(folder):
        return 0
    manifest = read_manifest(folder)
    scenes, lost = manifest.scenes, {entry.scene for entry in manifest.quarantined}
    table = load_dataset(folder).to_table().sort_by("episode_id")
    ids = {f"scene-{k:06d}" for k in range(scenes) if k not in lost}
    expected = _rows(complete)
    expected = expected.filter([row in ids for row in expected["scene_id"].to_pylist()])
    assert table.equals(expected), f"the dataset in place is not that of the first {scenes} scenes"
    return scenes


def forked(work):
    """Do work in a copy of this process; return the text it returned or how it ended.

    An error for users is its message after `error: `; any other its last lines.
    """
    _scratch_root()  # the child's own would never go
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        try:
            text = str(work() or "")
        except InternavError as error:
            text = f"error: {error}"
        except BaseException:  # noqa: BLE001 - it is the result
            text = f"bug: {traceback.format_exc()}"
        with contextlib.suppress(BaseException):
            os.write(writer, text.encode()[-60_000:])
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as file:
        text = file.read().decode()
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return f"killed by {signal.Signals(os.WTERMSIG(status)).name}"
    return text
