"""Surfaces of a house as rectangles: floors, ceilings, walls by room, casings, panes and leaves."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

from internav_data.navigation import room_of
from internav_data.records import OUTSIDE
from internav_data.render.materials import (
    DOOR_LEAF,
    PANE,
    PLAIN,
    Look,
    floor_look,
    wall_look,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from internav_data.records import Door, House, Room, Vec3, Wall, Window

NOTHING: Final = 0
"""Instance id of pixels that show nothing."""
FLOOR: Final = -1
"""Instance id of floors."""
CEILING: Final = -2
"""Instance id of ceilings."""
WALL: Final = -3
"""Instance id of walls, lintels and breasts, with the casings painted on them."""
DOOR: Final = -4
"""Instance id of the leaf of a closed door."""
WINDOW: Final = -5
"""Instance id of windows."""

_CEILING = Look((238, 238, 234), PLAIN)
_CASING = Look((236, 233, 226), PLAIN)
_PANE_COLOUR = (176, 208, 236)
_LEAF_COLOUR = (126, 84, 56)
_CASING_M = 0.07
"""Width of the casing around doors and windows."""
_BESIDE_M = 0.01
"""Distance in front of a surface at which the room that sees it is looked up."""


class _Hole(NamedTuple):
    """Box that a door or a window cuts from its wall, metres."""

    low: Vec3
    high: Vec3
    leaf: bool
    """Whether a closed door fills it."""


class Sheet(NamedTuple):
    """Axis-parallel rectangle."""

    axis: int
    """Axis of the normal: 0, 1 or 2 for x, y or z."""
    sign: int
    """Side from which it is seen: 1 from above on the axis, -1 from below."""
    at: float
    """Position on the axis, metres."""
    low: tuple[float, float]
    """Lower bounds along the two other axes (`PLANE_AXES`), metres."""
    high: tuple[float, float]
    """Upper bounds along the two other axes, metres."""


class Tile(NamedTuple):
    """Rectangle of one look, seen from one room."""

    sheet: Sheet
    """Place and size."""
    look: Look
    """Colour and pattern."""
    room: int
    """Id of the room."""
    label: int
    """Instance id."""
    origin: tuple[float, float] = (0.0, 0.0)
    """Point of the plane at which u = v = 0, metres."""


UP: Final = 2
"""Axis z."""
PLANE_AXES = ((1, 2), (0, 2), (0, 1))
"""Axes along the sides of a rectangle whose normal is along x, y or z."""


def _hole(item: Door | Window, bottom: float, *, leaf: bool) -> _Hole:
    """Return the hole of a door or window whose lower edge is `bottom` metres above the floor."""
    half, thick = item.width_m / 2.0, 0.06
    dx, dy = (half, thick) if item.yaw_deg == 0.0 else (thick, half)
    low = (item.x - dx, item.y - dy, bottom)
    return _Hole(low, (item.x + dx, item.y + dy, bottom + item.height_m), leaf)


def _holes(house: House) -> list[_Hole]:
    doors = [_hole(d, 0.0, leaf=not d.open) for d in house.doors]
    return [*doors, *(_hole(w, w.sill_m, leaf=False) for w in house.windows)]


def _cuts(low: float, high: float, values: Iterable[float]) -> list[float]:
    """Return `low`, `high` and the values between them, ascending, no two within 0.1 mm."""
    out = [low]
    for value in sorted(values):
        if out[-1] + 1e-4 < value < high - 1e-4:
            out.append(value)
    return [*out, high]


def _sides(wall: Wall, ceiling: float) -> list[Sheet]:
    """Return the sides of a wall's box, without those on the floor and at the ceiling."""
    low, high = (wall.x_min, wall.y_min, wall.z_min), (wall.x_max, wall.y_max, wall.z_max)
    out = []
    for axis, (a, b) in enumerate(PLANE_AXES):
        span = (low[a], low[b]), (high[a], high[b])
        out += [Sheet(axis, -1, low[axis], *span), Sheet(axis, 1, high[axis], *span)]
    return [s for s in out if s.axis != UP or 0.0 < s.at < ceiling]


