"""Predicates of a house's objects: rooms, supports, clear doors, reachable rooms."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import Polygon, box

from internav_data.verification.overlaps import (
    DEPTH_M,
    WALL_ID,
    overlapping_slabs,
    plans_overlap,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from shapely import Geometry

    from internav_data.records import Door, House, SceneObject
    from internav_data.verification.checked_lattice import CheckedLattice
    from internav_data.verification.checked_layout import CheckedLayout
    from internav_data.verification.findings import FindingCollector
    from internav_data.verification.shapes import Slab

DOOR_CLEAR_M = 0.65
"""Free depth before a door, from the wall's face."""
HALF_WALL_M = 0.06
HANGS_M = 0.05
"""Maximum distance of a hanging object from its wall or ceiling."""
REACHED = 0.5
"""Share of a room's free nodes that the house's largest component must exceed."""


def check_objects(
    layout: CheckedLayout, rooms: dict[int, Polygon], report: FindingCollector
) -> None:
    """Check objects: inside their rooms, clear of walls and each other, supported."""
    house, shapes = layout.house, layout.shapes
    slabs: list[Slab] = []
    owners: list[int] = []
    for slab in layout.wall_slabs:
        slabs.append(slab)
        owners.append(WALL_ID)
    within = {room: shapely.buffer(shape, DEPTH_M) for room, shape in rooms.items()}
    shapely.prepare(list(within.values()))
    groups = {scene_object.object_id: scene_object.group for scene_object in house.objects}
    blocks = {t.object_id: shapes.assets[t.asset_id].blocks for t in house.objects}
    own = layout.object_slabs
    for scene_object in house.objects:
        name = f"object {scene_object.object_id} ({scene_object.asset_id})"
        asset = shapes.assets[scene_object.asset_id]
        report.expect(
            scene_object.type == asset.type,
            "object.type",
            f"{name}: {asset.type}",
            scene_object.type,
        )
        slabs += own[scene_object.object_id]
        owners += [scene_object.object_id] * len(own[scene_object.object_id])
        room = within.get(scene_object.room)
        if room is not None:
            inside = shapely.covers(room, _plans(own[scene_object.object_id])).all()
            report.expect(inside, "object.room", f"{name} in room {scene_object.room}", "beyond it")
        _check_support(house, scene_object, own, report)

    def may_interlock(a: int, b: int) -> bool:
        """Return whether one of two owners is a rug on which the other stands, in one group."""
        return a != WALL_ID and groups[a] == groups[b] >= 0 and not (blocks[a] and blocks[b])

    for a, b in overlapping_slabs(slabs, owners, may_interlock):
        what = "a wall" if a == WALL_ID else f"object {a}"
        report.expect(False, "object.overlap", f"object {b} clear of {what}", "an overlap")  # noqa: FBT003
    report.counts["predicates"] += len(house.objects)


def _plans(slabs: list[Slab]) -> NDArray[np.object_]:
    return np.array([slab.plan for slab in slabs], dtype=object)


def _check_support(
    house: House, scene_object: SceneObject, own: dict[int, list[Slab]], report: FindingCollector
) -> None:
    """Check that an object stands on the floor or its support, or hangs on a wall or ceiling."""
    name = f"object {scene_object.object_id}"
    slabs = own[scene_object.object_id]
    low, high = min(slab.low for slab in slabs), max(slab.high for slab in slabs)
    if scene_object.support >= 0:
        held = any(
            abs(slab.high - low) < DEPTH_M and shapely.intersects(slab.plan, _plans(slabs)).any()
            for slab in own.get(scene_object.support, [])
        )
        report.expect(
            held,
            "object.support",
            f"{name} standing on object {scene_object.support}",
            "in the air",
        )
        return
    if abs(low) <= DEPTH_M:
        report.expect(True, "object.support", "", "")  # noqa: FBT003 - counted
        return
    ceiling = min(
        (r.ceiling_m for r in house.rooms if r.room_id == scene_object.room), default=math.inf
    )
    walls = [
        box(w.x_min, w.y_min, w.x_max, w.y_max)
        for w in house.walls
        if w.z_min < high and w.z_max > low
    ]
    hangs = low > 0.0 and (
        high > ceiling - HANGS_M
        or shapely.dwithin(_plans(slabs)[:, None], np.array(walls)[None, :], HANGS_M).any()
    )
    where = f"{name} on the floor, a wall or the ceiling"
    report.expect(hangs, "object.support", where, f"{low:.3f} m above the floor")


def _before(door: Door) -> Polygon:
    """Return the rectangle that must stay free on both sides of a door."""
    turn = math.radians(door.yaw_deg)
    ux, uy = math.cos(turn), math.sin(turn)
    half, deep = door.width_m / 2.0, HALF_WALL_M + DOOR_CLEAR_M
    return Polygon(
        [
            (door.x + a * half * ux - b * deep * uy, door.y + a * half * uy + b * deep * ux)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
    )


def check_passages(
    house: House,
    rooms: dict[int, Polygon],
    footprints: dict[int, list[Geometry]],
    lattice: CheckedLattice,
    report: FindingCollector,
) -> None:
    """Check that doors are clear of furniture and every room can be reached."""
    for door in house.doors:
        if not door.open:
            continue
        before = _before(door)
        shapely.prepare(before)
        for object_id, plans in footprints.items():
            if any(
                shapely.intersects(before, plan) and plans_overlap(before, plan) for plan in plans
            ):
                report.expect(
                    False,  # noqa: FBT003 - reached only where it fails
                    "house.door-clear",
                    f"0.65 m free before door {door.door_id}",
                    f"object {object_id}",
                )
        report.counts["predicates"] += 1
    labels = lattice.components()
    points = lattice.points()
    main = np.bincount(labels[labels >= 0]).argmax() if (labels >= 0).any() else -1
    for room_id, room in rooms.items():
        shapely.prepare(room)
        inside = shapely.intersects_xy(room, points[:, 0], points[:, 1]) & (labels >= 0)
        connected = int((inside & (labels == main)).sum())
        report.expect(
            connected > REACHED * int(inside.sum()),
            "house.reachable",
            f"room {room_id}: more than half of {int(inside.sum())} free nodes joined to the rest",
            connected,
        )
