"""Tangents: the straight pieces of a taut string between boundary arcs. Numba.

A directed arc is a boundary arc and a sense of going round it, numbered 2 * arc + sense: sense 0 is
counter-clockwise (the corner on the left), 1 clockwise. Progress is the angle turned round the arc
in that sense, from its middle: -half where it begins, +half where it ends.

A tangent is a directed record: it leaves one directed arc at a progress and arrives in another at
one. Its reverse leaves the *opposite* sense of the arc of arrival, so one test of clearness serves
both. Arrays of boundary arcs (n, 6) float64 are those of `boundary_arcs`; an array of tangents has
shape (n, 7) float64: progress on leaving and on arriving (radians), length, both ends (metres).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

from internav_data.geometry.planar import cross
from internav_data.navigation.tangent_graph.boundary_arcs import COS_HALF, HALF, MID_X, MID_Y, X, Y
from internav_data.navigation.tangent_graph.polygon_grid import SLACK_M, segment_clear

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints
    from internav_data.navigation.tangent_graph.polygon_grid import PolygonGrid

LEAVE, ARRIVE, LENGTH, FROM_X, FROM_Y, TO_X, TO_Y = range(7)
"""Columns of an array of tangents."""
ANGLE_SLACK = 1e-12
"""A cosine may fall short of an arc's by this: a tangent at the very end of an arc is on it."""


class Tangents(NamedTuple):
    """Clear tangents among a house's own arcs, grouped by the directed arc they leave."""

    starts: Ints
    """(directed arcs + 1,) int64 into the rows below."""
    target: Ints
    """(n,) int64: directed arc of arrival."""
    data: Floats
    """(n, 7) float64: see the module's docstring; within a directed arc by progress on leaving."""


@njit(cache=True)
def on_arc(boundary_arcs: Floats, a: int, nx: float, ny: float) -> bool:
    """Return whether the unit direction (nx, ny) lies on arc `a` of `boundary_arcs` (n, 6)."""
    return (
        boundary_arcs[a, MID_X] * nx + boundary_arcs[a, MID_Y] * ny
        >= boundary_arcs[a, COS_HALF] - ANGLE_SLACK
    )


@njit(cache=True)
def progress(boundary_arcs: Floats, directed_arc: int, nx: float, ny: float) -> float:
    """Return the progress of the unit direction (nx, ny) on a directed arc, radians.

    The value lies in [-half, half]; `boundary_arcs` (n, 6) float64.
    """
    a = directed_arc // 2
    mid_x, mid_y, half = boundary_arcs[a, MID_X], boundary_arcs[a, MID_Y], boundary_arcs[a, HALF]
    turn = math.atan2(cross(mid_x, mid_y, nx, ny), mid_x * nx + mid_y * ny)
    if directed_arc % 2 == 1:
        turn = -turn
    return min(half, max(-half, turn))


@njit(cache=True)
def join_point(
    data: Floats,
    row: int,
    boundary_arcs: Floats,
    directed_arc: int,
    x: float,
    y: float,
    radius: float,
) -> bool:
    """Write the tangent that leaves a directed arc for point (x, y) into a row of `data` (n, 7).

    Returns False where there is none.
    """
    a = directed_arc // 2
    ex, ey = x - boundary_arcs[a, X], y - boundary_arcs[a, Y]
    distance = math.sqrt(ex * ex + ey * ey)
    if distance == 0.0:
        return False
    ex, ey = ex / distance, ey / distance
    # A point on the circle may lie the last bit inside it.
    c = min(1.0, radius / distance)
    s = math.sqrt(1.0 - c * c)
    # Counter-clockwise, the string leaves before it has turned as far as the point's direction.
    if directed_arc % 2 == 0:
        s = -s
    nx, ny = c * ex - s * ey, s * ex + c * ey
    if not on_arc(boundary_arcs, a, nx, ny):
        return False
    data[row, LEAVE], data[row, ARRIVE] = progress(boundary_arcs, directed_arc, nx, ny), 0.0
    data[row, FROM_X], data[row, FROM_Y] = (
        boundary_arcs[a, X] + radius * nx,
        boundary_arcs[a, Y] + radius * ny,
    )
    data[row, TO_X], data[row, TO_Y] = x, y
    data[row, LENGTH] = math.hypot(x - data[row, FROM_X], y - data[row, FROM_Y])
    return True