def _near(
    sheet: Sheet, low: Sequence[float], high: Sequence[float], reach: float = _BESIDE_M
) -> bool:
    """Return whether a box comes within `reach` metres of a rectangle."""
    a, b = PLANE_AXES[sheet.axis]
    return (
        low[sheet.axis] - reach <= sheet.at <= high[sheet.axis] + reach
        and low[a] - reach <= sheet.high[0]
        and high[a] + reach >= sheet.low[0]
        and low[b] - reach <= sheet.high[1]
        and high[b] + reach >= sheet.low[1]
    )


def _within(point: Sequence[float], low: Sequence[float], high: Sequence[float]) -> bool:
    """Return whether a point lies inside a box, not on its surface."""
    return all(low[k] < point[k] < high[k] for k in range(3))


class _Builder:
    """Cuts the sides of walls where rooms, casings or other walls begin."""

    def __init__(self, house: House) -> None:
        self.house = house
        self.holes = _holes(house)
        self.boxes = [
            ((w.x_min, w.y_min, w.z_min), (w.x_max, w.y_max, w.z_max)) for w in house.walls
        ]
        surfaces = {m.name: m for m in house.materials}
        self.looks = {r.room_id: wall_look(surfaces[r.wall_material]) for r in house.rooms}
        self.lines = [sorted({p[k] for r in house.rooms for p in r.polygon}) for k in (0, 1)]

    def wall(self, sheet: Sheet) -> list[Tile]:
        """Cut one side of a wall into rectangles of one look, each seen from one room.

        The lines of walls, holes, casings and room borders cut the side into cells; cells that look
        alike are joined again, first up each column, then across columns.
        """
        boxes = [box for box in self.boxes if _near(sheet, *box)]
        holes = [h for h in self.holes if _near(sheet, h.low, h.high, _CASING_M + _BESIDE_M)]
        grid = []
        for k, axis in enumerate(PLANE_AXES[sheet.axis]):
            values = [v for low, high in boxes for v in (low[axis], high[axis])]
            values += [v for h in holes for v in (h.low[axis], h.high[axis])]
            values += [h.low[axis] - _CASING_M for h in holes]
            values += [h.high[axis] + _CASING_M for h in holes]
            values += self.lines[axis] if axis != UP else []
            grid.append(_cuts(sheet.low[k], sheet.high[k], values))
        columns = [
            _joined([self._tile(sheet, u, v, boxes, holes) for v in pairwise(grid[1])], 1)
            for u in pairwise(grid[0])
        ]
        return [t for t in _joined_columns(columns) if t is not None]

    def _tile(
        self,
        sheet: Sheet,
        u: tuple[float, float],
        v: tuple[float, float],
        boxes: list[tuple[Vec3, Vec3]],
        holes: list[_Hole],
    ) -> Tile | None:
        """Return the tile of one cell; None where a wall covers it or no room sees it."""
        point = [0.0, 0.0, 0.0]
        a, b = PLANE_AXES[sheet.axis]
        point[a], point[b] = (u[0] + u[1]) / 2.0, (v[0] + v[1]) / 2.0
        point[sheet.axis] = sheet.at + sheet.sign * _BESIDE_M
        if any(_within(point, *box) for box in boxes):
            return None
        room = room_of(self.house, point[0], point[1])
        if room == OUTSIDE:
            return None
        piece = sheet._replace(low=(u[0], v[0]), high=(u[1], v[1]))
        for hole in holes:
            # Grown by the casing in the plane, and across it so as to hold the point beside.
            margin = (_CASING_M, _BESIDE_M + 1e-3)
            grown = [margin[k == sheet.axis] for k in range(3)]
            low = [hole.low[k] - grown[k] for k in range(3)]
            high = [hole.high[k] + grown[k] for k in range(3)]
            if not _within(point, low, high):
                continue
            if hole.leaf and hole.low[a] < point[a] < hole.high[a] and point[b] < hole.high[b]:
                size = (hole.high[a] - hole.low[a], hole.high[2] - hole.low[2])
                look = Look(_LEAF_COLOUR, DOOR_LEAF, *size)
                return Tile(piece, look, room, DOOR, (hole.low[a], hole.low[2]))
            return Tile(piece, _CASING, room, WALL)
        return Tile(piece, self.looks[room], room, WALL)


