"""One Parquet file: written with checksums of its pages and chunks, which reading verifies."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from internav_data.core.ranges_file import RangesFile
from internav_data.core.storage import Store, StoreError, write_atomically
from internav_data.dataset.checksums import ChunkChecksums, checksums_of, with_checksums
from internav_data.dataset.compatibility import conformed, problems
from internav_data.dataset.decode import one_array
from internav_data.dataset.digest import logical_digest
from internav_data.dataset.encode import to_table
from internav_data.records.errors import CorruptDataError, InternavError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import BinaryIO

    from internav_data.dataset.tables import TableSpec

R = TypeVar("R")

SCENES_PER_GROUP = 10
"""Minimum number of scenes in a row group."""
ROWS_PER_GROUP = 400
"""Minimum number of rows in a row group of episodes.

A random record costs reading its group; a group costs its overhead.
"""
_ZSTD_LEVEL = 3
_TAIL = 8  # bytes: the footer's length and the letters PAR1

MAX_FOOTER_BYTES = 64 << 20
"""Size of a footer; one of 1,000 row groups takes 10 MB."""
MAX_GROUP_BYTES = 2 << 30
"""Size of a row group when it is decompressed."""
MAX_VALUES = 1 << 28
"""Rows times columns of a row group."""
MENDING = "fetch the file again from where it came, or generate the dataset anew"


@dataclass(frozen=True, slots=True)
class FileInfo:
    """Figures of one Parquet file that the manifest states."""

    path: str
    """Relative to the dataset's folder, with forward slashes."""
    rows: int
    bytes: int
    sha256: str
    footer_sha256: str
    logical_digest: str


def write_parquet(path: Path, records: Sequence[R], spec: TableSpec[R]) -> FileInfo:
    """Write records as one Parquet file; rows of episodes must be sorted by scene and index.

    Raises
    ------
    ValidationError
        A value that its column cannot hold.

    """
    return write_table(path, to_table(records, spec), spec)


def write_table(path: Path, table: pa.Table, spec: TableSpec[Any]) -> FileInfo:
    """Write a table of the spec's schema as a file, complete or absent (see `parquet_bytes`)."""
    data = parquet_bytes(table, spec)
    write_atomically(path, data)
    return file_info(path.name, data, table)


def parquet_bytes(table: pa.Table, spec: TableSpec[Any]) -> bytes:
    """Return a table of the spec's schema as a Parquet file: the same bytes for the same rows.

    A row group ends only where a scene ends.
    """
    table = table.combine_chunks()
    sink = pa.BufferOutputStream()
    with pq.ParquetWriter(
        sink,
        spec.schema,
        compression="zstd",
        compression_level=_ZSTD_LEVEL,
        use_dictionary=_repeating(spec),
        write_statistics=[*spec.filters],
        write_page_checksum=True,
    ) as writer:
        for start, stop in group_bounds(table):
            writer.write_table(table.slice(start, stop - start), row_group_size=stop - start)
    return with_checksums(sink.getvalue(), spec.schema)


def _repeating(spec: TableSpec[Any]) -> list[str]:
    """Return the Parquet paths of the leaf columns that are stored with a dictionary."""
    paths = _leaf_paths(pa.struct(list(spec.schema)), "")
    return [path for path in paths if not path.startswith(spec.plain)]


def _leaf_paths(kind: pa.DataType, path: str) -> Iterator[str]:
    if pa.types.is_struct(kind):
        for field in kind:
            yield from _leaf_paths(field.type, f"{path}.{field.name}".lstrip("."))
    elif pa.types.is_list(kind):
        yield from _leaf_paths(kind.value_type, f"{path}.list.element")
    else:
        yield path


def file_info(path: str, data: bytes, table: pa.Table) -> FileInfo:
    """Return the figures of a Parquet file: its path, its bytes and the table in it."""
    length = int.from_bytes(data[-_TAIL:-4], "little") + _TAIL
    return FileInfo(
        path,
        table.num_rows,
        len(data),
        hashlib.sha256(data).hexdigest(),
        hashlib.sha256(data[-length:]).hexdigest(),
        logical_digest(table.combine_chunks()),
    )


