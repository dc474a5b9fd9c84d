"""Row groups of a dataset's files, opened when asked for and kept within a bound."""

from __future__ import annotations

import os
from collections import OrderedDict
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from internav_data.dataset.decode import ColumnReader, RecordReader
from internav_data.dataset.manifest import DataFile, check_file, open_file
from internav_data.dataset.parquet import read_group

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import pyarrow.parquet as pq
    from numpy.typing import NDArray

    from internav_data.core.storage import Store
    from internav_data.dataset.tables import TableSpec

V = TypeVar("V")

Reader = RecordReader | ColumnReader

_OPEN_FILES = 64
_CACHED_BYTES = 96 << 20


class RowGroupCache:
    """The rows of one table in several files, numbered through, read a row group at a time.

    Holds open files and at most some 96 MiB of row groups. After a fork (a DataLoader's worker)
    it forgets both and opens the files again.
    """

    def __init__(
        self,
        store: Store,
        files: Sequence[DataFile],
        spec: TableSpec[Any],
        columns: Sequence[str] | None = None,
        extra: Callable[[], Mapping[str, Any]] | None = None,
    ) -> None:
        for file in files:
            check_file(store, file)
        self._store, self._files, self._spec = store, tuple(files), spec
        self._columns, self._extra = columns, extra
        self.starts: NDArray[np.int64] = np.cumsum([0, *[file.rows for file in files]])
        """(files + 1,) row number at which each file starts."""
        self._bounds: dict[int, NDArray[np.int64]] = {}
        self._forget()

    def __len__(self) -> int:
        return int(self.starts[-1])

    def _forget(self) -> None:
        self._process = os.getpid()
        self._open: OrderedDict[int, pq.ParquetFile] = OrderedDict()
        self._groups: OrderedDict[int, tuple[int, Reader]] = OrderedDict()
        self._bytes = 0

    def file(self, number: int) -> pq.ParquetFile:
        """Return an open file."""
        if self._process != os.getpid():
            self._forget()
        if number not in self._open:
            self._open[number] = open_file(self._store, self._files[number], self._spec)
            while len(self._open) > _OPEN_FILES:
                self._open.popitem(last=False)[1].close()
        self._open.move_to_end(number)
        return self._open[number]

    def bounds(self, number: int) -> NDArray[np.int64]:
        """Return the row numbers at which a file's row groups start, and the end: (groups + 1,)."""
        if number not in self._bounds:
            metadata = self.file(number).metadata
            rows = [metadata.row_group(k).num_rows for k in range(metadata.num_row_groups)]
            self._bounds[number] = self.starts[number] + np.cumsum([0, *rows])
        return self._bounds[number]

    def all_bounds(self) -> NDArray[np.int64]:
        """Return the row numbers at which the row groups of all files start, and the end."""
        parts = [self.bounds(number)[:-1] for number in range(len(self._files))]
        return np.concatenate([*parts, self.starts[-1:]])

    def group_of(self, row: int) -> tuple[int, int, Reader]:
        """Return the first row and the end of a row's group, and the group's reader."""
        number = int(np.searchsorted(self.starts, row, side="right")) - 1
        bounds = self.bounds(number)
        group = int(np.searchsorted(bounds, row, side="right")) - 1
        first, end = int(bounds[group]), int(bounds[group + 1])
        if self._process != os.getpid():
            self._forget()
        held = self._groups.get(first)
        if held is None:
            held = self._read(number, group)
            self._groups[first] = held
            self._bytes += held[0]
            while self._bytes > _CACHED_BYTES and len(self._groups) > 1:
                self._bytes -= self._groups.popitem(last=False)[1][0]
        else:
            self._groups.move_to_end(first)
        return first, end, held[1]

    def _read(self, number: int, group: int) -> tuple[int, Reader]:
        path = self._store.at(self._files[number].path)
        table = read_group(path, self.file(number), group, self._spec, self._columns)
        if self._columns is not None:
            return table.nbytes, ColumnReader(table.select(list(self._columns)), self._spec)
        extra = self._extra() if self._extra else None
        return table.nbytes, RecordReader(table, self._spec, extra)

    def row(self, row: int) -> Any:  # noqa: ANN401 - a record, or a dictionary of columns
        """Return one row."""
        first, _, reader = self.group_of(row)
        return reader.rows(row - first, row - first + 1)[0]
