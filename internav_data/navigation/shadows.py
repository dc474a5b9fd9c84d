"""Shadows: the directions that a polygon denies to the disc as it goes round a corner."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from numba import njit

from internav_data.geometry.planar import cross, inside

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

NONE, SOME, ALL = 0, 1, 2
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
    """Return the point of a convex polygon's outline nearest to (x, y), and its distance."""
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
def _touching_shadow(
    x: float, y: float, vertices: Floats, start: int, stop: int
) -> tuple[int, float, float]:
    """Shadow of a polygon that touches the corner: all but its own normal cone there."""
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
    """Whether a point is farther than `reach` from a box."""
    dx = max(0.0, boxes[k, 0] - x, x - boxes[k, 2])
    dy = max(0.0, boxes[k, 1] - y, y - boxes[k, 3])
    return dx * dx + dy * dy >= reach * reach


@njit(cache=True)
def shadow(
    x: float, y: float, radius: float, vertices: Floats, start: int, stop: int
) -> tuple[int, float, float]:
    """Which directions u a convex polygon denies to the disc's middle at corner + radius * u.

    A disc round the corner meets the polygon on *one* interval of directions: it is the union,
    over the polygon's connected set of points within two radii, of arcs that move continuously.
    Its ends come from the polygon's vertices or from its edges' offset lines.

    Returns (NONE | SOME | ALL, low, high): radians, low < high.
    """
    near_x, near_y, distance = nearest(x, y, vertices, start, stop)
    within = inside(x, y, vertices, start, stop)
    if within and distance > TOUCH_M:
        return ALL, 0.0, 0.0
    if distance >= 2.0 * radius:
        return NONE, 0.0, 0.0
    if distance <= TOUCH_M:
        return _touching_shadow(x, y, vertices, start, stop)
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
