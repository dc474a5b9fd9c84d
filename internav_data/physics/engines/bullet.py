"""Bullet (Coumans, pybullet) as physics engine: one client per process, one scene per call.

One thread solves at a time, from the first body of a scene to the last pose. Two threads in one
world take each other's bodies away, and clients of their own would share Bullet's globals. A lock
costs nothing that threads could gain: pybullet holds the interpreter while it steps.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from internav_data.core.locks import ThreadLock
from internav_data.core.temporary import process_folder
from internav_data.geometry import centre_of_mass, multiply, rotation_matrix
from internav_data.physics.engines.bullet_scene import (
    HULL_MARGIN_M,
    RULES,
    STEP_S,
    Builder,
    pybullet,
)
from internav_data.physics.scene import PushSolution, SettleSolution
from internav_data.physics.sweep import bounding_radius_m, sweep_recorder
from internav_data.records import Pose

if TYPE_CHECKING:
    from internav_data.physics.scene import PhysicsScene
    from internav_data.records import Asset, PushSpec


REST_SPEED = 0.001
"""Speed below which a body counts as slow, m/s."""
REST_SPIN = 0.01
"""Angular speed below which a body counts as slow, rad/s."""
SHIFT_M = 10.0 * REST_SPEED * STEP_S
"""Distance in one step above which a body cannot be slow. Asking for a speed costs time."""
REST_STEPS = 10
"""Number of successive slow steps after which a body is at rest."""
SETTLE_LIMIT_S = 1.0
"""Time limit of a settle, simulated seconds."""
CREEP_STEPS = 24
"""Interval at which trembling bodies are looked at, steps (0.1 s)."""
CREEP_M = REST_SPEED * CREEP_STEPS * STEP_S
"""Distance that a resting body may tremble over `CREEP_STEPS`: 0.1 mm."""
CREEP_RAD = REST_SPIN * CREEP_STEPS * STEP_S
"""Angle that a resting body may tremble over `CREEP_STEPS`: 1 mrad."""
PUSH_LIMIT_S = 5.0
"""Time limit of a push after the release, simulated seconds; a body still rolling is left there."""
_ENGINE_LOCK = ThreadLock()
"""Held while a scene is built, stepped and read: by one thread of the process."""
_ASLEEP = (
    pybullet.ACTIVATION_STATE_ENABLE_SLEEPING
    | pybullet.ACTIVATION_STATE_ENABLE_WAKEUP
    | pybullet.ACTIVATION_STATE_SLEEP
)


@dataclass(slots=True, eq=False)
class Bullet:
    """Engine on one client of pybullet in DIRECT mode (without graphics)."""

    builder: Builder
    """Builder of scenes on the engine's client."""
    name: str = "bullet"
    rules: int = RULES
    libraries: tuple[str, ...] = ("pybullet",)
    contact_margin_m: float = HULL_MARGIN_M
    build: str = field(default_factory=lambda: f"pybullet {version('pybullet')}, rules {RULES}")

    def settle(self, scene: PhysicsScene) -> SettleSolution:
        """Let the first body fall until it is at rest, for one second at most."""
        with _ENGINE_LOCK:
            return self._settle(scene)

    def push(self, scene: PhysicsScene, spec: PushSpec) -> PushSolution:
        """Push the first body along +x, release it, and step until all bodies are at rest."""
        with _ENGINE_LOCK:
            return self._push(scene, spec)

    def _settle(self, scene: PhysicsScene) -> SettleSolution:
        ids = self.builder.build(scene)
        body = scene.bodies[0]
        radius = bounding_radius_m(body.asset)
        start, start_turn = pybullet.getBasePositionAndOrientation(ids[0], self.builder.client)
        reach, calm, steps = 0.0, 0, 0
        limit = round(SETTLE_LIMIT_S / STEP_S)
        while steps < limit and calm < REST_STEPS:
            pybullet.stepSimulation(self.builder.client)
            steps += 1
            speed, spin = pybullet.getBaseVelocity(ids[0], self.builder.client)
            slow = math.hypot(*speed) < REST_SPEED and math.hypot(*spin) < REST_SPIN
            calm = calm + 1 if slow else 0
            now, turn = pybullet.getBasePositionAndOrientation(ids[0], self.builder.client)
            shift = math.hypot(now[0] - start[0], now[1] - start[1])
            # A bound for all corners: the shift of the centre of mass plus the arc of the farthest.
            reach = max(reach, shift + radius * _angle(start_turn, turn))
        return SettleSolution(
            pose=self._pose(ids[0], body.asset),
            seconds=steps * STEP_S,
            at_rest=calm >= REST_STEPS,
            penetration_m=self._penetration(ids[0]),
            reach_m=reach,
        )

    def _push(self, scene: PhysicsScene, spec: PushSpec) -> PushSolution:
        ids = self.builder.build(scene)
        client = self.builder.client
        moving = [k for k, body in enumerate(scene.bodies) if body.moves]
        pushes_left = round(spec.seconds / STEP_S)
        limit = pushes_left + round(PUSH_LIMIT_S / STEP_S)
        recorders = [sweep_recorder(scene.bodies[k].asset, limit) for k in moving]
        movers = [(ids[k], recorder) for k, recorder in zip(moving, recorders, strict=True)]
        for mover, _ in movers[1:]:
            # Asleep, a body that is not touched neither trembles nor costs time; a touch wakes it.
            pybullet.changeDynamics(mover, -1, activationState=_ASLEEP, physicsClientId=client)
        for mover, recorder in movers:
            recorder.follow(*pybullet.getBasePositionAndOrientation(mover, client))
        # Speed gained in one step of pushing; inf for a kick.
        gain = spec.force_n / scene.bodies[0].dynamics.mass_kg * STEP_S
        calm, steps, rests = 0, 0, False
        while steps < limit and not rests:
            if pushes_left:
                pushes_left = self._apply_push(ids[0], spec, gain, pushes_left)
            pybullet.stepSimulation(client)
            steps += 1
            slow = not pushes_left
            for mover, recorder in movers:
                shift = recorder.follow(*pybullet.getBasePositionAndOrientation(mover, client))
                slow = slow and shift < SHIFT_M and self._slow(mover)
            calm = calm + 1 if slow else 0
            rests = calm >= REST_STEPS
            if steps % CREEP_STEPS == 0:
                # Trembling counts as rest; a body that has not yielded to a constant push by now
                # never will.
                crept = [recorder.crept(CREEP_M, CREEP_RAD) for recorder in recorders]
                rests = rests or not any(crept)
        return PushSolution(
            poses=tuple(self._pose(ids[k], scene.bodies[k].asset) for k in moving),
            sweeps=tuple(recorder.dop8 for recorder in recorders),
            paths=tuple(recorder.path for recorder in recorders),
            seconds=steps * STEP_S,
            at_rest=rests,
        )

    def _slow(self, identity: int) -> bool:
        """Return whether a body's linear and angular speeds are those of a body at rest."""
        speed, spin = pybullet.getBaseVelocity(identity, self.builder.client)
        return math.hypot(*speed) < REST_SPEED and math.hypot(*spin) < REST_SPIN

    def _apply_push(self, identity: int, spec: PushSpec, gain: float, pushes_left: int) -> int:
        """Push for one step; return the number of steps of pushing that are left."""
        speed, spin = pybullet.getBaseVelocity(identity, self.builder.client)
        if speed[0] + gain >= spec.speed_m_s:
            # The last impulse is scaled: it gives just the speed that is missing.
            missing = (spec.speed_m_s, speed[1], speed[2])
            pybullet.resetBaseVelocity(identity, missing, spin, self.builder.client)
            return 0
        middle, _ = pybullet.getBasePositionAndOrientation(identity, self.builder.client)
        force = (spec.force_n, 0.0, 0.0)
        pybullet.applyExternalForce(
            identity, -1, force, middle, pybullet.WORLD_FRAME, self.builder.client
        )
        return pushes_left - 1

    def _pose(self, identity: int, asset: Asset) -> Pose:
        """Return the pose of the asset's frame; Bullet reports that of the centre of mass."""
        position, turn = pybullet.getBasePositionAndOrientation(identity, self.builder.client)
        offset = rotation_matrix(turn) @ centre_of_mass(asset)
        x, y, z = (float(p - o) for p, o in zip(position, offset, strict=True))
        return Pose(x, y, z, (turn[0], turn[1], turn[2], turn[3]))

    def _penetration(self, identity: int) -> float:
        client = self.builder.client
        contacts: Any = pybullet.getContactPoints(bodyA=identity, physicsClientId=client)
        # Column 8 of a contact point is the distance, negative where bodies overlap.
        depths = [-contact[8] for contact in contacts]
        return max(0.0, *depths) if depths else 0.0


def _angle(first: tuple[float, ...], second: tuple[float, ...]) -> float:
    """Return the angle between two orientations, radians."""
    inverse = (-first[0], -first[1], -first[2], first[3])
    x, y, z, w = multiply(inverse, (second[0], second[1], second[2], second[3]))
    return 2.0 * math.atan2(math.sqrt(x * x + y * y + z * z), abs(w))


def bullet() -> Bullet:
    """Return this process's Bullet, connected at first use; its files are removed at exit."""
    with _ENGINE_LOCK:
        return _of_process(os.getpid())


@cache  # by process: forked ones would overwrite each other's files
def _of_process(_pid: int) -> Bullet:
    return Bullet(Builder(pybullet.connect(pybullet.DIRECT), process_folder()))
