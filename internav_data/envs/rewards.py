"""What the main task pays: plain arithmetic on distances, so that it can be checked by hand."""

from __future__ import annotations

from typing import Final

from internav_data.navigation import SPACING_M

STEP: Final = -0.01
"""Every step, the last one and a `wait` included."""
SUCCESS: Final = 10.0
"""Done at the goal."""
OPENED: Final = 1.0
"""An interaction makes a way where there was none on the lattice; one that closes it costs it."""


def move_reward(before_m: float, after_m: float) -> float:
    """Pay the drop of the any-angle distance without obstacles, metres."""
    return before_m - after_m


def interaction_reward(before: int | None, after: int | None) -> float:
    """Pay what an interaction did to the lattice distance (steps; None where cut off).

    The drop in metres while both are finite, +1 for opening the way, -1 for closing it.
    """
    if before is None:
        return 0.0 if after is None else OPENED
    return -OPENED if after is None else SPACING_M * (before - after)
