"""Tests of fit in numba: boxes of furniture in a room, no overlap, doors clear, floor passable.

All tests use the bounding boxes of items and a square instead of the agent's disc. A pose that
passes here passes the exact lattice too: bounding boxes hold the true footprints and the square
holds the disc, and no box inflated by 0.2 m is thinner than the 0.25 m between two nodes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

from internav_data.geometry import HIGHEST_M, LOWEST_M
from internav_data.records.agent import CLEARANCE_M, SPACING_M

if TYPE_CHECKING:
    from internav_data.core.typing import Bools, Floats, Ints

GAP_M = 0.02
"""Smallest distance between items of different groups."""
FROM_WALL_M = 0.005
"""Smallest distance between an item and a wall."""


class GroupBoxes(NamedTuple):
    """Boxes of a furniture group in its own frame: x0, y0, x1, y1, z0, z1 in metres."""

    items: Floats
    """(k, 6) float64: bounding boxes of the items."""
    blocking: Bools
    """(k,) bool: the items that the agent's disc keeps clear of."""
    fronts: Floats
    """(q, 6) float64: boxes before the items that stay clear."""


class RoomBoxes(NamedTuple):
    """Boxes of a room: x0, y0, x1, y1, z0, z1 in metres."""

    inner: Floats
    """(4,) float64: the room's bounding box between wall faces."""
    solids: Floats
    """(n, 6) float64: placed items, and walls inside the bounding box."""
    keep_out: Floats
    """(m, 6) float64: boxes that stay clear of items."""


class FreeNodes(NamedTuple):
    """Lattice nodes of a room that are free for the agent's disc, and what must remain of them."""

    free: Bools
    """(nx, ny) bool, changed in place as items are placed."""
    origin: Ints
    """(2,) int64: lattice indices of `free[0, 0]`."""
    door_cells: Ints
    """(doors, 2) int64: indices in `free` of one node at each door."""
    min_free: int
    """Smallest allowed number of free nodes joined to the doors."""
    min_joined: float
    """Smallest allowed share of the free nodes that are joined to the doors."""


@njit(cache=True)
def turn_box(box: Floats, x: float, y: float, turn: int, out: Floats) -> None:
    """Turn a box (6,) by quarter turns about the origin, move it by (x, y) m, write it to `out`."""
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
def hits(box: Floats, boxes: Floats, gap: float) -> bool:
    """Return whether a box (6,) comes nearer than a gap in plan to one of boxes (n, 6).

    Only boxes that overlap it in height count. Coordinates and gap are metres.
    """
    for k in range(len(boxes)):
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
    """Return whether boxes (n, 6) come nearer than a gap (m) in plan to others at the same height.

    A box that lies on another does not touch it: heights may meet.
    """
    lifted = np.empty(6)
    for k in range(len(first)):
        lifted[:] = first[k]
        # A tenth of a millimetre forgives the last bits of heights.
        lifted[4] += 1e-4
        lifted[5] -= 1e-4
        if hits(lifted, second, gap):
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
    """Clear the nodes of `free` (nx, ny) that a box (6,) takes from the agent.

    A square of the disc's radius stands for the disc: the nodes on the box's rounded corners are
    taken too.
    """
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
    """Return the nodes (nx, ny) that are joined to a start over four neighbours, as bool."""
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
def doors_connected(free: Bools, door_cells: Ints, min_free: int, min_joined: float) -> bool:
    """Return whether all doors are joined, and enough of the free nodes with them.

    Parameters
    ----------
    free
        (nx, ny) bool: nodes free for the disc.
    door_cells
        (doors, 2) int64: one node at each door.
    min_free, min_joined
        Smallest number of joined nodes, and their smallest share of the free ones.
    """
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
    return count >= min_free and count >= min_joined * total


@njit(cache=True)
def _is_free(moved: Floats, room: RoomBoxes) -> bool:
    """Return whether boxes (k, 6) lie in the room, apart from its solids and keep-out boxes."""
    for k in range(len(moved)):
        if (
            not _within(moved[k], room.inner, FROM_WALL_M)
            or hits(moved[k], room.solids, GAP_M)
            or hits(moved[k], room.keep_out, 0.0)
        ):
            return False
    return True


@njit(cache=True)
def _fronts_clear(fronts: Floats, x: float, y: float, turn: int, room: RoomBoxes) -> bool:
    """Return whether the boxes before a group, moved to a pose, are in the room and empty."""
    box = np.empty(6)
    for k in range(len(fronts)):
        turn_box(fronts[k], x, y, turn, box)
        if not _within(box, room.inner, 0.0) or hits(box, room.solids, 0.0):
            return False
    return True


@njit(cache=True)
def _stays_connected(moved: Floats, blocking: Bools, nodes: FreeNodes) -> bool:
    """Return whether the room stays passable with boxes (k, 6) in it."""
    trial = nodes.free.copy()
    for k in range(len(moved)):
        if blocking[k]:
            mark_blocked(trial, nodes.origin, moved[k])
    return doors_connected(trial, nodes.door_cells, nodes.min_free, nodes.min_joined)


@njit(cache=True)
def first_fit(poses: Floats, group: GroupBoxes, room: RoomBoxes, nodes: FreeNodes) -> int:
    """Return the index of the first pose at which a group fits, -1 for none.

    Parameters
    ----------
    poses
        (m, 3) float64: x and y in metres, quarter turns; the preferred pose first.
    group
        Boxes of the group in its own frame.
    room
        Boxes of the room. The cheap tests against them come first.
    nodes
        Free nodes of the room: the flood fill over them is the expensive test.
    """
    moved = np.empty_like(group.items)
    for m in range(len(poses)):
        x, y, turn = poses[m, 0], poses[m, 1], int(poses[m, 2])
        for k in range(len(moved)):
            turn_box(group.items[k], x, y, turn, moved[k])
        if (
            _is_free(moved, room)
            and _fronts_clear(group.fronts, x, y, turn, room)
            and _stays_connected(moved, group.blocking, nodes)
        ):
            return m
    return -1
