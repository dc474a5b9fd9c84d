"""Staging: one file a finished scene below `.work/scenes/`, each complete or absent.

Workers call `stage_scene` or `stage_quarantine` for every scene they finish; after a kill,
`staged_scenes` tells which need not be built again. A file is

    b"INWORK02"  sha256 of what follows (32 bytes)  digest of the run's identity (32 bytes)
    u32 header length  header (JSON)
    u64 length  Arrow IPC stream of the scene row  u64 length  Arrow IPC stream of its episodes

and one that is damaged, of another identity, or under another scene's name counts as not done. A
worker whose parent is gone ends before it writes. Should it outlive its run all the same, the
folder may be removed or belong to another run by then: it writes only where the identity that its
run put there still stands, and below a folder named by it.
"""

from __future__ import annotations

import hashlib
import json
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from internav_data.core.files import FileLimits, parse_json
from internav_data.core.hardware import hardware
from internav_data.core.processes import end_if_orphaned
from internav_data.core.storage import Store, StoreLike, exists, final_of, store_of
from internav_data.dataset.encode import to_table
from internav_data.dataset.tables import EPISODES, SCENES
from internav_data.records.errors import CorruptDataError, InternavError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from internav_data.records import Episode, House, Split

STAGING = ".work/"
"""Prefix of the names of an unfinished dataset's files."""
IDENTITY = f"{STAGING}identity.json"
"""Name of the file that holds the identity of the run whose scenes are staged."""
MERGING = f"{STAGING}merging.json"
"""Name of the file that stands as long as `merge` has not committed all parts."""
_FILE = FileLimits(remedy=f"move {STAGING} away and start anew")
_SCENES = f"{STAGING}scenes/"
_NAME = re.compile(
    rf"{re.escape(IDENTITY)}|{re.escape(_SCENES)}(?:[0-9a-f]{{16}}/)?\d{{6}}/scene-\d{{6,8}}\.work"
)
_MAGIC = b"INWORK02"
_HEAD = len(_MAGIC) + 32
_BODY = _HEAD + 32
_DIGITS = 16
"""Hexadecimal digits of an identity's digest in the names of its scenes."""


@dataclass(frozen=True, slots=True)
class Identity:
    """Inputs that decide every scene: runs of one identity make one dataset.

    The number of scenes and of workers is no part of it.
    """

    generator: str
    generator_version: str
    seed: int
    catalogue_version: int
    catalogue_digest: str
    config: Mapping[str, Any]
    """The resolved configuration: numbers, strings, booleans, lists and mappings of them."""
    rules: str = ""
    """Digest of the code that makes scenes. Staged scenes of other rules are made again; a
    finished dataset does not hold it, and is extended by later rules of the same version."""
    obstacle_shares: Mapping[str, float] = field(default_factory=dict)
    """Share of each type of obstacle among what is drawn, which follows from all that is above;
    empty where it is not known."""

    def digest(self) -> str:
        """Return the sha256 of all values, 64 hexadecimal digits."""
        return hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()


def read_identity(root: StoreLike) -> Identity:
    """Return the identity of the run whose scenes are staged.

    Raises
    ------
    FileNotFoundError
        No run has opened the folder.
    CorruptDataError
        Damaged.

    """
    store = store_of(root)
    place = store.at(IDENTITY)
    values = parse_json(store.read(IDENTITY, stop=_FILE.max_bytes + 1), place, _FILE)
    try:
        identity = Identity(**values)
    except TypeError as error:
        raise _FILE.refusal(place, f"damaged, or of another program ({error})") from error
    if not isinstance(identity.config, dict):
        raise _FILE.refusal(place, "damaged, or of another program (config: expected an object)")
    return identity


