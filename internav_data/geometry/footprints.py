"""Footprints: convex polygons on the floor that block the agent's disc.

Each part's polyhedron is clipped to z in [0.02, 1.8] m and projected; its convex hull is one
polygon. Polygons inside another one of the same asset are dropped: the union is the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numba import njit

from internav_data.geometry.planar import cross, inside, polygon_distance
from internav_data.geometry.poses import rotation_matrix
from internav_data.geometry.solids import asset_corners
from internav_data.records.agent import AGENT

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from internav_data.core.typing import Floats, Ints
    from internav_data.records import Asset, House, Pose, Vec2, Wall

LOWEST_M: Final = AGENT.step_over_m
"""Height (m) below which parts do not block: the agent steps over them."""
HIGHEST_M: Final = AGENT.height_m
"""Height (m) above which parts do not block: the agent walks under them."""


@dataclass(frozen=True, slots=True, eq=False)
class Polygons:
    """Convex, counter-clockwise polygons in one array.

    Polygon k has the rows offsets[k]:offsets[k + 1] of the vertices.
    """

    vertices: Floats
    """Corners of all polygons, (n, 2) float64, metres."""
    offsets: Ints
    """First row of each polygon, and the number of rows, (polygons + 1,) int64."""

    def __len__(self) -> int:
        """Return the number of polygons."""
        return len(self.offsets) - 1

    def __iter__(self) -> Iterator[Floats]:
        """Yield each polygon's vertices, (n, 2) float64, metres."""
        for k in range(len(self)):
            yield self.vertices[self.offsets[k] : self.offsets[k + 1]]

    @staticmethod
    def of(polygons: Iterable[Sequence[Vec2] | Floats]) -> Polygons:
        """Gather convex, counter-clockwise polygons, (n, 2) each, metres."""
        arrays = [np.asarray(p, dtype=np.float64).reshape(-1, 2) for p in polygons]
        offsets = np.cumsum([0, *(len(a) for a in arrays)]).astype(np.int64)
        vertices = np.vstack(arrays) if arrays else np.empty((0, 2))
        return Polygons(np.ascontiguousarray(vertices), offsets)

    @staticmethod
    def joined(groups: Iterable[Polygons]) -> Polygons:
        """Concatenate groups of polygons, in order."""
        return Polygons.of(polygon for group in groups for polygon in group)


@njit(cache=True)
def convex_hull(points: Floats) -> Floats:
    """Return the corners of the convex hull of points (n, 2), (h, 2) float64, counter-clockwise.

    Collinear points are dropped. Monotone chain (Andrew, "Another efficient algorithm for convex
    hulls in two dimensions", 1979).
    """
    count = len(points)
    order = np.argsort(points[:, 0])
    # argsort orders by x alone: an insertion pass puts points of equal x in order of y.
    for a in range(1, count):
        b = a
        while b > 0:
            p, q = points[order[b]], points[order[b - 1]]
            if p[0] < q[0] or (p[0] == q[0] and p[1] < q[1]):
                order[b], order[b - 1] = order[b - 1], order[b]
                b -= 1
            else:
                break
    hull = np.empty((2 * count + 1, 2))
    size = 0
    # First the lower chain from left to right, then the upper chain back. A point that would make
    # the chain turn right or go straight pops its predecessor; the lower chain's end stays.
    for sweep in range(2):
        floor = size if sweep == 1 else 1
        for step in range(count):
            if sweep == 1 and step == 0:
                continue
            p = points[order[step if sweep == 0 else count - 1 - step]]
            while size > floor and (
                cross(
                    hull[size - 1, 0] - hull[size - 2, 0],
                    hull[size - 1, 1] - hull[size - 2, 1],
                    p[0] - hull[size - 1, 0],
                    p[1] - hull[size - 1, 1],
                )
                <= 1e-12  # noqa: PLR2004 - a millionth of a square millimetre
            ):
                size -= 1
            hull[size, 0], hull[size, 1] = p[0], p[1]
            size += 1
    # The last point repeats the first.
    return hull[: max(1, size - 1)].copy()


@njit(cache=True)
def _clipped(corners: Floats, low: float, high: float) -> Floats:
    """Return points (n, 2) whose hull is the plan of a convex polyhedron between two heights.

    `corners` (k, 3), metres. Every pair of corners spans a segment inside the polyhedron, so the
    plan is the hull of the corners between the planes and of the points where such segments pierce
    a plane: no list of edges is needed.
    """
    count = len(corners)
    out = np.empty((count + 2 * count * count, 2))
    size = 0
    for a in range(count):
        if low <= corners[a, 2] <= high:
            out[size, 0], out[size, 1] = corners[a, 0], corners[a, 1]
            size += 1
    for level in (low, high):
        for a in range(count):
            if corners[a, 2] >= level:
                continue
            for b in range(count):
                if corners[b, 2] <= level:
                    continue
                t = (level - corners[a, 2]) / (corners[b, 2] - corners[a, 2])
                out[size, 0] = corners[a, 0] + t * (corners[b, 0] - corners[a, 0])
                out[size, 1] = corners[a, 1] + t * (corners[b, 1] - corners[a, 1])
                size += 1
    # A nanometre grid makes corners above each other one point, whatever their last bits.
    for k in range(size):
        out[k, 0] = math.floor(out[k, 0] * 1e9 + 0.5) * 1e-9
        out[k, 1] = math.floor(out[k, 1] * 1e9 + 0.5) * 1e-9
    return out[:size]


