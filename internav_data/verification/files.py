"""Level `files`: all listed files are present, unchanged and readable, and no others."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

from internav_data.dataset import TABLES, logical_digest, read_manifest
from internav_data.dataset.manifest import MANIFEST
from internav_data.dataset.parquet import open_parquet
from internav_data.records.errors import CorruptDataError, InternavError, UsageError
from internav_data.verification.findings import FindingCollector

if TYPE_CHECKING:
    from pathlib import Path

    from internav_data.dataset import DataFile, Manifest

BLOCK_BYTES = 1 << 20


def check_manifest(root: Path, report: FindingCollector) -> Manifest | None:
    """Check and return the manifest; None if it cannot be read.

    Raises
    ------
    UsageError
        There is no such folder.
    CorruptDataError
        The folder holds no finished dataset.

    """
    if not root.is_dir():
        raise UsageError(f"{root}: no such folder: give the folder that `generate` wrote")
    try:
        manifest = read_manifest(root)
    except CorruptDataError as error:
        if not (root / MANIFEST).is_file():
            raise
        report.file = MANIFEST
        report.expect(False, "files.manifest", "a manifest that is whole", error)  # noqa: FBT003
        return None
    report.expect(True, "files.manifest", "", "")  # noqa: FBT003 - counted
    return manifest


def check_listing(root: Path, manifest: Manifest, report: FindingCollector) -> None:
    """Check that `data/` holds only files of the manifest."""
    listed = {file.path for file in manifest.files}
    for path in sorted((root / "data").rglob("*")):
        name = path.relative_to(root).as_posix()
        if path.is_dir() and not path.is_symlink():
            continue
        report.file = name
        report.expect(name in listed, "files.unlisted", "only files of the manifest", "another")


def check_file(root: Path, file: DataFile) -> FindingCollector:
    """Check one Parquet file: bytes, hashes, rows, checksums."""
    report = FindingCollector(file.path)
    report.counts["files"] += 1
    path = root / file.path
    if not report.expect(path.is_file(), "files.present", "a file", "none"):
        return report
    inside = path.resolve().is_relative_to(root.resolve())
    if not report.expect(inside, "files.inside", "a file of the dataset", "a link out of it"):
        return report
    size = path.stat().st_size
    report.expect(size == file.bytes, "files.bytes", file.bytes, size)
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(BLOCK_BYTES):
            digest.update(block)
    report.expect(
        digest.hexdigest() == file.sha256, "files.sha256", file.sha256, digest.hexdigest()
    )
    spec = next(spec for spec in TABLES if spec.name == file.table)
    try:
        with open_parquet(path, spec) as opened:
            table = opened.read_as_written()
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
