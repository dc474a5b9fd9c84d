"""Scenes of several kinds, for tests of an engine's purity."""

import numpy as np
from builders import asset, part, table

from internav_data.geometry import yaw_quaternion
from internav_data.physics import AgentCollider, Body, PhysicsScene, wall_body
from internav_data.physics.solving import solve_push, solve_settle
from internav_data.records import PUSH_SPECS, Pose, Wall

LEGS = {"leg_m": 0.05, "friction": 0.5}
THINGS = (
    table("Table_0", (0.8, 0.8, 0.44), mass_kg=9.0, **LEGS),
    table("Stool_0", (0.35, 0.35, 0.44), mass_kg=4.0, **LEGS),
    asset("Bin_0", part("cylinder", (0.0, 0.0, 0.25), (0.3, 0.3, 0.5)), mass_kg=3.0),
    asset("Ball_0", part("sphere", (0.0, 0.0, 0.12), (0.24, 0.24, 0.24)), mass_kg=0.6),
)


def scenes(count):
    """Pushes and falls of one to four things, some beside a wall or the agent."""
    rng = np.random.default_rng(7)
    made = []
    for k in range(count):
        thing = THINGS[k % len(THINGS)]
        around = [
            Body.of(
                THINGS[rng.integers(len(THINGS))],
                Pose(0.75 * (n + 1), rng.uniform(-0.2, 0.2), 0.001, yaw_quaternion(15 * k)),
                moves=bool(rng.random() < 0.7),
            )
            for n in range(rng.integers(3))
        ]
        if rng.random() < 0.5:
            around.append(wall_body(Wall(1.5, -2.0, 1.62, 2.0, 0.0, 2.6)))
        collider = AgentCollider(0.1, 0.85, 0.21) if rng.random() < 0.3 else None
        start = Pose(0.0, 0.0, 0.001 if k % 5 else 0.01, yaw_quaternion(15 * (k % 24)))
        made.append((PhysicsScene((Body.of(thing, start), *around), collider), k % 5 == 0))
    return made


def answer(engine, scene, falls):
    if falls:
        return solve_settle(engine, scene)
    return solve_push(engine, scene, PUSH_SPECS["force"])
