"""Lengths common to all houses: walls, doors, ceilings.

Sources: doors of real homes are 0.77 to 0.96 m wide, ceilings 2.4 to 3.2 m high.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.records import HousePreset

WALL_CM = 12
"""Thickness of every wall, around its centre line."""
HALF_WALL_CM = WALL_CM // 2
MAX_ROOMS = 10
"""Largest number of rooms of a generated house."""
DOOR_CLEAR_CM = 65
"""Free depth on both sides of a door, measured from the wall's faces."""
DOOR_HEIGHT_CM = 210
"""Height of every door."""
MIN_DOOR_CM: Mapping[HousePreset, int] = {"paper": 100, "realistic": 80}
"""Width of the narrowest inner door. A wall shorter than this cannot have one."""
CEILING_CM = (240, 320)
"""Lowest and highest ceiling of generated houses."""