@njit(cache=True)
def join(
    data: Floats, row: int, boundary_arcs: Floats, directed_arc: int, b: int, radius: float
) -> int:
    """Write the tangents from a directed arc to arc b, at most two, from a row of `data` (n, 7) on.

    Returns a bit for each sense in which they arrive: 1 counter-clockwise, 2 clockwise; the
    counter-clockwise one comes first. Scalars only: this is the innermost loop of everything.
    """
    a = directed_arc // 2
    dx, dy = boundary_arcs[b, X] - boundary_arcs[a, X], boundary_arcs[b, Y] - boundary_arcs[a, Y]
    square = dx * dx + dy * dy
    if square == 0.0:
        return 0
    distance = math.sqrt(square)
    dx, dy = dx / distance, dy / distance
    # Counter-clockwise the corner is on the left, so the string touches on its right: (dy, -dx).
    side = 1.0 if directed_arc % 2 == 0 else -1.0
    bits, same = 0, 1 << (directed_arc % 2)
    nx, ny = side * dy, -side * dx
    if on_arc(boundary_arcs, a, nx, ny) and on_arc(boundary_arcs, b, nx, ny):
        _write(
            data, row, boundary_arcs, directed_arc, nx, ny, 2 * b + directed_arc % 2, nx, ny, radius
        )
        bits = same
    s = 2.0 * radius / distance
    if s <= 1.0:
        c = math.sqrt(1.0 - s * s)
        # The string crosses the line of centres at asin(s), to touch on the other side.
        ux, uy = c * dx - side * s * dy, side * s * dx + c * dy
        nx, ny = side * uy, -side * ux
        if on_arc(boundary_arcs, a, nx, ny) and on_arc(boundary_arcs, b, -nx, -ny):
            if bits == 1:
                row += 1
            elif bits:
                data[row + 1] = data[row]
            _write(
                data,
                row,
                boundary_arcs,
                directed_arc,
                nx,
                ny,
                2 * b + 1 - directed_arc % 2,
                -nx,
                -ny,
                radius,
            )
            bits |= 3 - same
    return bits


@njit(cache=True)
def _write(
    data: Floats,
    row: int,
    boundary_arcs: Floats,
    directed_arc: int,
    nx: float,
    ny: float,
    other: int,
    mx: float,
    my: float,
    radius: float,
) -> None:
    a, b = directed_arc // 2, other // 2
    data[row, LEAVE] = progress(boundary_arcs, directed_arc, nx, ny)
    data[row, ARRIVE] = progress(boundary_arcs, other, mx, my)
    data[row, FROM_X], data[row, FROM_Y] = (
        boundary_arcs[a, X] + radius * nx,
        boundary_arcs[a, Y] + radius * ny,
    )
    data[row, TO_X], data[row, TO_Y] = (
        boundary_arcs[b, X] + radius * mx,
        boundary_arcs[b, Y] + radius * my,
    )
    data[row, LENGTH] = math.hypot(
        data[row, TO_X] - data[row, FROM_X], data[row, TO_Y] - data[row, FROM_Y]
    )


@njit(cache=True)
def _all_pairs(
    grid: PolygonGrid, boundary_arcs: Floats, radius: float
) -> tuple[Ints, Ints, Floats]:
    source = np.empty(1024, dtype=np.int64)
    target = np.empty(1024, dtype=np.int64)
    data = np.empty((1024, 7))
    found = np.empty((2, 7))
    count = 0
    for directed_arc in range(2 * len(boundary_arcs)):
        for b in range(directed_arc // 2 + 1, len(boundary_arcs)):
            bits = join(found, 0, boundary_arcs, directed_arc, b, radius)
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
                if not segment_clear(grid, x, y, e, f, radius - SLACK_M):
                    continue
                if count + 2 > len(source):
                    source = np.concatenate((source, np.empty_like(source)))
                    target = np.concatenate((target, np.empty_like(target)))
                    data = np.concatenate((data, np.empty_like(data)))
                other = 2 * b + sense
                source[count], target[count] = directed_arc, other
                data[count] = found[row]
                # Backwards: opposite senses, and progress counts from the other end.
                source[count + 1], target[count + 1] = other ^ 1, directed_arc ^ 1
                data[count + 1, LEAVE], data[count + 1, ARRIVE] = (
                    -found[row, ARRIVE],
                    -found[row, LEAVE],
                )
                data[count + 1, LENGTH] = found[row, LENGTH]
                data[count + 1, FROM_X], data[count + 1, FROM_Y] = e, f
                data[count + 1, TO_X], data[count + 1, TO_Y] = x, y
                count += 2
    return source[:count], target[:count], data[:count]


def tangents_of(grid: PolygonGrid, boundary_arcs: Floats, radius: float) -> Tangents:
    """Return all clear tangents among boundary arcs (n, 6) float64; `radius` in metres."""
    source, target, data = _all_pairs(grid, boundary_arcs, radius)
    # The last key of lexsort comes first: directed arc left, progress on leaving, arc of arrival.
    order = np.lexsort((target, data[:, LEAVE], source))
    starts = np.searchsorted(source[order], np.arange(2 * len(boundary_arcs) + 1)).astype(np.int64)
    return Tangents(starts, target[order], np.ascontiguousarray(data[order]))
