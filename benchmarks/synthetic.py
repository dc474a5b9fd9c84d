"""Episodes and houses that look like generated ones to a file format, made in no time.

Rooms on a grid with loops, all room and node paths, obstacles with settled poses: the same sizes,
repetitions and roundings as real data, but nothing that was simulated.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data.dataset import Identity, assemble, open_staging, stage_scene
from internav_data.records import (
    Asset,
    Door,
    Episode,
    Expert,
    Goal,
    House,
    Material,
    MovedObject,
    NodePath,
    Obstacle,
    Outcome,
    Part,
    Physics,
    Pose,
    Room,
    SceneObject,
    Start,
    Wall,
)

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from internav_data.dataset import Manifest

_ROOMS = ([1] * 22 + [2] * 17 + [3] * 14 + [4] * 14 + [5] * 14) + [6, 7, 8, 9, 10] * 4
_LIMIT = 64
_ACTIONS = ("push_east", "push_north", "push_west", "push_south", "pick")


def catalogue() -> tuple[Asset, ...]:
    """Return 655 assets of four parts each."""
    rng = np.random.default_rng(0)
    return tuple(
        Asset(
            asset_id=f"Type{k // 33}_{k % 33}",
            type=f"Type{k // 33}",
            size=_point(rng, 1, 3),
            mass_kg=round(float(rng.uniform(0.2, 90)), 3),
            friction=round(float(rng.uniform(0.4, 0.8)), 3),
            pushable=k % 2 == 0,
            pickable=k % 2 == 1,
            spawnable=True,
            blocks=True,
            parts=tuple(
                Part(
                    "box",
                    _point(rng, 1, 3),
                    _point(rng, 1, 3),
                    (0.0, 0.0, 0.0, 1.0),
                    (),
                    (9, 9, 9),
                    "wood",
                )
                for _ in range(4)
            ),
        )
        for k in range(655)
    )


def _point(rng: np.random.Generator, scale: float, dimensions: int) -> Any:  # noqa: ANN401 - a tuple of so many
    return tuple(round(float(v), 4) for v in rng.uniform(0, scale, dimensions))


def _house(scene: int, rng: np.random.Generator, assets: tuple[Asset, ...]) -> House:
    count = _ROOMS[scene * 37 % len(_ROOMS)]
    wide = math.ceil(math.sqrt(count))
    cells = [(k % wide * 5.0, k // wide * 5.0) for k in range(count)]
    rooms = tuple(
        Room(
            k,
            "bedroom",
            ((x, y), (x + 5, y), (x + 5, y + 5), (x, y + 5)),
            25.0,
            2.6,
            "oak",
            "paint",
        )
        for k, (x, y) in enumerate(cells)
    )
    doors = _doors(cells, rng)
    things = tuple(
        _thing(n, int(rng.integers(count)), rng, assets[int(rng.integers(len(assets)))])
        for n in range(6 * count)
    )
    walls = tuple(
        Wall(*_point(rng, 20, 2), *_point(rng, 20, 2), 0.0, 2.6) for _ in range(8 * count)
    )
    return House(
        scene_id=f"scene-{scene:06d}",
        scene=scene,
        seed=0,
        split="val" if scene % 120 == 0 else "test" if scene % 120 == 1 else "train",
        preset="paper",
        outline=((0.0, 0.0), (wide * 5.0, 0.0), (wide * 5.0, wide * 5.0), (0.0, wide * 5.0)),
        rooms=rooms,
        doors=doors,
        windows=(),
        walls=walls,
        objects=things,
        materials=(Material("oak", (120, 90, 60), "planks"),),
        room_graph=tuple(sorted({d.rooms for d in doors})),
        area_m2=25.0 * count,
        assets={},
    )


def _doors(cells: Sequence[tuple[float, float]], rng: np.random.Generator) -> tuple[Door, ...]:
    doors = []
    for a in range(len(cells)):
        for b in range(a + 1, len(cells)):
            dx, dy = cells[b][0] - cells[a][0], cells[b][1] - cells[a][1]
            if (
                dx + dy == 5
                and dx >= 0
                and dy >= 0
                and (rng.random() < 0.6 or b == a + 1 or dx == 0)
            ):
                along = round(float(rng.uniform(1, 4)), 2)
                x, y = (
                    (cells[b][0], cells[b][1] + along) if dx else (cells[b][0] + along, cells[b][1])
                )
                doors.append(
                    Door(
                        len(doors), (a, b), "single", x, y, 90.0 if dx else 0.0, 1.0, 2.1, open=True
                    )
                )
    return tuple(doors)


def _thing(number: int, room: int, rng: np.random.Generator, asset: Asset) -> SceneObject:
    x, y = _point(rng, 15, 2)
    half = math.radians(90 * int(rng.integers(4))) / 2
    turn = (0.0, 0.0, round(math.sin(half), 6), round(math.cos(half), 6))
    return SceneObject(number, asset.asset_id, asset.type, room, x, y, 0.0, turn, -1, -1)


def _paths(house: House, a: int, b: int) -> list[tuple[int, ...]]:
    found: list[tuple[int, ...]] = []

    def walk(path: tuple[int, ...]) -> None:
        if len(found) >= 4 * _LIMIT:
            return
        if path[-1] == b:
            found.append(path)
            return
        for pair in house.room_graph:
            if path[-1] in pair:
                beyond = pair[0] + pair[1] - path[-1]
                if beyond not in path:
                    walk((*path, beyond))

    walk((a,))
    return sorted(found, key=lambda p: (len(p), p))[:_LIMIT]


def _node_path(
    house: House, rooms: tuple[int, ...], start: tuple[float, float], goal: tuple[float, float]
) -> NodePath:
    doors = {door.rooms: door for door in house.doors}
    through = [doors[min(p, q), max(p, q)] for p, q in pairwise(rooms)]
    return NodePath(
        tuple(d.door_id for d in through), (start, *((d.x, d.y) for d in through), goal)
    )


def _episode(
    house: House, index: int, rng: np.random.Generator, assets: tuple[Asset, ...], full: bool
) -> Episode:
    count = len(house.rooms)
    a = int(rng.integers(count))
    b = (a + 1 + int(rng.integers(count - 1))) % count if count > 1 else a
    ends = [
        (int(x * 4) + int(rng.integers(2, 18)), int(y * 4) + int(rng.integers(2, 18)))
        for x, y in (house.rooms[a].polygon[0], house.rooms[b].polygon[0])
    ]
    (i, j), (k, l) = ends
    paths = _paths(house, a, b)
    node_paths = tuple(_node_path(house, p, (i / 4, j / 4), (k / 4, l / 4)) for p in paths)
    mode = "blocked" if (house.scene + index) % 2 == 0 else "lengthened"
    clear = int(rng.integers(8, 70))
    obstacles = tuple(
        _obstacle(rng, assets[int(rng.integers(len(assets)))], mode == "blocked", full)
        for _ in range(1 + int(rng.integers(2 + min(count, 6))))
    )
    way = None if mode == "blocked" and rng.random() < 0.5 else round(float(rng.uniform(2, 20)), 4)
    return Episode(
        episode_id=f"{house.scene_id}/{index:04d}",
        scene_id=house.scene_id,
        split=house.split,
        index=index,
        seed=0,
        room_count=count,
        mode=mode,  # type: ignore[arg-type] # one of two words
        sealed=way is None,
        rooms_on_path=len(paths[0]),
        obstacle_count=len(obstacles),
        shortest_path_m=round(float(rng.uniform(2, 20)), 4),
        shortest_path_steps=clear,
        obstructed_path_m=way,
        obstructed_path_steps=None if mode == "blocked" else clear + int(rng.integers(1, 30)),
        start=Start(i, j, i / 4, j / 4, 90 * int(rng.integers(4)), a),
        goal=Goal(k, l, k / 4, l / 4, b),
        room_paths=tuple(paths),
        room_paths_truncated=False,
        node_paths=node_paths,
        node_paths_truncated=False,
        obstacles=obstacles,
        expert=_expert(rng, index) if full else None,
        physics=_physics(obstacles),
    )


def _physics(obstacles: tuple[Obstacle, ...]) -> Physics:
    seconds, depth = (o.settle_s for o in obstacles), (o.settle_penetration_m for o in obstacles)
    return Physics("bullet", "3.2.7", max(seconds), max(depth))


def _expert(rng: np.random.Generator, index: int) -> Expert | None:
    """Actions as long as usual; none in a few episodes, as when unsolvable ones are kept."""
    if index % 50 == 5:
        return None
    steps = int(rng.integers(10, 80))
    pushes, picks = (int(count) for count in rng.integers(0, 3, 2))
    return Expert(
        tuple(rng.integers(0, 12, steps).tolist()), steps, pushes, picks, 0.25 * (steps // 2)
    )


def _obstacle(rng: np.random.Generator, asset: Asset, blocked: bool, full: bool) -> Obstacle:
    x, y = _point(rng, 15, 2)
    half = math.radians(15 * int(rng.integers(24))) / 2
    tilt = [round(float(v), 6) for v in rng.normal(0, 2e-5, 2)]
    yaw = (round(math.sin(half), 6), round(math.cos(half), 6))
    outcomes = tuple(_outcome(rng, action, asset, blocked) for action in _ACTIONS)
    return Obstacle(
        asset_id=asset.asset_id,
        type=asset.type,
        x=x,
        y=y,
        z=round(float(rng.normal(0, 1e-4)), 4),
        quaternion=(*tilt, *(yaw if yaw[1] >= 0 else (-yaw[0], -yaw[1]))),  # type: ignore[arg-type]
        mass_kg=asset.mass_kg,
        friction=asset.friction,
        pushable=asset.pushable,
        pickable=asset.pickable,
        node_path_segment=int(rng.integers(3)),
        settle_s=round(int(rng.integers(20, 140)) / 240, 6),
        settle_penetration_m=round(float(abs(rng.normal(0, 2e-4))), 6),
        outcomes=outcomes if full else None,
    )


def _outcome(rng: np.random.Generator, action: str, asset: Asset, blocked: bool) -> Outcome:
    able = asset.pickable if action == "pick" else asset.pushable
    success, opened = able and rng.random() < 0.6, blocked and rng.random() < 0.1
    return Outcome(
        action,
        bool(success),
        round(float(rng.uniform(0, 1)), 4),
        int(rng.integers(8, 90)),
        round(float(rng.uniform(2, 20)), 4),
        bool(success and opened),
        round(int(rng.integers(100, 900)) / 240, 6),
        "",
        pose=_pose(rng) if success and action != "pick" else None,
        moved=(MovedObject(None, 1, _pose(rng)),) if success and rng.random() < 0.1 else (),
        at_rest=True,
    )


def _pose(rng: np.random.Generator) -> Pose:
    half = float(rng.uniform(-math.pi / 2, math.pi / 2))
    turn = (*rng.normal(0, 2e-5, 2).round(6).tolist(), *(math.sin(half), math.cos(half)))
    x, y = rng.uniform(0, 15, 2).round(4).tolist()
    return Pose(x, y, 0.001, (turn[0], turn[1], round(turn[2], 6), round(turn[3], 6)))


def write_synthetic(out: Path, scenes: int, episodes: int, *, full: bool = False) -> Manifest:
    """Write a dataset; `full` ones have outcomes and an expert in every episode."""
    assets = catalogue()
    identity = Identity("synthetic", "1", 0, 1, "0" * 64, {"full": full})
    staging = open_staging(out, identity)
    for scene in range(scenes):
        rng = np.random.default_rng([scene, 1])
        house = _house(scene, rng, assets)
        rows = [_episode(house, index, rng, assets, full) for index in range(episodes)]
        redraws = {"no expert": 1} if full and scene % 10 == 0 else {}
        stage_scene(staging, scene, house, rows, redraws=redraws)
    return assemble(out, identity, assets, scenes)
