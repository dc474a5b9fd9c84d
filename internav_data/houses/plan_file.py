"""Floor plans of a user's own: a small TOML or JSON file, read and checked.

::

    ceiling_m = 2.6                       # optional

    [[rooms]]
    name = "kitchen"                      # optional: the type serves where it is unique
    type = "kitchen"                      # see internav_data.houses.room_types.ROOM_TYPES
    polygon = [[0, 0], [4, 0], [4, 3], [0, 3]]

    [[doors]]
    between = ["kitchen", "living"]       # or ["outside", "hall"]: a closed entrance
    at = [4.0, 1.5]                       # middle of the opening, on the wall both rooms share
    width = 1.0                           # optional, metres
    kind = "single"                       # optional: opening, doorway, single, wide or double

    [[windows]]                           # optional: without any, windows are drawn
    room = "kitchen"
    at = [2.0, 0.0]
    width = 1.2
    sill = 0.9
    height = 1.2

Polygons are the centre lines of walls 0.12 m thick, in metres; rooms share walls without gaps.
"""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from internav_data.core.files import FileLimits, parse_json, parse_toml, read_file
from internav_data.houses.access import JAMB_CM, spans
from internav_data.houses.plan import FloorPlan, Opening
from internav_data.houses.plan_shapes import FloorPlanError, lay_out, read_polygon
from internav_data.houses.room_types import ROOM_TYPES
from internav_data.houses.standards import CEILING_CM, DOOR_CLEAR_CM
from internav_data.records import OUTSIDE
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.houses.plan import FloorGrid, WallSegment
    from internav_data.records import DoorKind

FLOOR_PLAN: Final = FileLimits(
    "floor plan", UsageError, "docs/floor-plans.md shows one", max_values=20_000, max_number=1e6
)
"""Limits of a plan's file."""
MAX_PLAN_ROOMS = 40
MAX_OPENINGS: Final = 400
"""Largest number of doors, and of windows."""
_DOOR_KINDS: Mapping[str, int] = {
    "opening": 200,
    "doorway": 100,
    "single": 100,
    "wide": 150,
    "double": 200,
}
"""Default widths by kind, centimetres."""
MIN_USER_DOOR_CM = 70
"""Smallest width: the agent's disc finds no column of the lattice in a narrower door."""
_KEYS = {
    "": {"ceiling_m", "rooms", "doors", "windows"},
    "rooms": {"name", "type", "polygon"},
    "doors": {"between", "at", "width", "kind"},
    "windows": {"room", "at", "width", "sill", "height"},
}


def load_floor_plan(path: str | Path) -> FloorPlan:
    """Read a floor plan of the user's own.

    Raises
    ------
    UsageError
        In one line: the file, the room or door, what is wrong and what to do.

    """
    path = Path(path)
    data = read_file(path, FLOOR_PLAN)
    try:
        return _parsed(data, path)
    except FloorPlanError as complaint:
        raise UsageError(f"floor plan {path}: {complaint}") from complaint


@lru_cache(maxsize=8)
def _parsed(content: bytes, path: Path) -> FloorPlan:
    parse = parse_json if path.suffix.lower() == ".json" else parse_toml
    data = parse(content, path, FLOOR_PLAN)
    if not isinstance(data, dict):
        raise FloorPlanError("expected a table with [[rooms]] and [[doors]]")
    _known(data, "")
    rooms = _tables(data, "rooms")
    if not 1 <= len(rooms) <= MAX_PLAN_ROOMS:
        raise FloorPlanError(f"has {len(rooms)} rooms: give 1 to {MAX_PLAN_ROOMS} [[rooms]]")
    for kind in ("doors", "windows"):
        if len(_tables(data, kind)) > MAX_OPENINGS:
            raise FloorPlanError(f"has more than {MAX_OPENINGS} {kind}")
    names = _names(rooms)
    polygons = [read_polygon(r.get("polygon"), n) for r, n in zip(rooms, names, strict=True)]
    grid, shift = lay_out(polygons, names)
    types = tuple(str(room["type"]) for room in rooms)
    doors = [_door(d, grid, names, shift, k) for k, d in enumerate(_tables(data, "doors"))]
    _apart(doors, names)
    tree = _joined(doors, names)
    windows = [_window(w, grid, names, shift, k) for k, w in enumerate(_tables(data, "windows"))]
    _apart([*doors, *windows], names)
    doors.sort(key=lambda o: (o.rooms, o.along_x, o.at, o.low))
    return FloorPlan(
        types,
        grid,
        tree,
        doors=tuple(doors),
        windows=tuple(windows) if "windows" in data else None,
        ceiling_cm=_ceiling(data),
    )


