"""Polygons of a user's floor plan: read, checked and laid on a `FloorGrid`."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

from internav_data.houses.plan import FloorGrid
from internav_data.houses.standards import HALF_WALL_CM
from internav_data.records import OUTSIDE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.houses.plan import Corner, Rect

MIN_SIDE_CM = 100
"""Smallest side of a room: narrower ones leave the agent no place to turn beside furniture."""
MAX_EXTENT_CM = 10_000
"""Largest coordinate."""
MAX_CORNERS = 100
"""Largest number of a room's corners."""


class FloorPlanError(ValueError):
    """Error in a floor plan, raised before the file's name is known."""


def read_polygon(value: object, name: str) -> list[Corner]:
    """Read a room's corners: centimetres, without those in the middle of a straight side.

    Raises
    ------
    FloorPlanError
        When the value is no list of four or more corners, or its polygon is not rectilinear or
        touches itself.
    """
    if not isinstance(value, list) or len(value) < 4:  # noqa: PLR2004 - a rectangle has four
        raise FloorPlanError(
            f"room {name!r}: 'polygon' needs four or more corners [x, y] in metres"
        )
    if len(value) > MAX_CORNERS:
        raise FloorPlanError(f"room {name!r}: {len(value)} corners, at most {MAX_CORNERS}")
    corners: list[Corner] = []
    for entry in value:
        good = (
            isinstance(entry, list)
            and len(entry) == 2  # noqa: PLR2004 - x and y
            and all(
                isinstance(v, (int, float))
                and not isinstance(v, bool)
                and math.isfinite(v)
                and abs(v) * 100 <= MAX_EXTENT_CM
                for v in entry
            )
        )
        if not good:
            raise FloorPlanError(
                f"room {name!r}: corner {entry!r} is no [x, y] in metres within "
                f"{MAX_EXTENT_CM // 100} m"
            )
        corners.append((round(entry[0] * 100), round(entry[1] * 100)))
    corners = [c for k, c in enumerate(corners) if c != corners[k - 1]]
    if len(corners) < 4:  # noqa: PLR2004 - a rectangle has four
        raise FloorPlanError(f"room {name!r}: 'polygon' needs four or more different corners")
    for (ax, ay), (bx, by) in itertools.pairwise([*corners, corners[0]]):
        if (ax == bx) == (ay == by):
            raise FloorPlanError(
                f"room {name!r}: the side from ({ax / 100}, {ay / 100}) to ({bx / 100}, "
                f"{by / 100}) is not along x or y; walls are rectilinear"
            )
    count = len(corners)
    corners = [
        c
        for k, c in enumerate(corners)
        if not _straight(corners[k - 1], c, corners[(k + 1) % count])
    ]
    _check_simple(corners, name)
    return corners


def _straight(a: Corner, b: Corner, c: Corner) -> bool:
    """Return whether the outline goes straight on at b, and not back."""
    (ux, uy), (vx, vy) = (b[0] - a[0], b[1] - a[1]), (c[0] - b[0], c[1] - b[1])
    return ux * vy == uy * vx and ux * vx + uy * vy > 0


def _check_simple(corners: Sequence[Corner], name: str) -> None:
    """Raise FloorPlanError where a side touches or crosses one that is not its neighbour."""
    count = len(corners)
    sides = [(corners[k], corners[(k + 1) % count]) for k in range(count)]
    for a, b in itertools.combinations(range(count), 2):
        (p, q), (r, s) = sides[a], sides[b]
        meet = max(min(p[0], q[0]), min(r[0], s[0])) <= min(
            max(p[0], q[0]), max(r[0], s[0])
        ) and max(min(p[1], q[1]), min(r[1], s[1])) <= min(max(p[1], q[1]), max(r[1], s[1]))
        neighbours = b == a + 1 or (a == 0 and b == count - 1)
        backwards = neighbours and (p[0] == q[0]) == (r[0] == s[0])
        if meet and (not neighbours or backwards):
            raise FloorPlanError(f"room {name!r}: its outline touches or crosses itself")


def _covers(corners: Sequence[Corner], x: float, y: float) -> bool:
    """Return whether a point (never on a side) lies inside: count the sides to its right."""
    inside = False
    for (ax, ay), (bx, by) in itertools.pairwise([*corners, corners[0]]):
        if ax == bx and ax > x and min(ay, by) < y < max(ay, by):
            inside = not inside
    return inside


def lay_out(
    polygons: Sequence[Sequence[Corner]], names: Sequence[str]
) -> tuple[FloorGrid, tuple[int, int]]:
    """Lay rooms on a grid; return it and the shift of the origin (x, y), centimetres.

    Raises
    ------
    FloorPlanError
        When rooms overlap, are apart, enclose a gap or are too narrow.
    """
    left = min(x for corners in polygons for x, _ in corners) + HALF_WALL_CM
    low = min(y for corners in polygons for _, y in corners) + HALF_WALL_CM
    moved = [[(x - left, y - low) for x, y in corners] for corners in polygons]
    xs = sorted({x for corners in moved for x, _ in corners})
    ys = sorted({y for corners in moved for _, y in corners})
    rooms: list[list[Rect]] = [[] for _ in moved]
    for x0, x1 in itertools.pairwise(xs):
        for y0, y1 in itertools.pairwise(ys):
            inside = [
                k
                for k, corners in enumerate(moved)
                if _covers(corners, (x0 + x1) / 2, (y0 + y1) / 2)
            ]
            if len(inside) > 1:
                raise FloorPlanError(
                    f"room {names[inside[1]]!r}: overlaps room {names[inside[0]]!r} at "
                    f"({(x0 + left) / 100}, {(y0 + low) / 100})"
                )
            if inside:
                rooms[inside[0]].append((x0, y0, x1, y1))
    grid = FloorGrid.of(rooms)
    _check_tiling(grid, names)
    return grid, (left, low)


def _check_tiling(grid: FloorGrid, names: Sequence[str]) -> None:
    """Raise FloorPlanError for gaps between rooms and for rooms too narrow to furnish."""
    for room, name in enumerate(names):
        x0, y0, x1, y1 = grid.main_rectangle(room)
        if min(x1 - x0, y1 - y0) < MIN_SIDE_CM:
            raise FloorPlanError(f"room {name!r}: it is narrower than {MIN_SIDE_CM / 100} m")
    if grid.polygon(frozenset(range(len(names)))):
        return
    reached = {0}
    for _ in names:
        for wall in grid.segments:
            pair = {wall.before, wall.after}
            if OUTSIDE not in pair and pair & reached:
                reached |= pair
    lost = next((name for k, name in enumerate(names) if k not in reached), None)
    if lost is not None:
        raise FloorPlanError(
            f"room {lost!r}: shares no wall with the others; rooms are centre lines of walls, "
            "close the gap"
        )
    raise FloorPlanError(
        f"room {names[-1]!r}: the rooms enclose a gap or touch at a corner only; fill the gap "
        "with a room or close it"
    )
