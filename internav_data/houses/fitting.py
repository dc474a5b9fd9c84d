"""Does it fit? Boxes in a room, tested in numba: no overlap, doors clear, every way still open.

All tests use the bounding boxes of things and a square instead of the agent's disc. What passes
here passes the exact lattice too: bounding boxes hold the true footprints and the square holds the
disc, and no box inflated by 0.2 m is thinner than the 0.25 m between two nodes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from internav_data.geometry import HIGHEST_M, LOWEST_M
from internav_data.records.agent import CLEARANCE_M, SPACING_M

if TYPE_CHECKING:
    from internav_data.core.typing import Bools, Floats, Ints

GAP_M = 0.02
"""Least distance between things of different groups."""
FROM_WALL_M = 0.005
"""Least distance between a thing and a wall."""


@njit(cache=True)
def turn_box(box: Floats, x: float, y: float, turn: int, out: Floats) -> None:
    """Write a box (x0, y0, x1, y1, z0, z1), turned by quarter turns and moved to (x, y)."""
    if turn == 0:
        out[0], out[1], out[2], out[3] = box[0], box[1], box[2], box[3]
    elif turn == 1:
        out[0], out[1], out[2], out[3] = -box[3], box[0], -box[1], box[2]
    elif turn == 2:  # noqa: PLR2004 - quarter turns
        out[0], out[1], out[2], out[3] = -box[2], -box[3], -box[0], -box[1]
    else:
        out[0], out[1], out[2], out[3] = box[1], -box[2], box[3], -box[0]
    out[0] += x
    out[2] += x
    out[1] += y
    out[3] += y
    out[4], out[5] = box[4], box[5]


@njit(cache=True)
def hits(box: Floats, boxes: Floats, count: int, gap: float) -> bool:
    """Whether a box comes nearer than a gap (in plan) to one of some boxes at its height."""
    for k in range(count):
        other = boxes[k]
        if (
            box[0] < other[2] + gap
            and other[0] < box[2] + gap
            and box[1] < other[3] + gap
            and other[1] < box[3] + gap
            and box[4] < other[5]
            and other[4] < box[5]
        ):
            return True
    return False


@njit(cache=True)
def any_overlap(first: Floats, second: Floats, gap: float) -> bool:
    """Whether boxes (n, 6) come nearer than a gap in plan to others at the same height.

    What lies on a box does not touch it: heights may meet.
    """
    lifted = np.empty(6)
    for k in range(len(first)):
        lifted[:] = first[k]
        # A tenth of a millimetre forgives the last bits of heights.
        lifted[4] += 1e-4
        lifted[5] -= 1e-4
        if hits(lifted, second, len(second), gap):
            return True
    return False


@njit(cache=True)
def _within(box: Floats, inner: Floats, gap: float) -> bool:
    return bool(
        box[0] >= inner[0] + gap
        and box[1] >= inner[1] + gap
        and box[2] <= inner[2] - gap
        and box[3] <= inner[3] - gap
    )


@njit(cache=True)
def mark_blocked(free: Bools, origin: Ints, box: Floats) -> None:
    """Mark the nodes that a box takes from the agent."""
    if box[4] >= HIGHEST_M or box[5] <= LOWEST_M:
        return
    reach = CLEARANCE_M
    for i in range(free.shape[0]):
        x = (origin[0] + i) * SPACING_M
        if box[0] - reach < x < box[2] + reach:
            for j in range(free.shape[1]):
                y = (origin[1] + j) * SPACING_M
                if box[1] - reach < y < box[3] + reach:
                    free[i, j] = False


@njit(cache=True)
def flood_fill(free: Bools, start_i: int, start_j: int) -> Bools:
    """Nodes joined to a start, over four neighbours."""
    seen = np.zeros_like(free)
    if not free[start_i, start_j]:
        return seen
    queue = np.empty((free.size, 2), dtype=np.int64)
    queue[0, 0], queue[0, 1] = start_i, start_j
    seen[start_i, start_j] = True
    head, tail = 0, 1
    while head < tail:
        i, j = queue[head, 0], queue[head, 1]
        head += 1
        for k in range(4):
            a = i + (1 if k == 0 else -1 if k == 1 else 0)
            b = j + (1 if k == 2 else -1 if k == 3 else 0)  # noqa: PLR2004 - four directions
            if 0 <= a < free.shape[0] and 0 <= b < free.shape[1] and free[a, b] and not seen[a, b]:
                seen[a, b] = True
                queue[tail, 0], queue[tail, 1] = a, b
                tail += 1
    return seen


@njit(cache=True)
def doors_connected(free: Bools, door_cells: Ints, min_free: int, share: float) -> bool:
    """Whether all doors are joined and enough of the free nodes with them."""
    total = 0
    for i in range(free.shape[0]):
        for j in range(free.shape[1]):
            total += free[i, j]
    if total < min_free:
        return False
    if len(door_cells) == 0:
        return True
    seen = flood_fill(free, door_cells[0, 0], door_cells[0, 1])
    for k in range(len(door_cells)):
        if not seen[door_cells[k, 0], door_cells[k, 1]]:
            return False
    count = 0
    for i in range(free.shape[0]):
        for j in range(free.shape[1]):
            count += seen[i, j]
    return count >= min_free and count >= share * total


@njit(cache=True)
def _is_free(
    moved: Floats,
    inner: Floats,
    solids: Floats,
    solid_count: int,
    keep_out_boxes: Floats,
    keep_out_count: int,
) -> bool:
    """Whether boxes lie in the room, apart from what stands there and what must stay clear."""
    for k in range(len(moved)):
        if (
            not _within(moved[k], inner, FROM_WALL_M)
            or hits(moved[k], solids, solid_count, GAP_M)
            or hits(moved[k], keep_out_boxes, keep_out_count, 0.0)
        ):
            return False
    return True


@njit(cache=True)
def _stays_connected(
    moved: Floats,
    blocking: Bools,
    free: Bools,
    origin: Ints,
    door_cells: Ints,
    min_free: int,
    share: float,
) -> bool:
    trial = free.copy()
    for k in range(len(moved)):
        if blocking[k]:
            mark_blocked(trial, origin, moved[k])
    return doors_connected(trial, door_cells, min_free, share)


@njit(cache=True)
def first_fit(
    poses: Floats,
    items: Floats,
    blocking: Bools,
    fronts: Floats,
    inner: Floats,
    solids: Floats,
    solid_count: int,
    keep_out_boxes: Floats,
    keep_out_count: int,
    free: Bools,
    origin: Ints,
    door_cells: Ints,
    min_free: int,
    share: float,
) -> int:
    """Index of the first spot where a group fits, -1 for none.

    Shapes: spots (m, 3): x, y, quarter turns; items (k, 6) and fronts (q, 6) in the group's frame;
    inner (4,): the room's bounding box between wall faces; solids and keeps (n, 6): what stands in
    the room (its inner walls too) and what must stay clear; free (nx, ny); anchors (doors, 2).
    """
    box = np.empty(6)
    moved = np.empty_like(items)
    for m in range(len(poses)):
        x, y, turn = poses[m, 0], poses[m, 1], int(poses[m, 2])
        for k in range(len(items)):
            turn_box(items[k], x, y, turn, moved[k])
        if not _is_free(moved, inner, solids, solid_count, keep_out_boxes, keep_out_count):
            continue
        good = True
        for k in range(len(fronts)):
            turn_box(fronts[k], x, y, turn, box)
            if not _within(box, inner, 0.0) or hits(box, solids, solid_count, 0.0):
                good = False
                break
        if good and _stays_connected(moved, blocking, free, origin, door_cells, min_free, share):
            return m
    return -1
