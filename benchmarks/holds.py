"""Test of the poses after pushes: does each hold in a fresh Bullet scene for 2 s? JSON out.

    python benchmarks/holds.py [--pushes 2000] [--push-model force] [--seed 0] [--out FILE]

The scenes are built here, with Bullet's own defaults: everything within half a metre of what moved,
all that can move free to. A pose counts as one that nothing holds when its object moves more than
5 mm or turns more than 1 degree in 2 s. The poses in which obstacles stand at the start of an
episode are counted too.

Target: none of 2,000.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
from collections import Counter
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pybullet as bullet

from internav_data.catalog import catalogue
from internav_data.episodes import build_episodes
from internav_data.geometry import centre_of_mass, part_corners
from internav_data.houses import HouseConfig, build_house
from internav_data.physics.kdop import grown
from internav_data.physics.sweep import extent_of
from internav_data.world import HouseModel, World, WorldConfig
from internav_data.world.config import DEFAULT_WORLD

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from internav_data.physics import Body
    from internav_data.records import Asset, Episode, Pose

SECONDS = 2.0
TOLERANCE_M = 0.005
TOLERANCE_DEG = 1.0
NEAR_M = 0.5
STEP_S = 1.0 / 240.0
ROLLING_FRICTION = 0.01
TARGET = 0
FOLDER = tempfile.TemporaryDirectory()


class FreshScene:
    """A Bullet scene of its own for bodies at their poses."""

    def __init__(self, bodies: Sequence[Body]) -> None:
        self.client = bullet.connect(bullet.DIRECT)
        bullet.setGravity(0.0, 0.0, -9.81, physicsClientId=self.client)
        bullet.setTimeStep(STEP_S, physicsClientId=self.client)
        self._visual = bullet.createVisualShape(
            bullet.GEOM_SPHERE, radius=0.01, physicsClientId=self.client
        )
        floor = bullet.createCollisionShape(
            bullet.GEOM_BOX,
            halfExtents=(100.0, 100.0, 1.0),
            collisionFramePosition=(0.0, 0.0, -1.0),
            physicsClientId=self.client,
        )
        self._surface(bullet.createMultiBody(0.0, floor, physicsClientId=self.client), 1.0)
        self.ids = [self._add(body) for body in bodies]

    def close(self) -> None:
        """Disconnect from Bullet."""
        bullet.disconnect(self.client)

    def run(self, seconds: float) -> None:
        """Simulate for some time."""
        for _ in range(round(seconds / STEP_S)):
            bullet.stepSimulation(self.client)

    def placements(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return the centre of mass (3,) and orientation (4,) of each body, float64, metres."""
        return [
            tuple(map(np.array, bullet.getBasePositionAndOrientation(number, self.client)))
            for number in self.ids
        ]

    def _add(self, body: Body) -> int:
        pose = body.pose
        shape = bullet.createCollisionShape(
            bullet.GEOM_MESH, fileName=_file(body.asset), physicsClientId=self.client
        )
        number = bullet.createMultiBody(
            body.dynamics.mass_kg if body.moves else 0.0,
            shape,
            self._visual,
            basePosition=(pose.x, pose.y, pose.z),
            baseOrientation=pose.quaternion,
            baseInertialFramePosition=centre_of_mass(body.asset),
            physicsClientId=self.client,
        )
        self._surface(number, body.dynamics.friction)
        return int(number)

    def _surface(self, number: int, friction: float) -> None:
        bullet.changeDynamics(
            number,
            -1,
            lateralFriction=friction,
            rollingFriction=ROLLING_FRICTION,
            spinningFriction=ROLLING_FRICTION,
            restitution=0.0,
            linearDamping=0.0,
            angularDamping=0.0,
            activationState=bullet.ACTIVATION_STATE_DISABLE_SLEEPING,
            physicsClientId=self.client,
        )


@lru_cache(maxsize=4096)
def _file(asset: Asset) -> str:
    """Write an asset's parts as an OBJ file of one group a part; Bullet makes hulls of them."""
    lines, first = [], 1
    for number, part in enumerate(asset.parts):
        corners = part_corners(part)
        lines.append(f"o part{number}")
        lines += [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in corners]
        lines += [f"f {first} {first + k} {first + k + 1}" for k in range(1, len(corners) - 1)]
        first += len(corners)
    path = Path(FOLDER.name, f"{len(list(Path(FOLDER.name).iterdir()))}.obj")
    path.write_text("\n".join(lines), encoding="ascii")
    return str(path)


