"""Planar k-DOPs with k = 8: bounds of an object, or of the area that a moving one sweeps.

A k-DOP (discrete oriented polytope, Klosowski et al. 1998) holds a shape's supports along k fixed
directions: x, x + y, y, y - x, -x, -x - y, -y and x - y. The slanted directions are not normalised:
their length is the root of two, and a margin counts times as much along them. Two shapes do not
touch if one of the directions separates their 8-DOPs. Only sums are needed, and a quarter turn
shifts the eight numbers by two places.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints

Dop8 = tuple[float, float, float, float, float, float, float, float]
"""Supports along x, x + y, y, y - x and their opposites, metres (the slanted ones times √2)."""

EMPTY: Final[Dop8] = (-math.inf,) * 8
"""8-DOP of a held object: it touches nothing."""
SLANT: Final = math.sqrt(2.0)
"""Length of the slanted directions: a margin of 1 m adds this much along them."""


@njit(cache=True)
def widen(
    reach: Floats, corners: Floats, px: float, py: float, qx: float, qy: float, qz: float, qw: float
) -> None:
    """Widen an 8-DOP in place so that it holds an object's corners at a pose.

    Parameters
    ----------
    reach : (8,) float64
        Supports to widen, metres.
    corners : (n, 3) float64
        Corners in the frame of the pose, metres.
    px, py
        Position of the pose in the plane, metres.
    qx, qy, qz, qw
        Orientation of the pose; need not have unit length.

    """
    # The first two rows of the rotation matrix; heights do not matter here.
    s = 2.0 / (qx * qx + qy * qy + qz * qz + qw * qw)
    a, b, c = 1.0 - s * (qy * qy + qz * qz), s * (qx * qy - qz * qw), s * (qx * qz + qy * qw)
    d, e, f = s * (qx * qy + qz * qw), 1.0 - s * (qx * qx + qz * qz), s * (qy * qz - qx * qw)
    for k in range(len(corners)):
        u, v, w = corners[k, 0], corners[k, 1], corners[k, 2]
        x, y = a * u + b * v + c * w + px, d * u + e * v + f * w + py
        reach[0], reach[4] = max(reach[0], x), max(reach[4], -x)
        reach[2], reach[6] = max(reach[2], y), max(reach[6], -y)
        reach[1], reach[5] = max(reach[1], x + y), max(reach[5], -x - y)
        reach[3], reach[7] = max(reach[3], y - x), max(reach[7], x - y)


@njit(cache=True)
def _touching(rows: Floats, reach: Floats) -> Ints:
    """Return the indices of the rows (n, 8) that overlap an 8-DOP (8,)."""
    found = np.empty(len(rows), dtype=np.int64)
    count = 0
    for k in range(len(rows)):
        apart = False
        for d in range(8):
            # Direction d + 4 is opposite to d: their supports bound the gap between the shapes.
            apart = apart or rows[k, d] + reach[(d + 4) % 8] <= 0.0
        if not apart:
            found[count] = k
            count += 1
    return found[:count]


def touching(rows: Floats, dop8: Dop8) -> list[int]:
    """Return the indices of the 8-DOPs, rows (n, 8) float64, that overlap one, ascending."""
    indices: list[int] = _touching(rows, np.array(dop8)).tolist()
    return indices


def overlap(first: Dop8, second: Dop8) -> bool:
    """Return whether two 8-DOPs overlap."""
    return all(first[d] + second[(d + 4) % 8] > 0.0 for d in range(8))


def grown(dop8: Dop8, margin: float) -> Dop8:
    """Return an 8-DOP that holds every point within a margin of another one, metres."""
    a, b, c, d, e, f, g, h = dop8
    m, slant = margin, SLANT * margin
    return a + m, b + slant, c + m, d + slant, e + m, f + slant, g + m, h + slant


def dop8_of_rectangle(low_x: float, low_y: float, high_x: float, high_y: float) -> Dop8:
    """Return the 8-DOP of an axis-aligned rectangle, metres."""
    return (
        *(high_x, high_x + high_y, high_y, high_y - low_x),
        *(-low_x, -low_x - low_y, -low_y, high_x - low_y),
    )


def dop8_of_square(x: float, y: float, half: float) -> Dop8:
    """Return the 8-DOP of an axis-aligned square with sides of 2 · `half` metres."""
    return dop8_of_rectangle(x - half, y - half, x + half, y + half)
