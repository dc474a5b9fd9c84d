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
from internav_data.navigation.tangent_graph.arcs import COS_HALF, HALF, MID_X, MID_Y, X, Y
from internav_data.navigation.tangent_graph.polygon_grid import SLACK_M, segment_clear

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints
    from internav_data.navigation.tangent_graph.polygon_grid import Scene

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
def on_arc(arcs: Floats, a: int, nx: float, ny: float) -> bool:
    """Whether a unit direction lies on an arc."""
    return arcs[a, MID_X] * nx + arcs[a, MID_Y] * ny >= arcs[a, COS_HALF] - ANGLE_SLACK


@njit(cache=True)
def progress(arcs: Floats, slot: int, nx: float, ny: float) -> float:
    """How far round its arc a unit direction lies, radians in [-half, half]."""
    a = slot // 2
    mid_x, mid_y, half = arcs[a, MID_X], arcs[a, MID_Y], arcs[a, HALF]
    turn = math.atan2(cross(mid_x, mid_y, nx, ny), mid_x * nx + mid_y * ny)
    if slot % 2 == 1:
        turn = -turn
    return min(half, max(-half, turn))


@njit(cache=True)
def join_point(
    data: Floats, row: int, arcs: Floats, slot: int, x: float, y: float, radius: float
) -> bool:
    """Write the tangent that leaves a slot for a point into a row; False where there is none."""
    a = slot // 2
    ex, ey = x - arcs[a, X], y - arcs[a, Y]
    distance = math.sqrt(ex * ex + ey * ey)
    if distance == 0.0:
        return False
    ex, ey = ex / distance, ey / distance
    # A point on the circle may lie the last bit inside it.
    c = min(1.0, radius / distance)
    s = math.sqrt(1.0 - c * c)
    # Counter-clockwise, the string leaves before it has turned as far as the point's direction.
    if slot % 2 == 0:
        s = -s
    nx, ny = c * ex - s * ey, s * ex + c * ey
    if not on_arc(arcs, a, nx, ny):
        return False
    data[row, LEAVE], data[row, ARRIVE] = progress(arcs, slot, nx, ny), 0.0
    data[row, FROM_X], data[row, FROM_Y] = arcs[a, X] + radius * nx, arcs[a, Y] + radius * ny
    data[row, TO_X], data[row, TO_Y] = x, y
    data[row, LENGTH] = math.hypot(x - data[row, FROM_X], y - data[row, FROM_Y])
    return True


@njit(cache=True)
def join(data: Floats, row: int, arcs: Floats, slot: int, b: int, radius: float) -> int:
    """Write the tangents from a slot to another arc, at most two, from a row on.

    Returns a bit for each sense in which they arrive: 1 counter-clockwise, 2 clockwise; the
    counter-clockwise one comes first. Scalars only: this is the innermost loop of everything.
    """
    a = slot // 2
    dx, dy = arcs[b, X] - arcs[a, X], arcs[b, Y] - arcs[a, Y]
    square = dx * dx + dy * dy
    if square == 0.0:
        return 0
    distance = math.sqrt(square)
    dx, dy = dx / distance, dy / distance
    # Counter-clockwise the corner is on the left, so the string touches on its right: (dy, -dx).
    side = 1.0 if slot % 2 == 0 else -1.0
    bits, same = 0, 1 << (slot % 2)
    nx, ny = side * dy, -side * dx
    if on_arc(arcs, a, nx, ny) and on_arc(arcs, b, nx, ny):
        _write(data, row, arcs, slot, nx, ny, 2 * b + slot % 2, nx, ny, radius)
        bits = same
    s = 2.0 * radius / distance
    if s <= 1.0:
        c = math.sqrt(1.0 - s * s)
        # The string crosses the line of centres at asin(s), to touch on the other side.
        ux, uy = c * dx - side * s * dy, side * s * dx + c * dy
        nx, ny = side * uy, -side * ux
        if on_arc(arcs, a, nx, ny) and on_arc(arcs, b, -nx, -ny):
            if bits == 1:
                row += 1
            elif bits:
                data[row + 1] = data[row]
            _write(data, row, arcs, slot, nx, ny, 2 * b + 1 - slot % 2, -nx, -ny, radius)
            bits |= 3 - same
    return bits


@njit(cache=True)
def _write(
    data: Floats,
    row: int,
    arcs: Floats,
    slot: int,
    nx: float,
    ny: float,
    other: int,
    mx: float,
    my: float,
    radius: float,
) -> None:
    a, b = slot // 2, other // 2
    data[row, LEAVE] = progress(arcs, slot, nx, ny)
    data[row, ARRIVE] = progress(arcs, other, mx, my)
    data[row, FROM_X], data[row, FROM_Y] = arcs[a, X] + radius * nx, arcs[a, Y] + radius * ny
    data[row, TO_X], data[row, TO_Y] = arcs[b, X] + radius * mx, arcs[b, Y] + radius * my
    data[row, LENGTH] = math.hypot(
        data[row, TO_X] - data[row, FROM_X], data[row, TO_Y] - data[row, FROM_Y]
    )


@njit(cache=True)
def _all_pairs(scene: Scene, arcs: Floats, radius: float) -> tuple[Ints, Ints, Floats]:
    source = np.empty(1024, dtype=np.int64)
    target = np.empty(1024, dtype=np.int64)
    data = np.empty((1024, 7))
    found = np.empty((2, 7))
    count = 0
    for slot in range(2 * len(arcs)):
        for b in range(slot // 2 + 1, len(arcs)):
            bits = join(found, 0, arcs, slot, b, radius)
            row = -1
            for sense in range(2):
                if not bits & (1 << sense):
                    continue
                row += 1
                x, y, e, f = (
                    found[row, FROM_X],
                    found[row, FROM_Y],
                    found[row, TO_X],
                    found[row, TO_Y],
                )
                if not segment_clear(scene, x, y, e, f, radius - SLACK_M):
                    continue
                if count + 2 > len(source):
                    source = np.concatenate((source, np.empty_like(source)))
                    target = np.concatenate((target, np.empty_like(target)))
                    data = np.concatenate((data, np.empty_like(data)))
                other = 2 * b + sense
                source[count], target[count] = slot, other
                data[count] = found[row]
                # Backwards: opposite senses, and progress counts from the other end.
                source[count + 1], target[count + 1] = other ^ 1, slot ^ 1
                data[count + 1, LEAVE], data[count + 1, ARRIVE] = (
                    -found[row, ARRIVE],
                    -found[row, LEAVE],
                )
                data[count + 1, LENGTH] = found[row, LENGTH]
                data[count + 1, FROM_X], data[count + 1, FROM_Y] = e, f
                data[count + 1, TO_X], data[count + 1, TO_Y] = x, y
                count += 2
    return source[:count], target[:count], data[:count]


def tangents_of(scene: Scene, arcs: Floats, radius: float) -> Tangents:
    """Find all clear tangents among arcs (n, 6)."""
    source, target, data = _all_pairs(scene, arcs, radius)
    order = np.lexsort((target, data[:, LEAVE], source))
    starts = np.searchsorted(source[order], np.arange(2 * len(arcs) + 1)).astype(np.int64)
    return Tangents(starts, target[order], np.ascontiguousarray(data[order]))