def group_bounds(table: pa.Table) -> list[tuple[int, int]]:
    """Return the rows [start, stop) of each row group: full scenes, at least `SCENES_PER_GROUP`."""
    rows = table.num_rows
    if not rows:
        return []
    if "scene_id" not in table.column_names:
        return [(0, rows)]
    scenes = one_array(table.column("scene_id")).dictionary_encode().indices.to_numpy()
    starts = [0, *(np.flatnonzero(np.diff(scenes)) + 1).tolist(), rows]
    bounds, first = [], 0
    per_row_scene = len(starts) - 1 == rows  # the table of scenes: a row each
    min_rows = SCENES_PER_GROUP if per_row_scene else ROWS_PER_GROUP
    for k, stop in enumerate(starts[1:], start=1):
        if k - first >= SCENES_PER_GROUP and stop - starts[first] >= min_rows:
            bounds.append((starts[first], stop))
            first = k
    if starts[first] < rows:
        bounds.append((starts[first], rows))
    return bounds


def footer_sha256(store: Store, name: str, size: int) -> str:
    """Return the sha256 of a Parquet file's footer, which page checksums do not cover.

    Raises
    ------
    CorruptDataError
        Too short, or no Parquet file.

    """
    tail = store.read(name, max(0, size - _TAIL))
    length = int.from_bytes(tail[:4], "little") + _TAIL
    if tail[4:] != b"PAR1" or length > min(size, MAX_FOOTER_BYTES):
        raise damaged(store.at(name), ValueError("it does not end like a Parquet file"))
    return hashlib.sha256(store.read(name, size - length)).hexdigest()


def _check_sizes(footer: pq.FileMetaData) -> None:
    """Check what row groups state to take in memory, as a few bytes may state any number of rows.

    Raises
    ------
    ValueError
        One is too large to be of a dataset.

    """
    for k in range(footer.num_row_groups):
        group = footer.row_group(k)
        if group.num_rows * footer.num_columns > MAX_VALUES:
            raise ValueError(f"row group {k} states {group.num_rows} rows")
        if group.total_byte_size > MAX_GROUP_BYTES:
            raise ValueError(f"row group {k} states {group.total_byte_size} bytes")


class TableFile:
    """An open Parquet file of a table: what is read from it is verified before.

    Page checksums are verified, and those of the column chunks if the footer states them. Not to
    be used by a forked process.

    Parameters
    ----------
    place
        Place of the file, for error messages.
    source
        The file: a path, or one that can be read and sought.
    spec
        Table of which it has the columns.

    Raises
    ------
    OSError, pyarrow.ArrowException, ValueError
        It cannot be read, or is no Parquet file.

    """

    def __init__(self, place: str, source: Path | BinaryIO, spec: TableSpec[Any]) -> None:
        self.place, self._spec = place, spec
        self._ranges = None if isinstance(source, Path) else RangesFile(source)
        self._source = (
            pa.OSFile(str(source))
            if self._ranges is None
            else pa.PythonFile(self._ranges, mode="r")
        )
        try:
            self._file = pq.ParquetFile(self._source, page_checksum_verification=True)
            _check_sizes(self._file.metadata)
            self.schema: pa.Schema = self._file.schema_arrow
            self._checksums: ChunkChecksums | None = checksums_of(self._file.metadata)
        except BaseException:
            self._source.close()
            raise
        self._exact = self.schema.equals(spec.schema)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._source.close()

    @property
    def metadata(self) -> pq.FileMetaData:
        """Footer of the file."""
        return self._file.metadata

    def read_group(self, group: int, columns: Sequence[str] | None = None) -> pa.Table:
        """Return one row group as columns of the table.

        Raises
        ------
        CorruptDataError
            A page or a column chunk is damaged.

        """
        names = None if columns is None or not self._exact else list(columns)
        try:
            self._verify([group], names)
            table = self._file.read_row_group(group, columns=names, use_threads=False)
            self._release()
            table = table.replace_schema_metadata(None)  # the checksums, of this file alone
            return table if self._exact else conformed(table, self._spec.schema, columns)
        except Exception as error:
            raise damaged(self.place, error) from error

    def read_all(self, columns: Sequence[str] | None = None) -> pa.Table:
        """Return all rows as columns of the table.

        Raises
        ------
        CorruptDataError
            A page or a column chunk is damaged.

        """
        names = None if columns is None or not self._exact else list(columns)
        table = self._read_all(names)
        try:
            return table if self._exact else conformed(table, self._spec.schema, columns)
        except Exception as error:
            raise damaged(self.place, error) from error

    def read_as_written(self) -> pa.Table:
        """Return all rows with every column of the file, known to this release or not.

        Raises
        ------
        CorruptDataError
            A page or a column chunk is damaged.

        """
        return self._read_all(None)

    def _read_all(self, names: list[str] | None) -> pa.Table:
        try:
            self._verify(range(self.metadata.num_row_groups), names)
            table = self._file.read(columns=names).replace_schema_metadata(None)
            self._release()
            table.validate(full=True)
        except Exception as error:
            raise damaged(self.place, error) from error
        return table

    def _verify(self, groups: Sequence[int], names: Sequence[str] | None) -> None:
        """Check the column chunks that are about to be read."""
        if self._checksums is None or not groups:
            return
        columns = range(self.metadata.num_columns) if names is None else self._leaves(names)
        if self._ranges is not None:
            self._ranges.hold(self._checksums.ranges(groups, columns))
        for group in groups:
            self._checksums.verify(self._source.read_at, group, columns)

    def _release(self) -> None:
        """Forget the bytes of a file far away that were read."""
        if self._ranges is not None:
            self._ranges.release()

    def _leaves(self, names: Sequence[str]) -> list[int]:
        """Return the numbers of the leaf columns that are named, or lie below one that is."""
        # Of a row group, not from `schema`: pyarrow ties it and the footer, some 2 MB, in a cycle
        # that the garbage collector takes for small.
        group = self.metadata.row_group(0)
        paths = [group.column(k).path_in_schema for k in range(group.num_columns)]
        wanted = {*names}, tuple(f"{name}." for name in names)
        return [k for k, p in enumerate(paths) if p in wanted[0] or p.startswith(wanted[1])]


