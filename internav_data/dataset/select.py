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
_WORDS = {"true": True, "false": False}


def condition(text: str) -> Condition:
    """Read a condition as people write it: `room_count<=3` or `mode=blocked`.

    Raises
    ------
    UsageError
        It is no condition.

    """
    found = _CONDITION.fullmatch(text)
    if found is None:
        raise UsageError(f"--filter {text!r}: expected COLUMN=VALUE, as in room_count<=3")
    name, operator, word = found.groups()
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
    """Return some columns of all rows of the files, page checksums verified.

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
    names = _names(filters)
    table = read_columns(store, files, EPISODES, names)
    rows = pa.array(np.arange(table.num_rows))
    try:
        expression = pq.filters_to_expression(_plain(filters))
        kept = table.append_column("row number", rows).filter(expression)
    except (ValueError, TypeError, pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
        raise UsageError(f"filters: {error}: expected as in [('room_count', '>=', 4)]") from error
    numbers: NDArray[np.int64] = kept["row number"].to_numpy()
    return numbers


def _plain(filters: Filters) -> list[Any]:
    return [tuple(f) if isinstance(f[0], str) else [tuple(c) for c in f] for f in filters]


def _names(filters: Filters) -> list[str]:
    try:
        groups: list[Any] = [[f] if isinstance(f[0], str) else list(f) for f in filters]
        names = [str(name) for group in groups for name, _, _ in group]
    except (TypeError, ValueError, IndexError, KeyError) as error:
        raise UsageError(
            f"filters: expected (column, operator, value) as in [('room_count', '>=', 4)], "
            f"got {filters!r}"
        ) from error
    if not names:
        raise UsageError("filters: expected at least one condition, got none: leave filters out")
    check_columns(names, EPISODES)
    scalar = {f.name for f in EPISODES.node.fields if isinstance(f.node, Leaf)}
    for name in names:
        if name not in scalar:
            raise UsageError(f"filters: {name} is nested: expected one of {sorted(scalar)}")
    return sorted(set(names))
