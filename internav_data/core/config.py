"""Settings: nested frozen dataclasses with bounds, read from plain values and written as TOML.

A field states its type, its bounds and its default, as in `size: Annotated[int, Bounds(16, 1024)] =
64`, and in the docstring below it its meaning. Checks, error messages and documentation derive from
these. Types are bool, int, float, str, Literal, optional, tuples and mappings of these, and
dataclasses inside dataclasses. Errors name the key and the place that its value comes from.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import math
import textwrap
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, Final, TypeVar

from internav_data.core.field_docs import descriptions
from internav_data.core.files import FileLimits, parse_toml, read_toml
from internav_data.records.errors import CorruptDataError, UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from _typeshed import DataclassInstance

    class Section(DataclassInstance, typing.Protocol):
        """A config that is a section of a dataset's."""

        def check(self) -> None:
            """Raise UsageError if a value is out of its bounds."""


C = TypeVar("C", bound="DataclassInstance")
S = TypeVar("S", bound="Section")

NOTHING = "none"
"""Word for an absent number; TOML has none of its own."""
MANY: Final = 10**12
"""Upper bound of numbers that have no other: larger than any that makes sense."""
MAX_SEED: Final = 2**63 - 1
"""Upper bound of seeds, which are stored as int64."""
_FILE = FileLimits("config", UsageError, "--print-config shows one", max_values=10_000)
WORDS = {bool: "true or false", int: "a whole number", float: "a number", str: "text in quotes"}


@dataclass(frozen=True, slots=True)
class Bounds:
    """Values that a number in a config may have: `Annotated[int, Bounds(16, 1024)]`."""

    min: float
    """Smallest value."""
    max: float = MANY
    """Largest value."""
    advice: str = ""
    """End of the error message; empty: "expected" and the range."""
    exclusive: bool = False
    """Refuse `min` itself."""

    def __contains__(self, value: float) -> bool:
        above = self.min < value if self.exclusive else self.min <= value
        return above and value <= self.max

    def __str__(self) -> str:
        if self.max != MANY:
            return f"{self.min} … {'2^63 - 1' if self.max == MAX_SEED else self.max}"
        return f"more than {self.min}" if self.exclusive else f"{self.min} or more"

    def expected(self, value: float) -> str:
        """Return the range that a refused value should lie in."""
        return f"at most {self.max}" if value > self.max == MANY else str(self)


MESSAGE: Final = "{key} is {value}: {advice}"


def check_bounds(config: DataclassInstance, message: str = MESSAGE, prefix: str = "") -> None:
    """Check every number of a config, and of those inside it, against its bounds.

    Parameters
    ----------
    config
        A dataclass; numbers whose type names no bounds are not checked.
    message
        Format of the error. Fields: key, value, bounds, expected (the range) and advice (that of
        the bounds, or "expected" and the range).
    prefix
        Dotted key of the config itself, ending in a dot; empty at the top.

    Raises
    ------
    UsageError
        A number is out of its bounds.

    """
    for key, value, bounds in _bounded(config, prefix):
        if value not in bounds:
            expected = bounds.expected(value)
            advice = bounds.advice or f"expected {expected}"
            raise UsageError(
                message.format(
                    key=key, value=value, bounds=bounds, expected=expected, advice=advice
                )
            )


def _bounded(config: DataclassInstance, prefix: str) -> Iterator[tuple[str, float, Bounds]]:
    """Yield key, value and bounds of every number, items of tuples too."""
    hints = bounds_of(type(config))
    for field in dataclasses.fields(config):
        key, value = prefix + field.name, getattr(config, field.name)
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            yield from _bounded(value, f"{key}.")
        elif value is not None and (bounds := hints.get(field.name)):
            if isinstance(value, tuple):
                yield from ((f"{key}[{k}]", item, bounds) for k, item in enumerate(value))
            elif isinstance(value, Mapping):
                yield from ((f"{key}.{k}", item, bounds) for k, item in value.items())
            else:
                yield key, value, bounds


