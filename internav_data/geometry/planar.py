"""Distances in the plane between points, segments and convex polygons: numba, no allocation.

Polygons are convex and counter-clockwise, given as a range [start, stop) of rows of an array of
vertices (n, 2), metres. A polygon may have one or two vertices (a point, a segment).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from numba import njit

if TYPE_CHECKING:
    from internav_data.core.typing import Floats


@njit(cache=True, inline="always")
def cross(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the z component of the cross product of two vectors in the plane."""
    return ax * by - ay * bx


@njit(cache=True)
def point_segment_squared(
    px: float, py: float, ax: float, ay: float, bx: float, by: float
) -> float:
    """Return the squared distance from point p to segment ab, m²."""
    dx, dy = bx - ax, by - ay
    length = dx * dx + dy * dy
    # Parameter of the nearest point of the line, clamped to the segment's ends.
    t = 0.0
    if length > 0.0:
        t = ((px - ax) * dx + (py - ay) * dy) / length
        t = min(1.0, max(0.0, t))
    ex, ey = px - (ax + t * dx), py - (ay + t * dy)
    return ex * ex + ey * ey


@njit(cache=True)
def inside(px: float, py: float, vertices: Floats, start: int, stop: int) -> bool:
    """Return whether a point lies in or on a convex polygon (never in a point or segment).

    The polygon has the rows start:stop of `vertices` (n, 2), metres.
    """
    if stop - start < 3:  # noqa: PLR2004 - a polygon has three corners
        return False
    previous = stop - 1
    for k in range(start, stop):
        ax, ay = vertices[previous, 0], vertices[previous, 1]
        bx, by = vertices[k, 0], vertices[k, 1]
        if cross(bx - ax, by - ay, px - ax, py - ay) < 0.0:
            return False
        previous = k
    return True


@njit(cache=True)
def point_polygon_distance(px: float, py: float, vertices: Floats, start: int, stop: int) -> float:
    """Return the distance (m) from a point to a convex polygon, 0 inside.

    The polygon has the rows start:stop of `vertices` (n, 2), metres.
    """
    if inside(px, py, vertices, start, stop):
        return 0.0
    best = math.inf
    previous = stop - 1
    for k in range(start, stop):
        d = point_segment_squared(
            px, py, vertices[previous, 0], vertices[previous, 1], vertices[k, 0], vertices[k, 1]
        )
        best = min(best, d)
        previous = k
    return math.sqrt(best)


@njit(cache=True)
def segments_cross(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> bool:
    """Return whether segments ab and cd cross properly; ends that touch are left to distances."""
    d1 = cross(bx - ax, by - ay, cx - ax, cy - ay)
    d2 = cross(bx - ax, by - ay, dx - ax, dy - ay)
    d3 = cross(dx - cx, dy - cy, ax - cx, ay - cy)
    d4 = cross(dx - cx, dy - cy, bx - cx, by - cy)
    return (d1 > 0.0) != (d2 > 0.0) and (d3 > 0.0) != (d4 > 0.0)


@njit(cache=True)
def segment_segment_squared(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> float:
    """Return the squared distance between segments ab and cd, m²; 0 where they cross.

    Segments that do not cross are nearest at an end of one of them.
    """
    if segments_cross(ax, ay, bx, by, cx, cy, dx, dy):
        return 0.0
    return min(
        point_segment_squared(ax, ay, cx, cy, dx, dy),
        point_segment_squared(bx, by, cx, cy, dx, dy),
        point_segment_squared(cx, cy, ax, ay, bx, by),
        point_segment_squared(dx, dy, ax, ay, bx, by),
    )


@njit(cache=True)
def segment_polygon_distance(
    ax: float, ay: float, bx: float, by: float, vertices: Floats, start: int, stop: int
) -> float:
    """Return the distance (m) between segment ab and a convex polygon, 0 where they meet.

    The polygon has the rows start:stop of `vertices` (n, 2), metres. A disc of radius r swept along
    ab stays clear of the polygon exactly when the distance is >= r.
    """
    if inside(ax, ay, vertices, start, stop) or inside(bx, by, vertices, start, stop):
        return 0.0
    best = math.inf
    previous = stop - 1
    for k in range(start, stop):
        d = segment_segment_squared(
            ax,
            ay,
            bx,
            by,
            vertices[previous, 0],
            vertices[previous, 1],
            vertices[k, 0],
            vertices[k, 1],
        )
        best = min(best, d)
        previous = k
    return math.sqrt(best)


@njit(cache=True)
def polygon_distance(
    first: Floats, start: int, stop: int, second: Floats, begin: int, end: int
) -> float:
    """Return the distance (m) between two convex polygons, 0 where they overlap.

    The polygons have the rows start:stop of `first` (n, 2) and begin:end of `second` (m, 2).
    """
    # Overlapping polygons cross at an edge, or the second holds the first (both found below), or
    # the first holds the second.
    if inside(second[begin, 0], second[begin, 1], first, start, stop):
        return 0.0
    best = math.inf
    previous = stop - 1
    for k in range(start, stop):
        d = segment_polygon_distance(
            first[previous, 0],
            first[previous, 1],
            first[k, 0],
            first[k, 1],
            second,
            begin,
            end,
        )
        best = min(best, d)
        if best == 0.0:
            return 0.0
        previous = k
    return best
