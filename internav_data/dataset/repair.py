"""Files of a finished dataset that are missing or damaged: found, and made again.

A shard is a pure function of its scenes, and these of the run's identity: what is made again has
the bytes that the manifest states, or is refused.
"""

from __future__ import annotations

import hashlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import pyarrow as pa

from internav_data.core.storage import content_sha256, exists
from internav_data.dataset import shards
from internav_data.dataset.journal import Journal
from internav_data.dataset.manifest import MANIFEST, has_manifest, read_manifest, write_manifest
from internav_data.dataset.metadata_files import put_metadata
from internav_data.dataset.parquet import parquet_bytes
from internav_data.dataset.staging import read_staged_rows, remove_scenes
from internav_data.dataset.tables import ASSETS, SCENES, SPECS
from internav_data.records.errors import CorruptDataError
from internav_data.records.splits import split_of_scene

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.core.storage import Store
    from internav_data.dataset.manifest import DataFile, Manifest, MetadataFile
    from internav_data.dataset.staging import Staging
    from internav_data.records import Asset


@dataclass(frozen=True, slots=True)
class Damage:
    """Missing and damaged files of a finished dataset."""

    manifest: Manifest
    files: tuple[DataFile, ...] = ()
    metadata: tuple[MetadataFile, ...] = ()

    @property
    def paths(self) -> tuple[str, ...]:
        """Names of the files."""
        extra = (file.path for file in self.metadata)
        return (*(file.path for file in self.files), *extra)

    def scenes(self, file: DataFile) -> tuple[int, ...]:
        """Return the numbers of the scenes whose rows a file holds, in order; none for assets."""
        if file.table == ASSETS.name:
            return ()
        left_out = {entry.scene for entry in self.manifest.quarantined}
        kept = [
            scene
            for scene in self.manifest.scene_numbers
            if split_of_scene(scene) == file.split and scene not in left_out
        ]
        files, size = self.manifest.of(file.table, file.split), shards.SCENES_PER_SHARD[file.table]
        start = files.index(file) * size
        return tuple(kept[start : start + size])

    def all_scenes(self) -> tuple[int, ...]:
        """Return the numbers of all scenes that must be staged to make the files again."""
        return tuple(sorted({scene for file in self.files for scene in self.scenes(file)}))


def find_damage(store: Store) -> Damage | None:
    """Compare every file of a dataset with its size and SHA-256; None if all is well.

    Hashing takes about 0.6 s a gigabyte and core.
    """
    if not has_manifest(store):
        return None
    manifest = read_manifest(store)
    with ThreadPoolExecutor() as threads:
        data = [(file, threads.submit(_is_intact, store, file)) for file in manifest.files]
        extra = [
            (file, threads.submit(_is_intact, store, file)) for file in manifest.metadata or ()
        ]
    damage = Damage(
        manifest,
        tuple(file for file, intact in data if not intact.result()),
        tuple(file for file, intact in extra if not intact.result()),
    )
    return damage if damage.paths else None


def _is_intact(store: Store, file: DataFile | MetadataFile) -> bool:
    if not exists(store, file.path) or store.size(file.path) != file.bytes:
        return False
    return content_sha256(store, file.path, file.bytes) == file.sha256


def repair_files(staging: Staging, damage: Damage, assets: Sequence[Asset]) -> None:
    """Make the files of a damage again, from staged scenes and the catalogue.

    Raises
    ------
    CorruptDataError
        What was made has other bytes than the manifest states, or a scene is not staged.

    """
    store = staging.store
    journal = Journal(store)
    for file in damage.files:
        data = parquet_bytes(_table(staging, file, damage.scenes(file), assets), SPECS[file.table])
        if hashlib.sha256(data).hexdigest() != file.sha256:
            raise CorruptDataError(
                f"{store.at(file.path)}: missing or damaged, and made again it has other bytes "
                f"than {MANIFEST} states (another release, library or processor made it): restore "
                "it from where the dataset came, or generate the dataset anew in another folder"
            )
        journal.put(file.path, data)
    if damage.metadata:
        manifest = put_metadata(journal, store, damage.manifest)
        if manifest.metadata != damage.manifest.metadata:  # their texts are another release's
            journal.announce(MANIFEST)
            write_manifest(store, manifest)
    journal.sweep(read_manifest(store))
    remove_scenes(staging, damage.all_scenes())


def _table(
    staging: Staging, file: DataFile, scenes: Sequence[int], assets: Sequence[Asset]
) -> pa.Table:
    if file.table == ASSETS.name:
        return shards.assets_table(assets)
    rows = [read_staged_rows(staging, k, house=file.table == SCENES.name) for k in scenes]
    return pa.concat_tables([SPECS[file.table].schema.empty_table(), *rows]).combine_chunks()
