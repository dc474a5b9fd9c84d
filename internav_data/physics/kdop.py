"""Octagons: what a thing, or all that a moving one sweeps, reaches in the plane.

Eight numbers say how far a shape reaches along x, x + y, y, y - x, -x, -x - y, -y and x - y (its
support along these, the slanted ones not divided by the root of two). Two convex shapes that one
of these directions parts do not touch. Only sums are needed, and quarter turns only shift them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints

Dop8 = tuple[float, float, float, float, float, float, float, float]
"""Supports along x, x + y, y, y - x and their opposites, metres."""

EMPTY: Final[Dop8] = (-math.inf,) * 8
"""What is held: it touches nothing."""
SLANT: Final = math.sqrt(2.0)
"""Length of the slanted directions: a margin of 1 m adds this much along them."""


@njit(cache=True)
def widen(
    reach: Floats, corners: Floats, px: float, py: float, qx: float, qy: float, qz: float, qw: float
) -> None:
    """Widen supports (8,), in place, to hold corners (n, 3) turned by a quaternion and moved."""
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
    found = np.empty(len(rows), dtype=np.int64)
    count = 0
    for k in range(len(rows)):
        apart = False
        for d in range(8):
            apart = apart or rows[k, d] + reach[(d + 4) % 8] <= 0.0
        if not apart:
            found[count] = k
            count += 1
    return found[:count]


def touching(rows: Floats, dop8: Dop8) -> list[int]:
    """Which of some octagons (n, 8) overlap another one, ascending."""
    indices: list[int] = _touching(rows, np.array(dop8)).tolist()
    return indices


def overlap(first: Dop8, second: Dop8) -> bool:
    """Whether two octagons overlap."""
    return all(first[d] + second[(d + 4) % 8] > 0.0 for d in range(8))


def grown(dop8: Dop8, margin: float) -> Dop8:
    """Octagon of all within a margin, metres."""
    a, b, c, d, e, f, g, h = dop8
    m, slant = margin, SLANT * margin
    return a + m, b + slant, c + m, d + slant, e + m, f + slant, g + m, h + slant


def dop8_of_rectangle(low_x: float, low_y: float, high_x: float, high_y: float) -> Dop8:
    """Octagon of a rectangle along the axes."""
    return (
        *(high_x, high_x + high_y, high_y, high_y - low_x),
        *(-low_x, -low_x - low_y, -low_y, high_x - low_y),
    )


def dop8_of_disc(x: float, y: float, radius: float) -> Dop8:
    """Octagon round a disc."""
    return grown((x, x + y, y, y - x, -x, -x - y, -y, x - y), radius)


def dop8_of_square(x: float, y: float, half: float) -> Dop8:
    """Octagon of a square along the axes."""
    return dop8_of_rectangle(x - half, y - half, x + half, y + half)
