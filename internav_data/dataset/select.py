"""Columns and rows by name and condition, without making records of them."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from internav_data.dataset.nodes import Leaf
from internav_data.dataset.snapshot import read_shard
from internav_data.dataset.tables import EPISODES, TableSpec
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.core.storage import Store
    from internav_data.dataset.manifest import DataFile

Condition = tuple[str, str, Any]
Filters = Sequence[Condition] | Sequence[Sequence[Condition]]
_CONDITION = re.compile(r"\s*(\w+)\s*(<=|>=|!=|==|=|<|>)\s*(.+?)\s*")
_NULL = re.compile(r"\s*(\w+)\s+(is|is\s+not)\s+null\s*", re.IGNORECASE)
NULL_OPERATORS = ("is", "is not")
"""Operators whose value is None, on columns of any kind."""
_WORDS = {"true": True, "false": False}


def condition(text: str) -> Condition:
    """Read a condition as people write it: `room_count<=3`, `mode=blocked`, `expert is not null`.

    Raises
    ------
    UsageError
        It is no condition.

    """
    found = _NULL.fullmatch(text)
    if found is not None:
        return found[1], " ".join(found[2].lower().split()), None
    found = _CONDITION.fullmatch(text)
    if found is None:
        raise UsageError(
            f"--filter {text!r}: expected COLUMN=VALUE or COLUMN is null, as in room_count<=3, "
            "expert is not null"
        )
    name, operator, word = found.groups()
    if word.lower() in {"null", "none"}:
        raise UsageError(
            f"--filter {text!r}: nothing equals null: write '{name} is null' or "
            f"'{name} is not null'"
        )
    value: object = _WORDS.get(word.lower(), word)
    for kind in (float, int):
        try:
            value = kind(word)
        except ValueError:
            continue
    return name, operator, value


def check_columns(names: Sequence[str], spec: TableSpec[Any]) -> None:
    """Refuse names that are no top-level columns.

    Raises
    ------
    UsageError
        Names the unknown column and the nearest known one.

    """
    known = spec.schema.names
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(str(name), known, n=1)
            hint = f", did you mean {near[0]!r}?" if near else f": expected some of {known}"
            raise UsageError(f"columns: {spec.name} have no column {name!r}{hint}")


def read_columns(
    store: Store, files: Sequence[DataFile], spec: TableSpec[Any], names: Sequence[str]
) -> pa.Table:
    """Return some columns of all rows of the files, their checksums verified.

    Raises
    ------
    CorruptDataError
        A file is missing, truncated or damaged.

    """
    tables = [read_shard(store, file, spec, names) for file in files]
    schema = pa.schema([spec.schema.field(name) for name in names])
    return pa.concat_tables(
        [schema.empty_table(), *(table.select(list(names)) for table in tables)]
    )


def matching_rows(store: Store, files: Sequence[DataFile], filters: Filters) -> NDArray[np.int64]:
    """Return the numbers of the episodes for which the filters hold, ascending: (n,) int64.

    Only the filters' columns are read; pyarrow evaluates the conditions.

    Raises
    ------
    UsageError
        An unknown column or operator, or a value of another type.

    """
    groups = _groups(filters)
    table = read_columns(store, files, EPISODES, sorted({c[0] for g in groups for c in g}))
    columns = {"row number": pa.array(np.arange(table.num_rows))}
    for name, column in zip(table.column_names, table.columns, strict=True):
        columns |= {name: column, _null_column(name): column.is_null()}
    plain = [[_without_null(each) for each in group] for group in groups]
    try:
        kept = pa.table(columns).filter(pq.filters_to_expression(plain))["row number"]
    except (ValueError, TypeError, pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
        plain_columns = [field for field in table.schema if not pa.types.is_nested(field.type)]
        types = ", ".join(f"{field.name} is {field.type}" for field in plain_columns)
        raise UsageError(
            f"filters: {error}: expected as in [('room_count', '>=', 4)]"
            + (f"; {types}" if types else "")
        ) from error
    numbers: NDArray[np.int64] = kept.to_numpy()
    return numbers


def joined(one: Filters, other: Filters | None) -> Filters:
    """Return filters that hold where both do; None holds everywhere."""
    if other is None:
        return one
    return [[*a, *b] for a in _groups(one) for b in _groups(other)]


def _null_column(name: str) -> str:
    return f"{name} is null"


def _without_null(given: Condition) -> Condition:
    """Return a condition that pyarrow knows: `is null` asks for a column of its own."""
    name, operator, value = given
    if operator in NULL_OPERATORS:
        return _null_column(name), "==", operator == "is"
    return name, operator, value


def _groups(filters: Filters) -> list[list[Condition]]:
    """Return filters as a choice of lists of conditions, checked but for types of values."""
    try:
        given: Any = [filters] if filters and isinstance(filters[0][0], str) else filters
        groups = [[(str(name), str(op), value) for name, op, value in group] for group in given]
    except (TypeError, ValueError, IndexError, KeyError) as error:
        raise UsageError(
            f"filters: expected (column, operator, value) as in [('room_count', '>=', 4)], "
            f"got {filters!r}"
        ) from error
    if not any(groups):
        raise UsageError("filters: expected at least one condition, got none: leave filters out")
    check_columns([name for group in groups for name, _, _ in group], EPISODES)
    scalar = {f.name for f in EPISODES.node.fields if isinstance(f.node, Leaf)}
    for name, operator, value in (each for group in groups for each in group):
        if operator in NULL_OPERATORS or value is None:
            if operator not in NULL_OPERATORS or value is not None:
                raise UsageError(
                    f"filters: ({name!r}, {operator!r}, {value!r}): expected "
                    f"({name!r}, 'is', None) or ({name!r}, 'is not', None)"
                )
        elif name not in scalar:
            raise UsageError(
                f"filters: {name} is nested: expected 'is' or 'is not' None, or one of "
                f"{sorted(scalar)}"
            )
    return groups
