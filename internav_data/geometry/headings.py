"""Quarter turns without trigonometry: exact, the same on every processor."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from internav_data.records import Quaternion, Vec2


_HALF: Final = math.sqrt(0.5)

TURNS: Final[tuple[Quaternion, ...]] = (
    (0.0, 0.0, 0.0, 1.0),
    (0.0, 0.0, _HALF, _HALF),
    (0.0, 0.0, 1.0, 0.0),
    (0.0, 0.0, -_HALF, _HALF),
)
"""Quaternions of 0, 90, 180 and 270 degrees counter-clockwise."""

HEADINGS: Final[tuple[Vec2, ...]] = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
"""Unit vectors of the four headings: east (+x), north (+y), west (-x), south (-y)."""


def turned(quarter: int, x: float, y: float) -> Vec2:
    """Return a vector (x, y) turned counter-clockwise by quarter turns."""
    c, s = HEADINGS[quarter % 4]
    # + 0.0 makes -0.0 to 0.0.
    return c * x - s * y + 0.0, s * x + c * y + 0.0
