"""Rooms as a graph: the room of a point, and every path from room to room."""

from __future__ import annotations

import heapq
from itertools import islice, pairwise, product
from math import prod
from typing import TYPE_CHECKING

import numpy as np

from internav_data.records import OUTSIDE, NodePath

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from internav_data.records import House, Vec2

PATHS_AT_MOST = 64
"""Maximum number of room paths and of node paths; further ones are left out, and flagged."""

RoomPath = tuple[int, ...]
"""Room ids from start to goal, no room twice."""


def _contains(polygon: Sequence[Vec2], x: float, y: float) -> bool:
    """Return whether a polygon holds a point: half-open, so that of tiles exactly one does."""
    odd = False
    previous = polygon[-1]
    for corner in polygon:
        # Rectilinear: only upright sides cross a ray along x, and each at its own x.
        if (previous[1] > y) != (corner[1] > y) and corner[0] > x:
            odd = not odd
        previous = corner
    return odd


def room_of(house: House, x: float, y: float) -> int:
    """Return the id of the room that holds a point (metres), OUTSIDE (-1) where none does.

    A point on the line between two rooms belongs to the one at larger x (upright lines) or larger
    y (level lines).
    """
    for room in house.rooms:
        if _contains(room.polygon, x, y):
            return room.room_id
    return OUTSIDE


def rooms_of(house: House, points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the rooms of many points, (n,) int64, as `room_of` does for one.

    `points` (n, 2) float64, metres.
    """
    x, y = points[:, 0], points[:, 1]
    found = np.full(len(points), OUTSIDE, dtype=np.int64)
    for room in reversed(house.rooms):
        odd = np.zeros(len(points), dtype=np.bool_)
        for a, b in zip((room.polygon[-1], *room.polygon[:-1]), room.polygon, strict=True):
            odd ^= ((a[1] > y) != (b[1] > y)) & (b[0] > x)
        found[odd] = room.room_id
    return found


def _neighbours(house: House) -> dict[int, list[int]]:
    out: dict[int, list[int]] = {room.room_id: [] for room in house.rooms}
    for a, b in sorted(set(house.room_graph)):
        out[a].append(b)
        out[b].append(a)
    return {room: sorted(others) for room, others in out.items()}


def _best_rest(
    graph: Mapping[int, Sequence[int]], prefix: RoomPath, goal: int, banned: frozenset[int]
) -> RoomPath | None:
    """Return the shortest simple path that begins with a prefix, the smallest ids among equals.

    `banned` are rooms that may not be the very next one.
    """
    if prefix[-1] == goal:
        return None if banned else prefix
    closed = set(prefix)
    rooms_left = {goal: 0}
    frontier = [goal]
    while frontier:
        following = []
        for room in frontier:
            for other in graph[room]:
                if other not in rooms_left and other not in closed:
                    rooms_left[other] = rooms_left[room] + 1
                    following.append(other)
        frontier = following
    path = prefix
    while path[-1] != goal:
        allowed = [
            (rooms_left[room], room)
            for room in graph[path[-1]]
            if room in rooms_left and not (len(path) == len(prefix) and room in banned)
        ]
        if not allowed:
            return None
        path = (*path, min(allowed)[1])
    return path


def room_paths(
    house: House, a: int, b: int, limit: int = PATHS_AT_MOST
) -> tuple[tuple[RoomPath, ...], bool]:
    """Return the paths from room a to room b through open doors, no room twice.

    Sorted by (number of rooms, room ids): the first `limit` of them, and whether there are more.

    Each path found splits the others by the room at which they leave it, and each part's own best
    is found by one breadth-first search (Lawler, "A procedure for computing the K best solutions to
    discrete optimization problems", 1972). So the work is bounded by limit x rooms searches,
    however many paths a dense graph has.
    """
    graph = _neighbours(house)
    first = _best_rest(graph, (a,), b, frozenset())
    # (rooms, path, length of the fixed prefix, rooms banned right behind it)
    heap: list[tuple[int, RoomPath, int, frozenset[int]]] = []
    if first is not None:
        heap.append((len(first), first, 1, frozenset()))
    found: list[RoomPath] = []
    while heap and len(found) <= limit:
        _, path, fixed, banned = heapq.heappop(heap)
        found.append(path)
        for cut in range(fixed, len(path)):
            not_next = frozenset((path[cut],)) | (banned if cut == fixed else frozenset())
            rest = _best_rest(graph, path[:cut], b, not_next)
            if rest is not None:
                heapq.heappush(heap, (len(rest), rest, cut, not_next))
    return tuple(found[:limit]), len(found) > limit


def node_paths(
    house: House,
    start_xy: Vec2,
    goal_xy: Vec2,
    paths: Iterable[RoomPath],
    limit: int = PATHS_AT_MOST,
) -> tuple[tuple[NodePath, ...], bool]:
    """Return every choice of open doors along each room path: start, door centres, goal.

    In the order of `paths`, then of door ids: the first `limit`, and whether there are more.
    Positions in metres.
    """
    doors: dict[tuple[int, int], list[int]] = {}
    centres: dict[int, Vec2] = {}
    for door in house.doors:
        if door.open:
            low, high = sorted(door.rooms)
            doors.setdefault((low, high), []).append(door.door_id)
            centres[door.door_id] = (door.x, door.y)
    found: list[NodePath] = []
    total = 0
    for path in paths:
        choices = [sorted(doors.get((min(s), max(s)), [])) for s in pairwise(path)]
        total += prod(len(c) for c in choices)
        for ids in islice(product(*choices), limit - len(found)):
            points = (start_xy, *(centres[i] for i in ids), goal_xy)
            found.append(NodePath(doors=ids, points=points))
    return tuple(found), total > limit