@dataclass(frozen=True, slots=True)
class Staging:
    """Staged scenes of one identity in a store; made by `open_staging`, pickled to workers."""

    store: Store
    digest: str
    """Digest of the identity, 64 hexadecimal digits."""
    outbox: dict[str, bytes] | None = None
    """Staged files by name that are kept here instead of being put into the store, where a worker
    on another machine makes scenes: its executor puts them."""

    def name(self, scene: int) -> str:
        """Return the name of a scene's file: a thousand scenes a folder."""
        return f"{self.folder}{scene // 1000:06d}/scene-{scene:06d}.work"

    @property
    def folder(self) -> str:
        """Prefix of the names of the scenes of this identity."""
        return f"{_SCENES}{self.digest[:_DIGITS]}/"

    def check(self) -> None:
        """Check that the run of this identity still has the store.

        Raises
        ------
        InternavError
            The folder was removed, or another run has begun in it.

        """
        try:
            there = read_identity(self.store).digest()
        except (FileNotFoundError, CorruptDataError):
            there = ""
        if there != self.digest:
            raise InternavError(
                f"{self.store.at(STAGING)}: removed, or another run's by now, while this one was "
                "at work: run the command again, in a folder that stays"
            )


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
    died: bool = False
    """Whether it was given up because the processes that made it died."""
    hardware: str = ""
    """Name of the arithmetic of the process that staged it."""


@dataclass(frozen=True, slots=True)
class StagedScene:
    """Rows of a finished scene: one of SCENES (none if quarantined) and some of EPISODES."""

    state: SceneState
    house: pa.Table
    episodes: pa.Table


def is_unfinished(root: StoreLike) -> bool:
    """Return whether what makes a dataset is at work or was cut off: it has its first scenes."""
    store = store_of(root)
    return exists(store, IDENTITY) or exists(store, MERGING)


def end_merging(store: Store) -> None:
    """Remove the file `MERGING`, or what a kill left of it."""
    for name in store.names(STAGING):
        if MERGING in (name, final_of(name)):
            store.remove(name)


def any_staged(root: StoreLike) -> bool:
    """Return whether a scene is staged, even a damaged one."""
    return any(name.endswith(".work") for name in store_of(root).names(_SCENES))


def remove_foreign(staging: Staging) -> None:
    """Remove staged scenes of other identities; files that are no scenes stay."""
    for name in staging.store.names(_SCENES):
        if is_staging(name) and not name.startswith(staging.folder):
            staging.store.remove(name)


def clear_staging(root: StoreLike) -> None:
    """Remove the staged scenes and the identity that a run put there, and none but its files."""
    store = store_of(root)
    try:
        read_identity(store)
    except (FileNotFoundError, NotADirectoryError, CorruptDataError):
        return  # a folder of somebody else's
    for name in store.names(STAGING):
        if is_staging(name) and name != IDENTITY:
            store.remove(name)
    store.remove(IDENTITY)
    store.prune(STAGING)


def remove_scenes(staging: Staging, scenes: Iterable[int]) -> None:
    """Remove staged scenes by number, while others may be staged."""
    for scene in scenes:
        staging.store.remove(staging.name(scene))


def is_staging(name: str) -> bool:
    """Return whether a name is one under which staging puts files, finished or not."""
    return _NAME.fullmatch(final_of(name) or name) is not None


