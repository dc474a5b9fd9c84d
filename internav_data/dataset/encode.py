"""Records to Arrow, a column at a time; every value is checked on its way in."""

from __future__ import annotations

import math
from itertools import chain
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import pyarrow as pa

from internav_data.dataset.nodes import Coordinates, Keyed, Leaf, Node, Record, Sequence
from internav_data.dataset.tables import TableSpec, arrow_type
from internav_data.records.errors import ValidationError

if TYPE_CHECKING:
    from collections.abc import Sequence as Rows

R = TypeVar("R")

_ZEROS: dict[str, Any] = {"string": "", "bool": False, "float64": 0.0}


def to_table(records: Rows[R], spec: TableSpec[R]) -> pa.Table:
    """Return records as a table with exactly the spec's schema.

    Raises
    ------
    ValidationError
        A value that its column cannot hold (wrong type, out of range, not finite, unknown word),
        naming column and value.

    """
    columns = [
        _encode(
            field.node,
            [getattr(record, field.name) for record in records],
            field.name,
            nullable=field.nullable,
        )
        for field in spec.node.fields
    ]
    return pa.Table.from_arrays(columns, schema=spec.schema)


def _encode(node: Node, values: list[Any], path: str, *, nullable: bool) -> pa.Array:
    missing = [value is None for value in values]
    mask = None
    if any(missing):
        if not nullable:
            raise ValidationError(f"column {path}: a value is missing and the column has no nulls")
        mask = np.array(missing, dtype=bool)
    if isinstance(node, Leaf):
        return _encode_leaf(node, values, mask, path)
    if isinstance(node, Sequence):
        return _encode_sequence(node, values, mask, path)
    if isinstance(node, Coordinates):
        leaf = node.leaf
        zero = (_ZEROS.get(leaf.kind, 0),) * len(node.names)
        rows = values if mask is None else [zero if v is None else v for v in values]
        if any(len(row) != len(node.names) for row in rows):
            raise ValidationError(f"column {path}: expected tuples of {len(node.names)} numbers")
        parts = [
            _encode_leaf(leaf, [row[k] for row in rows], None, f"{path}.{name}")
            for k, name in enumerate(node.names)
        ]
        return _struct(node, parts, mask)
    if isinstance(node, Keyed):
        raise TypeError(f"column {path}: a mapping has no columns")
    parts = [
        _encode(
            field.node,
            # What lies under a null is never written, but Arrow wants something there.
            [
                zero_value(field.node, field.nullable) if v is None else getattr(v, field.name)
                for v in values
            ],
            f"{path}.{field.name}",
            nullable=field.nullable,
        )
        for field in node.fields
    ]
    return _struct(node, parts, mask)


def _struct(
    node: Record | Coordinates, parts: list[pa.Array], mask: np.ndarray[Any, Any] | None
) -> pa.Array:
    fields = list(arrow_type(node))
    return pa.StructArray.from_arrays(
        parts, fields=fields, mask=None if mask is None else pa.array(mask)
    )


def _encode_leaf(
    node: Leaf, values: list[Any], mask: np.ndarray[Any, Any] | None, path: str
) -> pa.Array:
    if node.kind == "float64" and not all(v is None or math.isfinite(v) for v in values):
        raise ValidationError(f"column {path}: expected finite numbers, got NaN or infinity")
    if node.choices and not set(values) <= {*node.choices, None}:
        wrong = sorted({str(v) for v in values} - set(node.choices))
        raise ValidationError(f"column {path}: expected one of {node.choices}, got {wrong[0]!r}")
    try:
        return pa.array(values, type=arrow_type(node), mask=mask)
    except (pa.ArrowInvalid, pa.ArrowTypeError, OverflowError, TypeError) as error:
        raise ValidationError(f"column {path}: expected {node.kind}: {error}") from error


def _encode_sequence(
    node: Sequence, values: list[Any], mask: np.ndarray[Any, Any] | None, path: str
) -> pa.Array:
    if mask is not None:
        values = [() if v is None else v for v in values]
    lengths = np.fromiter(map(len, values), dtype=np.int64, count=len(values))
    if (
        node.length is not None
        and not (lengths[~mask if mask is not None else ...] == node.length).all()
    ):
        raise ValidationError(f"column {path}: expected {node.length} members in every row")
    offsets = np.zeros(len(values) + 1, dtype=np.int32)
    np.cumsum(lengths, out=offsets[1:])
    items = _encode(node.item, list(chain.from_iterable(values)), f"{path}.element", nullable=False)
    return pa.ListArray.from_arrays(
        pa.array(offsets),
        items,
        type=arrow_type(node),
        mask=None if mask is None else pa.array(mask),
    )


def zero_value(node: Node, nullable: bool) -> Any:  # noqa: ANN401 - a value of any column
    """Return the value of a column that says nothing: null, 0, "" or an empty sequence."""
    if nullable:
        return None
    if isinstance(node, Leaf):
        return node.choices[0] if node.choices else _ZEROS.get(node.kind, 0)
    if isinstance(node, Coordinates):
        return (_ZEROS.get(node.leaf.kind, 0),) * len(node.names)
    if isinstance(node, Sequence):
        return ()
    if isinstance(node, Keyed):
        return {}
    values = {f.name: zero_value(f.node, f.nullable) for f in node.fields}
    return node.cls(**values)
