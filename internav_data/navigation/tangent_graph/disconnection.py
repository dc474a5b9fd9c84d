"""Disconnection: exact proof that obstacles close every path of the disc between two points.

The disc passes between two convex polygons exactly when they are two radii apart. Nearer ones are
linked: no path of the disc crosses the line between them. Obstacles and the house's own polygons
form a graph of links, and start and goal are apart exactly when some cycle of it winds round one of
them only, that is, crosses any curve from start to goal an odd number of times. With a path that
was clear before the obstacles came as that curve, links of the house are crossed zero times and
each cluster of its polygons shrinks to one node, so only the obstacles' few links are looked at.

A union-find that stores the parity of crossings from each node to its root finds such a cycle.
Arrays of polygons are those of `boundary_arcs`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from internav_data.geometry.planar import cross, inside, segments_cross
from internav_data.navigation.tangent_graph.boundary_arcs import near_ids, nearest

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints


@njit(cache=True)
def root_of(parent: Ints, parity: Ints, k: int) -> tuple[int, int]:
    """Return the root of node k's set and the parity of crossings on the chain of parents to it.

    `parent` and `parity` are (nodes,) int64. Every node of the chain is linked straight to the root
    (path compression).
    """
    root, odd = k, 0
    while parent[root] != root:
        odd ^= parity[root]
        root = parent[root]
    left = odd
    while parent[k] != root and k != root:
        following, step = parent[k], parity[k]
        parent[k], parity[k] = root, left
        left ^= step
        k = following
    return root, odd


@njit(cache=True)
def unite(parent: Ints, parity: Ints, a: int, b: int, odd: int) -> bool:
    """Link nodes a and b by a curve of parity `odd`; return False where that closes an odd cycle.

    `parent` and `parity` are (nodes,) int64.
    """
    root_a, odd_a = root_of(parent, parity, a)
    root_b, odd_b = root_of(parent, parity, b)
    if root_a == root_b:
        return (odd_a ^ odd_b) == odd
    parent[root_b] = root_a
    parity[root_b] = odd_a ^ odd_b ^ odd
    return True


@njit(cache=True)
def closest(
    first: Floats, start: int, stop: int, second: Floats, begin: int, end: int
) -> tuple[float, float, float, float, float]:
    """Return the distance of two convex polygons and a point of each that far apart, metres.

    The polygons are `first[start:stop]` and `second[begin:end]`, (n, 2) float64, metres; returned
    are distance, x and y on the first, x and y on the second.
    """
    best, px, py, qx, qy = math.inf, 0.0, 0.0, 0.0, 0.0
    for k in range(start, stop):
        x, y = first[k, 0], first[k, 1]
        if inside(x, y, second, begin, end):
            return 0.0, x, y, x, y
        bx, by, d = nearest(x, y, second, begin, end)
        if d < best:
            best, px, py, qx, qy = d, x, y, bx, by
    for k in range(begin, end):
        x, y = second[k, 0], second[k, 1]
        if inside(x, y, first, start, stop):
            return 0.0, x, y, x, y
        ax, ay, d = nearest(x, y, first, start, stop)
        if d < best:
            best, px, py, qx, qy = d, ax, ay, x, y
    # No corner of either inside the other, and yet they may cross like two bars.
    previous = stop - 1
    for k in range(start, stop):
        ax, ay, bx, by = first[previous, 0], first[previous, 1], first[k, 0], first[k, 1]
        previous = k
        before = end - 1
        for m in range(begin, end):
            cx, cy, dx, dy = second[before, 0], second[before, 1], second[m, 0], second[m, 1]
            before = m
            if segments_cross(ax, ay, bx, by, cx, cy, dx, dy):
                side = cross(bx - ax, by - ay, dx - cx, dy - cy)
                t = cross(cx - ax, cy - ay, dx - cx, dy - cy) / side
                x, y = ax + t * (bx - ax), ay + t * (by - ay)
                return 0.0, x, y, x, y
    return best, px, py, qx, qy


@njit(cache=True)
def clusters(vertices: Floats, offsets: Ints, boxes: Floats, gap: float) -> Ints:
    """Return the cluster of every polygon, (polygons,) int64: the number of one of its polygons.

    Polygons less than `gap` metres from each other share a cluster.
    """
    count = len(boxes)
    parent, parity = np.arange(count), np.zeros(count, dtype=np.int64)
    for a in range(count):
        for b in near_ids(boxes, boxes[a], gap):
            if b > a:
                d, _, _, _, _ = closest(
                    vertices, offsets[a], offsets[a + 1], vertices, offsets[b], offsets[b + 1]
                )
                if d < gap:
                    unite(parent, parity, a, b, 0)
    for a in range(count):
        parent[a], _ = root_of(parent, parity, a)
    return parent


@njit(cache=True)
def _crossings(path: Floats, ax: float, ay: float, bx: float, by: float) -> int:
    odd = 0
    for k in range(len(path) - 1):
        if segments_cross(path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1], ax, ay, bx, by):
            odd ^= 1
    return odd


@njit(cache=True)
def disconnects(
    path: Floats,
    vertices: Floats,
    offsets: Ints,
    boxes: Floats,
    labels: Ints,
    added: Floats,
    added_offsets: Ints,
    added_boxes: Floats,
    gap: float,
) -> bool:
    """Return whether added polygons disconnect the ends of a path that was clear without them.

    Parameters
    ----------
    path
        Points (n, 2) float64, metres, on no corner of any polygon.
    vertices, offsets, boxes
        Polygons that were there before.
    labels
        Their clusters, (polygons,) int64, as `clusters` returns them.
    added, added_offsets, added_boxes
        Polygons that come, as vertices, offsets and boxes.
    gap
        Two radii of the disc, metres: nearer polygons let nothing pass.
    """
    count, new = len(boxes), len(added_boxes)
    parent, parity = np.arange(count + new), np.zeros(count + new, dtype=np.int64)
    middles = np.empty((new, 2))
    for a in range(new):
        middles[a, 0] = added[added_offsets[a] : added_offsets[a + 1], 0].mean()
        middles[a, 1] = added[added_offsets[a] : added_offsets[a + 1], 1].mean()
    for a in range(new):
        start, stop = added_offsets[a], added_offsets[a + 1]
        for b in near_ids(boxes, added_boxes[a], gap):
            d, px, py, qx, qy = closest(added, start, stop, vertices, offsets[b], offsets[b + 1])
            if d < gap:
                # From an obstacle's middle to its own nearest point, then over the gap. Inside the
                # house's cluster no further crossings are counted: the path was clear of it.
                odd = _crossings(path, middles[a, 0], middles[a, 1], px, py)
                odd ^= _crossings(path, px, py, qx, qy)
                if not unite(parent, parity, labels[b], count + a, odd):
                    return True
        for b in near_ids(added_boxes, added_boxes[a], gap):
            if b <= a:
                continue
            d, px, py, qx, qy = closest(
                added, start, stop, added, added_offsets[b], added_offsets[b + 1]
            )
            if d < gap:
                odd = _crossings(path, middles[a, 0], middles[a, 1], px, py)
                odd ^= _crossings(path, px, py, qx, qy)
                odd ^= _crossings(path, qx, qy, middles[b, 0], middles[b, 1])
                if not unite(parent, parity, count + b, count + a, odd):
                    return True
    return False
