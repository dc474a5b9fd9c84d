"""Floor plans on integer centimetres: rooms as cells of a grid, with their walls and neighbours.

The grid's lines are where walls may stand; each cell belongs to one room or to OUTSIDE. That makes
rooms tile their outline by construction: there are no overlaps and no gaps to check afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from internav_data.core.arithmetic import plain_sum
from internav_data.houses.standards import DOOR_HEIGHT_CM, HALF_WALL_CM, WALL_CM
from internav_data.records import OUTSIDE

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from internav_data.houses.access import WallSpan
    from internav_data.records import DoorKind

Rect = tuple[int, int, int, int]
"""x_min, y_min, x_max, y_max in centimetres, centre line to centre line."""
Corner = tuple[int, int]
"""x, y in centimetres."""
RoomEdge = tuple[int, int]
"""Two rooms that a door joins or may join, ascending."""


@dataclass(frozen=True, slots=True)
class WallSegment:
    """A straight piece of wall between two rooms (or a room and OUTSIDE)."""

    along_x: bool
    at: int
    """y of a wall along x, x of one along y."""
    low: int
    high: int
    before: int
    """Room below (wall along x) or left of it (wall along y)."""
    after: int

    @property
    def length(self) -> int:
        """Length, centimetres."""
        return self.high - self.low


@dataclass(frozen=True, slots=True)
class Opening:
    """A door or window on the plan, centimetres."""

    along_x: bool
    at: int
    """y of an opening in a wall along x, x of one in a wall along y."""
    low: int
    high: int
    rooms: tuple[int, int]
    """Ascending; windows and entrances have OUTSIDE first."""
    kind: DoorKind | None
    """None for windows."""
    bottom: int = 0
    top: int = DOOR_HEIGHT_CM

    @property
    def open(self) -> bool:
        """Return whether people can walk through it: not through windows and the entrance."""
        return self.kind is not None and self.kind != "entrance"


@dataclass(frozen=True)
class FloorGrid:
    """A grid of cells: `owner[i][j]` is the room between xs[i], xs[i + 1] and ys[j], ys[j + 1]."""

    xs: tuple[int, ...]
    ys: tuple[int, ...]
    owner: tuple[tuple[int, ...], ...]

    @staticmethod
    def of(rooms: Sequence[Iterable[Rect]]) -> FloorGrid:
        """Lay rooms, given as rectangles, on their common grid; later rooms win overlaps."""
        rooms = [list(rects) for rects in rooms]
        xs = sorted({x for rects in rooms for r in rects for x in (r[0], r[2])})
        ys = sorted({y for rects in rooms for r in rects for y in (r[1], r[3])})
        column = {x: i for i, x in enumerate(xs)}
        row = {y: j for j, y in enumerate(ys)}
        owner = [[OUTSIDE] * (len(ys) - 1) for _ in range(len(xs) - 1)]
        for room, rects in enumerate(rooms):
            for x0, y0, x1, y1 in rects:
                below, above = row[y0], row[y1]
                for i in range(column[x0], column[x1]):
                    owner[i][below:above] = [room] * (above - below)
        return FloorGrid(tuple(xs), tuple(ys), tuple(tuple(cells) for cells in owner))

    def at(self, i: int, j: int) -> int:
        """Return the room of a cell; OUTSIDE beyond the grid."""
        inside = 0 <= i < len(self.xs) - 1 and 0 <= j < len(self.ys) - 1
        return self.owner[i][j] if inside else OUTSIDE

    @cached_property
    def cells(self) -> Mapping[int, list[tuple[int, int]]]:
        """Cells of each room, column by column."""
        out: dict[int, list[tuple[int, int]]] = {}
        for i, column in enumerate(self.owner):
            for j, room in enumerate(column):
                if room != OUTSIDE:
                    out.setdefault(room, []).append((i, j))
        return out

    def area_cm2(self, room: int) -> int:
        """Area of a room, centre line to centre line, cm²."""
        return plain_sum(
            (self.xs[i + 1] - self.xs[i]) * (self.ys[j + 1] - self.ys[j])
            for i, j in self.cells[room]
        )

    @cached_property
    def segments(self) -> tuple[WallSegment, ...]:
        """All walls, as long straight pieces that have the same room on either side."""
        return tuple(self._walls(along_x=False) + self._walls(along_x=True))

    def _walls(self, *, along_x: bool) -> list[WallSegment]:
        # Along each grid line: a wall goes on while the rooms on both sides stay the same.
        lines, stops = (self.ys, self.xs) if along_x else (self.xs, self.ys)
        out: list[WallSegment] = []
        for k, at in enumerate(lines):
            low, pair = 0, (OUTSIDE, OUTSIDE)
            for m in range(len(stops)):
                here = (OUTSIDE, OUTSIDE)
                if m < len(stops) - 1:
                    here = (
                        (self.at(m, k - 1), self.at(m, k))
                        if along_x
                        else (self.at(k - 1, m), self.at(k, m))
                    )
                if here != pair:
                    if pair[0] != pair[1]:
                        out.append(WallSegment(along_x, at, low, stops[m], *pair))
                    low, pair = stops[m], here
        return out

    def polygon(self, inside: frozenset[int]) -> tuple[Corner, ...]:
        """Corners of the union of some rooms, counter-clockwise; () where it is in pieces."""
        # Every border edge of a cell, directed so that the inside lies on its left; a corner from
        # which two edges leave is one where cells touch only diagonally.
        step: dict[Corner, list[Corner]] = {}
        for i in range(len(self.xs) - 1):
            for j in range(len(self.ys) - 1):
                if self.owner[i][j] not in inside:
                    continue
                x0, x1, y0, y1 = self.xs[i], self.xs[i + 1], self.ys[j], self.ys[j + 1]
                for (di, dj), a, b in (
                    ((0, -1), (x0, y0), (x1, y0)),
                    ((1, 0), (x1, y0), (x1, y1)),
                    ((0, 1), (x1, y1), (x0, y1)),
                    ((-1, 0), (x0, y1), (x0, y0)),
                ):
                    if self.at(i + di, j + dj) not in inside:
                        step.setdefault(a, []).append(b)
        if not step or any(len(ends) > 1 for ends in step.values()):
            return ()
        start = min(step)
        path = [start]
        for _ in range(len(step) - 1):
            path.append(step[path[-1]][0])
        if step[path[-1]][0] != start or len(set(path)) != len(path):
            return ()
        return _without_straight(path)

    def main_rectangle(self, room: int) -> Rect:
        """Return the largest rectangle of cells inside a room."""
        cells = set(self.cells[room])
        best, best_area = (0, 0, 0, 0), 0
        for i0, j0 in cells:
            # From its lower left cell a rectangle grows column by column; each column can only
            # lower the top.
            top = len(self.ys)
            i1 = i0
            while (i1, j0) in cells:
                j1 = j0
                while j1 < top and (i1, j1) in cells:
                    j1 += 1
                top = j1
                rect = (self.xs[i0], self.ys[j0], self.xs[i1 + 1], self.ys[top])
                area = (rect[2] - rect[0]) * (rect[3] - rect[1])
                if (area, rect) > (best_area, best):
                    best, best_area = rect, area
                i1 += 1
        return best


def _without_straight(path: list[Corner]) -> tuple[Corner, ...]:
    """Drop corners in the middle of straight lines."""
    count = len(path)
    corners: list[Corner] = []
    for k in range(count):
        (ax, ay), (bx, by), (cx, cy) = path[k - 1], path[k], path[(k + 1) % count]
        if (bx - ax) * (cy - by) != (by - ay) * (cx - bx):
            corners.append((bx, by))
    return tuple(corners)


@dataclass(frozen=True, slots=True)
class FloorPlan:
    """Rooms on the grid and the pairs of rooms that doors join.

    A user's plan brings its own doors and windows (see `internav_data.houses.plan_file`).
    """

    types: tuple[str, ...]
    grid: FloorGrid
    tree: tuple[RoomEdge, ...]
    """Pairs of rooms to be joined by a door, so that all rooms can be reached."""
    spans: Mapping[RoomEdge, Sequence[WallSpan]] = field(default_factory=dict)
    """Stretches of wall where a door is possible, by pair of rooms; empty for a user's plan."""
    score_terms: Mapping[str, float] = field(default_factory=dict)
    """Weighted penalties by name (see `internav_data.houses.plan_score`)."""
    doors: tuple[Opening, ...] = ()
    """A user's own doors; empty where they are to be drawn."""
    windows: tuple[Opening, ...] | None = None
    """A user's own windows; None where they are to be drawn."""
    ceiling_cm: int | None = None
    """A user's own height; None where it is to be drawn."""

    @property
    def score(self) -> float:
        """Sum of the penalties: the lower, the more like a home."""
        return plain_sum(self.score_terms.values())


def clear_size_m(rect: Rect) -> tuple[float, float]:
    """Return the shorter and the longer side between wall faces of a rectangle, metres.

    The rectangle's sides are centre lines of walls.
    """
    sides = sorted((rect[2] - rect[0] - WALL_CM, rect[3] - rect[1] - WALL_CM))
    return sides[0] / 100.0, sides[1] / 100.0


def clear_area_m2(grid: FloorGrid, room: int) -> float:
    """Return the area of a room between its wall faces, m²."""
    # Half a wall off all around, but a rectilinear polygon has four more outer corners than inner
    # ones, at which the strips overlap.
    around = plain_sum(s.length for s in grid.segments if room in {s.before, s.after})
    return (grid.area_cm2(room) - HALF_WALL_CM * around + 4 * HALF_WALL_CM**2) / 1e4
