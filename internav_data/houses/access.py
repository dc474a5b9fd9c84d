"""Which rooms can have a door between them, and which should."""

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
"""Least distance of an opening from the centre line of a wall that meets its own."""
DEPTH_CM = HALF_WALL_CM + DOOR_CLEAR_CM + HALF_WALL_CM
"""Centre-line depth that a room needs behind a door."""

_UNKNOWN_COST = (1.2, 4.0, 14.0)
"""Door costs of pairs without an entry, by the number of private rooms among the two."""


@dataclass(frozen=True, slots=True)
class WallSpan:
    """A stretch of wall in which an opening may lie; centimetres."""

    along_x: bool
    at: int
    low: int
    high: int

    @property
    def length(self) -> int:
        """Centimetres."""
        return self.high - self.low


def door_cost(first: str, second: str) -> float:
    """Return how unusual a door between two types of room is."""
    key = type_pair(first, second)
    if key in ROOM_PAIRS:
        return ROOM_PAIRS[key].door_cost
    return _UNKNOWN_COST[ROOM_TYPES[first].private + ROOM_TYPES[second].private]


def _deep_enough(grid: FloorGrid, segment: WallSegment, m: int, side: int) -> bool:
    """Whether the room on one side of a wall is deep enough for a door beside grid cell m."""
    lines = grid.ys if segment.along_x else grid.xs
    room = segment.before if side < 0 else segment.after
    if room == OUTSIDE:
        return True
    k = lines.index(segment.at)
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
    """Stretches of a wall where doors have their clear depth on both sides."""
    stops = grid.xs if segment.along_x else grid.ys
    out: list[WallSpan] = []
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
    """Where doors of at least a width can be, by pair of rooms (ascending), longest span first."""
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
    """Of several bathrooms, one may belong to a bedroom: (bathroom, bedroom)."""
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
            cost += 40.0
        weighted.append((cost, a, b))
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
    """Further doors that make ways round: between public rooms, and from bedroom to bathroom."""
    out: list[tuple[int, int]] = []
    for a, b in sorted(set(edges) - set(tree)):
        draw = float(rng.random())
        pair = ROOM_PAIRS.get(type_pair(types[a], types[b]))
        public = not (ROOM_TYPES[types[a]].private or ROOM_TYPES[types[b]].private)
        wish = 1.0 if public else pair.loop_share if pair is not None else 0.0
        if draw < share * wish:
            out.append((a, b))
    return out
