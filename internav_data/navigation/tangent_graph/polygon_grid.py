"""Polygons with a uniform grid over them, to ask whether a segment is clear of all of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

from internav_data.geometry.planar import point_polygon_distance, segment_polygon_distance

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints
    from internav_data.geometry import Polygons

CELL_M = 0.5
"""Side of a grid cell."""
SLACK_M = 1e-8
"""Tangents touch what they turn round: a segment may come this much nearer than the radius."""


class PolygonGrid(NamedTuple):
    """Convex polygons, their boxes and, per grid cell, those within a reach of it."""

    vertices: Floats
    """(n, 2) float64, metres: all polygons' corners, each polygon's counter-clockwise."""
    offsets: Ints
    """(polygons + 1,) int64: polygon k has the rows offsets[k]:offsets[k + 1]."""
    boxes: Floats
    """(polygons, 4) float64, metres: x_min, y_min, x_max, y_max."""
    low_x: float
    low_y: float
    """Lower corner of cell (0, 0), metres."""
    cells_x: int
    cells_y: int
    """Number of cells along x and y; cell (i, j) has the number i * cells_y + j."""
    starts: Ints
    """(cells_x * cells_y + 1,) int64 into `ids`."""
    ids: Ints
    """(m,) int64: polygons of each cell."""


def index_polygons(polygons: Polygons, reach: float) -> PolygonGrid:
    """Return a grid over polygons that tests segments for clearances up to `reach` metres."""
    boxes = boxes_of(polygons.vertices, polygons.offsets)
    if not len(boxes):
        none = np.empty(0, dtype=np.int64)
        starts = np.zeros(2, dtype=np.int64)
        return PolygonGrid(polygons.vertices, polygons.offsets, boxes, 0.0, 0.0, 1, 1, starts, none)
    # A micrometre more: a point on the line between two cells may be given to either.
    margin = reach + 1e-6
    low_x, low_y = (float(v) - margin for v in boxes[:, :2].min(axis=0))
    high_x, high_y = (float(v) + margin for v in boxes[:, 2:].max(axis=0))
    cells_x = max(1, math.ceil((high_x - low_x) / CELL_M))
    cells_y = max(1, math.ceil((high_y - low_y) / CELL_M))
    starts, ids = _fill(boxes, margin, low_x, low_y, cells_x, cells_y)
    return PolygonGrid(
        polygons.vertices, polygons.offsets, boxes, low_x, low_y, cells_x, cells_y, starts, ids
    )


@njit(cache=True)
def boxes_of(vertices: Floats, offsets: Ints) -> Floats:
    """Return the polygons' bounding boxes, (polygons, 4) float64: x_min, y_min, x_max, y_max.

    `vertices` (n, 2) float64, metres; `offsets` (polygons + 1,) int64.
    """
    boxes = np.empty((len(offsets) - 1, 4))
    for k in range(len(boxes)):
        part = vertices[offsets[k] : offsets[k + 1]]
        boxes[k, 0], boxes[k, 1] = part[:, 0].min(), part[:, 1].min()
        boxes[k, 2], boxes[k, 3] = part[:, 0].max(), part[:, 1].max()
    return boxes


@njit(cache=True)
def _fill(
    boxes: Floats, margin: float, low_x: float, low_y: float, cells_x: int, cells_y: int
) -> tuple[Ints, Ints]:
    starts = np.zeros(cells_x * cells_y + 1, dtype=np.int64)
    ids = np.empty(0, dtype=np.int64)
    # First pass counts, second pass fills.
    for turn in range(2):
        for k in range(len(boxes)):
            i0 = max(0, int((boxes[k, 0] - margin - low_x) / CELL_M))
            j0 = max(0, int((boxes[k, 1] - margin - low_y) / CELL_M))
            i1 = min(cells_x - 1, int((boxes[k, 2] + margin - low_x) / CELL_M))
            j1 = min(cells_y - 1, int((boxes[k, 3] + margin - low_y) / CELL_M))
            for i in range(i0, i1 + 1):
                for j in range(j0, j1 + 1):
                    cell = i * cells_y + j
                    if turn == 1:
                        ids[starts[cell]] = k
                    starts[cell] += 1
        if turn == 0:
            ids = np.empty(starts.sum(), dtype=np.int64)
            starts[1:] = np.cumsum(starts)[:-1]
            starts[0] = 0
    # Filling moved each start to its cell's end.
    starts[1:] = starts[:-1].copy()
    starts[0] = 0
    return starts, ids


@njit(cache=True)
def touches(
    ax: float,
    ay: float,
    bx: float,
    by: float,
    vertices: Floats,
    start: int,
    stop: int,
    limit: float,
) -> bool:
    """Return whether a convex polygon comes nearer than `limit` metres to segment ab.

    The polygon is `vertices[start:stop]`, (n, 2) float64, metres.
    """
    dx, dy = bx - ax, by - ay
    length = math.sqrt(dx * dx + dy * dy)
    if length > 0.0:
        # Most polygons lie wholly on one side: a separating axis settles them cheaply.
        ux, uy = dx / length, dy / length
        left, right, front, back = math.inf, -math.inf, math.inf, -math.inf
        for k in range(start, stop):
            ex, ey = vertices[k, 0] - ax, vertices[k, 1] - ay
            across, along = ux * ey - uy * ex, ux * ex + uy * ey
            left, right = min(left, across), max(right, across)
            front, back = min(front, along), max(back, along)
        if left >= limit or right <= -limit or front >= length + limit or back <= -limit:
            return False
    return segment_polygon_distance(ax, ay, bx, by, vertices, start, stop) < limit


@njit(cache=True)
def segment_clear(
    grid: PolygonGrid, ax: float, ay: float, bx: float, by: float, limit: float
) -> bool:
    """Return whether every polygon keeps at least `limit` metres from segment ab.

    `limit` must not exceed the grid's reach. Cells are walked from a to b as in Amanatides and
    Woo, "A fast voxel traversal algorithm for ray tracing", 1987.
    """
    x, y = (ax - grid.low_x) / CELL_M, (ay - grid.low_y) / CELL_M
    dx, dy = (bx - ax) / CELL_M, (by - ay) / CELL_M
    i, j = math.floor(x), math.floor(y)
    last_i, last_j = math.floor(x + dx), math.floor(y + dy)
    step_i = 1 if dx > 0.0 else -1
    step_j = 1 if dy > 0.0 else -1
    # Share of the segment at which the next line between columns and between rows is crossed.
    to_i = (i + (step_i > 0) - x) / dx if i != last_i else math.inf
    to_j = (j + (step_j > 0) - y) / dy if j != last_j else math.inf
    for _ in range(abs(last_i - i) + abs(last_j - j) + 1):
        if 0 <= i < grid.cells_x and 0 <= j < grid.cells_y:
            cell = i * grid.cells_y + j
            for n in range(grid.starts[cell], grid.starts[cell + 1]):
                k = grid.ids[n]
                start, stop = grid.offsets[k], grid.offsets[k + 1]
                if touches(ax, ay, bx, by, grid.vertices, start, stop, limit):
                    return False
        if i == last_i and j == last_j:
            break
        if to_i < to_j:
            i += step_i
            to_i = (i + (step_i > 0) - x) / dx if i != last_i else math.inf
        else:
            j += step_j
            to_j = (j + (step_j > 0) - y) / dy if j != last_j else math.inf
    return True


@njit(cache=True)
def segment_clear_of(
    vertices: Floats,
    offsets: Ints,
    boxes: Floats,
    ax: float,
    ay: float,
    bx: float,
    by: float,
    limit: float,
) -> bool:
    """Return whether each of a few polygons, without a grid, keeps `limit` metres from segment ab.

    `vertices` (n, 2) float64, metres; `offsets` (polygons + 1,) int64; `boxes` (polygons, 4).
    """
    low_x, high_x = min(ax, bx) - limit, max(ax, bx) + limit
    low_y, high_y = min(ay, by) - limit, max(ay, by) + limit
    for k in range(len(boxes)):
        if (
            boxes[k, 0] < high_x
            and boxes[k, 2] > low_x
            and boxes[k, 1] < high_y
            and boxes[k, 3] > low_y
            and touches(ax, ay, bx, by, vertices, offsets[k], offsets[k + 1], limit)
        ):
            return False
    return True


@njit(cache=True)
def path_clear_of(
    points: Floats, vertices: Floats, offsets: Ints, boxes: Floats, limit: float
) -> bool:
    """Return whether each polygon keeps at least `limit` metres from a path.

    `points` (n, 2) float64, metres, n >= 1; polygons as for `segment_clear_of`.
    """
    for k in range(max(1, len(points) - 1)):
        m = min(k + 1, len(points) - 1)
        ax, ay, bx, by = points[k, 0], points[k, 1], points[m, 0], points[m, 1]
        if not segment_clear_of(vertices, offsets, boxes, ax, ay, bx, by, limit):
            return False
    return True


@njit(cache=True)
def point_clear(
    vertices: Floats, offsets: Ints, boxes: Floats, x: float, y: float, limit: float
) -> bool:
    """Return whether every polygon keeps at least `limit` metres from a point, as for the lattice.

    `vertices` (n, 2) float64, metres; `offsets` (polygons + 1,) int64; `boxes` (polygons, 4).
    """
    for k in range(len(boxes)):
        if (
            boxes[k, 0] - limit <= x <= boxes[k, 2] + limit
            and boxes[k, 1] - limit <= y <= boxes[k, 3] + limit
            and point_polygon_distance(x, y, vertices, offsets[k], offsets[k + 1]) < limit
        ):
            return False
    return True
