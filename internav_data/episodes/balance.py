"""Weights that balance the types of obstacles: with them each type stands as often as it is listed.

Measured by `benchmarks/balance.py`, which prints this table; make it again when the catalogue, the
houses or spawning change.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

BALANCE_WEIGHTS: Final[Mapping[str, float]] = {
    "AlarmClock": 0.13,
    "Apple": 0.103,
    "ArmChair": 0.94,
    "Box": 0.196,
    "Bread": 0.158,
    "Chair": 0.279,
    "Desk": 2.089,
    "DiningTable": 2.443,
    "DogBed": 0.403,
    "GarbageCan": 0.171,
    "Laptop": 0.155,
    "Lettuce": 0.121,
    "Microwave": 0.245,
    "Pillow": 0.214,
    "Pot": 0.145,
    "SideTable": 0.297,
    "Sofa": 9.928,
    "Stool": 0.191,
    "Television": 0.308,
    "Tomato": 0.132,
}
"""Weight of each asset of a type among all assets that can be drawn; 1 for types of users."""
