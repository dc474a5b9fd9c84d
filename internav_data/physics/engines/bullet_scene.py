"""Scenes in Bullet: settings of plain data, built anew at each call.

What is worked around here was measured: an empty world costs 0.7 ms and more, so it serves many
scenes; `removeBody` leaks 8 kB, so not too many; `resetSimulation` keeps time step and parameters,
so all are set each time; saved states are not bit-equal for compounds; automatic visual shapes make
bodies 27 times slower; shape arrays stop at 16 shapes without a word. So each asset is one OBJ file
of convex groups (any number of parts), written once per process.

An emptied world has to be as good as new. Bullet's usual broadphase is not: its trees and clocks
remember, and now and then a push came out otherwise in the ninth digit. The simple one
remembers nothing but the order in which its places became free: bodies go in the reverse order of
their coming, and the next ones get the same places. `tests/physics/test_bullet.py` holds it.
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
        finally:
            os.dup2(kept, 2)
            os.close(kept)


pybullet: Any = _import_quietly()

RULES = 4
"""Raised with every change of what scenes, settling or pushing give: certificates name it, so a
dataset made by other rules is told from a wrong one."""
STEP_S = 1.0 / 240.0
GRAVITY = 9.81
SOLVER_ITERATIONS = 20
SOLVER_RESIDUAL = 1e-6
"""The solver stops early below this."""
HULL_MARGIN_M = 0.001
"""Thickness that Bullet adds to convex hulls."""
CONTACT_BREAKS_M = 0.002
"""A contact point that has drifted this far is looked for anew. At Bullet's 2 cm stale points make
sliding things jump and stay awake: a push among others takes twice as long."""
FLOOR_HALF_M = (20.0, 20.0, 1.0)
"""The floor is a box: on Bullet's plane so short-lived contacts let a pushed box sink 1 mm and
rub: slides come out 8 % short, on a box 4 % (of v^2 / 2 mu g)."""
FLOOR_FRICTION = 1.0
"""Bullet multiplies frictions, so an asset's own is what acts on floor and walls."""
ROLLING_FRICTION = 0.01


SCENES_PER_WORLD = 512


@dataclass(slots=True, eq=False)
class Builder:
    """Makes scenes on one client, and keeps the assets' files and shapes."""

    client: int
    folder: Path
    scenes_per_world: int = SCENES_PER_WORLD
    """1: an empty world for every scene, half as slow again and by definition without history."""
    _files: dict[Asset, str] = field(default_factory=dict)
    _shapes: dict[tuple[Asset, bool], int] = field(default_factory=dict)
    _bodies: list[int] = field(default_factory=list)
    _visual: int = -1
    _slab: int = -1
    _scenes_left: int = 0

    def build(self, scene: PhysicsScene) -> list[int]:
        """Take the last scene down, make another one and return the ids of its bodies, in order."""
        # Zero until the scene stands: what an interrupt left half done is swept away as a whole.
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
        # In reverse: see above.
        while len(self._bodies) > 1:
            pybullet.removeBody(self._bodies.pop(), physicsClientId=self.client)

    def _begin(self) -> None:
        client = self.client
        self._bodies.clear()
        self._shapes.clear()
        pybullet.resetSimulation(pybullet.RESET_USE_SIMPLE_BROADPHASE, physicsClientId=client)
        pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
        # A dummy visual: without one Bullet makes a visual mesh for every collision shape, and a
        # sphere's many triangles alone would cost two thirds of a settle.
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
        # For every scene: some of them are Bullet's own globals, and a user may have a client too.
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=STEP_S,
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
            # Walls and their like: as many as there are houses, so they get no file.
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
