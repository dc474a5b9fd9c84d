"""Weights that balance the types of obstacles: with them each type stands as often as it is listed.

Measured by `benchmarks/balance.py`, which prints this table; make it again when the catalogue, the
houses or spawning change.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

BALANCE_WEIGHTS: Final[Mapping[str, float]] = {
    "AlarmClock": 0.1835,
    "Apple": 0.1433,
    "ArmChair": 1.151,
    "Box": 0.2928,
    "Bread": 0.1889,
    "Chair": 0.3974,
    "Desk": 2.083,
    "DiningTable": 2.532,
    "DogBed": 0.7088,
    "GarbageCan": 0.2829,
    "Laptop": 0.2441,
    "Lettuce": 0.1628,
    "Microwave": 0.3579,
    "Pillow": 0.2985,
    "Pot": 0.1928,
    "SideTable": 0.4228,
    "Sofa": 8.433,
    "Stool": 0.2495,
    "Television": 0.4303,
    "Tomato": 0.157,
}
"""Weight of each asset of a type among all assets that can be drawn; 1 for types of users."""