def open_parquet(
    path: Path | str, spec: TableSpec[Any], source: Path | BinaryIO | None = None
) -> TableFile:
    """Open a Parquet file of the spec's columns.

    Parameters
    ----------
    path
        Place of the file, for error messages.
    spec
        Table of which it has the columns.
    source
        File to read; None: the one at `path`.

    Raises
    ------
    CorruptDataError
        Missing, truncated, no Parquet, or of other columns.

    """
    try:
        file = TableFile(str(path), Path(path) if source is None else source, spec)
    except FileNotFoundError:
        raise CorruptDataError(f"{path}: the file is missing: {MENDING}") from None
    except Exception as error:
        raise damaged(path, error) from error
    if not file.schema.equals(spec.schema) and (found := problems(file.schema, spec.schema)):
        file.close()
        raise CorruptDataError(
            f"{path}: the columns are not those of {spec.name}: {', '.join(found[:3])}: {MENDING}"
        )
    return file


def open_stored(store: Store, name: str, spec: TableSpec[Any]) -> TableFile:
    """Open a Parquet file of the spec's columns in a store.

    Raises
    ------
    CorruptDataError
        As `open_parquet`.
    StoreError
        The store cannot be reached.

    """
    try:
        source = store.source(name)
    except FileNotFoundError:
        raise CorruptDataError(f"{store.at(name)}: the file is missing: {MENDING}") from None
    return open_parquet(store.at(name), spec, source)


def read_table(path: Path, spec: TableSpec[Any], columns: Sequence[str] | None = None) -> pa.Table:
    """Return the table in a file, everything that is read of it verified.

    Raises
    ------
    CorruptDataError
        Missing, damaged or of other columns.

    """
    with open_parquet(path, spec) as file:
        return file.read_all(columns)


def damaged(path: Path | str, error: BaseException) -> InternavError:
    """Return the error to raise for a file that pyarrow cannot read, or that is out of reach."""
    if isinstance(error, StoreError):
        return StoreError(*error.args)
    reason = (str(error).splitlines() or [type(error).__name__])[0]
    return CorruptDataError(f"{path}: the file is damaged ({reason}): {MENDING}")
