"""Tangents: the straight pieces of a taut string between free arcs.

A slot is an arc and a sense of going round it: slot = 2 * arc + sense, sense 0 counter-clockwise
(the corner on the left), 1 clockwise. Progress is the angle gone round the arc in that sense,
from its middle: -half where it begins, +half where it ends.

A tangent is a directed record: it leaves one slot at a progress and arrives in another at one.
Its reverse leaves the *opposite* sense of where it arrived, so one test of clearness serves both.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

from internav_data.geometry.planar import cross
from internav_data.navigation.arcs import COS_HALF, HALF, MID_X, MID_Y, X, Y
from internav_data.navigation.scene import SLACK_M, segment_clear

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.navigation.scene import Scene

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

LEAVE, ARRIVE, LENGTH, FROM_X, FROM_Y, TO_X, TO_Y = range(7)
ANGLE_SLACK = 1e-12


class Tangents(NamedTuple):
    """Clear tangents among a house's own arcs, grouped by the slot they leave.

    Shapes: starts (slots + 1,); target (n,) slot of arrival; data (n, 7): progress on leaving and
    on arriving (radians), length (metres), both ends; sorted by progress within a slot.
    """

    starts: Ints
    target: Ints
    data: Floats


@njit(cache=True)
def on_arc(arc: Floats, nx: float, ny: float) -> bool:
    """Whether a unit direction lies on an arc."""
    return arc[MID_X] * nx + arc[MID_Y] * ny >= arc[COS_HALF] - ANGLE_SLACK


@njit(cache=True)
def progress(arc: Floats, nx: float, ny: float, sense: int) -> float:
    """How far round its arc a unit direction lies, radians in [-half, half]."""
    turn = math.atan2(cross(arc[MID_X], arc[MID_Y], nx, ny), arc[MID_X] * nx + arc[MID_Y] * ny)
    if sense == 1:
        turn = -turn
    return min(arc[HALF], max(-arc[HALF], turn))


@njit(cache=True)
def from_point(
    px: float, py: float, arc: Floats, sense: int, radius: float
) -> tuple[bool, float, float]:
    """Touching direction of the tangent from a point that goes on round the arc in a sense.

    A tangent that leaves the arc in a sense and ends in the point touches where one from the point
    touches in the opposite sense.
    """
    ex, ey = px - arc[X], py - arc[Y]
    distance = math.sqrt(ex * ex + ey * ey)
    if distance == 0.0:
        return False, 0.0, 0.0
    ex, ey = ex / distance, ey / distance
    # A point on the circle may lie the last bit inside it.
    c = min(1.0, radius / distance)
    s = math.sqrt(1.0 - c * c)
    if sense == 1:
        s = -s
    nx, ny = c * ex - s * ey, s * ex + c * ey
    return on_arc(arc, nx, ny), nx, ny


@njit(cache=True)
def between(
    first: Floats, sense: int, second: Floats, end_sense: int, radius: float
) -> tuple[bool, float, float, float, float]:
    """Touching directions of the tangent that leaves one arc and arrives on another."""
    dx, dy = second[X] - first[X], second[Y] - first[Y]
    distance = math.sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return False, 0.0, 0.0, 0.0, 0.0
    dx, dy = dx / distance, dy / distance
    # Counter-clockwise the corner is on the left, so it touches on the right: (dy, -dx).
    side = 1.0 if sense == 0 else -1.0
    if sense == end_sense:
        nx, ny = side * dy, -side * dx
        return on_arc(first, nx, ny) and on_arc(second, nx, ny), nx, ny, nx, ny
    s = 2.0 * radius / distance
    if s > 1.0:
        return False, 0.0, 0.0, 0.0, 0.0
    c = math.sqrt(1.0 - s * s)
    # The string crosses over from one side to the other: turned by asin(s) from the centres' line.
    ux, uy = c * dx - side * s * dy, side * s * dx + c * dy
    nx, ny = side * uy, -side * ux
    return on_arc(first, nx, ny) and on_arc(second, -nx, -ny), nx, ny, -nx, -ny


@njit(cache=True)
def _record(
    row: Floats,
    first: Floats,
    sense: int,
    nx: float,
    ny: float,
    second: Floats,
    end_sense: int,
    mx: float,
    my: float,
    radius: float,
) -> None:
    row[LEAVE] = progress(first, nx, ny, sense)
    row[ARRIVE] = progress(second, mx, my, end_sense)
    row[FROM_X], row[FROM_Y] = first[X] + radius * nx, first[Y] + radius * ny
    row[TO_X], row[TO_Y] = second[X] + radius * mx, second[Y] + radius * my
    row[LENGTH] = math.hypot(row[TO_X] - row[FROM_X], row[TO_Y] - row[FROM_Y])


@njit(cache=True)
def joined(row: Floats, arcs: Floats, slot: int, other: int, radius: float) -> bool:
    """Write the tangent from slot to slot into a row; False where there is none."""
    first, second = arcs[slot // 2], arcs[other // 2]
    sense, end_sense = slot % 2, other % 2
    there, nx, ny, mx, my = between(first, sense, second, end_sense, radius)
    if there:
        _record(row, first, sense, nx, ny, second, end_sense, mx, my, radius)
    return there


@njit(cache=True)
def join_point(row: Floats, arcs: Floats, slot: int, x: float, y: float, radius: float) -> bool:
    """Write the tangent that leaves a slot for a point into a row; False where there is none."""
    arc, sense = arcs[slot // 2], slot % 2
    there, nx, ny = from_point(x, y, arc, 1 - sense, radius)
    if there:
        row[LEAVE], row[ARRIVE] = progress(arc, nx, ny, sense), 0.0
        row[FROM_X], row[FROM_Y] = arc[X] + radius * nx, arc[Y] + radius * ny
        row[TO_X], row[TO_Y] = x, y
        row[LENGTH] = math.hypot(x - row[FROM_X], y - row[FROM_Y])
    return there


@njit(cache=True)
def _all_pairs(scene: Scene, arcs: Floats, radius: float) -> tuple[Ints, Ints, Floats]:
    source = np.empty(1024, dtype=np.int64)
    target = np.empty(1024, dtype=np.int64)
    data = np.empty((1024, 7))
    row = np.empty(7)
    count = 0
    for a in range(len(arcs)):
        for b in range(a + 1, len(arcs)):
            for kind in range(4):
                slot, other = 2 * a + kind // 2, 2 * b + kind % 2
                there = joined(row, arcs, slot, other, radius)
                if not there or not segment_clear(
                    scene, row[FROM_X], row[FROM_Y], row[TO_X], row[TO_Y], radius - SLACK_M
                ):
                    continue
                if count + 2 > len(source):
                    source = np.concatenate((source, np.empty_like(source)))
                    target = np.concatenate((target, np.empty_like(target)))
                    data = np.concatenate((data, np.empty_like(data)))
                source[count], target[count] = slot, other
                data[count] = row
                # Backwards: opposite senses, and progress counts from the other end.
                source[count + 1], target[count + 1] = other ^ 1, slot ^ 1
                data[count + 1, LEAVE], data[count + 1, ARRIVE] = -row[ARRIVE], -row[LEAVE]
                data[count + 1, LENGTH] = row[LENGTH]
                data[count + 1, FROM_X], data[count + 1, FROM_Y] = row[TO_X], row[TO_Y]
                data[count + 1, TO_X], data[count + 1, TO_Y] = row[FROM_X], row[FROM_Y]
                count += 2
    return source[:count], target[:count], data[:count]


def tangents_of(scene: Scene, arcs: Floats, radius: float) -> Tangents:
    """Find all clear tangents among arcs (n, 6)."""
    source, target, data = _all_pairs(scene, arcs, radius)
    order = np.lexsort((target, data[:, LEAVE], source))
    starts = np.searchsorted(source[order], np.arange(2 * len(arcs) + 1)).astype(np.int64)
    return Tangents(starts, target[order], np.ascontiguousarray(data[order]))
