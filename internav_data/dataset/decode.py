"""Arrow to records, a column at a time.

A tree of cursors is built over one table: a fixed effort for each column, after which any run of
rows becomes dataclasses by slicing numpy arrays. A single record of a cached row group takes tens
of microseconds, and each row of a table no more.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np
import pyarrow as pa

from internav_data.dataset.nodes import Coordinates, Field, Keyed, Leaf, Node, record_node
from internav_data.dataset.nodes import Sequence as SequenceNode
from internav_data.records.errors import ValidationError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from internav_data.dataset.tables import TableSpec

R = TypeVar("R")


def from_table(
    table: pa.Table, spec: TableSpec[R], extra: Mapping[str, Any] | None = None
) -> list[R]:
    """Return the records of a table that has the spec's schema.

    `extra` gives the fields that are not stored, the same for every record (`assets` of a House).

    Raises
    ------
    ValidationError
        The table's schema is not the spec's.

    """
    return RecordReader(table, spec, extra).rows(0, table.num_rows)


class RecordReader:
    """Turns runs of rows of one table into records. Holds the table's columns as numpy arrays."""

    def __init__(
        self, table: pa.Table, spec: TableSpec[Any], extra: Mapping[str, Any] | None = None
    ) -> None:
        if not table.schema.equals(spec.schema):
            raise ValidationError(
                f"{spec.name}: the columns are not those of this format: "
                f"{schema_difference(table.schema, spec.schema)}"
            )
        self.num_rows: int = table.num_rows
        columns = [one_array(table.column(name)) for name in table.schema.names]
        self._records = _RecordCursor(_maker(spec.cls, extra or {}), spec.node.fields, columns)

    def rows(self, start: int, stop: int) -> list[Any]:
        """Return the records of rows start … stop - 1."""
        return self._records.take(start, stop)


class ColumnReader:
    """Turns runs of rows of some columns into dictionaries of the same values as in records."""

    def __init__(self, table: pa.Table, spec: TableSpec[Any]) -> None:
        self.num_rows: int = table.num_rows
        nodes = {field.name: field.node for field in spec.node.fields}
        self._names = table.schema.names
        self._columns = [cursor(nodes[n], one_array(table.column(n))) for n in self._names]

    def rows(self, start: int, stop: int) -> list[Any]:
        """Return the rows start … stop - 1, each a dictionary by column."""
        columns = [column.take(start, stop) for column in self._columns]
        return [dict(zip(self._names, row, strict=True)) for row in zip(*columns, strict=True)]


def one_array(column: pa.ChunkedArray) -> pa.Array:
    """Return a column as one array."""
    if column.num_chunks == 1:
        return column.chunk(0)
    return pa.concat_arrays(column.chunks) if column.num_chunks else pa.array([], column.type)


def schema_difference(got: pa.Schema, expected: pa.Schema) -> str:
    """Return the difference of two schemas in a few words."""
    missing = [n for n in expected.names if n not in got.names]
    surplus = [n for n in got.names if n not in expected.names]
    if missing or surplus:
        return f"missing {missing}, unknown {surplus}"
    changed = [n for n in expected.names if not got.field(n).equals(expected.field(n))]
    return f"of another type: {changed}" if changed else "in another order"


Maker = Callable[[Sequence[Sequence[Any]]], list[Any]]
"""Function from columns, one at least, to records."""


def _maker(cls: type[Any], extra: Mapping[str, Any]) -> Maker:
    """Return a function that makes records of a frozen dataclass with slots.

    `extra` gives the fields that are not stored, the same for every record.
    """
    names = (*(field.name for field in record_node(cls).fields), *extra)
    twin = _twin(cls, names)  # type: ignore[arg-type] # any class can be hashed
    repeated = [itertools.repeat(value) for value in extra.values()]

    def made(columns: Sequence[Sequence[Any]]) -> list[Any]:
        records: list[Any] = list(map(twin, *columns, *repeated))
        for record in records:
            record.__class__ = cls
        return records

    return made


@cache
def _twin(cls: type[Any], names: tuple[str, ...]) -> type[Any]:
    """Return a class with the slots of a frozen dataclass, whose instances can become records.

    Its constructor takes the fields in the order of `names`.
    """
    # That of a frozen dataclass calls object.__setattr__ for each field: ten times an assignment.
    return dataclasses.make_dataclass(cls.__name__, names, slots=True)


class _NumberCursor:
    def __init__(self, array: pa.Array) -> None:
        self._values = array.to_numpy(zero_copy_only=False)

    def take(self, start: int, stop: int) -> list[Any]:
        values: list[Any] = self._values[start:stop].tolist()
        return values


