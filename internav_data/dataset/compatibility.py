"""Columns and settings of another release read as this one's.

From format version 2 on columns are only added, nullable. A reader takes the columns that it knows
from a file; what the file's writer did not know yet is null. What a reader must know to understand
a dataset stands in the manifest's `requires`. Settings that have moved are read at their present
place.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import pyarrow as pa

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

MOVED_SETTINGS: Final = {
    ("episodes", "push_model"): ("world", "push_model"),
    ("episodes", "engine"): ("physics", "engine"),
}
"""Section and name of settings of earlier releases, and where they are today."""


def present_settings(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return a dataset's config with the settings of earlier releases at their present place."""
    moved = dict(config)
    for (section, name), (now_section, now_name) in MOVED_SETTINGS.items():
        before, now = moved.get(section), moved.get(now_section, {})
        if isinstance(before, dict) and isinstance(now, dict) and name in before:
            moved[section] = {key: value for key, value in before.items() if key != name}
            moved[now_section] = {now_name: before[name], **now}
    return moved


def problems(got: pa.Schema, wanted: pa.Schema) -> list[str]:
    """Return the reasons for which columns `got` cannot be read as `wanted`; empty if they can."""
    return list(_problems(pa.struct(list(got)), pa.struct(list(wanted)), ""))


def _problems(got: pa.DataType, wanted: pa.DataType, path: str) -> Iterator[str]:
    if pa.types.is_struct(wanted) and pa.types.is_struct(got):
        for field in wanted:
            name = f"{path}.{field.name}".lstrip(".")
            at = got.get_field_index(field.name)
            if at >= 0:
                if got.field(at).nullable and not field.nullable:
                    yield f"{name} may be null"
                yield from _problems(got.field(at).type, field.type, name)
            elif not field.nullable:
                yield f"{name} is missing"
    elif pa.types.is_list(wanted) and pa.types.is_list(got):
        if got.value_field.nullable and not wanted.value_field.nullable:
            yield f"{path}.element may be null"
        yield from _problems(got.value_type, wanted.value_type, f"{path}.element")
    elif got != wanted:
        yield f"{path} is {got}, expected {wanted}"


def conformed(table: pa.Table, schema: pa.Schema, columns: Sequence[str] | None = None) -> pa.Table:
    """Return a table as if written with `schema`.

    Parameters
    ----------
    table
        Read from a file without `problems`.
    schema
        This release's columns.
    columns
        Names to keep, dotted for a part of a struct (`expert.steps`); None: all.
    """
    fields = list(schema) if columns is None else _pruned(schema, columns)
    names = table.column_names
    arrays = [
        pa.chunked_array(
            [_conformed(chunk, field.type) for chunk in table.column(field.name).chunks],
            field.type,
        )
        if field.name in names
        else pa.nulls(table.num_rows, field.type)
        for field in fields
    ]
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def _conformed(array: pa.Array, wanted: pa.DataType) -> pa.Array:
    if array.type == wanted:
        return array
    nulls = array.is_null() if array.null_count else None
    if pa.types.is_list(wanted):
        offsets = pa.array(array.offsets.to_numpy())
        items = _conformed(array.values, wanted.value_type)
        return pa.ListArray.from_arrays(offsets, items, type=wanted, mask=nulls)
    children = [
        _conformed(array.field(at), field.type)
        if (at := array.type.get_field_index(field.name)) >= 0
        else pa.nulls(len(array), field.type)
        for field in wanted
    ]
    return pa.StructArray.from_arrays(children, fields=list(wanted), mask=nulls)


def _pruned(schema: pa.Schema, columns: Sequence[str]) -> list[pa.Field]:
    """Return the fields that are named; of a struct the parts that are."""
    wanted: dict[str, list[str]] = {}
    complete = set()
    for name in columns:
        first, _, rest = name.partition(".")
        wanted.setdefault(first, []).append(rest)
        if not rest:
            complete.add(first)
    return [
        field if field.name in complete else _part(field, wanted[field.name])
        for field in schema
        if field.name in wanted
    ]


def _part(field: pa.Field, paths: Sequence[str]) -> pa.Field:
    if pa.types.is_list(field.type):
        inner = [path.removeprefix("list.element").lstrip(".") for path in paths]
        item = field.type.value_field
        part = item if "" in inner else _part(item, inner)
        return field.with_type(pa.list_(part))
    return field.with_type(pa.struct(_pruned(pa.schema(list(field.type)), paths)))
