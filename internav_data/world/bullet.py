"""Bullet as the physics engine: one client a process, rebuilt from plain data at each call.

What is worked around here was measured: `resetSimulation` keeps time step and parameters (so all
are set each time), `removeBody` leaks, saved states are not bit-equal for compounds, automatic
visual shapes make bodies 27 times slower, and shape arrays stop at 16 shapes without a word. So
each asset is one OBJ file of convex groups (any number of parts), written once per process.
"""

from __future__ import annotations

import atexit
import math
import os
import sys
import tempfile
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from internav_data.geometry import asset_corners, centre_of_mass, multiply, rotation_matrix
from internav_data.records import Pose
from internav_data.world.setting import Motion, Rest
from internav_data.world.sweeps import trail_of
from internav_data.world.wavefront import obj_text

if TYPE_CHECKING:
    from types import ModuleType

    from internav_data.records import Asset, Vec3
    from internav_data.world.setting import Body, Column, Setting, Shove


def _import_quietly() -> ModuleType:
    """Import pybullet without the line about its build time that it prints on stderr."""
    sys.stderr.flush()
    kept = os.dup(2)
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 2)
        try:
            return import_module("pybullet")
        finally:
            os.dup2(kept, 2)
            os.close(kept)


pybullet: Any = _import_quietly()

STEP_S = 1.0 / 240.0
GRAVITY = 9.81
SOLVER_ITERATIONS = 50
FLOOR_FRICTION = 1.0
"""Bullet multiplies frictions, so an asset's own is what acts on floor and walls."""
ROLLING_FRICTION = 0.01
REST_SPEED = 0.001
"""m/s."""
REST_SPIN = 0.01
"""rad/s."""
REST_STEPS = 10
"""A thing is at rest once it was slow for this many steps running."""
SETTLE_LIMIT_S = 1.0
CREEP_STEPS = 24
CREEP_M = REST_SPEED * CREEP_STEPS * STEP_S
"""At rest is also what came no farther in 0.1 s than the rest speed allows: 0.1 mm, 1 mrad."""
CREEP_RAD = REST_SPIN * CREEP_STEPS * STEP_S
PUSH_LIMIT_S = 5.0
"""From letting go; what still rolls then stays where it is."""
AGENT_HEIGHT_M = 1.8
_ASLEEP = (
    pybullet.ACTIVATION_STATE_ENABLE_SLEEPING
    | pybullet.ACTIVATION_STATE_ENABLE_WAKEUP
    | pybullet.ACTIVATION_STATE_SLEEP
)


