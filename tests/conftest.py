"""A house written by hand, so that rooms' tests need no generator."""

from __future__ import annotations

import os
from types import MappingProxyType
from typing import TYPE_CHECKING

import pytest

from internav_data.records import (
    OUTSIDE,
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
    Window,
)

if TYPE_CHECKING:
    from internav_data.records import RGB, Vec3

# Tests ask the engine itself: an answer from disk would be right even if the engine no longer were.
os.environ["INTERNAV_CACHE_DIR"] = ""

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
HALF = 0.06


def box(centre: Vec3, size: Vec3, colour: RGB = (150, 110, 70)) -> Part:
    return Part("box", centre, size, UPRIGHT, (), colour, "wood")


def asset(asset_id: str, parts: list[Part], size: Vec3, **flags: bool | float) -> Asset:
    return Asset(
        asset_id=asset_id,
        type=asset_id.rsplit("_", 1)[0],
        size=size,
        mass_kg=float(flags.get("mass_kg", 10.0)),
        friction=0.6,
        pushable=bool(flags.get("pushable", False)),
        pickable=bool(flags.get("pickable", False)),
        spawnable=bool(flags.get("spawnable", False)),
        blocks=bool(flags.get("blocks", True)),
        parts=tuple(parts),
    )


def table() -> Asset:
    legs = [box((x, y, 0.36), (0.06, 0.06, 0.72)) for x in (-0.6, 0.6) for y in (-0.35, 0.35)]
    top = box((0.0, 0.0, 0.74), (1.3, 0.8, 0.04), (171, 128, 84))
    return asset("DiningTable_0", [*legs, top], (1.3, 0.8, 0.76), pushable=True, spawnable=True)


def chair() -> Asset:
    legs = [box((x, y, 0.22), (0.04, 0.04, 0.44)) for x in (-0.2, 0.2) for y in (-0.2, 0.2)]
    seat = box((0.0, 0.0, 0.46), (0.45, 0.45, 0.05), (98, 122, 150))
    back = box((0.0, 0.205, 0.7), (0.45, 0.04, 0.44), (82, 104, 130))
    return asset("Chair_0", [*legs, seat, back], (0.45, 0.45, 0.92), pushable=True, spawnable=True)


def bed() -> Asset:
    frame = box((0.0, 0.0, 0.15), (1.4, 2.1, 0.3), (120, 86, 58))
    mattress = box((0.0, 0.0, 0.4), (1.3, 2.0, 0.2), (232, 228, 220))
    cover = box((0.0, -0.35, 0.51), (1.34, 1.3, 0.04), (86, 120, 146))
    pillows = [
        Part("sphere", (x, 0.75, 0.56), (0.55, 0.35, 0.16), UPRIGHT, (), (248, 246, 240), "fabric")
        for x in (-0.33, 0.33)
    ]
    return asset("Bed_0", [frame, mattress, cover, *pillows], (1.4, 2.1, 0.65))


def apple() -> Asset:
    ball = Part("sphere", (0.0, 0.0, 0.05), (0.1, 0.1, 0.1), UPRIGHT, (), (190, 40, 40), "food")
    return asset("Apple_0", [ball], (0.1, 0.1, 0.1), pickable=True, spawnable=True, mass_kg=0.2)


def rug() -> Asset:
    flat = box((0.0, 0.0, 0.005), (2.0, 1.4, 0.01), (170, 120, 110))
    return asset("Rug_0", [flat], (2.0, 1.4, 0.01), blocks=False)


def thing(number: int, asset_id: str, x: float, y: float, room: int) -> SceneObject:
    kind = asset_id.rsplit("_", 1)[0]
    return SceneObject(number, asset_id, kind, room, x, y, 0.0, UPRIGHT, -1, -1)


