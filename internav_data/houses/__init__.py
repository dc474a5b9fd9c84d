"""From a seed to a house: programme, floor plan, doors and windows, furniture, materials."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.houses.config import HouseConfig
from internav_data.houses.quota import room_count
from internav_data.records.splits import split_of_scene

if TYPE_CHECKING:
    from internav_data.houses.build import build_house
    from internav_data.houses.plan_file import load_floor_plan

__all__ = ["HouseConfig", "build_house", "load_floor_plan", "room_count", "split_of_scene"]

_HOMES = {"build_house": "build", "load_floor_plan": "plan_file"}


def __getattr__(name: str) -> object:
    """Import what is asked for: a config alone needs no numba."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module  # noqa: PLC0415

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