@dataclass(slots=True, eq=False)
class Bullet:
    """The engine of `internav_data.world.setting.Engine`, on one DIRECT client."""

    _client: int
    _folder: Path
    _files: dict[Asset, str] = field(default_factory=dict)
    name: str = "bullet"
    build: str = field(default_factory=lambda: f"pybullet {version('pybullet')}")

    def settle(self, setting: Setting) -> Rest:
        """Let the first body fall until at rest, one second at most."""
        ids = self._build(setting)
        body = setting.bodies[0]
        radius = _radius(body.asset)
        start, start_turn = pybullet.getBasePositionAndOrientation(ids[0], self._client)
        reach, calm, steps = 0.0, 0, 0
        limit = round(SETTLE_LIMIT_S / STEP_S)
        while steps < limit and calm < REST_STEPS:
            pybullet.stepSimulation(self._client)
            steps += 1
            speed, spin = pybullet.getBaseVelocity(ids[0], self._client)
            slow = math.hypot(*speed) < REST_SPEED and math.hypot(*spin) < REST_SPIN
            calm = calm + 1 if slow else 0
            now, turn = pybullet.getBasePositionAndOrientation(ids[0], self._client)
            shift = math.hypot(now[0] - start[0], now[1] - start[1])
            reach = max(reach, shift + radius * _angle(start_turn, turn))
        return Rest(
            pose=self._pose(ids[0], body.asset),
            seconds=steps * STEP_S,
            at_rest=calm >= REST_STEPS,
            penetration_m=self._penetration(ids[0]),
            reach_m=reach,
        )

    def push(self, setting: Setting, shove: Shove) -> Motion:
        """Push the first body along +x, let it go, and wait until all that moves is at rest."""
        ids = self._build(setting)
        moving = [k for k, body in enumerate(setting.bodies) if body.moves]
        trails = [trail_of(setting.bodies[k].asset) for k in moving]
        movers = [(ids[k], trail) for k, trail in zip(moving, trails, strict=True)]
        for mover, _ in movers[1:]:
            # What is not touched neither trembles nor costs time; a touch wakes it.
            pybullet.changeDynamics(
                mover, -1, activationState=_ASLEEP, physicsClientId=self._client
            )
        for mover, trail in movers:
            trail.follow(*pybullet.getBasePositionAndOrientation(mover, self._client))
        gain = shove.force_n / setting.bodies[0].asset.mass_kg * STEP_S
        pushes_left = round(shove.seconds / STEP_S)
        calm, steps, rests = 0, 0, False
        limit = pushes_left + round(PUSH_LIMIT_S / STEP_S)
        while steps < limit and not rests:
            if pushes_left:
                pushes_left = self._shove(ids[0], shove, gain, pushes_left)
            pybullet.stepSimulation(self._client)
            steps += 1
            slow = not pushes_left
            for mover, trail in movers:
                trail.follow(*pybullet.getBasePositionAndOrientation(mover, self._client))
                if slow:
                    speed, spin = pybullet.getBaseVelocity(mover, self._client)
                    slow = math.hypot(*speed) < REST_SPEED and math.hypot(*spin) < REST_SPIN
            calm = calm + 1 if slow else 0
            rests = calm >= REST_STEPS
            if steps % CREEP_STEPS == 0:
                # What only trembles is at rest too; what has not yielded to a constant push
                # by now never will.
                crept = [trail.crept(CREEP_M, CREEP_RAD) for trail in trails]
                rests = rests or not any(crept)
        return Motion(
            poses=tuple(self._pose(ids[k], setting.bodies[k].asset) for k in moving),
            sweeps=tuple(trail.box for trail in trails),
            seconds=steps * STEP_S,
            at_rest=rests,
        )

    def _shove(self, identity: int, shove: Shove, gain: float, pushes_left: int) -> int:
        """Push for one step; returns how many steps of pushing are left."""
        speed, spin = pybullet.getBaseVelocity(identity, self._client)
        if speed[0] + gain >= shove.speed_m_s:
            # The last impulse: just what is missing.
            missing = (shove.speed_m_s, speed[1], speed[2])
            pybullet.resetBaseVelocity(identity, missing, spin, self._client)
            return 0
        middle, _ = pybullet.getBasePositionAndOrientation(identity, self._client)
        pybullet.applyExternalForce(
            identity, -1, (shove.force_n, 0.0, 0.0), middle, pybullet.WORLD_FRAME, self._client
        )
        return pushes_left - 1

    def _build(self, setting: Setting) -> list[int]:
        """Make the scene anew and return the ids of its bodies, in order."""
        client = self._client
        pybullet.resetSimulation(physicsClientId=client)
        pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=STEP_S,
            numSolverIterations=SOLVER_ITERATIONS,
            numSubSteps=0,
            deterministicOverlappingPairs=1,
            restitutionVelocityThreshold=0.2,
            enableConeFriction=1,
            contactBreakingThreshold=0.02,
            erp=0.2,
            contactERP=0.2,
            frictionERP=0.2,
            physicsClientId=client,
        )
        # A dummy visual: without one Bullet makes a visual mesh for every collision shape, and a
        # sphere's many triangles alone would cost two thirds of a settle.
        visual = pybullet.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=(0.01, 0.01, 0.01), physicsClientId=client
        )
        plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
        floor = pybullet.createMultiBody(0.0, plane, visual, physicsClientId=client)
        self._surface(floor, FLOOR_FRICTION)
        if setting.column is not None:
            self._add_agent(setting.column, visual)
        return [self._add(body, visual) for body in setting.bodies]

    def _add_agent(self, column: Column, visual: int) -> None:
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER,
            radius=column.radius_m,
            height=AGENT_HEIGHT_M,
            physicsClientId=self._client,
        )
        agent = pybullet.createMultiBody(
            0.0,
            shape,
            visual,
            basePosition=(column.x, column.y, AGENT_HEIGHT_M / 2.0),
            physicsClientId=self._client,
        )
        self._surface(agent, FLOOR_FRICTION)

    def _add(self, body: Body, visual: int) -> int:
        asset, pose = body.asset, body.pose
        shape = self._shape(body)
        identity = pybullet.createMultiBody(
            asset.mass_kg if body.moves else 0.0,
            shape,
            visual,
            basePosition=(pose.x, pose.y, pose.z),
            baseOrientation=pose.quaternion,
            baseInertialFramePosition=centre_of_mass(asset),
            physicsClientId=self._client,
        )
        self._surface(identity, asset.friction)
        return int(identity)

    def _shape(self, body: Body) -> int:
        part = body.asset.parts[0]
        if len(body.asset.parts) == 1 and part.shape == "box" and not body.moves:
            # Walls and their like: as many as there are houses, so they get no file.
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_BOX,
                halfExtents=[s / 2.0 for s in part.size],
                collisionFramePosition=part.centre,
                collisionFrameOrientation=part.rotation,
                physicsClientId=self._client,
            )
        else:
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_MESH, fileName=self._file(body.asset), physicsClientId=self._client
            )
        return int(shape)

    def _surface(self, identity: int, friction: float) -> None:
        pybullet.changeDynamics(
            identity,
            -1,
            lateralFriction=friction,
            rollingFriction=ROLLING_FRICTION,
            spinningFriction=ROLLING_FRICTION,
            restitution=0.0,
            linearDamping=0.0,
            angularDamping=0.0,
            activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
            physicsClientId=self._client,
        )

    def _pose(self, identity: int, asset: Asset) -> Pose:
        """Pose of the asset's frame; Bullet reports that of the centre of mass."""
        position, turn = pybullet.getBasePositionAndOrientation(identity, self._client)
        offset = rotation_matrix(turn) @ centre_of_mass(asset)
        x, y, z = (float(p - o) for p, o in zip(position, offset, strict=True))
        return Pose(x, y, z, (turn[0], turn[1], turn[2], turn[3]))

    def _penetration(self, identity: int) -> float:
        contacts: Any = pybullet.getContactPoints(bodyA=identity, physicsClientId=self._client)
        depths = [-contact[8] for contact in contacts]
        return max(0.0, *depths) if depths else 0.0

    def _file(self, asset: Asset) -> str:
        path = self._files.get(asset)
        if path is None:
            target = self._folder / f"{len(self._files)}.obj"
            target.write_text(obj_text(asset), encoding="ascii")
            path = self._files[asset] = str(target)
        return path


def _radius(asset: Asset) -> float:
    """Farthest corner from the centre of mass: how far a turn can carry it."""
    corners, _ = asset_corners(asset)
    middle: Vec3 = centre_of_mass(asset)
    return max(math.dist(corner, middle) for corner in corners.tolist())


def _angle(first: tuple[float, ...], second: tuple[float, ...]) -> float:
    """Angle between two orientations, radians."""
    inverse = (-first[0], -first[1], -first[2], first[3])
    x, y, z, w = multiply(inverse, (second[0], second[1], second[2], second[3]))
    return 2.0 * math.atan2(math.sqrt(x * x + y * y + z * z), abs(w))


@lru_cache(maxsize=1)
def bullet() -> Bullet:
    """Return this process's Bullet: connected at first use, its files removed at exit."""
    folder = tempfile.TemporaryDirectory(prefix="internav-")
    atexit.register(folder.cleanup)
    return Bullet(pybullet.connect(pybullet.DIRECT), Path(folder.name))
