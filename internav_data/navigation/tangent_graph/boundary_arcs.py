"""Boundary arcs: curves on which the disc's centre turns round a corner, touching it. Numba.

The shortest path of a disc is a taut string round circles of its radius about polygons' corners.
Such a circle serves only inside the corner's normal cone (elsewhere the disc would run into the
corner's own polygon) and only where no other polygon comes nearer than the radius: directions that
others forbid are cut out of the cone, and arcs are left.

An array of boundary arcs has shape (n, 6) float64. A row is (x, y, mid_x, mid_y, half, cos_half):
the corner (metres), the unit direction to the arc's middle, half the arc's angle (radians) and the
cosine of that half.

Polygons are given by `vertices` (v, 2) float64 in metres, `offsets` (polygons + 1,) int64 (polygon
k has the rows offsets[k]:offsets[k + 1], counter-clockwise) and `boxes` (polygons, 4) float64 of
x_min, y_min, x_max, y_max.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from internav_data.geometry.planar import cross, inside

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints


NONE, SOME, ALL = 0, 1, 2
"""Share of the directions round a corner that a polygon forbids."""
TOUCH_M = 1e-9
"""Polygons nearer than this touch: walls in one line, furniture flush with each other."""
FULL_TURN = 2.0 * math.pi


@njit(cache=True)
def wrapped(angle: float) -> float:
    """Bring an angle into (-pi, pi]."""
    while angle > math.pi:
        angle -= FULL_TURN
    while angle <= -math.pi:
        angle += FULL_TURN
    return angle


@njit(cache=True)
def nearest(
    x: float, y: float, vertices: Floats, start: int, stop: int
) -> tuple[float, float, float]:
    """Return the outline's point nearest to (x, y) and its distance, metres: x, y, distance.

    The convex polygon is `vertices[start:stop]`, (n, 2) float64, metres.
    """
    best, best_x, best_y = math.inf, 0.0, 0.0
    previous = stop - 1
    for k in range(start, stop):
        ax, ay = vertices[previous, 0], vertices[previous, 1]
        dx, dy = vertices[k, 0] - ax, vertices[k, 1] - ay
        length = dx * dx + dy * dy
        t = 0.0
        if length > 0.0:
            t = min(1.0, max(0.0, ((x - ax) * dx + (y - ay) * dy) / length))
        px, py = ax + t * dx, ay + t * dy
        d = (px - x) * (px - x) + (py - y) * (py - y)
        if d < best:
            best, best_x, best_y = d, px, py
        previous = k
    return best_x, best_y, math.sqrt(best)


@njit(cache=True)
def _forbidden_by_touching(
    x: float, y: float, vertices: Floats, start: int, stop: int
) -> tuple[int, float, float]:
    """Return what a polygon that touches the corner forbids: all but its normal cone there."""
    mid_x = vertices[start:stop, 0].mean() - x
    mid_y = vertices[start:stop, 1].mean() - y
    middle = math.atan2(mid_y, mid_x)
    low, high = 0.0, 0.0
    for k in range(start, stop):
        dx, dy = vertices[k, 0] - x, vertices[k, 1] - y
        if dx * dx + dy * dy > TOUCH_M * TOUCH_M:
            turn = wrapped(math.atan2(dy, dx) - middle)
            low, high = min(low, turn), max(high, turn)
    if high - low >= math.pi - TOUCH_M:
        return ALL, 0.0, 0.0
    return SOME, middle + low - math.pi / 2.0, middle + high + math.pi / 2.0


@njit(cache=True)
def far_from(x: float, y: float, boxes: Floats, k: int, reach: float) -> bool:
    """Return whether a point lies `reach` metres or more from box k of `boxes` (n, 4) float64."""
    dx = max(0.0, boxes[k, 0] - x, x - boxes[k, 2])
    dy = max(0.0, boxes[k, 1] - y, y - boxes[k, 3])
    return dx * dx + dy * dy >= reach * reach


@njit(cache=True)
def forbidden_directions(
    x: float, y: float, radius: float, vertices: Floats, start: int, stop: int
) -> tuple[int, float, float]:
    """Return the directions u in which a convex polygon forbids the disc's centre.

    The centre is at corner + radius * u, the corner at (x, y), the polygon `vertices[start:stop]`,
    (n, 2) float64, metres. The forbidden directions are *one* interval: the union, over the
    polygon's connected set of points within two radii, of intervals that move continuously. Its
    ends come from the polygon's vertices or from its edges' offset lines.

    Returns
    -------
    tuple
        (NONE | SOME | ALL, low, high) with low < high in radians; 0, 0 unless SOME.
    """
    near_x, near_y, distance = nearest(x, y, vertices, start, stop)
    within = inside(x, y, vertices, start, stop)
    if within and distance > TOUCH_M:
        return ALL, 0.0, 0.0
    if distance >= 2.0 * radius:
        return NONE, 0.0, 0.0
    if distance <= TOUCH_M:
        return _forbidden_by_touching(x, y, vertices, start, stop)
    # A point at distance d <= 2 r is met in the directions within acos(d / 2 r) of its own.
    middle = math.atan2(near_y - y, near_x - x)
    spread = math.acos(distance / (2.0 * radius))
    low, high = -spread, spread
    previous = stop - 1
    for k in range(start, stop):
        ax, ay = vertices[previous, 0], vertices[previous, 1]
        bx, by = vertices[k, 0], vertices[k, 1]
        previous = k
        d = math.sqrt((bx - x) * (bx - x) + (by - y) * (by - y))
        if d < 2.0 * radius:
            turn = wrapped(math.atan2(by - y, bx - x) - middle)
            spread = math.acos(d / (2.0 * radius))
            low, high = min(low, turn - spread), max(high, turn + spread)
        ex, ey = bx - ax, by - ay
        length = math.sqrt(ex * ex + ey * ey)
        if length == 0.0:
            continue
        ex, ey = ex / length, ey / length
        height = cross(x - ax, y - ay, ex, ey)  # along the outward normal (ey, -ex)
        if not 0.0 <= height < 2.0 * radius:
            continue
        # The centre is one radius from the edge's line where its own height above it is r.
        normal = math.atan2(-ex, ey)
        opening = math.acos(1.0 - height / radius)
        for side in (-1.0, 1.0):
            angle = normal + side * opening
            foot = (x + radius * math.cos(angle) - ax) * ex
            foot += (y + radius * math.sin(angle) - ay) * ey
            if 0.0 <= foot <= length:
                turn = wrapped(angle - middle)
                low, high = min(low, turn), max(high, turn)
    return SOME, middle + low, middle + high


X, Y, MID_X, MID_Y, HALF, COS_HALF = range(6)
"""Columns of an array of boundary arcs."""
TINY_RAD = 1e-10
"""A shorter arc is what rounding leaves where polygons are flush; nothing turns there."""


@njit(cache=True)
def cone(vertices: Floats, start: int, stop: int, k: int) -> tuple[float, float]:
    """Return the direction in which a corner's normal cone begins and the cone's angle, radians.

    The cone opens counter-clockwise from there. The corner is row k of the convex polygon
    `vertices[start:stop]`, (n, 2) float64, metres.
    """
    previous = k - 1 if k > start else stop - 1
    following = k + 1 if k + 1 < stop else start
    px, py = vertices[k, 0] - vertices[previous, 0], vertices[k, 1] - vertices[previous, 1]
    nx, ny = vertices[following, 0] - vertices[k, 0], vertices[following, 1] - vertices[k, 1]
    turn = math.atan2(cross(px, py, nx, ny), px * nx + py * ny)
    if stop - start <= 2:  # noqa: PLR2004 - the two ends of a segment turn by half a circle
        turn = math.pi
    return math.atan2(-px, py), turn


@njit(cache=True)
def _cover(pieces: Floats, count: int, begin: float, width: float, low: float, high: float) -> int:
    """Add the parts of directions [low, high] that lie in a cone, as offsets from its begin."""
    first = (low - begin) % FULL_TURN
    for shift in (0.0, -FULL_TURN):
        a, b = first + shift, first + shift + high - low
        if b > 0.0 and a < width:
            pieces[count, 0], pieces[count, 1] = a, b
            count += 1
    return count


@njit(cache=True)
def _gaps(
    pieces: Floats, count: int, x: float, y: float, begin: float, width: float, out: Floats
) -> int:
    """Write the gaps between covered pieces of a cone as arcs; return their number."""
    order = np.argsort(pieces[:count, 0])
    reached = 0.0
    found = 0
    for n in range(count + 1):
        following = min(width, pieces[order[n], 0]) if n < count else width
        if following - reached > TINY_RAD:
            half = (following - reached) / 2.0
            middle = begin + reached + half
            out[found, X], out[found, Y] = x, y
            out[found, MID_X], out[found, MID_Y] = math.cos(middle), math.sin(middle)
            out[found, HALF], out[found, COS_HALF] = half, math.cos(half)
            found += 1
        if n < count:
            reached = max(reached, pieces[order[n], 1])
    return found


@njit(cache=True)
def near_ids(boxes: Floats, box: Floats, reach: float) -> Ints:
    """Return the indices (m,) int64 of `boxes` (n, 4) float64 nearer than `reach` to `box` (4,).

    All in metres. Nearness is judged by axis: corners of boxes count as squares, not as circles.
    """
    found = np.empty(len(boxes), dtype=np.int64)
    count = 0
    for k in range(len(boxes)):
        if (
            boxes[k, 0] < box[2] + reach
            and boxes[k, 2] > box[0] - reach
            and boxes[k, 1] < box[3] + reach
            and boxes[k, 3] > box[1] - reach
        ):
            found[count] = k
            count += 1
    return found[:count]


@njit(cache=True)
def _buried(x: float, y: float, vertices: Floats, offsets: Ints, boxes: Floats, ids: Ints) -> bool:
    """Return whether a point lies in one of some polygons, deeper than touching: cheap refusal."""
    for o in ids:
        if not far_from(x, y, boxes, o, 0.5 * TOUCH_M) and inside(
            x, y, vertices, offsets[o], offsets[o + 1]
        ):
            _, _, depth = nearest(x, y, vertices, offsets[o], offsets[o + 1])
            if depth > TOUCH_M:
                return True
    return False


@njit(cache=True)
def _forbid(
    pieces: Floats,
    count: int,
    corner: tuple[float, float, float, float],
    radius: float,
    vertices: Floats,
    offsets: Ints,
    boxes: Floats,
    ids: Ints,
    skip: int,
) -> int:
    """Add the directions that some polygons forbid in a corner's cone (x, y, begin, width).

    Returns the number of pieces, -1 once one of them covers the cone.
    """
    x, y, begin, width = corner
    for o in ids:
        if o == skip or far_from(x, y, boxes, o, 2.0 * radius):
            continue
        state, low, high = forbidden_directions(x, y, radius, vertices, offsets[o], offsets[o + 1])
        if state == ALL:
            return -1
        if state == SOME:
            first = count
            count = _cover(pieces, count, begin, width, low, high)
            if count > first and pieces[first, 0] <= 0.0 and pieces[first, 1] >= width:
                return -1
    return count


@njit(cache=True)
def find_boundary_arcs(
    vertices: Floats,
    offsets: Ints,
    boxes: Floats,
    others: Floats,
    other_offsets: Ints,
    other_boxes: Floats,
    radius: float,
) -> Floats:
    """Return the boundary arcs (n, 6) float64 of a group's corners, among it and another group.

    Both groups are arrays as in the module's docstring; `radius` in metres.
    """
    pieces = np.empty((2 * (len(boxes) + len(other_boxes)), 2))
    found = np.empty((len(pieces) + 1, 6))
    out = np.empty((2 * len(vertices) + 8, 6))
    size = 0
    for k in range(len(boxes)):
        own = near_ids(boxes, boxes[k], 2.0 * radius)
        foreign = near_ids(other_boxes, boxes[k], 2.0 * radius)
        for v in range(offsets[k], offsets[k + 1]):
            x, y = vertices[v, 0], vertices[v, 1]
            if _buried(x, y, vertices, offsets, boxes, own) or _buried(
                x, y, others, other_offsets, other_boxes, foreign
            ):
                continue
            begin, width = cone(vertices, offsets[k], offsets[k + 1], v)
            corner = (x, y, begin, width)
            count = _forbid(pieces, 0, corner, radius, vertices, offsets, boxes, own, k)
            if count >= 0:
                count = _forbid(
                    pieces, count, corner, radius, others, other_offsets, other_boxes, foreign, -1
                )
            if count < 0 or width <= TINY_RAD:
                continue
            gaps = _gaps(pieces, count, x, y, begin, width, found)
            while size + gaps > len(out):
                out = np.concatenate((out, np.empty_like(out)))
            out[size : size + gaps] = found[:gaps]
            size += gaps
    return out[:size].copy()


@njit(cache=True)
def forbidden_parts(
    boundary_arcs: Floats, vertices: Floats, offsets: Ints, boxes: Floats, radius: float
) -> tuple[Ints, Floats]:
    """Return the parts of boundary arcs (n, 6) float64 that polygons forbid.

    Parameters
    ----------
    boundary_arcs
        Arcs of other polygons, (n, 6) float64.
    vertices, offsets, boxes
        Polygons that forbid, as in the module's docstring.
    radius
        Radius of the disc, metres.

    Returns
    -------
    tuple
        Starts (n + 1,) int64 into pieces (m, 2) float64. A piece is a closed interval of angles
        from its arc's middle, counter-clockwise, radians.
    """
    starts = np.zeros(len(boundary_arcs) + 1, dtype=np.int64)
    pieces = np.empty((2 * len(boxes) * len(boundary_arcs), 2))
    count = 0
    for a in range(len(boundary_arcs)):
        x, y, half = boundary_arcs[a, X], boundary_arcs[a, Y], boundary_arcs[a, HALF]
        begin = math.nan
        for k in range(len(boxes)):
            if far_from(x, y, boxes, k, 2.0 * radius):
                continue
            if math.isnan(begin):
                begin = math.atan2(boundary_arcs[a, MID_Y], boundary_arcs[a, MID_X]) - half
            state, low, high = forbidden_directions(
                x, y, radius, vertices, offsets[k], offsets[k + 1]
            )
            first = count
            if state == ALL:
                pieces[count, 0], pieces[count, 1] = -math.inf, math.inf
                count += 1
            elif state == SOME:
                count = _cover(pieces, count, begin, 2.0 * half, low, high)
                pieces[first:count] -= half
        starts[a + 1] = count
    return starts, pieces[:count].copy()
