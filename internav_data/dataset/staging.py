"""Unfinished work: one file a scene below `.work/scenes/`, each whole or not at all.

Workers call `write_scene_work` or `write_quarantine` for every scene they finish; after a kill,
`finished_scenes` says what need not be done again. A file is

    b"INWORK01"  sha256 of what follows (32 bytes)  u32 header length  header (JSON)
    u64 length  Arrow IPC stream of the scene row  u64 length  Arrow IPC stream of its episodes

and one that is damaged counts as not done.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import pyarrow as pa

from internav_data.core.files import write_atomically
from internav_data.dataset.encode import to_table
from internav_data.dataset.tables import EPISODES, SCENES
from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from internav_data.records import Episode, House, Split

WORK = ".work"
_MAGIC = b"INWORK01"
_HEAD = len(_MAGIC) + 32


@dataclass(frozen=True, slots=True)
class SceneState:
    """How one scene ended."""

    scene: int
    scene_id: str
    split: Split
    episodes: int
    redraws: Mapping[str, int]
    """How often something was drawn again, by reason."""
    attempts: int
    quarantined: str
    """Why the scene was given up; empty when it is good."""


@dataclass(frozen=True, slots=True)
class SceneWork:
    """A finished scene's rows: one of SCENES (none if quarantined) and some of EPISODES."""

    state: SceneState
    house: pa.Table
    episodes: pa.Table


def work_dir(out: Path) -> Path:
    """Return the folder of unfinished work in a dataset's folder."""
    return out / WORK


def scene_file(work: Path, scene: int) -> Path:
    """Return where a scene's work lies: a thousand scenes a folder."""
    return work / "scenes" / f"{scene // 1000:06d}" / f"scene-{scene:06d}.work"


def write_scene_work(
    work: Path,
    scene: int,
    house: House,
    episodes: Sequence[Episode],
    *,
    redraws: Mapping[str, int] | None = None,
    attempts: int = 1,
) -> Path:
    """Store a finished scene: its house and its episodes, in order of their index.

    Raises
    ------
    ValidationError
        A value that its column cannot hold.

    """
    counts = dict(sorted((redraws or {}).items()))
    state = SceneState(scene, house.scene_id, house.split, len(episodes), counts, attempts, "")
    return _write(work, SceneWork(state, to_table([house], SCENES), to_table(episodes, EPISODES)))


def write_quarantine(
    work: Path,
    scene: int,
    reason: str,
    *,
    split: Split,
    attempts: int,
    redraws: Mapping[str, int] | None = None,
) -> Path:
    """Store that a scene was given up, and why (a reason must hold nothing of the machine)."""
    counts = dict(sorted((redraws or {}).items()))
    state = SceneState(scene, f"scene-{scene:06d}", split, 0, counts, attempts, reason or "unknown")
    return _write(work, SceneWork(state, to_table([], SCENES), to_table([], EPISODES)))


def finished_scenes(work: Path, scenes: Iterable[int] | None = None) -> dict[int, SceneState]:
    """Return the scenes (all found, or of those asked for) whose work is stored and whole."""
    if scenes is None:
        paths = sorted((work / "scenes").glob("*/scene-*.work"))
    else:
        paths = [path for path in (scene_file(work, k) for k in scenes) if path.exists()]
    states = {}
    for path in paths:
        try:
            state = _state(path, path.read_bytes())
        except CorruptDataError:
            continue
        states[state.scene] = state
    return dict(sorted(states.items()))


def read_scene_rows(work: Path, scene: int, *, house: bool) -> pa.Table:
    """Return one of a scene's two tables, its house's or its episodes', without the other.

    Raises
    ------
    CorruptDataError
        Missing or damaged.

    """
    _, houses, episodes = _parts(work, scene)
    return _table(houses if house else episodes)


def _parts(work: Path, scene: int) -> tuple[SceneState, pa.Buffer, pa.Buffer]:
    """Check a scene's file and cut it into its state and its two streams."""
    path = scene_file(work, scene)
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise CorruptDataError(f"{path}: scene {scene} is not finished: generate again") from None
    state = _state(path, data)
    start = _HEAD + 4 + int.from_bytes(data[_HEAD : _HEAD + 4], "little")
    streams = []
    for _ in range(2):
        length = int.from_bytes(data[start : start + 8], "little")
        streams.append(pa.py_buffer(data[start + 8 : start + 8 + length]))
        start += 8 + length
    return state, streams[0], streams[1]


def _table(stream: pa.Buffer) -> pa.Table:
    return pa.ipc.open_stream(stream).read_all()


def _write(work: Path, scene: SceneWork) -> Path:
    header = json.dumps(asdict(scene.state)).encode()
    parts = [len(header).to_bytes(4, "little"), header]
    for table in (scene.house, scene.episodes):
        stream = _stream(table)
        parts += [len(stream).to_bytes(8, "little"), stream]
    body = b"".join(parts)
    path = scene_file(work, scene.state.scene)
    write_atomically(path, _MAGIC + hashlib.sha256(body).digest() + body)
    return path


def _stream(table: pa.Table) -> bytes:
    sink = pa.BufferOutputStream()
    options = pa.ipc.IpcWriteOptions(compression="zstd")
    with pa.ipc.new_stream(sink, table.schema, options=options) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue())


def _state(path: Path, data: bytes) -> SceneState:
    body = data[_HEAD:]
    if data[: len(_MAGIC)] != _MAGIC or hashlib.sha256(body).digest() != data[len(_MAGIC) : _HEAD]:
        raise CorruptDataError(f"{path}: damaged: remove it and generate again")
    length = int.from_bytes(body[:4], "little")
    return SceneState(**json.loads(body[4 : 4 + length]))
