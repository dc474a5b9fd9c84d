"""From a seed to a house: programme, floor plan, doors and windows, furniture, materials."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.lazy import lazy_imports
from internav_data.houses.config import HouseConfig
from internav_data.houses.quota import room_count
from internav_data.records.splits import split_of_scene

if TYPE_CHECKING:
    from internav_data.houses.build import build_house
    from internav_data.houses.plan_file import load_floor_plan

__all__ = ["HouseConfig", "build_house", "load_floor_plan", "room_count", "split_of_scene"]

# A config alone needs no numba.
__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "build": ["build_house"],
        "plan_file": ["load_floor_plan"],
    },
)
