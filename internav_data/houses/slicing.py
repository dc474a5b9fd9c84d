"""Slicing trees (Otten 1982): rectangles cut in two until every room has its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.arithmetic import plain_sum
from internav_data.houses.standards import HALF_WALL_CM, WALL_CM

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.random import Generator

    from internav_data.houses.plan import Rect
    from internav_data.houses.programme import RoomSpec

GRID_CM = 5
"""Walls stand on multiples of this."""
Layout = dict[int, list["Rect"]]
"""Rectangles by index of the room in the programme."""


def snapped(value: float) -> int:
    """Round centimetres to the grid of walls."""
    return round(value / GRID_CM) * GRID_CM


def min_width_cm(spec: RoomSpec) -> int:
    """Smallest distance of centre lines, on the grid, that keeps the clear width; centimetres."""
    clear = round(spec.standard.width_m * 100) + WALL_CM
    return -(-clear // GRID_CM) * GRID_CM


def _best_cut(specs: Sequence[RoomSpec], order: Sequence[int], rng: Generator) -> tuple[int, float]:
    """Draw the place at which to part the order of rooms; return it and the area before it.

    Even cuts are likelier: the weight of a cut is the square of both shares' product. The area is
    a share of the total.
    """
    areas = [specs[k].area_m2 for k in order]
    total = plain_sum(areas)
    weights: list[float] = []
    running = 0.0
    for area in areas[:-1]:
        running += area
        share = running / total
        weights.append((share * (1.0 - share)) ** 2)
    position = float(rng.random()) * plain_sum(weights)
    running = 0.0
    for k, weight in enumerate(weights):
        running += areas[k]
        position -= weight
        if position < 0.0 or k == len(weights) - 1:
            return k + 1, running / total
    return 1, areas[0] / total


def slice_rooms(
    rect: Rect, specs: Sequence[RoomSpec], order: Sequence[int], rng: Generator, layout: Layout
) -> None:
    """Cut a rectangle into the rooms of `order` (neighbours in it tend to stay neighbours)."""
    if len(order) == 1:
        layout[order[0]] = [rect]
        return
    x0, y0, x1, y1 = rect
    cut, share = _best_cut(specs, order, rng)
    first, second = order[:cut], order[cut:]
    if float(rng.random()) < 0.5:  # noqa: PLR2004 - a fair coin
        first, second, share = second, first, 1.0 - share
    # Mostly across the longer side; the random factor lets nearly square rectangles go either way.
    wide = (x1 - x0) * (0.75 + 0.5 * float(rng.random())) > (y1 - y0)
    low, high = (x0, x1) if wide else (y0, y1)
    near = max(min_width_cm(specs[k]) for k in first)
    far = max(min_width_cm(specs[k]) for k in second)
    at = snapped(low + share * (high - low))
    # The minima of both sides first; where they exclude each other, at least a grid step remains
    # and the plan is refused later.
    at = max(low + near, min(high - far, at))
    at = max(low + GRID_CM, min(high - GRID_CM, at))
    one: Rect = (x0, y0, at, y1) if wide else (x0, y0, x1, at)
    two: Rect = (at, y0, x1, y1) if wide else (x0, at, x1, y1)
    slice_rooms(one, specs, first, rng, layout)
    slice_rooms(two, specs, second, rng, layout)


def carve(rects: Sequence[Rect], chunk: Rect) -> list[Rect]:
    """Return some rectangles without another one, cut into rectangles."""
    out: list[Rect] = []
    cx0, cy0, cx1, cy1 = chunk
    for x0, y0, x1, y1 in rects:
        ix0, iy0, ix1, iy1 = max(x0, cx0), max(y0, cy0), min(x1, cx1), min(y1, cy1)
        if ix0 >= ix1 or iy0 >= iy1:
            out.append((x0, y0, x1, y1))
            continue
        pieces = ((x0, y0, ix0, y1), (ix1, y0, x1, y1), (ix0, y0, ix1, iy0), (ix0, iy1, ix1, y1))
        out += [p for p in pieces if p[0] < p[2] and p[1] < p[3]]
    return out


def mirrored(layout: Layout, rng: Generator) -> Layout:
    """Turn and mirror a layout at random, then move it to the origin."""
    swap, flip_x, flip_y = (float(rng.random()) < 0.5 for _ in range(3))  # noqa: PLR2004 - coins
    out: Layout = {}
    for room, rects in layout.items():
        turned: list[Rect] = []
        for x0, y0, x1, y1 in rects:
            if flip_x:
                x0, x1 = -x1, -x0  # noqa: PLW2901 - one step after the other
            if flip_y:
                y0, y1 = -y1, -y0  # noqa: PLW2901
            turned.append((y0, x0, y1, x1) if swap else (x0, y0, x1, y1))
        out[room] = turned
    return at_origin(out)


def at_origin(layout: Layout) -> Layout:
    """Move a layout so that the interior's bounding box starts at (0, 0)."""
    left = min(r[0] for rects in layout.values() for r in rects) + HALF_WALL_CM
    low = min(r[1] for rects in layout.values() for r in rects) + HALF_WALL_CM
    return {
        room: [(x0 - left, y0 - low, x1 - left, y1 - low) for x0, y0, x1, y1 in rects]
        for room, rects in layout.items()
    }
