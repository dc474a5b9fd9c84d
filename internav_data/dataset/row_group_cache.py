"""Row groups of a dataset's files: read at their first use, the latest ones kept in memory."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from internav_data.core.locks import ThreadLock
from internav_data.core.lru import LRUCache
from internav_data.dataset.decode import ColumnReader, RecordReader
from internav_data.dataset.snapshot import open_shard
from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from internav_data.core.storage import Store
    from internav_data.dataset.manifest import DataFile
    from internav_data.dataset.parquet import TableFile
    from internav_data.dataset.tables import TableSpec

V = TypeVar("V")

Reader = RecordReader | ColumnReader

MAX_OPEN_FILES = 64
MAX_CACHED_BYTES = 96 << 20
"""Bytes of decoded row groups in memory, a table."""


class RowGroupCache:
    """The rows of one table in several files, numbered through, read a row group at a time.

    Holds `max_files` files and `max_bytes` of row groups. After a fork (a DataLoader's
    worker) it drops both and opens the files again.

    Parameters
    ----------
    store
        Store of the dataset.
    files
        Files of the table, in the order of their rows.
    spec
        The table.
    columns
        Columns of the rows, which are then dictionaries; None: rows are records.
    extra
        Values of a record's fields that the table does not hold, read with the first row group.
    max_bytes
        Bytes of decoded row groups in memory.
    max_files
        Number of open files; the footer of one takes 2 MB.

    """

    def __init__(
        self,
        store: Store,
        files: Sequence[DataFile],
        spec: TableSpec[Any],
        columns: Sequence[str] | None = None,
        extra: Callable[[], Mapping[str, Any]] | None = None,
        max_bytes: float = MAX_CACHED_BYTES,
        max_files: float = MAX_OPEN_FILES,
    ) -> None:
        self.max_bytes, self.max_files = max_bytes, max_files
        self._store, self._files, self._spec = store, tuple(files), spec
        self._columns, self._extra = columns, extra
        self.starts: NDArray[np.int64] = np.cumsum([0, *[file.rows for file in files]])
        """(files + 1,) row number at which each file starts."""
        self._bounds: dict[int, NDArray[np.int64]] = {}
        # One for files and groups: no thread closes a file that another one reads.
        self._lock = ThreadLock()
        self._open_anew()

    def __len__(self) -> int:
        return int(self.starts[-1])

    def _open_anew(self) -> None:
        # A forked process shares file positions with its parent: nothing of it may be used.
        self._process = os.getpid()
        self._open: LRUCache[int, TableFile] = LRUCache(
            self.max_files, on_evict=lambda file: file.close()
        )
        self._groups: LRUCache[int, tuple[int, Reader]] = LRUCache(
            self.max_bytes, weigh=lambda held: held[0]
        )

    @property
    def groups_held(self) -> int:
        """Number of row groups in memory."""
        return len(self._groups)

    def limit(self, max_bytes: float, max_files: int) -> None:
        """Hold fewer or more bytes of row groups, and open files, from now on."""
        with self._lock:
            self.max_bytes = self._groups.capacity = max_bytes
            self.max_files = self._open.capacity = max_files

    def clear(self) -> None:
        """Drop the row groups in memory; files stay open."""
        self._groups.clear()

    def file(self, number: int) -> TableFile:
        """Return an open file.

        Raises
        ------
        CorruptDataError
            It is missing, truncated or edited.

        """
        if self._process != os.getpid():
            self._open_anew()
        return self._open.get(
            number, lambda: open_shard(self._store, self._files[number], self._spec)
        )

    def bounds(self, number: int) -> NDArray[np.int64]:
        """Return the row numbers at which a file's row groups start, and the end: (groups + 1,)."""
        with self._lock:
            if number not in self._bounds:
                metadata = self.file(number).metadata
                rows = [metadata.row_group(k).num_rows for k in range(metadata.num_row_groups)]
                # A file that took another's place ends later: its first groups are the other's.
                starts, total = np.cumsum([0, *rows]), self._files[number].rows
                kept = np.append(starts[starts < total], total)
                self._bounds[number] = self.starts[number] + kept
            return self._bounds[number]

    def all_bounds(self) -> NDArray[np.int64]:
        """Return the rows at which the row groups of all files start, and the end: (n,) int64."""
        parts = [self.bounds(number)[:-1] for number in range(len(self._files))]
        return np.concatenate([*parts, self.starts[-1:]])

    def group_of(self, row: int) -> tuple[int, int, Reader]:
        """Return the first row and the end of a row's group, and the group's reader."""
        number = int(self.starts.searchsorted(row, side="right")) - 1
        with self._lock:
            bounds = self.bounds(number)
            group = int(bounds.searchsorted(row, side="right")) - 1
            first, end = int(bounds[group]), int(bounds[group + 1])
            if self._process != os.getpid():
                self._open_anew()
            _, reader = self._groups.get(first, lambda: self._read(number, group))
            return first, end, reader

    def _read(self, number: int, group: int) -> tuple[int, Reader]:
        """Return the bytes of a row group in memory, and its reader."""
        try:
            table = self.file(number).read_group(group, self._columns)
        except CorruptDataError:
            # A network file system takes a removed file away from those who hold it open.
            self._open.clear()
            table = self.file(number).read_group(group, self._columns)
        if self._columns is not None:
            return table.nbytes, ColumnReader(table.select(list(self._columns)), self._spec)
        extra = self._extra() if self._extra else None
        return table.nbytes, RecordReader(table, self._spec, extra)

    def row(self, row: int) -> Any:  # noqa: ANN401 - a record, or a dictionary of columns
        """Return one row."""
        first, _, reader = self.group_of(row)
        return reader.rows(row - first, row - first + 1)[0]
