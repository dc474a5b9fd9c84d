"""What architects know about rooms: areas, widths, doors and ceilings by preset.

Sources: `paper` follows the room sizes that Table 2 implies (about 24 m² each, as in ProcTHOR),
`realistic` the bands measured on real homes: bedrooms 5-17, bathrooms 2-7.5, kitchens 5.3-9,
living rooms 19-48 m²; habitable rooms at least 6.5 m² and 2.13 m wide, double bedrooms 11.5 m² and
2.75 m, halls 0.91 m clear, doors 0.77-0.96 m, ceilings 2.4-3.2 m.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.records import HousePreset

WALL_CM = 12
"""Thickness of every wall, around its centre line."""
HALF_WALL_CM = WALL_CM // 2
MAX_ROOMS = 10
DOOR_CLEAR_CM = 65
"""Free depth on both sides of a door, measured from the wall's faces."""
DOOR_HEIGHT_CM = 210
MIN_DOOR_CM: Mapping[HousePreset, int] = {"paper": 100, "realistic": 80}
"""Width of the narrowest inner door. A wall shorter than this cannot have one."""
CEILING_CM = (240, 320)

ROOM_TYPES = (
    "bathroom",
    "bedroom",
    "dining",
    "hall",
    "kitchen",
    "laundry",
    "living",
    "office",
    "storage",
    "studio",
)
"""Studio: one room to live, cook and sleep in."""

PUBLIC = frozenset({"hall", "living", "kitchen", "dining", "studio"})
"""Rooms one may be asked to walk through."""
PRIVATE = frozenset({"bedroom", "bathroom", "office", "laundry", "storage"})
"""Rooms that should not be the way to another."""
HABITABLE = frozenset({"bedroom", "dining", "kitchen", "living", "office", "studio"})
"""Rooms where people stay: they get daylight and the stated minima."""


@dataclass(frozen=True, slots=True)
class RoomStandard:
    """Sizes of one type of room; areas and widths are clear, between wall faces."""

    area_m2: float
    """Typical area."""
    low_m2: float
    high_m2: float
    width_m: float
    """Least clear width."""
    aspect: float
    """Longest side over shortest that still looks right."""


_PAPER: Mapping[str, RoomStandard] = {
    "bathroom": RoomStandard(13.0, 5.0, 30.0, 2.0, 1.9),
    "bedroom": RoomStandard(25.0, 11.5, 60.0, 2.9, 1.6),
    "dining": RoomStandard(24.0, 11.0, 60.0, 3.0, 1.6),
    "hall": RoomStandard(20.0, 4.0, 80.0, 1.5, 9.0),
    "kitchen": RoomStandard(25.0, 10.0, 60.0, 2.9, 1.7),
    "laundry": RoomStandard(12.0, 5.0, 25.0, 2.0, 1.9),
    "living": RoomStandard(32.0, 15.0, 90.0, 3.5, 1.6),
    "office": RoomStandard(19.0, 9.0, 40.0, 2.6, 1.6),
    "storage": RoomStandard(10.0, 4.0, 20.0, 1.8, 2.0),
    "studio": RoomStandard(28.0, 18.0, 80.0, 3.8, 1.6),
}
_REALISTIC: Mapping[str, RoomStandard] = {
    "bathroom": RoomStandard(4.6, 3.0, 7.5, 1.5, 2.2),
    "bedroom": RoomStandard(11.3, 6.5, 17.0, 2.13, 1.75),
    "dining": RoomStandard(11.0, 7.5, 16.0, 2.5, 1.7),
    "hall": RoomStandard(7.0, 1.5, 20.0, 0.98, 12.0),
    "kitchen": RoomStandard(8.0, 6.6, 9.0, 2.13, 1.9),
    "laundry": RoomStandard(4.0, 2.6, 7.0, 1.5, 2.2),
    "living": RoomStandard(25.0, 19.0, 48.0, 3.2, 1.7),
    "office": RoomStandard(9.0, 6.6, 13.0, 2.13, 1.75),
    "storage": RoomStandard(3.4, 2.2, 7.0, 1.3, 2.4),
    "studio": RoomStandard(30.0, 22.0, 45.0, 3.6, 1.7),
}
STANDARDS: Mapping[HousePreset, Mapping[str, RoomStandard]] = {
    "paper": _PAPER,
    "realistic": _REALISTIC,
}

DOUBLE_BEDROOM = RoomStandard(13.0, 11.6, 17.0, 2.76, 1.6)
"""The realistic bedroom for two."""
SINGLE_BEDROOM = RoomStandard(9.2, 6.8, 11.0, 2.2, 1.75)
"""The realistic bedroom for one."""

WANTED: Mapping[tuple[str, str], float] = {
    ("dining", "kitchen"): 1.0,
    ("kitchen", "living"): 0.8,
    ("dining", "living"): 0.8,
    ("bathroom", "bedroom"): 0.5,
    ("kitchen", "laundry"): 0.4,
    ("hall", "living"): 0.8,
    ("hall", "kitchen"): 0.4,
    ("living", "office"): 0.2,
}
"""Pairs of types (sorted) that want to share a wall, and how much."""


def type_pair(first: str, second: str) -> tuple[str, str]:
    """Return two types in the order that tables of pairs use."""
    return (first, second) if first <= second else (second, first)