def _known(table: Mapping[str, Any], kind: str) -> None:
    for key in table:
        if key not in _KEYS[kind]:
            where = f"[[{kind}]]" if kind else "the file"
            raise FloorPlanError(
                f"unknown key {key!r} in {where}; known: {', '.join(sorted(_KEYS[kind]))}"
            )


def _tables(data: Mapping[str, Any], kind: str) -> list[dict[str, Any]]:
    found = data.get(kind, [])
    if not isinstance(found, list) or not all(isinstance(entry, dict) for entry in found):
        raise FloorPlanError(f"'{kind}' must be a list of tables: write [[{kind}]]")
    for entry in found:
        _known(entry, kind)
    return found


def _names(rooms: Sequence[Mapping[str, Any]]) -> list[str]:
    names: list[str] = []
    for k, room in enumerate(rooms):
        kind = room.get("type")
        name = str(room.get("name", kind if kind is not None else f"number {k + 1}"))
        if kind not in list(ROOM_TYPES):  # a list, as what cannot be hashed is no type either
            raise FloorPlanError(
                f"room {name!r}: type is {kind!r}; choose one of {', '.join(sorted(ROOM_TYPES))}"
            )
        if name in names or name == "outside":
            raise FloorPlanError(
                f"room {name!r}: this name is taken, give each room a 'name' of its own"
            )
        names.append(name)
    return names


def _ceiling(data: Mapping[str, Any]) -> int | None:
    if "ceiling_m" not in data:
        return None
    height = _centimetres(data["ceiling_m"], "ceiling_m")
    low, high = CEILING_CM
    if not low <= height <= high + 80:
        raise FloorPlanError(
            f"ceiling_m is {data['ceiling_m']}: choose {low / 100} to {high / 100 + 0.8}"
        )
    return height


