"""Reading a dataset that a generator may be extending at the same time.

A commit puts new shards, turns the manifest, and then removes the shards that the new manifest does
not name. So a reader may find a file gone that its manifest names:

- one that is opening the dataset reads the manifest again, and has the extended dataset;
- one that has the dataset open already goes on with the scenes that it began with. The rows of a
  removed shard are the first rows of the shard that took its place; their logical digest, which the
  older manifest states, proves it.

No file is kept for late readers: folders hold what the manifest names, and nothing twice.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from internav_data.dataset.digest import logical_digest
from internav_data.dataset.manifest import open_file, read_manifest, read_manifest_and_digest
from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import pyarrow as pa

    from internav_data.core.storage import Store
    from internav_data.dataset.manifest import DataFile, Manifest
    from internav_data.dataset.parquet import TableFile
    from internav_data.dataset.tables import TableSpec

T = TypeVar("T")

MAX_TRIES = 20
"""Commits that a reader may lose a race against, one after the other."""


def with_manifest(store: Store, use: Callable[[Manifest, str], T]) -> T:
    """Return `use(manifest, digest)`; called again if a commit turned the manifest meanwhile.

    The digest is the SHA-256 of the manifest's file.

    Raises
    ------
    CorruptDataError
        No dataset, or a file that the manifest in place names is missing or damaged.

    """
    for _ in range(MAX_TRIES - 1):
        manifest, digest = read_manifest_and_digest(store)
        try:
            return use(manifest, digest)
        except CorruptDataError:
            if read_manifest_and_digest(store)[1] == digest:
                raise
    return use(*read_manifest_and_digest(store))


def open_shard(store: Store, file: DataFile, spec: TableSpec[Any]) -> TableFile:
    """Open a file of a manifest, or the one that has taken its place.

    The latter begins with the same `file.rows` rows, proven by their digest; any after them are
    not the reader's.

    Raises
    ------
    CorruptDataError
        Missing, truncated, edited, of other columns, or replaced by other rows.

    """
    for _ in range(MAX_TRIES):
        try:
            return open_file(store, file, spec)
        except CorruptDataError:
            later = _replacement(store, file)
            if later is None:
                raise
        try:
            opened = open_file(store, later, spec)
        except CorruptDataError:
            continue  # replaced in its turn
        if logical_digest(opened.read_as_written().slice(0, file.rows)) == file.logical_digest:
            return opened
        break
    raise CorruptDataError(
        f"{store.at(file.path)}: other rows have taken its place (the dataset was made anew, or "
        "scenes were tried again): load it again"
    )


def read_shard(
    store: Store, file: DataFile, spec: TableSpec[Any], columns: Sequence[str] | None = None
) -> pa.Table:
    """Return the rows of a file of a manifest as columns of the spec (see `open_shard`).

    Raises
    ------
    CorruptDataError
        As `open_shard`, or a column chunk is damaged.

    """
    with open_shard(store, file, spec) as opened:
        return opened.read_all(columns).slice(0, file.rows)


def _replacement(store: Store, file: DataFile) -> DataFile | None:
    """Return the file that stands in the manifest in place where `file` stood before."""
    stem = file.path.rpartition("-")[0]
    for other in read_manifest(store).of(file.table, file.split):
        if other.path.rpartition("-")[0] == stem and other.rows >= file.rows:
            return None if other.path == file.path else other
    return None
