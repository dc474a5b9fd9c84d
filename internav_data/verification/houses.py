"""Predicates of a house without its objects: rooms, walls, doors and windows."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import shapely
from shapely import LineString, Polygon, box

from internav_data.records import OUTSIDE
from internav_data.verification.overlaps import GRID_M

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Geometry

    from internav_data.records import Door, House, Vec2, Window
    from internav_data.verification.findings import FindingCollector

AREA_M2 = 1e-6
"""Upper bound of areas that should be zero."""
STATED_AREA_M2 = 0.01
"""Tolerance of stated areas, which are rounded."""
LENGTH_M = 1e-3
"""Upper bound of lengths that should be zero."""
HALF_WALL_M = 0.06
CORNERS_OF_A_RING = 4


def _rectilinear(ring: Sequence[Vec2]) -> bool:
    sides = zip(ring, [*ring[1:], ring[0]], strict=True)
    return all((a[0] == b[0]) != (a[1] == b[1]) for a, b in sides)


def _proper(report: FindingCollector, name: str, ring: Sequence[Vec2], what: str) -> Polygon | None:
    """Check and return a stored polygon; None if it is not a simple polygon."""
    predicate = f"house.{name}-polygon"
    if not report.expect(
        len(ring) >= CORNERS_OF_A_RING, predicate, "4 corners or more", f"{what}: {len(ring)}"
    ):
        return None
    polygon = Polygon(ring)
    report.expect(_rectilinear(ring), predicate, "right angles", what)
    report.expect(polygon.exterior.is_ccw, predicate, "counter-clockwise corners", what)
    valid = report.expect(polygon.is_valid, predicate, "a simple polygon", what)
    return polygon if valid else None


def check_rooms(house: House, report: FindingCollector) -> dict[int, Polygon]:
    """Check outline and rooms (polygons, stated areas, tiling); return the rooms by id."""
    outline = _proper(report, "outline", house.outline, "outline")
    rooms: dict[int, Polygon] = {}
    for room in house.rooms:
        what = f"room {room.room_id}"
        polygon = _proper(report, "room", room.polygon, what)
        if polygon is None:
            continue
        rooms[room.room_id] = polygon
        report.expect(
            abs(polygon.area - room.area_m2) <= STATED_AREA_M2,
            "house.room-area",
            f"{what}: {polygon.area:.4f} m²",
            room.area_m2,
        )
    if outline is None or len(rooms) < len(house.rooms):
        return rooms
    shapes = list(rooms.values())
    x_min, y_min, _, _ = outline.bounds
    report.expect(
        math.hypot(x_min + HALF_WALL_M, y_min + HALF_WALL_M) < LENGTH_M,
        "house.origin",
        "an interior that starts at (0, 0)",
        (x_min + HALF_WALL_M, y_min + HALF_WALL_M),
    )
    tiles = shapely.union_all(shapes)
    shared = sum(shape.area for shape in shapes) - tiles.area
    report.expect(shared < AREA_M2, "house.rooms-overlap", "no overlap", f"{shared:.6f} m²")
    missed = shapely.area(shapely.symmetric_difference(tiles, outline, grid_size=GRID_M))
    report.expect(
        missed < AREA_M2, "house.rooms-tile", "rooms fill the outline", f"{missed:.6f} m²"
    )
    report.expect(
        abs(outline.area - house.area_m2) <= STATED_AREA_M2,
        "house.area",
        f"{outline.area:.4f} m²",
        house.area_m2,
    )
    return rooms


def opening(part: Door | Window) -> LineString:
    """Return the centre line of a door's or window's opening."""
    turn = math.radians(part.yaw_deg)
    dx, dy = math.cos(turn) * part.width_m / 2.0, math.sin(turn) * part.width_m / 2.0
    return LineString([(part.x - dx, part.y - dy), (part.x + dx, part.y + dy)])


def _outside_of(line: LineString, area: Geometry) -> float:
    return float(shapely.length(shapely.difference(line, shapely.buffer(area, 1e-6))))


def check_doors(house: House, rooms: dict[int, Polygon], report: FindingCollector) -> None:
    """Check doors, windows and the room graph against the rooms' borders."""
    if len(rooms) < len(house.rooms):
        return
    outer = Polygon(house.outline).exterior
    borders: dict[int, Geometry] = {room: shape.exterior for room, shape in rooms.items()}
    borders[OUTSIDE] = outer
    for door in house.doors:
        for room in door.rooms:
            gap = _outside_of(opening(door), borders.get(room, LineString()))
            report.expect(
                gap < LENGTH_M,
                "house.door-rooms",
                f"door {door.door_id} on the border of room {room}",
                f"{gap:.4f} m off it",
            )
        report.expect(
            not (door.open and OUTSIDE in door.rooms),
            "house.entrance",
            f"door {door.door_id} to the outside closed",
            "open",
        )
    for window in house.windows:
        for where, border in (("outer wall", outer), ("room", borders.get(window.room))):
            gap = _outside_of(opening(window), border if border is not None else LineString())
            report.expect(
                gap < LENGTH_M,
                "house.window",
                f"window {window.window_id} on its {where}",
                f"{gap:.4f} m off it",
            )
    open_pairs = sorted({d.rooms for d in house.doors if d.open and OUTSIDE not in d.rooms})
    report.expect(
        list(house.room_graph) == open_pairs, "house.room-graph", open_pairs, list(house.room_graph)
    )


def check_walls(house: House, rooms: dict[int, Polygon], report: FindingCollector) -> None:
    """Check the walls at every height: solid along all borders, open exactly at openings."""
    if len(rooms) < len(house.rooms) or not rooms:
        return
    lines = shapely.union_all([shape.exterior for shape in rooms.values()])
    zone = shapely.buffer(lines, HALF_WALL_M, cap_style="square", join_style="mitre")
    plans = [box(w.x_min, w.y_min, w.x_max, w.y_max) for w in house.walls]
    stray = shapely.area(shapely.difference(shapely.union_all(plans), zone))
    report.expect(stray < LENGTH_M, "house.walls-stray", "walls along borders", f"{stray:.4f} m²")
    top = min(room.ceiling_m for room in house.rooms)
    levels = {0.0, top}
    for wall in house.walls:
        levels |= {z for z in (wall.z_min, wall.z_max) if 0.0 < z < top}
    for door in house.doors:
        levels |= {z for z in (door.height_m,) if 0.0 < z < top}
    ordered = sorted(levels)
    for low, high in pairwise(ordered):
        z = (low + high) / 2.0
        solid = [p for p, w in zip(plans, house.walls, strict=True) if w.z_min < z < w.z_max]
        gaps = shapely.difference(lines, shapely.buffer(shapely.union_all(solid), 1e-6))
        openings = [opening(d) for d in house.doors if d.open and z < d.height_m]
        openings += [opening(w) for w in house.windows if w.sill_m < z < w.sill_m + w.height_m]
        wanted = shapely.union_all(openings)
        extra = float(shapely.length(shapely.difference(gaps, shapely.buffer(wanted, 1e-5))))
        closed = float(shapely.length(shapely.difference(wanted, shapely.buffer(gaps, 1e-5))))
        report.expect(
            extra < LENGTH_M,
            "house.walls-gap",
            f"wall without holes at z = {z:.3f} m",
            f"{extra:.4f} m of holes",
        )
        report.expect(
            closed < LENGTH_M,
            "house.walls-closed",
            f"openings free at z = {z:.3f} m",
            f"{closed:.4f} m walled up",
        )
