"""A config as TOML with the words of its fields: to be saved, changed and read again."""

from __future__ import annotations

import dataclasses
import json
import textwrap
from typing import TYPE_CHECKING, Any

from internav_data.dataset.jsonschemas import descriptions
from internav_data.generation.values import NOTHING

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

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
