"""Doors between rooms: the walls in which one is possible, and the pairs of rooms that get one.

The doors of a house are a spanning tree of its rooms (every room can be reached) and further doors
that close loops (there is more than one path).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from internav_data.houses.room_types import ROOM_PAIRS, ROOM_TYPES, type_pair
from internav_data.houses.standards import DOOR_CLEAR_CM, HALF_WALL_CM
from internav_data.records import OUTSIDE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.random import Generator

    from internav_data.houses.plan import FloorGrid, RoomEdge, WallSegment

JAMB_CM = 10
"""Smallest distance of an opening from the centre line of a wall that meets its own."""
DEPTH_CM = HALF_WALL_CM + DOOR_CLEAR_CM + HALF_WALL_CM
"""Centre-line depth that a room needs behind a door."""

_UNKNOWN_COST = (1.2, 4.0, 14.0)
"""Door costs of pairs without an entry, by the number of private rooms among the two."""


@dataclass(frozen=True, slots=True)
class WallSpan:
    """Stretch of wall in which an opening may lie; centimetres."""

    along_x: bool
    at: int
    """y of a wall along x, x of one along y."""
    low: int
    high: int

    @property
    def length(self) -> int:
        """Length, centimetres."""
        return self.high - self.low


def door_cost(first: str, second: str) -> float:
    """Return the cost of a door between two types of room: unusual doors are dear."""
    key = type_pair(first, second)
    if key in ROOM_PAIRS:
        return ROOM_PAIRS[key].door_cost
    return _UNKNOWN_COST[ROOM_TYPES[first].private + ROOM_TYPES[second].private]


def _deep_enough(grid: FloorGrid, segment: WallSegment, m: int, side: int) -> bool:
    """Return whether the room on one side (-1, +1) of a wall is deep enough beside grid line m."""
    lines = grid.ys if segment.along_x else grid.xs
    room = segment.before if side < 0 else segment.after
    if room == OUTSIDE:
        return True
    k = lines.index(segment.at)
    # Walk away from the wall, cell by cell, until the depth is reached or the room ends.
    step = -1 if side < 0 else 0
    while 0 <= k + step < len(lines) - 1:
        owner = grid.at(m, k + step) if segment.along_x else grid.at(k + step, m)
        if owner != room:
            return False
        far = lines[k + step] if side < 0 else lines[k + step + 1]
        if abs(far - segment.at) >= DEPTH_CM:
            return True
        step += side
    return False


def spans(grid: FloorGrid, segment: WallSegment) -> list[WallSpan]:
    """Return the stretches of a wall where doors have their clear depth on both sides."""
    stops = grid.xs if segment.along_x else grid.ys
    out: list[WallSpan] = []
    # A run of good grid cells is one span: `start` is where the present run begins.
    start: int | None = None
    for m in range(len(stops) - 1):
        if stops[m] < segment.low or stops[m] >= segment.high:
            continue
        good = _deep_enough(grid, segment, m, -1) and _deep_enough(grid, segment, m, 1)
        if good and start is None:
            start = stops[m]
        if start is not None and (not good or stops[m + 1] >= segment.high):
            end = stops[m + 1] if good else stops[m]
            if end - start > 2 * JAMB_CM:
                out.append(WallSpan(segment.along_x, segment.at, start + JAMB_CM, end - JAMB_CM))
            start = None
    return out


def possible_doors(grid: FloorGrid, width_cm: int) -> dict[RoomEdge, list[WallSpan]]:
    """Return the wall spans of at least a width by pair of rooms, ascending, longest span first."""
    out: dict[RoomEdge, list[WallSpan]] = {}
    for segment in grid.segments:
        if OUTSIDE in {segment.before, segment.after} or segment.length < width_cm:
            continue
        rooms = (min(segment.before, segment.after), max(segment.before, segment.after))
        for span in spans(grid, segment):
            if span.length >= width_cm:
                out.setdefault(rooms, []).append(span)
    for found in out.values():
        found.sort(key=lambda s: (-s.length, s.along_x, s.at, s.low))
    return out


def _ensuite(
    types: Sequence[str], edges: Sequence[RoomEdge], rng: Generator
) -> tuple[int, int] | None:
    """Choose (bathroom, bedroom) where one of several bathrooms belongs to a bedroom, else None."""
    bathrooms = [k for k, name in enumerate(types) if name == "bathroom"]
    if len(bathrooms) < 2 or float(rng.random()) < 0.15:  # noqa: PLR2004 - one bath is for all
        return None
    found = [
        (a, b) if types[a] == "bathroom" else (b, a)
        for a, b in edges
        if {types[a], types[b]} == {"bathroom", "bedroom"}
    ]
    return found[int(float(rng.random()) * len(found))] if found else None


def door_tree(
    types: Sequence[str],
    edges: Sequence[RoomEdge],
    rng: Generator,
    jitter: float,
) -> list[RoomEdge] | None:
    """Join all rooms by the least unusual doors; None where they cannot be joined.

    Kruskal's minimum spanning tree (1956) over `edges`, the pairs of rooms that can have a door.
    Each door costs `door_cost` plus a random part of up to `jitter`.
    """
    ensuite = _ensuite(types, edges, rng)
    weighted = []
    for a, b in edges:
        cost = door_cost(types[a], types[b]) + jitter * float(rng.random())
        if ensuite is not None and ensuite[0] in {a, b} and set(ensuite) != {a, b}:
            # Dearer than any other door: no path leads through an ensuite bathroom.
            cost += 40.0
        weighted.append((cost, a, b))
    # Rooms that doors join already have the same number here.
    group = list(range(len(types)))
    chosen: list[RoomEdge] = []
    for _, a, b in sorted(weighted):
        if group[a] != group[b]:
            old, new = group[a], group[b]
            group = [new if g == old else g for g in group]
            chosen.append((a, b))
    if len(chosen) != len(types) - 1:
        return None
    return chosen


def loop_doors(
    types: Sequence[str],
    edges: Sequence[RoomEdge],
    tree: Sequence[RoomEdge],
    share: float,
    rng: Generator,
) -> list[RoomEdge]:
    """Draw further doors that close loops: between public rooms, and pairs with a `loop_share`.

    `share` is the share of the doors wished for that are built, `HouseConfig.loops`.
    """
    out: list[tuple[int, int]] = []
    for a, b in sorted(set(edges) - set(tree)):
        draw = float(rng.random())
        pair = ROOM_PAIRS.get(type_pair(types[a], types[b]))
        public = not (ROOM_TYPES[types[a]].private or ROOM_TYPES[types[b]].private)
        wish = 1.0 if public else pair.loop_share if pair is not None else 0.0
        if draw < share * wish:
            out.append((a, b))
    return out
