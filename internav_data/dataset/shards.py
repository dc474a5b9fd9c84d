"""Shards: the files that a dataset's rows are cut into, named by number and content.

A shard is `train-00000-` and the first eight hexadecimal digits of its sha256. An extended dataset
differs from the one before in its last shards only, and these get other names: nothing that the
manifest in place names is ever written over.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import groupby
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.compute as pc

from internav_data.dataset.encode import to_table
from internav_data.dataset.manifest import DataFile, Manifest, check_file, open_file
from internav_data.dataset.parquet import file_info, parquet_bytes
from internav_data.dataset.staging import SceneState, Staging, read_staged_rows
from internav_data.dataset.tables import ASSETS, EPISODES, SCENES, SPECS, TableSpec

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from internav_data.core.storage import Store
    from internav_data.dataset.journal import Journal
    from internav_data.records import Asset, Split

SPLITS: tuple[Split, ...] = ("train", "val", "test")
SCENES_PER_SHARD = {"episodes": 240, "scenes": 2400}
_DIGITS = 8
"""Hexadecimal digits of a shard's sha256 in its name."""


@dataclass(frozen=True, slots=True)
class _Home:
    """A file of a finished dataset."""

    store: Store
    file: DataFile

    def read(self, columns: Sequence[str] | None = None) -> pa.Table:
        with open_file(self.store, self.file, SPECS[self.file.table]) as opened:
            return opened.read_all(columns)


@dataclass(frozen=True, slots=True)
class _Span:
    """Rows start … end - 1 of a file."""

    home: _Home
    start: int
    end: int


def scene_number(scene_id: str) -> int:
    """Return a scene's number: ids have six digits, or as many as they need."""
    return int(scene_id.rpartition("-")[2])


class SceneSource:
    """The rows of scenes: from an older version of the dataset, from parts of it, from staging.

    Parameters
    ----------
    store, old
        Store of the dataset, and the manifest in place.
    staging, states
        Staged scenes, by number.
    parts
        Stores and manifests of finished datasets with other scenes.

    """

    def __init__(
        self,
        store: Store,
        old: Manifest | None,
        staging: Staging | None = None,
        states: Mapping[int, SceneState] = MappingProxyType({}),
        parts: Sequence[tuple[Store, Manifest]] = (),
    ) -> None:
        self.store, self._staging = store, staging
        self._states = {s.scene_id: s for s in states.values() if not s.quarantined}
        self._old_files = old.files if old else ()
        self._old_digests = {file.path: file.sha256 for file in self._old_files}
        self._held: dict[str, list[str]] = {}
        self._home: dict[tuple[str, str], _Span] = {}
        self._last: tuple[_Home, pa.Table] | None = None
        self.scenes: dict[Split, list[str]] = {split: [] for split in SPLITS}
        for home in (_Home(store, file) for file in self._old_files):
            self._held[home.file.path] = self._find_scenes(home)
        for place, manifest in parts:
            for file in manifest.files:
                self._find_scenes(_Home(place, file))
        for state in self._states.values():
            self.scenes[state.split].append(state.scene_id)
        for scenes in self.scenes.values():
            scenes.sort(key=scene_number)  # a scene may be made long after its neighbours

    def _find_scenes(self, home: _Home) -> list[str]:
        """Note which rows of a file are a scene's, as they stand together; return the scenes."""
        file = home.file
        if file.split is None:  # assets
            return []
        column = home.read(["scene_id"])["scene_id"]
        runs, end = pc.value_counts(column).to_pylist(), 0
        for run in runs:
            start, end = end, end + run["counts"]
            self._home[file.table, run["values"]] = _Span(home, start, end)
        scenes = [run["values"] for run in runs]
        if file.table == SCENES.name:
            self.scenes[file.split] += scenes
        return scenes

    def in_place(self, path: str, sha256: str) -> bool:
        """Return whether the older dataset has this very file."""
        return self._old_digests.get(path) == sha256

    def unchanged(self, table: str, scenes: Sequence[str]) -> DataFile | None:
        """Return the older file that holds exactly these scenes, if there is one."""
        for file in self._old_files:
            if file.table == table and self._held.get(file.path) == list(scenes):
                return file
        return None

    def rows(self, spec: TableSpec[Any], scenes: Sequence[str]) -> pa.Table:
        """Return the rows of scenes in order."""
        # Reading is the one serial part of a run; pyarrow and hashlib let threads share it.
        with ThreadPoolExecutor() as threads:
            new = [scene_id for scene_id in scenes if scene_id in self._states]
            read = dict(zip(new, threads.map(partial(self._new_rows, spec), new), strict=True))
        tables = [spec.schema.empty_table()]
        for is_new, run in groupby(scenes, key=read.__contains__):
            group = list(run)
            tables += [read[k] for k in group] if is_new else self._old_rows(spec, group)
        return pa.concat_tables(tables).combine_chunks()

    def _new_rows(self, spec: TableSpec[Any], scene_id: str) -> pa.Table:
        if self._staging is None:
            raise AssertionError  # states come with their staging
        scene = self._states[scene_id].scene
        return read_staged_rows(self._staging, scene, house=spec is SCENES)

    def _old_rows(self, spec: TableSpec[Any], scenes: Sequence[str]) -> Iterator[pa.Table]:
        """Yield the rows of older scenes, those that stand together in a file as one table."""
        spans: list[_Span] = []
        for scene_id in scenes:
            span = self._home.get((spec.name, scene_id))
            if span is None:
                continue  # a scene without episodes
            if spans and (spans[-1].home, spans[-1].end) == (span.home, span.start):
                span = _Span(span.home, spans.pop().start, span.end)
            spans.append(span)
        for span in spans:
            if self._last is None or self._last[0] != span.home:
                self._last = (span.home, span.home.read())
            yield self._last[1].slice(span.start, span.end - span.start)


