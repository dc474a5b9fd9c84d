"""Assets, houses and episodes made by hand, for every room's tests: records alone, no generator."""

from __future__ import annotations

import math
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from internav_data.physics import engines
from internav_data.records import (
    Asset,
    Door,
    Episode,
    Goal,
    House,
    Material,
    NodePath,
    Obstacle,
    Part,
    Physics,
    Room,
    SceneObject,
    Start,
    Wall,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import numpy as np
    from numpy.typing import NDArray

    from internav_data.records import RGB, Quaternion, Vec2, Vec3

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
WOOD: RGB = (150, 110, 70)
WALL_HALF_M = 0.06
"""Half a wall's thickness."""
WALL_HEIGHT_M = 2.6
DOOR_HEIGHT_M = 2.1
STEP_M = 0.25
"""Distance between nodes of the lattice."""
MATERIALS = (
    Material("oak", (190, 150, 105), "planks"),
    Material("wool", (170, 176, 190), "carpet"),
    Material("white", (240, 240, 236), "plain"),
)


def yaw(degrees: float) -> Quaternion:
    """Quaternion of a turn about z, rounded to 6 decimals as in data."""
    half = math.radians(degrees) / 2
    return (0.0, 0.0, round(math.sin(half), 6), round(math.cos(half), 6))


# Assets


def part(
    shape: str,
    centre: Vec3,
    size: Vec3,
    rotation: Quaternion = UPRIGHT,
    *,
    corners: Iterable[Vec3] = (),
    colour: RGB = WOOD,
    material: str = "wood",
) -> Part:
    """Return a wooden part."""
    return Part(shape, centre, size, rotation, tuple(corners), colour, material)


def box(centre: Vec3, size: Vec3, colour: RGB = WOOD) -> Part:
    """Return a wooden box that stands upright."""
    return part("box", centre, size, colour=colour)


def asset(asset_id: str, *parts: Part, **changes: Any) -> Asset:
    """Return an asset of 10 kg that can be pushed; its type is its id without the number.

    Its size is that of its parts' boxes, as if these stood upright.
    """
    spans = [
        max(p.centre[k] + p.size[k] / 2 for p in parts)
        - min(p.centre[k] - p.size[k] / 2 for p in parts)
        for k in range(3)
    ]
    made = Asset(
        asset_id=asset_id,
        type=asset_id.rsplit("_", 1)[0],
        size=(spans[0], spans[1], spans[2]),
        mass_kg=10.0,
        friction=0.6,
        pushable=True,
        pickable=False,
        spawnable=True,
        blocks=True,
        parts=parts,
    )
    return replace(made, **changes)


def crate(asset_id: str, size: Vec3, *, colour: RGB = WOOD, **changes: Any) -> Asset:
    """Return a box on the floor, 10 kg, that can be pushed."""
    return asset(asset_id, box((0.0, 0.0, size[2] / 2), size, colour), **{"size": size, **changes})


def table(
    asset_id: str = "DiningTable_0",
    size: Vec3 = (1.3, 0.8, 0.76),
    *,
    leg_m: float = 0.06,
    inset_m: float = 0.05,
    **changes: Any,
) -> Asset:
    """Return a table: a top of 4 cm on four legs whose middles are `inset_m` from its edges."""
    width, depth, height = size
    high = height - 0.04
    x, y = round(width / 2 - inset_m, 6), round(depth / 2 - inset_m, 6)
    legs = [
        box((sx * x, sy * y, high / 2), (leg_m, leg_m, high)) for sx in (-1, 1) for sy in (-1, 1)
    ]
    top = box((0.0, 0.0, height - 0.02), (width, depth, 0.04), (171, 128, 84))
    return asset(asset_id, *legs, top, **{"size": size, **changes})


def chair(asset_id: str = "Chair_0", *, seat_m: float = 0.46, **changes: Any) -> Asset:
    """Return a chair, 10 kg; its seat's middle is `seat_m` high, its back half a metre more."""
    high = seat_m - 0.02
    legs = [box((x, y, high / 2), (0.04, 0.04, high)) for x in (-0.2, 0.2) for y in (-0.2, 0.2)]
    seat = box((0.0, 0.0, seat_m), (0.45, 0.45, 0.05), (98, 122, 150))
    back = box((0.0, 0.205, seat_m + 0.24), (0.45, 0.04, 0.44), (82, 104, 130))
    return asset(asset_id, *legs, seat, back, **{"size": (0.45, 0.45, seat_m + 0.46), **changes})


def bed() -> Asset:
    """Return a double bed that cannot be moved."""
    frame = box((0.0, 0.0, 0.15), (1.4, 2.1, 0.3), (120, 86, 58))
    mattress = box((0.0, 0.0, 0.4), (1.3, 2.0, 0.2), (232, 228, 220))
    cover = box((0.0, -0.35, 0.51), (1.34, 1.3, 0.04), (86, 120, 146))
    pillows = [
        part(
            "sphere", (x, 0.75, 0.56), (0.55, 0.35, 0.16), colour=(248, 246, 240), material="fabric"
        )
        for x in (-0.33, 0.33)
    ]
    made = asset("Bed_0", frame, mattress, cover, *pillows, pushable=False, spawnable=False)
    return replace(made, size=(1.4, 2.1, 0.65))


def apple() -> Asset:
    """Return a ball of 10 cm and 0.2 kg that can be picked up."""
    size = (0.1, 0.1, 0.1)
    ball = part("sphere", (0.0, 0.0, 0.05), size, colour=(190, 40, 40), material="food")
    return asset("Apple_0", ball, size=size, mass_kg=0.2, pushable=False, pickable=True)


def screen(asset_id: str = "Screen_0", **changes: Any) -> Asset:
    """Return a screen on a flat foot that reaches 18 cm beyond its footprint to both sides."""
    foot = box((0.0, 0.0, 0.009), (0.6, 0.4, 0.018))
    panel = box((0.0, 0.0, 0.259), (0.6, 0.04, 0.482))
    return asset(asset_id, foot, panel, **changes)


def rug() -> Asset:
    """Return a rug, which blocks nothing."""
    made = crate("Rug_0", (2.0, 1.4, 0.01), colour=(170, 120, 110))
    return replace(made, pushable=False, spawnable=False, blocks=False)


def bounds_of(asset: Asset) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest corner of an asset's bounding box: two (3,) float64, metres."""
    from internav_data.geometry import asset_corners

    corners, _ = asset_corners(asset)
    return corners.min(axis=0), corners.max(axis=0)


def by_id(*assets: Asset) -> Mapping[str, Asset]:
    """Return a catalogue of assets."""
    return MappingProxyType({a.asset_id: a for a in assets})


# Houses


def rectangle(x0: float, y0: float, x1: float, y1: float) -> tuple[Vec2, Vec2, Vec2, Vec2]:
    """Corners of a rectangle, counter-clockwise."""
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def room(number: int, polygon: Iterable[Vec2], area_m2: float, kind: str = "living_room") -> Room:
    """Return a room with a floor of oak."""
    return Room(number, kind, tuple(polygon), area_m2, WALL_HEIGHT_M, "oak", "white")


def wall(
    x0: float, y0: float, x1: float, y1: float, z0: float = 0.0, z1: float = WALL_HEIGHT_M
) -> Wall:
    """Return a wall as high as the rooms, if nothing else is given."""
    return Wall(x0, y0, x1, y1, z0, z1)


def lintel(x0: float, y0: float, x1: float, y1: float) -> Wall:
    """Wall above a door."""
    return wall(x0, y0, x1, y1, DOOR_HEIGHT_M)


def outer_walls(width: float, depth: float) -> tuple[Wall, ...]:
    """Walls along the outline of a house of width x depth metres, half of them within it."""
    h = WALL_HALF_M
    return (
        wall(-h, -h, width + h, h),
        wall(-h, depth - h, width + h, depth + h),
        wall(-h, h, h, depth - h),
        wall(width - h, h, width + h, depth - h),
    )


def door(number: int, rooms: tuple[int, int], x: float, y: float, yaw_deg: float = 90.0) -> Door:
    """Return an open door of 1 m; without a yaw it stands in a wall along y."""
    return Door(number, rooms, "single", x, y, yaw_deg, 1.0, DOOR_HEIGHT_M, True)


def scene_object(
    number: int,
    asset_id: str,
    room: int,
    x: float,
    y: float,
    *,
    yaw_deg: float = 0.0,
    group: int = -1,
) -> SceneObject:
    """Return an object on the floor."""
    kind = asset_id.rsplit("_", 1)[0]
    return SceneObject(number, asset_id, kind, room, x, y, 0.0, yaw(yaw_deg), group, -1)


def house(rooms: Iterable[Room], outline: Iterable[Vec2], scene: int = 0, **changes: Any) -> House:
    """Return a house of the split "train": no door, wall, window or object if none is given."""
    rooms = tuple(rooms)
    made = House(
        scene_id=f"scene-{scene:06d}",
        scene=scene,
        seed=0,
        split="train",
        preset="paper",
        outline=tuple(outline),
        rooms=rooms,
        doors=(),
        windows=(),
        walls=(),
        objects=(),
        materials=MATERIALS,
        room_graph=(),
        area_m2=sum(r.area_m2 for r in rooms),
        assets=by_id(),
    )
    return replace(made, **{name: _frozen(value) for name, value in changes.items()})


def _frozen(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def one_room(width: float, depth: float, *inner: tuple[float, float, float, float]) -> House:
    """Return a room of width x depth metres; inner walls are (low x, low y, high x, high y)."""
    outline = rectangle(0.0, 0.0, width, depth)
    walls = (*outer_walls(width, depth), *(wall(*bounds) for bounds in inner))
    return house([room(0, outline, width * depth)], outline, walls=walls)


# Episodes


def obstacle(
    asset: Asset, x: float, y: float, *, yaw_deg: float = 0.0, penetration_m: float = 0.0
) -> Obstacle:
    """Return an obstacle on the floor, with its asset's dynamics and no outcomes."""
    return Obstacle(
        asset_id=asset.asset_id,
        type=asset.type,
        x=x,
        y=y,
        z=0.0,
        quaternion=yaw(yaw_deg),
        mass_kg=asset.mass_kg,
        friction=asset.friction,
        pushable=asset.pushable,
        pickable=asset.pickable,
        node_path_segment=0,
        settle_s=0.1,
        settle_penetration_m=penetration_m,
        outcomes=None,
    )


def start(i: int, j: int, yaw_deg: int = 90, room: int = 0) -> Start:
    """Return a start at a node of the lattice."""
    return Start(i, j, STEP_M * i, STEP_M * j, yaw_deg, room)


def goal(i: int, j: int, room: int = 0) -> Goal:
    """Return a goal at a node of the lattice."""
    return Goal(i, j, STEP_M * i, STEP_M * j, room)


def episode(
    house: House, start: Start, goal: Goal, obstacles: Iterable[Obstacle], **changes: Any
) -> Episode:
    """Return a blocked, sealed episode; if nothing else is given, its ends are in one room.

    The shortest path is the straight line, its steps are those between the nodes.
    """
    obstacles = tuple(obstacles)
    index = changes.pop("index", 1)
    ends = ((start.x, start.y), (goal.x, goal.y))
    made = Episode(
        episode_id=f"{house.scene_id}/{index:04d}",
        scene_id=house.scene_id,
        split=house.split,
        index=index,
        seed=house.seed,
        room_count=len(house.rooms),
        mode="blocked",
        sealed=True,
        rooms_on_path=1,
        obstacle_count=len(obstacles),
        shortest_path_m=math.dist(*ends),
        shortest_path_steps=abs(goal.i - start.i) + abs(goal.j - start.j),
        obstructed_path_m=None,
        obstructed_path_steps=None,
        start=start,
        goal=goal,
        room_paths=((start.room,),),
        room_paths_truncated=False,
        node_paths=(NodePath((), ends),),
        node_paths_truncated=False,
        obstacles=obstacles,
        expert=None,
        physics=Physics(engines.DEFAULT_ENGINE, "3.2.7", 0.1, 0.0),
    )
    return replace(made, **changes)
