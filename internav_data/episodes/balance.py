"""Weights that balance the types of obstacles: with them each type stands as often as it is listed.

Measured by `benchmarks/balance.py`, which prints this table; make it again when the catalogue, the
houses or spawning change.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

BALANCE_WEIGHTS: Final[Mapping[str, float]] = {
    "AlarmClock": 0.1148,
    "Apple": 0.1143,
    "ArmChair": 0.9427,
    "Box": 0.2093,
    "Bread": 0.1251,
    "Chair": 0.3067,
    "Desk": 1.713,
    "DiningTable": 2.387,
    "DogBed": 0.6786,
    "GarbageCan": 0.2099,
    "Laptop": 0.177,
    "Lettuce": 0.1153,
    "Microwave": 0.2899,
    "Pillow": 0.237,
    "Pot": 0.1505,
    "SideTable": 0.3572,
    "Sofa": 8.201,
    "Stool": 0.1798,
    "Television": 0.3068,
    "Tomato": 0.1175,
}
"""Weight of each asset of a type among all assets that can be drawn; 1 for types of users."""
