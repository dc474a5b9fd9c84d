"""A found way as points: straight tangents, turns as chords."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from internav_data.navigation.arcs import MID_X, MID_Y, X, Y
from internav_data.navigation.tangents import ARRIVE, FROM_X, FROM_Y, LEAVE, TO_X, TO_Y

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

CHORD_RAD = math.radians(10.0)
"""Chords of at most this angle lie within 0.8 mm of the arc."""


@njit(cache=True)
def drawn(rows: Floats, slots: Ints, arcs: Floats, radius: float) -> Floats:
    """Points (n, 2) of a way, given its tangents (n, 7) and the slots they arrive in (n,)."""
    count = 2
    for k in range(len(rows) - 1):
        count += 2 + int(max(0.0, rows[k + 1, LEAVE] - rows[k, ARRIVE]) / CHORD_RAD)
    points = np.empty((count, 2))
    points[0] = rows[0, FROM_X : FROM_Y + 1]
    size = 1
    for k in range(len(rows)):
        points[size] = rows[k, TO_X : TO_Y + 1]
        size += 1
        if k + 1 == len(rows):
            break
        arc, side = arcs[slots[k] // 2], 1.0 - 2.0 * (slots[k] % 2)
        middle = math.atan2(arc[MID_Y], arc[MID_X])
        begin, turn = rows[k, ARRIVE], max(0.0, rows[k + 1, LEAVE] - rows[k, ARRIVE])
        chords = 1 + int(turn / CHORD_RAD)
        for c in range(1, chords):
            angle = middle + side * (begin + turn * c / chords)
            points[size, 0] = arc[X] + radius * math.cos(angle)
            points[size, 1] = arc[Y] + radius * math.sin(angle)
            size += 1
        if turn > 0.0:
            points[size] = rows[k + 1, FROM_X : FROM_Y + 1]
            size += 1
    return points[:size].copy()