class _WordCursor:
    """Reader of strings: the few distinct ones are made once and shared by all records."""

    def __init__(self, array: pa.Array) -> None:
        coded = array.dictionary_encode()
        self._words: list[str] = coded.dictionary.to_pylist()
        self._codes = coded.indices.to_numpy(zero_copy_only=False)

    def take(self, start: int, stop: int) -> list[Any]:
        words = self._words
        return [words[k] for k in self._codes[start:stop].tolist()]


class _CoordinatesCursor:
    """Reader of tuples of numbers, which share one array: a slice for all of their members."""

    def __init__(self, names: Iterable[str], array: pa.Array) -> None:
        columns = [array.field(k) for k in _indices(array, names)]
        self._values = np.column_stack([c.to_numpy(zero_copy_only=False) for c in columns])

    def take(self, start: int, stop: int) -> list[Any]:
        return [*map(tuple, self._values[start:stop].tolist())]


class _RecordCursor:
    """Reader of records: their numbers of one type share an array, all else has its own reader."""

    def __init__(self, make: Maker, fields: Iterable[Field], arrays: Iterable[pa.Array]) -> None:
        self._make = make
        self._others: list[tuple[int, Cursor]] = []
        numbers: dict[str, tuple[list[int], list[np.ndarray[Any, Any]]]] = {}
        for place, (field, array) in enumerate(zip(fields, arrays, strict=True)):
            if not isinstance(field.node, Leaf) or field.node.kind == "string" or array.null_count:
                self._others.append((place, cursor(field.node, array)))
                continue
            # Integers of all widths together: a list of Python's has no width.
            kind = field.node.kind if field.node.kind in {"float64", "bool"} else "int"
            places, columns = numbers.setdefault(kind, ([], []))
            places.append(place)
            columns.append(array.to_numpy(zero_copy_only=False))
        self._numbers = [(places, np.stack(columns)) for places, columns in numbers.values()]
        self._width = len(self._others) + sum(len(places) for places, _ in self._numbers)

    def take(self, start: int, stop: int) -> list[Any]:
        columns: list[list[Any]] = [[]] * self._width
        for places, block in self._numbers:
            for place, values in zip(places, block[:, start:stop].tolist(), strict=True):
                columns[place] = values
        for place, reader in self._others:
            columns[place] = reader.take(start, stop)
        return self._make(columns)


class _ListCursor:
    def __init__(self, node: Node, array: pa.Array) -> None:
        self._offsets = array.offsets.to_numpy()
        self._items = cursor(node, array.values)

    def take(self, start: int, stop: int) -> list[Any]:
        offsets = self._offsets[start : stop + 1].tolist()
        first, last = offsets[0], offsets[-1]
        if first == last:  # most lists of moved objects
            return [()] * (stop - start)
        items = self._items.take(first, last)
        return [tuple(items[a - first : b - first]) for a, b in itertools.pairwise(offsets)]


class _SparseCursor:
    """Reader of values some of which are null: a reader of the others, and their places."""

    def __init__(self, node: Node, array: pa.Array) -> None:
        self._valid = array.is_valid().to_numpy(zero_copy_only=False)
        self._before = np.concatenate([[0], np.cumsum(self._valid)]).data
        """Number of values that are there before each row."""
        self._others = cursor(node, array.drop_null())

    def take(self, start: int, stop: int) -> list[Any]:
        first, last = self._before[start], self._before[stop]
        if first == last:  # most poses of outcomes
            return [None] * (stop - start)
        there = self._others.take(first, last)
        if last - first == stop - start:
            return there
        following = iter(there)
        return [next(following) if ok else None for ok in self._valid[start:stop].tolist()]


class Cursor(Protocol):
    """Reader of one column."""

    def take(self, start: int, stop: int) -> list[Any]:
        """Return the values of rows start … stop - 1."""


def cursor(node: Node, array: pa.Array) -> Cursor:
    """Return a reader of an array.

    Parameters
    ----------
    node
        Shape of a row of the array.
    array
        Array, no slice of a struct array: its children would begin elsewhere.

    Raises
    ------
    TypeError
        `node` is a mapping, which has no columns.

    """
    if array.null_count:
        return _SparseCursor(node, array)
    if isinstance(node, Leaf):
        return _WordCursor(array) if node.kind == "string" else _NumberCursor(array)
    if isinstance(node, SequenceNode):
        return _ListCursor(node.item, array)
    if isinstance(node, Coordinates):
        return _CoordinatesCursor(node.names, array)
    if isinstance(node, Keyed):
        raise TypeError("a mapping has no columns")
    names = [field.name for field in node.fields]
    children = [array.field(k) for k in _indices(array, names)]
    return _RecordCursor(_maker(node.cls, {}), node.fields, children)


def _indices(array: pa.Array, names: Iterable[str]) -> list[int]:
    return [array.type.get_field_index(name) for name in names]