def _centimetres(value: object, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise FloorPlanError(f"{what} is {value!r}: expected a number of metres")
    return round(value * 100)


def _point(value: object, what: str, shift: tuple[int, int]) -> tuple[int, int]:
    if not isinstance(value, list) or len(value) != 2:  # noqa: PLR2004 - x and y
        raise FloorPlanError(f"{what}: 'at' is {value!r}, expected [x, y] in metres")
    x, y = (_centimetres(v, what) for v in value)
    return x - shift[0], y - shift[1]


def _room(name: object, names: Sequence[str], what: str) -> int:
    if name == "outside":
        return OUTSIDE
    if name not in names:
        raise FloorPlanError(f"{what}: no room {name!r}; rooms: {', '.join(map(repr, names))}")
    return names.index(str(name))


def _wall(
    grid: FloorGrid, rooms: tuple[int, int], at: tuple[int, int], low_high: tuple[int, int]
) -> WallSegment | None:
    """Find the wall between two rooms that holds an opening."""
    before, after = low_high
    for segment in grid.segments:
        if sorted((segment.before, segment.after)) != sorted(rooms):
            continue
        along, line = (at[0], at[1]) if segment.along_x else (at[1], at[0])
        low, high = along - before, along + after
        if line == segment.at and segment.low + JAMB_CM <= low and high <= segment.high - JAMB_CM:
            return segment
    return None


def _door(
    entry: Mapping[str, Any],
    grid: FloorGrid,
    names: Sequence[str],
    shift: tuple[int, int],
    number: int,
) -> Opening:
    between = entry.get("between")
    what = f"door {number + 1}"
    if not isinstance(between, list) or len(between) != 2:  # noqa: PLR2004 - two rooms
        raise FloorPlanError(f"{what}: 'between' is {between!r}, expected two names of rooms")
    what = f"door {number + 1} between {between[0]!r} and {between[1]!r}"
    a, b = sorted(_room(name, names, what) for name in between)
    if a == b:
        raise FloorPlanError(f"{what}: a door joins two different rooms")
    kind = entry.get("kind", "single")
    if kind not in list(_DOOR_KINDS):  # a list, as what cannot be hashed is no kind either
        raise FloorPlanError(f"{what}: kind is {kind!r}; choose one of {', '.join(_DOOR_KINDS)}")
    at = _point(entry.get("at"), what, shift)
    width = _centimetres(entry.get("width", _DOOR_KINDS[kind] / 100.0), what)
    if width < MIN_USER_DOOR_CM:
        raise FloorPlanError(
            f"{what}: {width / 100} m is too narrow, give {MIN_USER_DOOR_CM / 100} or more"
        )
    sides = (width // 2, width - width // 2)
    wall = _wall(grid, (a, b), at, sides)
    if wall is None:
        raise FloorPlanError(
            f"{what}: does not lie on a wall they share, {JAMB_CM / 100} m from its ends; "
            f"move 'at' or make it narrower"
        )
    along = at[0] if wall.along_x else at[1]
    low, high = along - sides[0], along + sides[1]
    if not any(s.low <= low and high <= s.high for s in spans(grid, wall)):
        raise FloorPlanError(f"{what}: a room is less than {DOOR_CLEAR_CM / 100} m deep behind it")
    door_kind: DoorKind = "entrance" if a == OUTSIDE else kind
    return Opening(wall.along_x, wall.at, low, high, (a, b), door_kind)


def _window(
    entry: Mapping[str, Any],
    grid: FloorGrid,
    names: Sequence[str],
    shift: tuple[int, int],
    number: int,
) -> Opening:
    what = f"window {number + 1} of {entry.get('room')!r}"
    room = _room(entry.get("room"), names, what)
    at = _point(entry.get("at"), what, shift)
    width, sill, height = (
        _centimetres(entry.get(key, usual), what)
        for key, usual in (("width", 1.3), ("sill", 0.9), ("height", 1.2))
    )
    if width < 20 or sill < 10 or height < 20 or sill + height > CEILING_CM[0] - 5:  # noqa: PLR2004 - a pane
        raise FloorPlanError(f"{what}: width, sill and height make no window under the ceiling")
    sides = (width // 2, width - width // 2)
    wall = _wall(grid, (OUTSIDE, room), at, sides)
    if wall is None:
        raise FloorPlanError(f"{what}: does not lie on an outer wall of the room; move 'at'")
    along = at[0] if wall.along_x else at[1]
    return Opening(
        wall.along_x,
        wall.at,
        along - sides[0],
        along + sides[1],
        (OUTSIDE, room),
        None,
        sill,
        sill + height,
    )


def _apart(openings: Sequence[Opening], names: Sequence[str]) -> None:
    for k, one in enumerate(openings):
        for other in openings[k + 1 :]:
            if (
                (one.along_x, one.at) == (other.along_x, other.at)
                and one.low < other.high
                and other.low < one.high
            ):
                room = names[one.rooms[1]]
                raise FloorPlanError(
                    f"room {room!r}: two of its doors or windows overlap; move one"
                )


def _joined(doors: Sequence[Opening], names: Sequence[str]) -> tuple[tuple[int, int], ...]:
    """Pairs of rooms that doors join; complain about rooms that none leads to."""
    pairs = sorted({door.rooms for door in doors if door.open})
    seen = {0}
    for _ in names:
        seen |= {b for a, b in pairs if a in seen} | {a for a, b in pairs if b in seen}
    lost = [name for k, name in enumerate(names) if k not in seen]
    if lost:
        raise FloorPlanError(f"room {lost[0]!r}: no way leads there from {names[0]!r}; add a door")
    return tuple(pairs)
