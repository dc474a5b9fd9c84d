"""Nested frozen dataclasses to and from plain values, with errors that name the key and its place.

Types are read from the dataclasses' hints: bool, int, float, str, Literal, optional and tuples of
these, and dataclasses inside dataclasses.

A config as TOML with the words of its fields: to be saved, changed and read again.
"""

from __future__ import annotations

import dataclasses
import json
import math
import textwrap
import tomllib
import types
import typing
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, TypeVar

from internav_data.core.field_docs import descriptions
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from _typeshed import DataclassInstance

C = TypeVar("C", bound="DataclassInstance")

NOTHING = "none"
"""What stands for no value where a number may be missing; TOML has no word for it."""
WORDS = {bool: "true or false", int: "a whole number", float: "a number", str: "text in quotes"}


def read_toml(path: Path) -> dict[str, Any]:
    """Return what a file of settings says.

    Raises
    ------
    UsageError
        It cannot be read, or is not TOML.

    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"cannot read config {path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UsageError(f"config {path} is not TOML: {error}") from error


def plain(value: Any) -> Any:  # noqa: ANN401 - whatever a config holds
    """Return a config as dictionaries, lists, strings, numbers, booleans and None."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    return value


def from_mapping(
    config: C,
    values: Mapping[str, Any],
    where: str,
    elsewhere: Sequence[str] = (),
    prefix: str = "",
) -> C:
    """Return a config with some values replaced.

    Parameters
    ----------
    config
        A frozen dataclass. Its class may have `RENAMED`, which maps names of earlier versions to
        those of fields: an old name is refused with a line that gives the new one.
    values
        Nested values by field name.
    where
        Where the values come from, for error messages.
    elsewhere
        Names that are options of the command line only.
    prefix
        Dotted key of the config itself, ending in a dot; empty at the top.

    Raises
    ------
    UsageError
        An unknown key, a key that the config's `RENAMED` lists, or a value of the wrong type.

    """
    hints = typing.get_type_hints(type(config))
    fields = {field.name for field in dataclasses.fields(config)}
    renamed: Mapping[str, str] = getattr(type(config), "RENAMED", {})
    changes: dict[str, Any] = {}
    for name, value in values.items():
        key = prefix + name
        if name in renamed:
            raise UsageError(f"{where}: '{key}' is called '{prefix}{renamed[name]}' now")
        if name not in fields:
            raise _unknown(key, where, known_keys(config, prefix), elsewhere)
        current = getattr(config, name)
        if dataclasses.is_dataclass(current) and not isinstance(current, type):
            if not isinstance(value, dict):
                raise UsageError(f"{where}: {key} is a table of settings, got {value!r}")
            changes[name] = from_mapping(current, value, where, elsewhere, f"{key}.")
        else:
            changes[name] = _typed(value, hints[name], f"{where}: {key}")
    return dataclasses.replace(config, **changes)


def updated(config: C, assignment: str, elsewhere: Sequence[str] = ()) -> C:
    """Return a config with one `a.b=c` applied; c is read as TOML, or as text for texts."""
    where = f"--set {assignment}"
    key, equals, text = (piece.strip() for piece in assignment.partition("="))
    if not equals or not key:
        raise UsageError(f"{where}: expected KEY=VALUE, as in --set house.scale=1.1")
    hint = _hint_of(config, key)
    value: Any = text if hint is not None and _is_text(hint) else _parsed(text)
    return from_mapping(config, nested(key, value), where, elsewhere)


def nested(key: str, value: Any) -> dict[str, Any]:  # noqa: ANN401 - any value
    """Return a value under its dotted key: a.b and c give {"a": {"b": c}}."""
    first, dot, rest = key.partition(".")
    return {first: nested(rest, value) if dot else value}


def known_keys(config: DataclassInstance, prefix: str = "") -> list[str]:
    """Return all dotted keys of a config, in the order of its fields."""
    keys: list[str] = []
    for f in dataclasses.fields(config):
        value = getattr(config, f.name)
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            keys += known_keys(value, f"{prefix}{f.name}.")
        else:
            keys.append(prefix + f.name)
    return keys


def _unknown(key: str, where: str, known: Sequence[str], elsewhere: Sequence[str]) -> UsageError:
    if key in elsewhere:
        return UsageError(
            f"{where}: '{key}' is no part of a dataset's config; give it on the command line"
        )
    by_last = {name.rsplit(".", 1)[-1]: name for name in known}
    near = get_close_matches(key, known, 2)
    near += [by_last[name] for name in get_close_matches(key.rsplit(".", 1)[-1], by_last, 2)]
    names = list(dict.fromkeys(near)) or list(known)
    listed = " or ".join(f"'{name}'" for name in names[:2]) if near else ", ".join(names)
    return UsageError(
        f"{where}: there is no key '{key}'; " + (f"did you mean {listed}?" if near else listed)
    )


