"""Level `files`: all listed files are present, unchanged and readable, and no others."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.storage import (
    FolderStore,
    Store,
    StoreError,
    StoreLike,
    content_sha256,
    store_of,
)
from internav_data.dataset import logical_digest, read_manifest
from internav_data.dataset.journal import journal_names
from internav_data.dataset.manifest import MANIFEST
from internav_data.dataset.parquet import open_stored
from internav_data.dataset.tables import SPECS
from internav_data.records.errors import CorruptDataError, InternavError, UsageError
from internav_data.verification.findings import FindingCollector

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from internav_data.dataset import DataFile, Manifest
    from internav_data.dataset.manifest import MetadataFile

CHANGING = "file that a generator is putting or replacing, or was when it was cut off: not checked"


def check_manifest(root: StoreLike, report: FindingCollector) -> Manifest | None:
    """Check and return the manifest; None if it cannot be read.

    Raises
    ------
    UsageError
        There is no such folder.
    CorruptDataError
        The folder holds no finished dataset.

    """
    store = store_of(root)
    if isinstance(store, FolderStore) and not store.root.is_dir():
        raise UsageError(f"{store.root}: no such folder: give the folder that `generate` wrote")
    try:
        manifest = read_manifest(store)
    except CorruptDataError as error:
        if _size(store, MANIFEST) is None:
            raise
        report.file = MANIFEST
        report.expect(False, "files.manifest", "a manifest that is whole", error)  # noqa: FBT003
        return None
    report.expect(True, "files.manifest", "", "")  # noqa: FBT003 - counted
    return manifest


def check_listing(root: StoreLike, manifest: Manifest, report: FindingCollector) -> None:
    """Check that `data/` holds only files of the manifest, and the files beside the data.

    Files that a commit puts or replaces, under way or cut off, are left out and noted.
    """
    store = store_of(root)
    listed, changing = manifest.paths(), _changing(store)
    for name in sorted(_data_names(store, listed)):
        if name in changing - listed:
            report.notes[CHANGING] += 1
            continue
        report.file = name
        report.expect(
            name in listed,
            "files.unlisted",
            "only files of the manifest",
            "another: nobody removes it for you; move it elsewhere, as readers of data/*.parquet "
            "take it for data",
        )
    for file in manifest.metadata or ():
        if file.path in changing:
            report.notes[CHANGING] += 1
        else:
            report.file = file.path
            report.counts["files"] += 1
            _check_bytes(store, file, report)


def _changing(store: Store) -> frozenset[str]:
    try:
        return frozenset(journal_names(store))
    except (CorruptDataError, OSError):
        return frozenset()  # the generator that left it says so


def _data_names(store: Store, listed: frozenset[str]) -> Iterator[str]:
    if isinstance(store, FolderStore):
        yield from _names_below(store.root, "data", listed)
    else:  # it has no links
        yield from store.names("data/")


def _names_below(root: Path, folder: str, listed: frozenset[str]) -> Iterator[str]:
    """Yield the names of all files below a folder; a link counts as the folder it stands for.

    A link below which no file is listed is not followed: it might lead round in a circle.
    """
    for path in (root / folder).rglob("*"):
        name = path.relative_to(root).as_posix()
        if not path.is_dir():
            yield name
        elif path.is_symlink():
            if any(other.startswith(f"{name}/") for other in listed):
                yield from _names_below(root, name, listed)
            else:
                yield name


def check_file(root: StoreLike, file: DataFile) -> FindingCollector:
    """Check one Parquet file: bytes, hashes, rows, checksums."""
    report = FindingCollector(file.path)
    report.counts["files"] += 1
    store = store_of(root)
    if not _check_bytes(store, file, report):
        return report
    spec = SPECS[file.table]
    try:
        with open_stored(store, file.path, spec) as opened:
            table = opened.read_as_written()
    except StoreError:
        raise  # of a bucket that cannot be reached nothing is known
    except InternavError as error:
        report.expect(False, "files.readable", "a whole Parquet file of its table", error)  # noqa: FBT003
        return report
    report.counts["rows"] += table.num_rows
    report.expect(table.num_rows == file.rows, "files.rows", file.rows, table.num_rows)
    logical = logical_digest(table)
    report.expect(
        logical == file.logical_digest, "files.logical-digest", file.logical_digest, logical
    )
    return report


def _check_bytes(store: Store, file: DataFile | MetadataFile, report: FindingCollector) -> bool:
    """Check that a file is there, with its size and sha256; return whether it can be read."""
    size = _size(store, file.path)
    if not report.expect(size is not None, "files.present", "a file", "none"):
        return False
    report.expect(size == file.bytes, "files.bytes", file.bytes, size)
    digest = content_sha256(store, file.path, size or 0)
    report.expect(digest == file.sha256, "files.sha256", file.sha256, digest)
    return True


def _size(store: Store, name: str) -> int | None:
    """Return the number of bytes of a file; None where there is none."""
    try:
        return store.size(name)
    except OSError:  # a folder or a pipe, too
        return None
