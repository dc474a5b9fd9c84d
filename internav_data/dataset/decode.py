"""Arrow to records, a column at a time.

A tree of cursors is built over one table: a fixed effort for each column, after which any run of
rows becomes dataclasses by slicing numpy arrays. A single record of a cached row group takes tens
of microseconds, and each row of a table no more.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, TypeVar

import pyarrow as pa

from internav_data.dataset.nodes import Coordinates, Keyed, Leaf, Node, Sequence
from internav_data.records.errors import ValidationError

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

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
        self._make = spec.cls if not extra else _with_extra(spec.cls, extra)
        self._columns = [
            cursor(field.node, one_array(table.column(field.name))) for field in spec.node.fields
        ]

    def rows(self, start: int, stop: int) -> list[Any]:
        """Return the records of rows start … stop - 1."""
        return list(map(self._make, *[column.take(start, stop) for column in self._columns]))


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


def _with_extra(cls: type[Any], extra: Mapping[str, Any]) -> Any:  # noqa: ANN401 - a constructor
    def make(*values: object) -> object:
        return cls(*values, **extra)

    return make


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


class _LeafCursor:
    def __init__(self, array: pa.Array, *, is_text: bool) -> None:
        self._valid = _validity(array)
        self._words: list[str] | None = None
        if is_text:
            # Few distinct strings: each is made once and shared by all records.
            coded = (
                array.fill_null("").dictionary_encode()
                if array.null_count
                else (array.dictionary_encode())
            )
            self._words = coded.dictionary.to_pylist()
            self._values = coded.indices.to_numpy(zero_copy_only=False)
        else:
            if array.null_count:
                array = array.fill_null(False if pa.types.is_boolean(array.type) else 0)
            self._values = array.to_numpy(zero_copy_only=False)

    def take(self, start: int, stop: int) -> list[Any]:
        values = self._values[start:stop].tolist()
        if self._words is not None:
            words = self._words
            values = [words[k] for k in values]
        return _nulled(values, self._valid, start, stop)


class _StructCursor:
    def __init__(self, make: Any, names: list[str], nodes: list[Node], array: pa.Array) -> None:  # noqa: ANN401
        self._make = make
        self._valid = _validity(array)
        self._columns = [
            cursor(node, array.field(k))
            for k, node in zip(_indices(array, names), nodes, strict=True)
        ]

    def take(self, start: int, stop: int) -> list[Any]:
        columns = [column.take(start, stop) for column in self._columns]
        made = zip(*columns, strict=True) if self._make is tuple else map(self._make, *columns)
        return _nulled(list(made), self._valid, start, stop)


class _ListCursor:
    def __init__(self, node: Node, array: pa.Array) -> None:
        self._valid = _validity(array)
        self._offsets = array.offsets.to_numpy()
        self._items = cursor(node, array.values)

    def take(self, start: int, stop: int) -> list[Any]:
        if start >= stop:
            return []
        offsets = self._offsets[start : stop + 1].tolist()
        first = offsets[0]
        items = self._items.take(first, offsets[-1])
        rows = [tuple(items[a - first : b - first]) for a, b in itertools.pairwise(offsets)]
        return _nulled(rows, self._valid, start, stop)


Cursor = _LeafCursor | _StructCursor | _ListCursor


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
    if isinstance(node, Leaf):
        return _LeafCursor(array, is_text=node.kind == "string")
    if isinstance(node, Sequence):
        return _ListCursor(node.item, array)
    if isinstance(node, Coordinates):
        return _StructCursor(tuple, list(node.names), [node.leaf] * len(node.names), array)
    if isinstance(node, Keyed):
        raise TypeError("a mapping has no columns")
    fields = node.fields
    return _StructCursor(node.cls, [f.name for f in fields], [f.node for f in fields], array)


def _indices(array: pa.Array, names: list[str]) -> list[int]:
    return [array.type.get_field_index(name) for name in names]


def _validity(array: pa.Array) -> np.ndarray[Any, Any] | None:
    if not array.null_count:
        return None
    valid: np.ndarray[Any, Any] = array.is_valid().to_numpy(zero_copy_only=False)
    return valid


def _nulled(
    values: list[Any], valid: np.ndarray[Any, Any] | None, start: int, stop: int
) -> list[Any]:
    if valid is None:
        return values
    flags = valid[start:stop].tolist()
    return [v if ok else None for v, ok in zip(values, flags, strict=True)]
