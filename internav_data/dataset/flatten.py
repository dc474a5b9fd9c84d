"""Obstacles and outcomes as flat tables, one row each, for engines that like no nested columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

if TYPE_CHECKING:
    from collections.abc import Callable

_KEYS: Final = ("episode_id", "scene_id", "split")
COLUMNS: Final = (*_KEYS, "obstacles")
"""Columns of episodes that the flat tables are made of."""


def obstacle_rows(episodes: pa.Table) -> pa.Table:
    """Return one row an obstacle: keys of its episode, its number there, its plain values.

    Members of structs get the struct's name before theirs (`quaternion_x`). Lists are left out.
    """
    rows, obstacles = _unrolled(episodes, "obstacles")
    keys = {name: rows[name] for name in _KEYS}
    return pa.table(keys | {"obstacle": _numbers(rows["row"])} | _plain(obstacles))


def outcome_rows(episodes: pa.Table) -> pa.Table:
    """Return one row an outcome: keys, number, asset and type of its obstacle, its plain values.

    The pose is `pose_x` … `pose_quaternion_w`; `moved_count` is the number of other objects that
    moved. Obstacles without outcomes have no row.
    """
    rows, obstacles = _unrolled(episodes, "obstacles")
    of_obstacle = {name: rows[name] for name in _KEYS} | {"obstacle": _numbers(rows["row"])}
    for name in ("asset_id", "type"):
        of_obstacle[name] = pc.struct_field(obstacles, name)
    nested = pa.table(of_obstacle | {"outcomes": pc.struct_field(obstacles, "outcomes")})
    repeated, outcomes = _unrolled(nested, "outcomes")
    keys = {name: repeated[name] for name in of_obstacle}
    moved = {"moved_count": pc.list_value_length(pc.struct_field(outcomes, "moved"))}
    return pa.table(keys | _plain(outcomes) | moved)


FLAT: Final[dict[str, Callable[[pa.Table], pa.Table]]] = {
    "obstacles": obstacle_rows,
    "outcomes": outcome_rows,
}
"""Flat tables by name, each made of the episodes' `COLUMNS`."""


def _unrolled(table: pa.Table, name: str) -> tuple[pa.Table, pa.StructArray]:
    """Return a table with a row for each element of a column of lists, and the elements.

    The column `row` of the table is the number of the row that the element stood in.
    """
    lists = table[name].combine_chunks()
    parents = pc.list_parent_indices(lists)
    rows = table.drop_columns([name]).take(parents).append_column("row", parents)
    return rows, pc.list_flatten(lists)


def _numbers(parents: pa.ChunkedArray) -> pa.Array:
    """Return the number of each element within its list, from the ascending rows of the lists."""
    rows = parents.to_numpy()
    first = np.concatenate([[True], rows[1:] != rows[:-1]]) if len(rows) else np.empty(0, bool)
    starts = np.flatnonzero(first)
    return pa.array((np.arange(len(rows)) - starts[np.cumsum(first) - 1]).astype(np.int32))


def _plain(structs: pa.StructArray, prefix: str = "") -> dict[str, pa.Array]:
    """Return the plain members of structs by name, at any depth; nulls of a struct are theirs."""
    found: dict[str, pa.Array] = {}
    for field, values in zip(structs.type, structs.flatten(), strict=True):
        if pa.types.is_struct(field.type):
            found |= _plain(values, f"{prefix}{field.name}_")
        elif not pa.types.is_list(field.type):
            found[f"{prefix}{field.name}"] = values
    return found