def stage_scene(
    staging: Staging,
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
    InternavError
        The folder was removed or is another run's.

    """
    counts = dict(sorted((redraws or {}).items()))
    state = SceneState(
        *(scene, house.scene_id, house.split, len(episodes), counts, attempts, ""),
        hardware=hardware(),
    )
    tables = to_table([house], SCENES), to_table(episodes, EPISODES)
    _write(staging, StagedScene(state, *tables))


def stage_quarantine(
    staging: Staging, scene: int, reason: str, *, split: Split, attempts: int, died: bool = False
) -> None:
    """Store a scene that was given up; its reason becomes data and must not name the machine.

    Parameters
    ----------
    staging
        Staging of the run.
    scene, split
        Number and split of the scene.
    reason, attempts
        Reason of the last of so many failures.
    died
        Whether the processes that made it died: it may be fine, and is tried again.

    Raises
    ------
    InternavError
        The folder was removed or is another run's.

    """
    scene_id = f"scene-{scene:06d}"
    state = SceneState(
        *(scene, scene_id, split, 0, {}, attempts, reason or "unknown", died), hardware()
    )
    _write(staging, StagedScene(state, to_table([], SCENES), to_table([], EPISODES)))


def staged_scenes(staging: Staging, scenes: Iterable[int] | None = None) -> dict[int, SceneState]:
    """Return the scenes that are staged undamaged, by number: all, or those of `scenes`."""
    store = staging.store
    if scenes is None:
        names = [name for name in store.names(staging.folder) if name.endswith(".work")]
    else:
        names = [name for name in map(staging.name, scenes) if exists(store, name)]
    with ThreadPoolExecutor() as threads:  # a bucket takes 20 ms for each
        states = [state for state in threads.map(partial(_state_or_none, staging), names) if state]
    return {state.scene: state for state in sorted(states, key=lambda state: state.scene)}


def _state_or_none(staging: Staging, name: str) -> SceneState | None:
    try:
        return _state(staging, name, staging.store.read(name))
    except CorruptDataError:
        return None


def read_staged_rows(staging: Staging, scene: int, *, house: bool) -> pa.Table:
    """Return one of a scene's two tables, its house's or its episodes', without the other.

    Raises
    ------
    CorruptDataError
        Missing, damaged, or of another identity.

    """
    houses, episodes = _streams(staging, scene)
    return _table(houses if house else episodes)


def _streams(staging: Staging, scene: int) -> tuple[pa.Buffer, pa.Buffer]:
    """Check a scene's file and return its two streams."""
    name = staging.name(scene)
    try:
        data = staging.store.read(name)
    except FileNotFoundError:
        raise CorruptDataError(
            f"{staging.store.at(name)}: scene {scene} is not finished: generate again"
        ) from None
    _state(staging, name, data)
    start = _BODY + 4 + int.from_bytes(data[_BODY : _BODY + 4], "little")
    streams = []
    for _ in range(2):
        length = int.from_bytes(data[start : start + 8], "little")
        streams.append(pa.py_buffer(data[start + 8 : start + 8 + length]))
        start += 8 + length
    return streams[0], streams[1]


def _table(stream: pa.Buffer) -> pa.Table:
    return pa.ipc.open_stream(stream).read_all()


def _write(staging: Staging, scene: StagedScene) -> None:
    header = json.dumps(asdict(scene.state)).encode()
    parts = [bytes.fromhex(staging.digest), len(header).to_bytes(4, "little"), header]
    for table in (scene.house, scene.episodes):
        stream = _stream(table)
        parts += [len(stream).to_bytes(8, "little"), stream]
    body = b"".join(parts)
    put_staged(
        staging,
        staging.name(scene.state.scene),
        _MAGIC + hashlib.sha256(body).digest() + body,
    )


def put_staged(staging: Staging, name: str, data: bytes) -> None:
    """Put the file of a finished scene into the store, or into the outbox where there is one.

    Raises
    ------
    InternavError
        The folder was removed or is another run's.

    """
    if staging.outbox is not None:
        staging.outbox[name] = data
        return
    end_if_orphaned()
    staging.check()
    staging.store.put(name, data, beside=IDENTITY)


def _stream(table: pa.Table) -> bytes:
    sink = pa.BufferOutputStream()
    options = pa.ipc.IpcWriteOptions(compression="zstd")
    with pa.ipc.new_stream(sink, table.schema, options=options) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue())


def _state(staging: Staging, name: str, data: bytes) -> SceneState:
    place, body = staging.store.at(name), data[_HEAD:]
    if data[: len(_MAGIC)] != _MAGIC or hashlib.sha256(body).digest() != data[len(_MAGIC) : _HEAD]:
        raise CorruptDataError(f"{place}: damaged: remove it and generate again")
    if data[_HEAD:_BODY] != bytes.fromhex(staging.digest):
        raise CorruptDataError(f"{place}: made by another run: remove it and generate again")
    length = int.from_bytes(data[_BODY : _BODY + 4], "little")
    state = SceneState(**json.loads(data[_BODY + 4 : _BODY + 4 + length]))
    if name != staging.name(state.scene):
        raise CorruptDataError(f"{place}: holds another scene: remove it and generate again")
    return state
