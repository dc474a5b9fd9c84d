"""Weights that balance the types of obstacles: with them each type stands as often as it is listed.

Measured by `benchmarks/balance.py`, which prints this table; make it again when the catalogue, the
houses or spawning change.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

BALANCE_WEIGHTS: Final[Mapping[str, float]] = {
    "AlarmClock": 0.1324,
    "Apple": 0.1265,
    "ArmChair": 1.145,
    "Box": 0.2176,
    "Bread": 0.1375,
    "Chair": 0.2757,
    "Desk": 1.658,
    "DiningTable": 2.223,
    "DogBed": 0.3293,
    "GarbageCan": 0.1912,
    "Laptop": 0.1598,
    "Lettuce": 0.113,
    "Microwave": 0.2593,
    "Pillow": 0.214,
    "Pot": 0.145,
    "SideTable": 0.3122,
    "Sofa": 10.58,
    "Stool": 0.252,
    "Television": 0.2694,
    "Tomato": 0.1208,
}
"""Weight of each asset of a type among all assets that can be drawn; 1 for types of users."""