def drift(bodies: Sequence[Body], seconds: float = SECONDS) -> list[tuple[float, float]]:
    """Return how far (m) each body moves, and how far (degrees) it turns, in a fresh scene."""
    scene = FreshScene(bodies)
    before = scene.placements()
    scene.run(seconds)
    after = scene.placements()
    scene.close()
    return [
        (
            float(np.linalg.norm(there - here)),
            math.degrees(2.0 * math.acos(min(1.0, abs(float(turn @ turned))))),
        )
        for (here, turn), (there, turned) in zip(before, after, strict=True)
    ]


def holds(moved: tuple[float, float]) -> bool:
    return moved[0] <= TOLERANCE_M and moved[1] <= TOLERANCE_DEG


def around(world: World, indices: Iterable[int]) -> tuple[list[int], list[Body]]:
    """Return all bodies near some of a world's objects, with their keys, these objects first."""
    first = list(indices)
    bodies = {k: world.body(k) for k in first}
    for k in first:
        body = bodies[k]
        bodies.update(world.near(grown(extent_of(body.asset, body.pose).dop8, NEAR_M)))
    return list(bodies), list(bodies.values())


def push_drift(world: World, moved: Sequence[tuple[int, Pose]]) -> list[tuple[float, float]]:
    """Return the drift of the objects that a push moved, from the poses after it."""
    there = world.copy()
    there.put(moved)
    _, bodies = around(there, [k for k, _ in moved])
    return drift(bodies)[: len(moved)]


def made(seed: int, world_config: WorldConfig = DEFAULT_WORLD) -> Iterator[tuple[World, Episode]]:
    """Make worlds of episodes, four a house."""
    pool, config = catalogue().spawnable, HouseConfig()
    scene = 0
    while True:
        house = build_house(seed, scene, config, catalogue())
        model = HouseModel.of(house)
        for episode in build_episodes(house, 4, pool):
            yield World.of_episode(model, episode, catalogue().assets, world_config), episode
        scene += 1


def successful_pushes(world: World) -> Iterator[tuple[int, int, Any]]:
    """Push every obstacle along every heading; yield index, heading and result of successes."""
    for index in world.obstacles:
        if not world.items[index].dynamics.pushable:
            continue
        for heading in range(4):
            pushed = world.simulate_push(index, heading, agent=False)
            if pushed.success:
                yield index, heading, pushed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pushes", type=int, default=2000)
    parser.add_argument("--push-model", default="force")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()

    count: Counter[str] = Counter()
    failed: list[dict[str, Any]] = []
    for world, episode in made(args.seed, WorldConfig(push_model=args.push_model)):
        if count["pushes"] >= args.pushes:
            break
        _, bodies = around(world, world.obstacles)
        count["starts"] += len(world.obstacles)
        count["starts_that_move"] += sum(
            not holds(d) for d in drift(bodies)[: len(world.obstacles)]
        )
        for index, heading, pushed in successful_pushes(world):
            moved = [(index, pushed.pose), *pushed.moved]
            drifts = push_drift(world, moved)
            count["pushes"] += 1
            count["crowded"] += len(moved) > 1
            count["poses"] += len(moved)
            count["not_at_rest"] += not pushed.at_rest
            count["simulated_s"] += pushed.seconds
            loose = [(k, d) for (k, _), d in zip(moved, drifts, strict=True) if not holds(d)]
            count["pushes_that_move"] += bool(loose) and pushed.at_rest
            failed += [
                {
                    "episode": episode.episode_id,
                    "pushed": world.items[index].asset.asset_id,
                    "heading": heading,
                    "moves": world.items[k].asset.asset_id,
                    "by_m": round(d[0], 4),
                    "by_deg": round(d[1], 2),
                    "seconds": pushed.seconds,
                    "at_rest": pushed.at_rest,
                    "toppled": pushed.toppled,
                    "objects": len(moved),
                }
                for k, d in loose
            ]
    result = {"target": TARGET, "tolerance_m": TOLERANCE_M, "tolerance_deg": TOLERANCE_DEG}
    result |= {key: round(value, 3) for key, value in count.items()} | {"failed": failed}
    text = json.dumps(result, indent=2)
    if args.out:
        args.out.write_text(text + "\n", encoding="utf-8")
    sys.stdout.write(text + "\n")


if __name__ == "__main__":
    main()