def _hint_of(config: object, key: str) -> Any:  # noqa: ANN401 - a type hint
    *parents, last = key.split(".")
    for parent in parents:
        config = getattr(config, parent, None)
    if not dataclasses.is_dataclass(config):
        return None
    return typing.get_type_hints(type(config)).get(last)


def _is_text(hint: Any) -> bool:  # noqa: ANN401 - a type hint
    if typing.get_origin(hint) is tuple:
        return False
    return hint is str or str in typing.get_args(hint) or typing.get_origin(hint) is typing.Literal


def _parsed(text: str) -> Any:  # noqa: ANN401 - any TOML value
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _typed(value: Any, hint: Any, where: str) -> Any:  # noqa: ANN401 - checked here
    """Return a value as its hint wants it, or raise UsageError."""
    origin, members = typing.get_origin(hint), typing.get_args(hint)
    if origin is typing.Literal:
        if value not in members:
            raise UsageError(f"{where} is {value!r}: expected one of {', '.join(members)}")
        return value
    if origin in {types.UnionType, typing.Union}:
        (inner,) = (member for member in members if member is not type(None))
        nothing = value is None or (value == NOTHING and inner is not str)
        return None if nothing else _typed(value, inner, where)
    if origin is tuple:
        return _typed_tuple(value, members, where)
    fits = type(value) is hint or (hint is float and type(value) is int)
    if not fits:
        raise UsageError(f"{where}: expected {WORDS[hint]}, got {value!r}")
    if hint is float and not math.isfinite(value):
        raise UsageError(f"{where}: expected a finite number, got {value}")
    return hint(value)


def _typed_tuple(value: Any, members: tuple[Any, ...], where: str) -> tuple[Any, ...]:  # noqa: ANN401
    anything = len(members) == 2 and members[1] is Ellipsis  # noqa: PLR2004 - tuple[T, ...]
    count = "a list" if anything else f"a list of {len(members)}"
    if not isinstance(value, list | tuple) or (not anything and len(value) != len(members)):
        raise UsageError(f"{where}: expected {count}, got {value!r}")
    kinds = [members[0]] * len(value) if anything else members
    return tuple(
        _typed(item, kind, f"{where}[{index}]")
        for index, (item, kind) in enumerate(zip(value, kinds, strict=True))
    )


WIDTH = 96


def config_toml(config: DataclassInstance, program: str = "internav-gen") -> str:
    """Return all settings of a config with what they mean; its program reads it back."""
    head = f"Settings of {program}: --config FILE reads them, --set KEY=VALUE overrides one."
    return "\n".join([f"# {head}", *_table(config, "")]) + "\n"


def _table(config: Any, name: str) -> list[str]:  # noqa: ANN401 - a dataclass
    notes = descriptions(type(config))
    lines: list[str] = []
    tables: list[str] = []
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        note = " ".join(notes.get(field.name, "").split())
        comment = textwrap.wrap(note, WIDTH, initial_indent="# ", subsequent_indent="# ")
        if dataclasses.is_dataclass(value):
            tables += ["", *comment, f"[{name}{field.name}]", *_table(value, f"{field.name}.")]
        elif value is None and field.default is not None:
            lines += ["", *comment, f"{field.name} = {_value(NOTHING)}"]
        elif value is None:
            lines += ["", *comment, f"# {field.name} ="]
        else:
            lines += ["", *comment, f"{field.name} = {_value(value)}"]
    return lines + tables


def _value(value: Any) -> str:  # noqa: ANN401 - what configs hold
    """Return a value in TOML, which writes strings, numbers, booleans and lists as JSON does."""
    return json.dumps(list(value) if isinstance(value, tuple) else value, ensure_ascii=False)


def keys_given(
    file: Path | None, overrides: Sequence[str], options: Mapping[str, Any]
) -> list[str]:
    """Return the dotted keys of the settings that `config_of` is given."""

    def flat(table: Mapping[str, Any], prefix: str = "") -> list[str]:
        return [
            key
            for name, value in table.items()
            for key in (
                flat(value, f"{prefix}{name}.") if isinstance(value, dict) else [prefix + name]
            )
        ]

    named = [override.partition("=")[0].strip() for override in overrides]
    return [*flat(read_toml(file) if file is not None else {}), *named, *options]
