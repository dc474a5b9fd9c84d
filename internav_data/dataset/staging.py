"""Staging: one file a finished scene below `.work/scenes/`, each complete or absent.

Workers call `stage_scene` or `stage_quarantine` for every scene they finish; after a kill,
`staged_scenes` tells which need not be built again. A file is

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

from internav_data.core.storage import StoreLike, exists, store_of
from internav_data.dataset.encode import to_table
from internav_data.dataset.tables import EPISODES, SCENES
from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from internav_data.core.storage import Store
    from internav_data.records import Episode, House, Split

STAGING = ".work/"
"""Prefix of the names of an unfinished dataset's files."""
_SCENES = f"{STAGING}scenes/"
_MAGIC = b"INWORK01"
_HEAD = len(_MAGIC) + 32


@dataclass(frozen=True, slots=True)
class SceneState:
    """Result of one scene: its number of episodes, or the reason of its quarantine."""

    scene: int
    scene_id: str
    split: Split
    episodes: int
    redraws: Mapping[str, int]
    """Number of redraws by reason."""
    attempts: int
    quarantined: str
    """Reason for which the scene was given up; empty when it is good."""


@dataclass(frozen=True, slots=True)
class StagedScene:
    """Rows of a finished scene: one of SCENES (none if quarantined) and some of EPISODES."""

    state: SceneState
    house: pa.Table
    episodes: pa.Table


def scene_name(scene: int) -> str:
    """Return the name of a scene's file: a thousand scenes a folder."""
    return f"{_SCENES}{scene // 1000:06d}/scene-{scene:06d}.work"


def any_staged(root: StoreLike) -> bool:
    """Return whether a scene is staged, even a damaged one."""
    return any(name.endswith(".work") for name in store_of(root).names(_SCENES))


def stage_scene(
    root: StoreLike,
    scene: int,
    house: House,
    episodes: Sequence[Episode],
    *,
    redraws: Mapping[str, int] | None = None,
    attempts: int = 1,
) -> None:
    """Store a finished scene: its house and its episodes, in order of their index.

    Raises
    ------
    ValidationError
        A value that its column cannot hold.

    """
    counts = dict(sorted((redraws or {}).items()))
    state = SceneState(scene, house.scene_id, house.split, len(episodes), counts, attempts, "")
    tables = to_table([house], SCENES), to_table(episodes, EPISODES)
    _write(store_of(root), StagedScene(state, *tables))


def stage_quarantine(
    root: StoreLike,
    scene: int,
    reason: str,
    *,
    split: Split,
    attempts: int,
    redraws: Mapping[str, int] | None = None,
) -> None:
    """Store a scene that was given up; its reason becomes data and must not name the machine."""
    counts = dict(sorted((redraws or {}).items()))
    state = SceneState(scene, f"scene-{scene:06d}", split, 0, counts, attempts, reason or "unknown")
    _write(store_of(root), StagedScene(state, to_table([], SCENES), to_table([], EPISODES)))


def staged_scenes(root: StoreLike, scenes: Iterable[int] | None = None) -> dict[int, SceneState]:
    """Return the scenes that are staged undamaged, by number: all, or those of `scenes`."""
    store = store_of(root)
    if scenes is None:
        names = [name for name in store.names(_SCENES) if name.endswith(".work")]
    else:
        names = [name for name in map(scene_name, scenes) if exists(store, name)]
    states = {}
    for name in names:
        try:
            state = _state(store.at(name), store.read(name))
        except CorruptDataError:
            continue
        states[state.scene] = state
    return dict(sorted(states.items()))


def read_staged_rows(root: StoreLike, scene: int, *, house: bool) -> pa.Table:
    """Return one of a scene's two tables, its house's or its episodes', without the other.

    Raises
    ------
    CorruptDataError
        Missing or damaged.

    """
    houses, episodes = _streams(store_of(root), scene)
    return _table(houses if house else episodes)


def _streams(store: Store, scene: int) -> tuple[pa.Buffer, pa.Buffer]:
    """Check a scene's file and return its two streams."""
    name = scene_name(scene)
    place = store.at(name)
    try:
        data = store.read(name)
    except FileNotFoundError:
        raise CorruptDataError(f"{place}: scene {scene} is not finished: generate again") from None
    _state(place, data)
    start = _HEAD + 4 + int.from_bytes(data[_HEAD : _HEAD + 4], "little")
    streams = []
    for _ in range(2):
        length = int.from_bytes(data[start : start + 8], "little")
        streams.append(pa.py_buffer(data[start + 8 : start + 8 + length]))
        start += 8 + length
    return streams[0], streams[1]


def _table(stream: pa.Buffer) -> pa.Table:
    return pa.ipc.open_stream(stream).read_all()


def _write(store: Store, scene: StagedScene) -> None:
    header = json.dumps(asdict(scene.state)).encode()
    parts = [len(header).to_bytes(4, "little"), header]
    for table in (scene.house, scene.episodes):
        stream = _stream(table)
        parts += [len(stream).to_bytes(8, "little"), stream]
    body = b"".join(parts)
    store.put(scene_name(scene.state.scene), _MAGIC + hashlib.sha256(body).digest() + body)


def _stream(table: pa.Table) -> bytes:
    sink = pa.BufferOutputStream()
    options = pa.ipc.IpcWriteOptions(compression="zstd")
    with pa.ipc.new_stream(sink, table.schema, options=options) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue())


def _state(place: str, data: bytes) -> SceneState:
    body = data[_HEAD:]
    if data[: len(_MAGIC)] != _MAGIC or hashlib.sha256(body).digest() != data[len(_MAGIC) : _HEAD]:
        raise CorruptDataError(f"{place}: damaged: remove it and generate again")
    length = int.from_bytes(body[:4], "little")
    return SceneState(**json.loads(body[4 : 4 + length]))
