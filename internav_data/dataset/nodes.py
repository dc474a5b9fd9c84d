"""The shape of a row, read from a frozen dataclass: the one source of Arrow and JSON Schemas.

A tree of nodes mirrors the type hints. `Leaf` holds numbers, strings and booleans, `Coordinates`
a tuple of fixed length with a name for each member (a point, a quaternion, a colour), `Sequence`
a tuple of any length and `Record` a dataclass. Everything else in this package (writing, reading,
schemas, digests) walks this tree.
"""

from __future__ import annotations

import collections.abc
import dataclasses
import types
import typing
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

COORDINATES: dict[tuple[type, ...], tuple[str, ...]] = {
    (float, float): ("x", "y"),
    (float, float, float): ("x", "y", "z"),
    (float, float, float, float): ("x", "y", "z", "w"),
    (int, int, int): ("r", "g", "b"),
}
"""Names for the members of tuples of fixed length, stored as structs: a column each."""

WIDTHS: dict[str, str] = {
    "seed": "int64",
    "actions": "int8",
    "index": "int32",
    "scene": "int32",
    "shortest_path_steps": "int32",
    "obstructed_path_steps": "int32",
    "path_steps_after": "int32",
    "steps": "int32",
    "reachable_nodes": "int32",
    "group": "int16",
}
"""Integers that are not ids or counts within one house; those are int16."""

UNITS = {"m": "m", "m2": "m^2", "kg": "kg", "s": "s", "deg": "deg", "seconds": "s"}
"""Unit by the last word of a field's name."""

METRES = frozenset(
    {"x", "y", "z", "centre", "size", "corners", "polygon", "outline", "points", "swept"}
)
"""Fields in metres whose names state no unit."""

Kind = Literal["string", "bool", "float64", "int8", "uint8", "int16", "int32", "int64"]


@dataclass(frozen=True, slots=True)
class Leaf:
    """One value."""

    kind: Kind
    choices: tuple[str, ...] = ()
    """Strings that the value may be; () for any."""


@dataclass(frozen=True, slots=True)
class Coordinates:
    """A tuple of fixed length whose members have names and one kind."""

    names: tuple[str, ...]
    leaf: Leaf


@dataclass(frozen=True, slots=True)
class Sequence:
    """A tuple of any length, or of `length` members."""

    item: Node
    length: int | None = None


@dataclass(frozen=True, slots=True)
class Record:
    """A frozen dataclass."""

    cls: type[Any]
    fields: tuple[Field, ...]


@dataclass(frozen=True, slots=True)
class Keyed:
    """A mapping by name: in JSON files, never in tables."""

    item: Node | None
    """Shape of its values; None: any."""


Node: TypeAlias = Leaf | Coordinates | Sequence | Record | Keyed


@dataclass(frozen=True, slots=True)
class Field:
    """One named member of a record."""

    name: str
    node: Node
    nullable: bool
    unit: str | None


_known: dict[type[Any], Record] = {}


def record_node(cls: type[Any]) -> Record:
    """Return the shape of a dataclass; fields with `compare=False` are not stored.

    Raises
    ------
    TypeError
        A type hint that has no place in a table.

    """
    if cls not in _known:
        hints = typing.get_type_hints(cls)
        fields = (_field(f.name, hints[f.name]) for f in dataclasses.fields(cls) if f.compare)
        _known[cls] = Record(cls, tuple(fields))
    return _known[cls]


def _field(name: str, hint: object) -> Field:
    nullable = False
    if typing.get_origin(hint) in (types.UnionType, typing.Union):
        members = [a for a in typing.get_args(hint) if a is not type(None)]
        if len(members) != 1:
            raise TypeError(f"field {name}: a union of several types has no column: {hint}")
        nullable, hint = True, members[0]
    return Field(name, _node(name, hint), nullable, _unit(name))


def _node(name: str, hint: object) -> Node:
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return record_node(hint)
    if typing.get_origin(hint) is tuple:
        return _tuple_node(name, typing.get_args(hint))
    if typing.get_origin(hint) is collections.abc.Mapping:
        value = typing.get_args(hint)[1]
        return Keyed(None if value is Any else _node(name, value))
    return _leaf(name, hint)


def _tuple_node(name: str, args: tuple[Any, ...]) -> Node:
    if len(args) == 2 and args[1] is Ellipsis:  # noqa: PLR2004 - tuple[T, ...]
        return Sequence(_node(name, args[0]))
    if args in COORDINATES:
        names = COORDINATES[args]
        kind: Kind = "uint8" if args[0] is int else "float64"
        return Coordinates(names, Leaf(kind))
    if len(set(args)) == 1:
        return Sequence(_node(name, args[0]), len(args))
    raise TypeError(f"field {name}: no column for a tuple of {args}")


def _leaf(name: str, hint: object) -> Leaf:
    if typing.get_origin(hint) is Literal:
        return Leaf("string", typing.get_args(hint))
    if hint is str:
        return Leaf("string")
    if hint is bool:
        return Leaf("bool")
    if hint is float:
        return Leaf("float64")
    if hint is int:
        return Leaf(typing.cast("Kind", WIDTHS.get(name, "int16")))
    raise TypeError(f"field {name}: no column for {hint}")


def _unit(name: str) -> str | None:
    if name in METRES:
        return "m"
    return UNITS.get(name.rsplit("_", 1)[-1]) if "_" in name or name == "seconds" else None
