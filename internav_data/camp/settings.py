"""How a run's settings are put together: a preset, a file, options, overrides; and its device."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import torch

from internav_data.camp.config import CampConfig, from_mapping, preset
from internav_data.generation import values
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path


def config_of(
    name: str,
    file: Path | None = None,
    overrides: Sequence[str] = (),
    options: Mapping[str, Any] | None = None,
) -> CampConfig:
    """Return a checked config: a preset, a TOML file, options by dotted key, `a.b=c`.

    Raises
    ------
    UsageError
        Something in them cannot be meant; the place is named.
    """
    config = preset(name)
    if file is not None:
        config = values.from_mapping(config, values.read_toml(file), str(file))
    for key, value in (options or {}).items():
        config = values.from_mapping(config, values.nested(key, value), "option")
    for override in overrides:
        config = values.updated(config, override)
    return from_mapping(config, {}, "config")


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
    return [*flat(values.read_toml(file) if file is not None else {}), *named, *options]


def device_of(name: str) -> torch.device:
    """Return "cpu" or "cuda"; "auto" is a GPU where there is one.

    Raises
    ------
    UsageError
        There is no GPU.
    """
    there = torch.cuda.is_available()
    if name == "cuda" and not there:
        raise UsageError("--device cuda: torch finds no GPU here; choose --device cpu")
    return torch.device("cuda" if name != "cpu" and there else "cpu")


def default_preset(device: str) -> str:
    """Return the preset that suits this machine: `paper` where there is a GPU, else `small`."""
    return "paper" if device != "cpu" and torch.cuda.is_available() else "small"
