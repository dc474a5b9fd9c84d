"""Numba kernels of the lattice: blocker counts of nodes and edges, and steps between nodes.

One array holds the lattice: blockers (3, nx, ny) int32 counts the polygons that block node (i, j)
[0], its edge to (i + 1, j) [1] and its edge to (i, j + 1) [2]. Edges that leave the lattice are
blocked for good. That border lets the searches skip all bounds checks: an index before the first
row wraps round to the last one, whose outgoing edges are closed.

`spacing` is the distance of neighbouring nodes in metres; node (i, j) lies at (i, j) * spacing.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from internav_data.geometry.planar import (
    cross,
    point_polygon_distance,
    segment_polygon_distance,
)

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints, Ints32

NODE, EAST, NORTH = 0, 1, 2
"""First index of blockers: a node, its edge to +x, its edge to +y."""


@njit(cache=True)
def mark(  # noqa: C901, PLR0912 - one pass over a window, spelt out for speed
    blockers: Ints32,
    vertices: Floats,
    offsets: Ints,
    spacing: float,
    radius: float,
    step: int,
) -> None:
    """Add `step` to the count of every node and edge on which a disc comes too near a polygon.

    Each polygon costs only the window of nodes around its bounding box.

    Parameters
    ----------
    blockers
        Counts, (3, nx, ny) int32; changed in place.
    vertices, offsets
        Convex polygons: (n, 2) float64, metres; (polygons + 1,) int64.
    spacing, radius
        Distance of nodes; distance at which a polygon blocks no more, metres.
    step
        1 to add polygons, -1 to remove them.
    """
    nx, ny = blockers.shape[1], blockers.shape[2]
    for k in range(len(offsets) - 1):
        start, stop = offsets[k], offsets[k + 1]
        if stop == start:
            continue
        low_x = high_x = vertices[start, 0]
        low_y = high_y = vertices[start, 1]
        for v in range(start + 1, stop):
            low_x, high_x = min(low_x, vertices[v, 0]), max(high_x, vertices[v, 0])
            low_y, high_y = min(low_y, vertices[v, 1]), max(high_y, vertices[v, 1])
        # One node more on each side: its edge may reach the window though it does not.
        i0 = max(0, math.floor((low_x - radius) / spacing))
        i1 = min(nx - 1, math.ceil((high_x + radius) / spacing))
        j0 = max(0, math.floor((low_y - radius) / spacing))
        j1 = min(ny - 1, math.ceil((high_y + radius) / spacing))
        if i0 > i1 or j0 > j1:
            continue
        distance = np.empty((i1 - i0 + 1, j1 - j0 + 1))
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                d = point_polygon_distance(i * spacing, j * spacing, vertices, start, stop)
                distance[i - i0, j - j0] = d
                if d < radius:
                    blockers[NODE, i, j] += step
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                here = distance[i - i0, j - j0]
                for direction in (EAST, NORTH):
                    a, b = (i + 1, j) if direction == EAST else (i, j + 1)
                    if a > i1 or b > j1:
                        continue
                    there = distance[a - i0, b - j0]
                    blocked = here < radius or there < radius
                    # Along an edge the distance changes by at most the length gone: where both ends
                    # are far, so is the edge.
                    if not blocked and here + there < 2.0 * radius + spacing:
                        x, y, e, f = i * spacing, j * spacing, a * spacing, b * spacing
                        d = segment_polygon_distance(x, y, e, f, vertices, start, stop)
                        blocked = d < radius
                    if blocked:
                        blockers[direction, i, j] += step


@njit(cache=True)
def in_outline(x: float, y: float, outline: Floats) -> bool:
    """Return whether a point lies in or on a simple polygon, (n, 2) float64, metres.

    Crossing number of a ray along +x.
    """
    odd = False
    previous = len(outline) - 1
    for k in range(len(outline)):
        ax, ay = outline[previous, 0], outline[previous, 1]
        bx, by = outline[k, 0], outline[k, 1]
        side = cross(bx - ax, by - ay, x - ax, y - ay)
        if side == 0.0 and min(ax, bx) <= x <= max(ax, bx) and min(ay, by) <= y <= max(ay, by):
            return True
        if (ay > y) != (by > y) and (side > 0.0) == (by > ay):
            odd = not odd
        previous = k
    return odd


@njit(cache=True)
def _leaves(ax: float, ay: float, bx: float, by: float, outline: Floats) -> bool:
    """Return whether segment ab, whose ends lie in or on an outline, leaves it in between.

    Unlike `planar.segments_cross`, which settles ties one way, touching is not crossing here.
    """
    previous = len(outline) - 1
    for k in range(len(outline)):
        cx, cy, dx, dy = outline[previous, 0], outline[previous, 1], outline[k, 0], outline[k, 1]
        previous = k
        first = cross(bx - ax, by - ay, cx - ax, cy - ay)
        second = cross(bx - ax, by - ay, dx - ax, dy - ay)
        third = cross(dx - cx, dy - cy, ax - cx, ay - cy)
        fourth = cross(dx - cx, dy - cy, bx - cx, by - cy)
        if first * second < 0.0 and third * fourth < 0.0:
            return True
    return not in_outline((ax + bx) / 2.0, (ay + by) / 2.0, outline)


@njit(cache=True)
def close_outside(  # noqa: C901 - nodes, their edges, then edges along each side
    blockers: Ints32, outline: Floats, spacing: float
) -> None:
    """Block for good all nodes outside an outline and all edges that leave it or the lattice.

    `blockers` (3, nx, ny) int32 is changed in place; `outline` (n, 2) float64, metres.
    """
    nx, ny = blockers.shape[1], blockers.shape[2]
    for i in range(nx):
        for j in range(ny):
            if not in_outline(i * spacing, j * spacing, outline):
                blockers[:, i, j] = 1
                if i > 0:
                    blockers[EAST, i - 1, j] = 1
                if j > 0:
                    blockers[NORTH, i, j - 1] = 1
    previous = len(outline) - 1
    for k in range(len(outline)):
        ax, ay, bx, by = outline[previous, 0], outline[previous, 1], outline[k, 0], outline[k, 1]
        previous = k
        # An edge between two nodes inside can leave the outline only across a side near it.
        for i in range(
            max(0, math.floor(min(ax, bx) / spacing)), min(nx, math.ceil(max(ax, bx) / spacing) + 1)
        ):
            for j in range(
                max(0, math.floor(min(ay, by) / spacing)),
                min(ny, math.ceil(max(ay, by) / spacing) + 1),
            ):
                x, y = i * spacing, j * spacing
                if blockers[EAST, i, j] == 0 and _leaves(x, y, x + spacing, y, outline):
                    blockers[EAST, i, j] = 1
                if blockers[NORTH, i, j] == 0 and _leaves(x, y, x, y + spacing, outline):
                    blockers[NORTH, i, j] = 1
    blockers[EAST, nx - 1, :] = 1
    blockers[NORTH, :, ny - 1] = 1


@njit(cache=True)
def _spread(
    blockers: Ints32,
    steps: Ints32,
    queue: Ints32,
    first: int,
    value: int,
    stride: int,
    until: int,
) -> None:
    """Flood from one node over open edges; each node gets its source's value + stride.

    Stops early once node `until` has its value; -1 floods all.
    """
    ny = blockers.shape[2]
    east = blockers[EAST].ravel()
    north = blockers[NORTH].ravel()
    flat = steps.ravel()
    flat[first] = value
    queue[0] = first
    head, tail = 0, 1
    while head < tail:
        k = queue[head]
        if k == until:
            return
        head += 1
        following = flat[k] + stride
        # k - ny and k - 1 wrap round before the first node: see the module's docstring.
        if east[k] == 0 and flat[k + ny] < 0:
            flat[k + ny] = following
            queue[tail] = k + ny
            tail += 1
        if east[k - ny] == 0 and flat[k - ny] < 0:
            flat[k - ny] = following
            queue[tail] = k - ny
            tail += 1
        if north[k] == 0 and flat[k + 1] < 0:
            flat[k + 1] = following
            queue[tail] = k + 1
            tail += 1
        if north[k - 1] == 0 and flat[k - 1] < 0:
            flat[k - 1] = following
            queue[tail] = k - 1
            tail += 1


@njit(cache=True)
def steps_to(blockers: Ints32, i: int, j: int) -> Ints32:
    """Return the steps from every node to node (i, j), (nx, ny) int32; -1 where cut off.

    `blockers` (3, nx, ny) int32. Breadth-first.
    """
    nx, ny = blockers.shape[1], blockers.shape[2]
    steps = np.full((nx, ny), -1, dtype=np.int32)
    if blockers[NODE, i, j] == 0:
        _spread(blockers, steps, np.empty(nx * ny, dtype=np.int32), i * ny + j, 0, 1, -1)
    return steps


@njit(cache=True)
def steps_between(blockers: Ints32, i: int, j: int, a: int, b: int) -> int:
    """Return the steps from node (i, j) to node (a, b); -1 where cut off.

    `blockers` (3, nx, ny) int32. Breadth-first, up to the second node.
    """
    nx, ny = blockers.shape[1], blockers.shape[2]
    steps = np.full((nx, ny), -1, dtype=np.int32)
    if blockers[NODE, i, j] == 0 and blockers[NODE, a, b] == 0:
        queue = np.empty(nx * ny, dtype=np.int32)
        _spread(blockers, steps, queue, i * ny + j, 0, 1, a * ny + b)
    return steps[a, b]


@njit(cache=True)
def components(blockers: Ints32) -> Ints32:
    """Return the component of every node, (nx, ny) int32; -1 where blocked.

    Components are numbered in order of their first node; `blockers` (3, nx, ny) int32.
    """
    nx, ny = blockers.shape[1], blockers.shape[2]
    labels = np.full((nx, ny), -1, dtype=np.int32)
    queue = np.empty(nx * ny, dtype=np.int32)
    count = 0
    for k in range(nx * ny):
        if blockers[NODE, k // ny, k % ny] == 0 and labels[k // ny, k % ny] < 0:
            _spread(blockers, labels, queue, k, count, 0, -1)
            count += 1
    return labels


@njit(cache=True)
def open_edge(blockers: Ints32, i: int, j: int, direction: int) -> bool:
    """Return whether a step from node (i, j) is free: direction 0 to +x, 1 to +y, 2 to -x, 3 to -y.

    `blockers` (3, nx, ny) int32.
    """
    if direction == 0:
        return blockers[EAST, i, j] == 0
    if direction == 1:
        return blockers[NORTH, i, j] == 0
    if direction == 2:  # noqa: PLR2004 - the third quarter turn
        return i > 0 and blockers[EAST, i - 1, j] == 0
    return j > 0 and blockers[NORTH, i, j - 1] == 0


@njit(cache=True)
def descend(blockers: Ints32, steps: Ints32, i: int, j: int) -> Ints:
    """Return nodes (n, 2) int64 of a shortest path from node (i, j), straight on where possible.

    `blockers` (3, nx, ny) int32; `steps` (nx, ny) int32 as `steps_to` returns them.
    """
    path = np.empty((steps[i, j] + 1, 2), dtype=np.int64)
    direction = 0
    for k in range(len(path)):
        path[k, 0], path[k, 1] = i, j
        for turn in range(4):
            candidate = (direction + turn) % 4
            a = i + (candidate == 0) - (candidate == 2)  # noqa: PLR2004
            b = j + (candidate == 1) - (candidate == 3)  # noqa: PLR2004
            if open_edge(blockers, i, j, candidate) and steps[a, b] == steps[i, j] - 1:
                i, j, direction = a, b, candidate
                break
    return path