def _merge(first: Tile | None, second: Tile | None, along: int) -> Tile | None:
    """Return two neighbours joined along one axis of their plane, None where they differ."""
    if first is None or second is None or first[1:] != second[1:]:
        return None
    a, b = first.sheet, second.sheet
    across = 1 - along
    same = (a.low[across], a.high[across]) == (b.low[across], b.high[across])
    if not same or a.high[along] != b.low[along]:
        return None
    return first._replace(sheet=a._replace(high=b.high))


def _joined(tiles: list[Tile | None], along: int) -> list[Tile | None]:
    """Return a row of cells with equal neighbours joined."""
    out: list[Tile | None] = []
    for tile in tiles:
        merged = _merge(out[-1], tile, along) if out else None
        if merged is not None:
            out[-1] = merged
        else:
            out.append(tile)
    return out


def _joined_columns(columns: list[list[Tile | None]]) -> list[Tile | None]:
    """Return the tiles of all columns, joined with an equal one of the column before."""
    out: list[Tile | None] = []
    # Tiles of the last column, which the next one may still extend.
    open_tiles: list[Tile | None] = []
    for column in columns:
        grown: list[Tile | None] = []
        for tile in column:
            match = next((o for o in open_tiles if _merge(o, tile, 0) is not None), None)
            if match is None:
                grown.append(tile)
            else:
                open_tiles.remove(match)
                grown.append(_merge(match, tile, 0))
        out += open_tiles
        open_tiles = grown
    return [*out, *open_tiles]


def room_boxes(house: House, room: Room) -> list[tuple[float, float, float, float]]:
    """Return boxes that tile a room's polygon: (x_min, y_min, x_max, y_max), metres."""
    xs, ys = (sorted({p[k] for p in room.polygon}) for k in (0, 1))
    out = []
    for y0, y1 in pairwise(ys):
        run: list[float] = []
        for x0, x1 in pairwise(xs):
            inside = room_of(house, (x0 + x1) / 2.0, (y0 + y1) / 2.0) == room.room_id
            if inside and run and run[1] == x0:
                run[1] = x1
            elif inside:
                if run:
                    out.append((run[0], y0, run[1], y1))
                run = [x0, x1]
        if run:
            out.append((run[0], y0, run[1], y1))
    return out


def _pane(house: House, window: Window) -> Tile:
    """Return the pane of a window, on the wall's centre line, seen from its room."""
    axis = 1 if window.yaw_deg == 0.0 else 0
    middle, at = (window.x, window.y) if axis == 1 else (window.y, window.x)
    probe = [window.x, window.y]
    probe[axis] += 0.1
    sign = 1 if room_of(house, *probe) == window.room else -1
    low = (middle - window.width_m / 2.0, window.sill_m)
    high = (low[0] + window.width_m, window.sill_m + window.height_m)
    look = Look(_PANE_COLOUR, PANE, window.width_m, window.height_m)
    return Tile(Sheet(axis, sign, at, low, high), look, window.room, WINDOW, low)


def house_tiles(house: House) -> list[Tile]:
    """Return the rectangles that can be seen from inside a house."""
    surfaces = {m.name: m for m in house.materials}
    tiles: list[Tile] = []
    for room in house.rooms:
        look = floor_look(surfaces[room.floor_material])
        for x0, y0, x1, y1 in room_boxes(house, room):
            span = (x0, y0), (x1, y1)
            tiles.append(Tile(Sheet(2, 1, 0.0, *span), look, room.room_id, FLOOR))
            ceiling = Sheet(2, -1, room.ceiling_m, *span)
            tiles.append(Tile(ceiling, _CEILING, room.room_id, CEILING))
    builder = _Builder(house)
    for wall in house.walls:
        for sheet in _sides(wall, max(r.ceiling_m for r in house.rooms)):
            tiles += builder.wall(sheet)
    return [*tiles, *(_pane(house, w) for w in house.windows)]