@functools.cache
def bounds_of(cls: type[DataclassInstance]) -> Mapping[str, Bounds]:
    """Return the bounds of a config's numbers, and of the items of its tuples, by field name."""
    hints = typing.get_type_hints(cls, include_extras=True)
    return {
        field.name: bounds
        for field in dataclasses.fields(cls)
        for bounds in _in_hint(hints[field.name])
    }


def _in_hint(hint: Any) -> Iterator[Bounds]:  # noqa: ANN401 - a type hint
    """Yield the first bounds in a hint: of a number, or of a tuple's or mapping's items."""
    if typing.get_origin(hint) is tuple:
        hint = typing.get_args(hint)[0]
    elif typing.get_origin(hint) is Mapping:
        hint = typing.get_args(hint)[1]
    yield from (note for note in getattr(hint, "__metadata__", ())[:1] if isinstance(note, Bounds))


def read_settings(path: Path) -> dict[str, Any]:
    """Return the values in a file of settings.

    Raises
    ------
    UsageError
        The file cannot be read, or is not TOML.

    """
    return read_toml(path, _FILE)


def plain(value: Any) -> Any:  # noqa: ANN401 - whatever a config holds
    """Return a config as dictionaries, lists, strings, numbers, booleans and None."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    return dict(value) if isinstance(value, Mapping) else value


def from_mapping(
    config: C,
    values: Mapping[str, Any],
    where: str,
    elsewhere: Sequence[str] = (),
    prefix: str = "",
    known: Sequence[str] = (),
) -> C:
    """Return a config with some values replaced.

    Parameters
    ----------
    config
        A frozen dataclass.
    values
        Nested values by field name.
    where
        Source of the values, for error messages: a file, an option.
    elsewhere
        Names that are options of the command line only.
    prefix
        Dotted key of the config itself, ending in a dot; empty at the top.
    known
        All dotted keys from the top, which an unknown one may have been meant for.

    Raises
    ------
    UsageError
        An unknown key, or a value of the wrong type.

    """
    hints = typing.get_type_hints(type(config))
    fields = {field.name for field in dataclasses.fields(config)}
    known = known or known_keys(config)
    changes: dict[str, Any] = {}
    for name, value in values.items():
        key = prefix + name
        if name not in fields:
            raise _unknown(key, where, known, elsewhere)
        current = getattr(config, name)
        if dataclasses.is_dataclass(current) and not isinstance(current, type):
            if not isinstance(value, dict):
                raise UsageError(f"{where}: {key} is a table of settings, got {value!r}")
            changes[name] = from_mapping(current, value, where, elsewhere, f"{key}.", known)
        else:
            if isinstance(current, Mapping) and isinstance(value, dict):
                value = {**current, **value}  # noqa: PLW2901 - names of other layers stay
            changes[name] = _typed(value, hints[name], f"{where}: {key}")
    return dataclasses.replace(config, **changes)


def of_dataset(default: S, config: Mapping[str, Any], section: str) -> S:
    """Return a section of a dataset's config; keys of other releases are left out.

    Parameters
    ----------
    default
        Section with the values of keys that the dataset does not have.
    config
        Config of the dataset's manifest.
    section
        Name of the section, as in `world`.

    Raises
    ------
    CorruptDataError
        A value that no generator writes.

    """
    given, names = config.get(section), {field.name for field in dataclasses.fields(default)}
    values = given if isinstance(given, dict) else {}
    known = {name: value for name, value in values.items() if name in names}
    try:
        made = from_mapping(default, known, "manifest.json", prefix=f"{section}.")
        made.check()
    except UsageError as error:
        raise CorruptDataError(f"config: {error}; generate the dataset again") from error
    return made


def updated(config: C, assignment: str, elsewhere: Sequence[str] = ()) -> C:
    """Return a config with one `a.b=c` applied; c is read as TOML, or as text for texts.

    Raises
    ------
    UsageError
        `assignment` is not of this form, its key is unknown, or its value has the wrong type.

    """
    where = f"--set {' '.join(assignment.split())}"
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
    last = key.rsplit(".", 1)[-1]
    by_last = {name.rsplit(".", 1)[-1]: name for name in known}
    near = get_close_matches(key, known, 2)
    near += [by_last[name] for name in get_close_matches(last, by_last, 2)]
    if last in by_last:  # a key of another section
        near = [by_last[last]]
    names = list(dict.fromkeys(near)) or list(known)
    listed = " or ".join(f"'{name}'" for name in names[:2]) if near else ", ".join(names)
    hint = f"did you mean {listed}?" if near else f"there are {listed}"
    return UsageError(f"{where}: there is no key {key!r}; {hint}")


def _hint_of(config: object, key: str) -> Any:  # noqa: ANN401 - a type hint
    *parents, last = key.split(".")
    for parent in parents:
        config = getattr(config, parent, None)
    if not dataclasses.is_dataclass(config):
        return None
    return typing.get_type_hints(type(config)).get(last)


def _is_text(hint: Any) -> bool:  # noqa: ANN401 - a type hint
    if typing.get_origin(hint) in {tuple, Mapping}:
        return False
    return hint is str or str in typing.get_args(hint) or typing.get_origin(hint) is typing.Literal


def _parsed(text: str) -> Any:  # noqa: ANN401 - any TOML value
    if text in {"nan", "inf", "-inf", "+inf"}:
        return float(text)  # refused with the setting's name
    try:
        table = parse_toml(f"value = {text}".encode(errors="replace"), "", _FILE)
    except UsageError:
        return text
    return table["value"] if len(table) == 1 else text  # a line break begins another setting


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
    if origin is Mapping:
        if not isinstance(value, Mapping):
            raise UsageError(f"{where}: expected a table of values by name, got {value!r}")
        return {name: _typed(item, members[1], f"{where}.{name}") for name, item in value.items()}
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
_GLUE = "\N{NO-BREAK SPACE}"


def config_toml(config: DataclassInstance, program: str = "internav-gen") -> str:
    """Return all settings of a config as TOML, each with its meaning and its bounds.

    The program reads it back: `--config FILE`.
    """
    head = f"Settings of {program}: --config FILE reads them, --set KEY=VALUE overrides one."
    return "\n".join([f"# {head}", *_table(config, "")]).replace(_GLUE, " ") + "\n"


def settings_notes(cls: type[DataclassInstance]) -> dict[str, str]:
    """Return meaning and bounds of a config's fields, a line each, by name.

    Spaces inside a range are such that no line breaks at them.
    """
    notes, bounds = descriptions(cls), bounds_of(cls)
    return {
        field.name: " ".join(
            [
                *notes.get(field.name, "").split(),
                *(f"Range: {b}.".replace(" ", _GLUE) for b in [bounds.get(field.name)] if b),
            ]
        )
        for field in dataclasses.fields(cls)
    }


def _table(config: DataclassInstance, name: str) -> list[str]:
    notes = settings_notes(type(config))
    lines: list[str] = []
    tables: list[str] = []
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        comment = textwrap.wrap(
            notes[field.name], WIDTH, initial_indent="# ", subsequent_indent="# "
        )
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            tables += ["", *comment, f"[{name}{field.name}]", *_table(value, f"{field.name}.")]
        elif value is None and field.default is not None:
            lines += ["", *comment, f"{field.name} = {_value(NOTHING)}"]
        elif value is None:
            lines += ["", *comment, f"# {field.name} ="]
        else:
            lines += ["", *comment, f"{field.name} = {_value(value)}"]
    return lines + tables


def _value(value: Any) -> str:  # noqa: ANN401 - what configs hold
    """Return a value in TOML, which writes all but tables as JSON does."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{json.dumps(k)} = {_value(v)}' for k, v in value.items())}}}"
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
    return [*flat(read_settings(file) if file is not None else {}), *named, *options]
