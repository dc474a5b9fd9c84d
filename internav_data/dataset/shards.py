"""How a dataset's rows are cut into files."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.compute as pc

from internav_data.core.files import link_or_copy
from internav_data.dataset.encode import to_table
from internav_data.dataset.manifest import DataFile, Manifest, locate
from internav_data.dataset.parquet import FileInfo, read_table, write_table
from internav_data.dataset.staging import SceneState, read_scene_rows, work_dir
from internav_data.dataset.tables import ASSETS, EPISODES, SCENES, TableSpec

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from internav_data.records import Asset, Split

SPLITS: tuple[Split, ...] = ("train", "val", "test")
SCENES_PER_SHARD = {"episodes": 240, "scenes": 2400}


class SceneSource:
    """The rows of scenes, from an older version of the dataset or from finished work."""

    def __init__(self, out: Path, old: Manifest | None, states: Mapping[int, SceneState]) -> None:
        self._out = out
        self._states = {s.scene_id: s for s in states.values() if not s.quarantined}
        self._old_files = old.files if old else ()
        self._held: dict[str, list[str]] = {}
        self._home: dict[tuple[str, str], DataFile] = {}
        self._last: tuple[str, pa.Table] | None = None
        self.scenes: dict[Split, list[str]] = {split: [] for split in SPLITS}
        for file in self._old_files:
            if file.table != "assets":
                column = read_table(locate(out, file), _spec(file.table), ["scene_id"])["scene_id"]
                self._held[file.path] = pc.unique(column).to_pylist()
                self._home |= {(file.table, name): file for name in self._held[file.path]}
            if file.table == "scenes" and file.split is not None:
                self.scenes[file.split] += self._held[file.path]
        for state in self._states.values():
            self.scenes[state.split].append(state.scene_id)

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
        rows = (read[k] if k in read else self._old_rows(spec, k) for k in scenes)
        tables = [spec.schema.empty_table(), *rows]
        return pa.concat_tables(tables).combine_chunks()

    def _new_rows(self, spec: TableSpec[Any], scene_id: str) -> pa.Table:
        scene = self._states[scene_id].scene
        return read_scene_rows(work_dir(self._out), scene, house=spec is SCENES)

    def _old_rows(self, spec: TableSpec[Any], scene_id: str) -> pa.Table:
        file = self._home.get((spec.name, scene_id))
        if file is None:
            return spec.schema.empty_table()  # a scene without episodes
        if self._last is None or self._last[0] != file.path:
            self._last = (file.path, read_table(locate(self._out, file), spec))
        table = self._last[1]
        return table.filter(pc.equal(table["scene_id"], scene_id))

    def old_path(self, file: DataFile) -> Path:
        """Return where an older file lies."""
        return locate(self._out, file)


def _spec(table: str) -> TableSpec[Any]:
    return EPISODES if table == "episodes" else SCENES


def write_shards(
    folder: Path, source: SceneSource, assets: Sequence[Asset]
) -> tuple[DataFile, ...]:
    """Write all files of a dataset below `folder` and return them as they belong in the manifest.

    Episodes come in shards of 240 scenes and scenes in shards of 2,400, split by split, in order
    of scene and index.
    """
    files = []
    for spec in (EPISODES, SCENES):
        for split in SPLITS:
            files += _write_split(folder, source, spec, split)
    ordered = sorted(assets, key=lambda asset: asset.asset_id)
    info = write_table(folder / "assets.parquet", to_table(ordered, ASSETS), ASSETS)
    return (*files, _data_file(info, "data/assets.parquet", "assets", None))


def _write_split(
    folder: Path, source: SceneSource, spec: TableSpec[Any], split: Split
) -> list[DataFile]:
    scenes, size = source.scenes[split], SCENES_PER_SHARD[spec.name]
    chunks = [scenes[k : k + size] for k in range(0, len(scenes), size)]
    files = []
    for k, chunk in enumerate(chunks):
        name = f"{spec.name}/{split}-{k:05d}-of-{len(chunks):05d}.parquet"
        old = source.unchanged(spec.name, chunk)
        if old is not None:
            link_or_copy(source.old_path(old), folder / name)
            files.append(replace(old, path=f"data/{name}"))
        else:
            info = write_table(folder / name, source.rows(spec, chunk), spec)
            files.append(_data_file(info, f"data/{name}", spec.name, split))
    return files


def _data_file(info: FileInfo, path: str, table: str, split: Split | None) -> DataFile:
    return DataFile(
        path,
        table,
        split,
        info.rows,
        info.bytes,
        info.sha256,
        info.footer_sha256,
        info.logical_digest,
    )
