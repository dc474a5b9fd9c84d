"""Scenes in Bullet, built from plain data at each call.

Each workaround here was measured. An empty world costs 0.7 ms and more, so one world serves many
scenes; `removeBody` leaks 8 kB, so not too many. `resetSimulation` keeps time step and parameters,
so all are set each time. Saved states are not bit-equal for compounds. Automatic visual shapes make
bodies 27 times slower. Arrays of shapes stop at 16 without a word, so each asset is one OBJ file of
convex groups (any number of parts), written once per process.

An emptied world has to be as good as new. With Bullet's usual broadphase it is not: its trees and
clocks keep state, and now and then a push differed in the ninth digit. The simple broadphase keeps
only the order in which its slots became free: bodies are removed in the reverse order of their
creation, so the next ones get the same slots. `tests/physics/test_bullet.py` holds it.
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from internav_data.core.extras import missing
from internav_data.geometry import centre_of_mass
from internav_data.geometry.obj import obj_text
from internav_data.physics.scene import AGENT_HEIGHT_M, AGENT_LOW_M

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType

    from internav_data.physics.scene import AgentCollider, Body, PhysicsScene
    from internav_data.records import Asset


def _import_quietly() -> ModuleType:
    """Import pybullet without the line about its build time that it prints on stderr."""
    sys.stderr.flush()
    kept = os.dup(2)
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 2)
        try:
            return import_module("pybullet")
        except ModuleNotFoundError as error:
            raise missing(error.name) from error
        finally:
            os.dup2(kept, 2)
            os.close(kept)


pybullet: Any = _import_quietly()

STEP_S = 1.0 / 240.0
"""Time step of all data, seconds."""
GRAVITY = 9.81
"""Acceleration of gravity, m/s²."""
SOLVER_ITERATIONS = 20
SOLVER_RESIDUAL = 1e-6
"""Residual below which the solver stops before its last iteration."""
HULL_MARGIN_M = 0.001
"""Thickness that Bullet adds to convex hulls, metres."""
CONTACT_BREAKS_M = 0.002
"""Distance that a contact point may drift before it is computed anew, metres. At Bullet's default
of 2 cm stale points make sliding bodies jump and stay awake: a push among others takes twice as
long."""
FLOOR_HALF_M = (20.0, 20.0, 1.0)
"""Half extents of the floor, metres. It is a box: on Bullet's plane, contacts that live so shortly
let a pushed box sink 1 mm and rub, and slides are 8 % short of v² / 2μg; on a box 4 %."""
FLOOR_FRICTION = 1.0
"""Friction of floor and agent. Bullet multiplies the frictions of two bodies, so that an object's
own coefficient acts between it and the floor."""
ROLLING_FRICTION = 0.01
SCENES_PER_WORLD = 512
"""Number of scenes after which a world is reset, for `removeBody` leaks."""


@dataclass(slots=True, eq=False)
class Builder:
    """Builder of scenes on one client; it keeps the files and shapes of assets."""

    client: int
    folder: Path
    step_s: float = STEP_S
    """Time step, seconds."""
    scenes_per_world: int = SCENES_PER_WORLD
    """1 gives every scene an empty world: 1.5 times as slow, and by definition without history."""
    _files: dict[Asset, str] = field(default_factory=dict)
    _shapes: dict[tuple[Asset, bool], int] = field(default_factory=dict)
    _bodies: list[int] = field(default_factory=list)
    _visual: int = -1
    _slab: int = -1
    _scenes_left: int = 0

    def build(self, scene: PhysicsScene) -> list[int]:
        """Remove the last scene, build another and return its bodies' ids in order."""
        # Zero until the scene is complete: after an interrupt the next call resets the world.
        left, self._scenes_left = self._scenes_left, 0
        if left > 0:
            self._empty()
        else:
            self._begin()
            left = self.scenes_per_world
        self._set_parameters()
        if scene.agent is not None:
            self._add_agent(scene.agent)
        ids = [self._add(body) for body in scene.bodies]
        self._scenes_left = left - 1
        return ids

    def _empty(self) -> None:
        # In reverse, so that the next bodies get the same slots (see the module's docstring).
        while len(self._bodies) > 1:
            pybullet.removeBody(self._bodies.pop(), physicsClientId=self.client)

    def _begin(self) -> None:
        client = self.client
        self._bodies.clear()
        self._shapes.clear()
        pybullet.resetSimulation(pybullet.RESET_USE_SIMPLE_BROADPHASE, physicsClientId=client)
        pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
        # A dummy: without a visual shape Bullet makes a mesh for every collision shape, and a
        # sphere's many triangles alone would take two thirds of a settle.
        self._visual = pybullet.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=(0.01, 0.01, 0.01), physicsClientId=client
        )
        self._slab = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=FLOOR_HALF_M,
            collisionFramePosition=(0.0, 0.0, -FLOOR_HALF_M[2]),
            physicsClientId=client,
        )
        self._surface(self._place(0.0, self._slab), FLOOR_FRICTION)

    def _set_parameters(self) -> None:
        # For every scene: some are globals of Bullet, and a user's own client may have set them.
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self.step_s,
            numSolverIterations=SOLVER_ITERATIONS,
            numSubSteps=0,
            deterministicOverlappingPairs=1,
            restitutionVelocityThreshold=0.2,
            enableConeFriction=1,
            solverResidualThreshold=SOLVER_RESIDUAL,
            contactBreakingThreshold=CONTACT_BREAKS_M,
            erp=0.2,
            contactERP=0.2,
            frictionERP=0.2,
            physicsClientId=self.client,
        )

    def _place(self, mass_kg: float, shape: int, **where: Sequence[float]) -> int:
        identity = int(
            pybullet.createMultiBody(
                mass_kg, shape, self._visual, physicsClientId=self.client, **where
            )
        )
        self._bodies.append(identity)
        return identity

    def _add_agent(self, collider: AgentCollider) -> None:
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER,
            radius=collider.radius_m,
            height=AGENT_HEIGHT_M - AGENT_LOW_M,
            physicsClientId=self.client,
        )
        middle = (collider.x, collider.y, (AGENT_LOW_M + AGENT_HEIGHT_M) / 2.0)
        self._surface(self._place(0.0, int(shape), basePosition=middle), FLOOR_FRICTION)

    def _add(self, body: Body) -> int:
        asset, pose = body.asset, body.pose
        identity = self._place(
            body.dynamics.mass_kg if body.moves else 0.0,
            self._shape(body),
            basePosition=(pose.x, pose.y, pose.z),
            baseOrientation=pose.quaternion,
            baseInertialFramePosition=centre_of_mass(asset),
        )
        self._surface(identity, body.dynamics.friction)
        return identity

    def _shape(self, body: Body) -> int:
        key = (body.asset, body.moves)
        shape = self._shapes.get(key)
        if shape is None:
            shape = self._shapes[key] = self._new_shape(body)
        return shape

    def _new_shape(self, body: Body) -> int:
        part = body.asset.parts[0]
        if len(body.asset.parts) == 1 and part.shape == "box" and not body.moves:
            # Walls and other boxes that stay: every house brings new ones, so they get no file.
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_BOX,
                halfExtents=[s / 2.0 for s in part.size],
                collisionFramePosition=part.centre,
                collisionFrameOrientation=part.rotation,
                physicsClientId=self.client,
            )
        else:
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_MESH, fileName=self._file(body.asset), physicsClientId=self.client
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
            physicsClientId=self.client,
        )

    def _file(self, asset: Asset) -> str:
        path = self._files.get(asset)
        if path is None:
            target = self.folder / f"{len(self._files)}.obj"
            target.write_text(obj_text(asset), encoding="ascii")
            path = self._files[asset] = str(target)
        return path