@njit(cache=True)
def _contained(vertices: Floats, a0: int, a1: int, b0: int, b1: int) -> bool:
    """Return whether polygon a (rows a0:a1) lies in polygon b (rows b0:b1)."""
    for k in range(a0, a1):
        if not inside(vertices[k, 0], vertices[k, 1], vertices, b0, b1):
            return False
    return True


@njit(cache=True)
def _project(  # noqa: C901 - one kernel, three plain loops
    corners: Floats, starts: Ints, matrix: Floats, shift: Floats, low: float, high: float
) -> tuple[Floats, Ints]:
    """Return a footprint as the arrays of `Polygons`: one hull a part, nested ones dropped.

    `corners` (n, 3) of all parts and `starts` (parts + 1,) as `asset_corners` returns them;
    `matrix` (3, 3) and `shift` (3,) move them into the house's frame.
    """
    moved = np.empty_like(corners)
    for k in range(len(corners)):
        for axis in range(3):
            moved[k, axis] = (
                matrix[axis, 0] * corners[k, 0]
                + matrix[axis, 1] * corners[k, 1]
                + matrix[axis, 2] * corners[k, 2]
                + shift[axis]
            )
    parts = len(starts) - 1
    vertices = np.empty((0, 2))
    offsets = np.zeros(parts + 1, dtype=np.int64)
    count = 0
    for part in range(parts):
        plan = _clipped(moved[starts[part] : starts[part + 1]], low, high)
        if len(plan) == 0:
            continue
        hull = convex_hull(plan)
        vertices = np.concatenate((vertices, hull))
        count += 1
        offsets[count] = len(vertices)
    # A polygon that was dropped drops no other: of two equal ones the first goes, the second stays.
    keep = np.ones(count, dtype=np.bool_)
    for a in range(count):
        for b in range(count):
            if a != b and keep[a] and keep[b]:
                keep[a] = not _contained(
                    vertices, offsets[a], offsets[a + 1], offsets[b], offsets[b + 1]
                )
    out = np.empty_like(vertices)
    out_offsets = np.zeros(count + 1, dtype=np.int64)
    size = 0
    kept = 0
    for a in range(count):
        if keep[a]:
            for k in range(offsets[a], offsets[a + 1]):
                out[size, 0], out[size, 1] = vertices[k, 0], vertices[k, 1]
                size += 1
            kept += 1
            out_offsets[kept] = size
    return out[:size].copy(), out_offsets[: kept + 1].copy()


def footprint(asset: Asset, pose: Pose) -> Polygons:
    """Return the footprint of an asset at a pose; empty where the asset does not block."""
    if not asset.blocks:
        return Polygons.of([])
    corners, starts = asset_corners(asset)
    shift = np.array([pose.x, pose.y, pose.z])
    vertices, offsets = _project(
        corners, starts, rotation_matrix(pose.quaternion), shift, LOWEST_M, HIGHEST_M
    )
    return Polygons(vertices, offsets)


def wall_footprints(walls: Iterable[Wall]) -> Polygons:
    """Return the rectangles of walls that block the agent (lintels hang above it)."""
    return Polygons.of(
        [(w.x_min, w.y_min), (w.x_max, w.y_min), (w.x_max, w.y_max), (w.x_min, w.y_max)]
        for w in walls
        if w.z_min < HIGHEST_M and w.z_max > LOWEST_M
    )


def house_footprints(house: House) -> Polygons:
    """Return the footprints of the walls, then of the furniture in order; no obstacles."""
    objects = (footprint(house.assets[o.asset_id], o.pose) for o in house.objects)
    return Polygons.joined([wall_footprints(house.walls), *objects])


@njit(cache=True)
def _bounds(vertices: Floats, offsets: Ints) -> Floats:
    """Return the bounding boxes of polygons: x_min, y_min, x_max, y_max, (polygons, 4) float64."""
    boxes = np.empty((len(offsets) - 1, 4))
    for polygon in range(len(boxes)):
        boxes[polygon, :2] = vertices[offsets[polygon]]
        boxes[polygon, 2:] = vertices[offsets[polygon]]
        for k in range(offsets[polygon] + 1, offsets[polygon + 1]):
            x, y = vertices[k, 0], vertices[k, 1]
            boxes[polygon, 0] = min(boxes[polygon, 0], x)
            boxes[polygon, 1] = min(boxes[polygon, 1], y)
            boxes[polygon, 2] = max(boxes[polygon, 2], x)
            boxes[polygon, 3] = max(boxes[polygon, 3], y)
    return boxes


@njit(cache=True)
def _clearance(first: Floats, starts: Ints, second: Floats, begins: Ints, stop_at: float) -> float:
    """Return the least distance of two groups given by the arrays of `Polygons`, or `stop_at`."""
    best = stop_at
    ours, theirs = _bounds(first, starts), _bounds(second, begins)
    for b in range(len(theirs)):
        for a in range(len(ours)):
            # A gap between bounding boxes is a lower bound, and nearly always large enough.
            gap = max(
                theirs[b, 0] - ours[a, 2],
                ours[a, 0] - theirs[b, 2],
                theirs[b, 1] - ours[a, 3],
                ours[a, 1] - theirs[b, 3],
            )
            if gap < best:
                best = min(
                    best,
                    polygon_distance(
                        first, starts[a], starts[a + 1], second, begins[b], begins[b + 1]
                    ),
                )
    return best


def clearance(first: Polygons, second: Polygons, stop_at: float = 1e6) -> float:
    """Return the distance between two groups of polygons, at most `stop_at`, metres."""
    return float(
        _clearance(first.vertices, first.offsets, second.vertices, second.offsets, stop_at)
    )