def put_shards(journal: Journal, source: SceneSource, assets: pa.Table) -> tuple[DataFile, ...]:
    """Put all files of a dataset below `data/` and return them as they belong in the manifest.

    Episodes come in shards of 240 scenes and scenes in shards of 2,400, split by split, in order
    of scene and index; `assets` are all rows of the catalogue (see `assets_table`).
    """
    files = []
    for spec in (EPISODES, SCENES):
        for split in SPLITS:
            files += _put_split(journal, source, spec, split)
    return (*files, _put(journal, source, assets, ASSETS, "assets", None))


def assets_table(assets: Sequence[Asset]) -> pa.Table:
    """Return assets as rows, in order of their ids."""
    return to_table(sorted(assets, key=lambda asset: asset.asset_id), ASSETS)


def _put_split(
    journal: Journal, source: SceneSource, spec: TableSpec[Any], split: Split
) -> list[DataFile]:
    scenes, size = source.scenes[split], SCENES_PER_SHARD[spec.name]
    files = []
    for number, start in enumerate(range(0, len(scenes), size)):
        shard, stem = scenes[start : start + size], f"{spec.name}/{split}-{number:05d}"
        old = source.unchanged(spec.name, shard)
        if old is None:
            files.append(_put(journal, source, source.rows(spec, shard), spec, stem, split))
        else:
            files.append(_renamed(journal, source, old, stem))
    return files


def _put(
    journal: Journal,
    source: SceneSource,
    table: pa.Table,
    spec: TableSpec[Any],
    stem: str,
    split: Split | None,
) -> DataFile:
    data = parquet_bytes(table, spec)
    info = file_info(stem, data, table)
    path = _path(stem, info.sha256)
    if not source.in_place(path, info.sha256):
        journal.put(path, data)
    return DataFile(table=spec.name, split=split, **asdict(info) | {"path": path})


def _renamed(journal: Journal, source: SceneSource, file: DataFile, stem: str) -> DataFile:
    """Return an older file; one of another release's name is put in place under today's."""
    check_file(source.store, file)
    path = _path(stem, file.sha256)
    if path != file.path:
        journal.put(path, source.store.read(file.path))
    return replace(file, path=path)


def _path(stem: str, sha256: str) -> str:
    return f"data/{stem}-{sha256[:_DIGITS]}.parquet"