def walls() -> tuple[Wall, ...]:
    """Outer walls of 9 x 4 m, one wall at x = 5 with a door of 1 m at y = 2, a window's breast."""
    high = 2.6
    return (
        Wall(-HALF, -HALF, 9 + HALF, HALF, 0.0, high),
        Wall(-HALF, HALF, HALF, 4 - HALF, 0.0, high),
        Wall(9 - HALF, HALF, 9 + HALF, 4 - HALF, 0.0, high),
        Wall(-HALF, 4 - HALF, 1.5, 4 + HALF, 0.0, high),
        Wall(2.9, 4 - HALF, 9 + HALF, 4 + HALF, 0.0, high),
        Wall(1.5, 4 - HALF, 2.9, 4 + HALF, 0.0, 0.9),
        Wall(1.5, 4 - HALF, 2.9, 4 + HALF, 2.1, high),
        Wall(5 - HALF, HALF, 5 + HALF, 1.5, 0.0, high),
        Wall(5 - HALF, 2.5, 5 + HALF, 4 - HALF, 0.0, high),
        Wall(5 - HALF, 1.5, 5 + HALF, 2.5, 2.1, high),
    )


@pytest.fixture(scope="session")
def hand_house() -> House:
    """Two rooms, 5 x 4 and 4 x 4 m, joined by one door; a table with chairs, a bed, a rug."""
    assets = {a.asset_id: a for a in (table(), chair(), bed(), apple(), rug())}
    return House(
        scene_id="scene-000003",
        scene=3,
        seed=0,
        split="train",
        preset="paper",
        outline=((0.0, 0.0), (9.0, 0.0), (9.0, 4.0), (0.0, 4.0)),
        rooms=(
            Room(
                0,
                "living_room",
                ((0.0, 0.0), (5.0, 0.0), (5.0, 4.0), (0.0, 4.0)),
                20.0,
                2.6,
                "oak",
                "white",
            ),
            Room(
                1,
                "bedroom",
                ((5.0, 0.0), (9.0, 0.0), (9.0, 4.0), (5.0, 4.0)),
                16.0,
                2.6,
                "wool",
                "white",
            ),
        ),
        doors=(
            Door(0, (0, 1), "single", 5.0, 2.0, 90.0, 1.0, 2.1, True),
            Door(1, (OUTSIDE, 0), "entrance", 4.0, 0.0, 0.0, 1.0, 2.1, False),
        ),
        windows=(Window(0, 0, 2.2, 4.0, 0.0, 1.4, 1.2, 0.9),),
        walls=walls(),
        objects=(
            thing(0, "Rug_0", 1.6, 1.6, 0),
            thing(1, "DiningTable_0", 1.6, 1.6, 0),
            thing(2, "Chair_0", 1.6, 2.2, 0),
            thing(3, "Bed_0", 8.2, 2.9, 1),
        ),
        materials=(
            Material("oak", (190, 150, 105), "planks"),
            Material("wool", (170, 176, 190), "carpet"),
            Material("white", (240, 240, 236), "plain"),
        ),
        room_graph=((0, 1),),
        area_m2=36.0,
        assets=MappingProxyType(assets),
    )


@pytest.fixture(scope="session")
def hand_episode() -> Episode:
    """A chair in the door of `hand_house` and an apple beyond it."""

    def obstacle(asset_id: str, x: float, y: float, *, pickable: bool) -> Obstacle:
        kind = asset_id.rsplit("_", 1)[0]
        return Obstacle(
            asset_id=asset_id,
            type=kind,
            x=x,
            y=y,
            z=0.0,
            quaternion=UPRIGHT,
            mass_kg=0.2 if pickable else 10.0,
            friction=0.6,
            pushable=not pickable,
            pickable=pickable,
            segment=0,
            settle_s=0.1,
            settle_penetration_m=0.0,
            outcomes=None,
        )

    return Episode(
        episode_id="scene-000003/0001",
        scene_id="scene-000003",
        split="train",
        index=1,
        seed=0,
        room_count=2,
        mode="blocked",
        sealed=True,
        rooms_on_path=2,
        obstacle_count=2,
        shortest_path_m=5.1,
        shortest_path_steps=22,
        obstructed_path_m=None,
        obstructed_path_steps=None,
        start=Start(12, 4, 3.0, 1.0, 90, 0),
        goal=Goal(28, 4, 7.0, 1.0, 1),
        room_paths=((0, 1),),
        room_paths_truncated=False,
        node_paths=(NodePath((0,), ((3.0, 1.0), (5.0, 2.0), (7.0, 1.0))),),
        node_paths_truncated=False,
        obstacles=(
            obstacle("Chair_0", 5.0, 2.0, pickable=False),
            obstacle("Apple_0", 6.0, 1.5, pickable=True),
        ),
        expert=None,
        physics=Physics("bullet", "3.2.7", 0.1, 0.0),
    )
