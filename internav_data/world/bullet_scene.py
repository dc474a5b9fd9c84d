"""Scenes in Bullet: settings of plain data, rebuilt at each call.

What is worked around here was measured: `resetSimulation` keeps time step and parameters (so all
are set each time), `removeBody` leaks, saved states are not bit-equal for compounds, automatic
visual shapes make bodies 27 times slower, and shape arrays stop at 16 shapes without a word. So
each asset is one OBJ file of convex groups (any number of parts), written once per process.
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from internav_data.geometry import centre_of_mass
from internav_data.world.setting import AGENT_HEIGHT_M, AGENT_LOW_M
from internav_data.world.wavefront import obj_text

if TYPE_CHECKING:
    from types import ModuleType

    from internav_data.records import Asset
    from internav_data.world.setting import Body, Column, Setting


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

RULES = 3
"""Raised with every change of what scenes, settling or pushing give: certificates name it, so a
dataset made by other rules is told from a wrong one."""
STEP_S = 1.0 / 240.0
GRAVITY = 9.81
SOLVER_ITERATIONS = 20
SOLVER_RESIDUAL = 1e-6
"""The solver stops early below this."""
CONTACT_BREAKS_M = 0.002
"""A contact point that has drifted this far is looked for anew. At Bullet's 2 cm stale points make
sliding things jump and stay awake: a push among others takes twice as long."""
FLOOR_HALF_M = (20.0, 20.0, 1.0)
"""The floor is a box: on Bullet's plane so short-lived contacts let a pushed box sink 1 mm and
rub: slides come out 8 % short, on a box 4 % (of v^2 / 2 mu g)."""
FLOOR_FRICTION = 1.0
"""Bullet multiplies frictions, so an asset's own is what acts on floor and walls."""
ROLLING_FRICTION = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Builder:
    """Makes scenes on one client, and keeps the assets' files."""

    client: int
    folder: Path
    _files: dict[Asset, str] = field(default_factory=dict)

    def build(self, setting: Setting) -> list[int]:
        """Make the scene anew and return the ids of its bodies, in order."""
        client = self.client
        pybullet.resetSimulation(physicsClientId=client)
        pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
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
            physicsClientId=client,
        )
        # A dummy visual: without one Bullet makes a visual mesh for every collision shape, and a
        # sphere's many triangles alone would cost two thirds of a settle.
        visual = pybullet.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=(0.01, 0.01, 0.01), physicsClientId=client
        )
        slab = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=FLOOR_HALF_M,
            collisionFramePosition=(0.0, 0.0, -FLOOR_HALF_M[2]),
            physicsClientId=client,
        )
        floor = pybullet.createMultiBody(0.0, slab, visual, physicsClientId=client)
        self._surface(floor, FLOOR_FRICTION)
        if setting.column is not None:
            self._add_agent(setting.column, visual)
        return [self._add(body, visual) for body in setting.bodies]

    def _add_agent(self, column: Column, visual: int) -> None:
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER,
            radius=column.radius_m,
            height=AGENT_HEIGHT_M - AGENT_LOW_M,
            physicsClientId=self.client,
        )
        agent = pybullet.createMultiBody(
            0.0,
            shape,
            visual,
            basePosition=(column.x, column.y, (AGENT_LOW_M + AGENT_HEIGHT_M) / 2.0),
            physicsClientId=self.client,
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
            physicsClientId=self.client,
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
