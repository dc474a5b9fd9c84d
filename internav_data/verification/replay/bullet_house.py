"""A house in Bullet, built by the validator's own code from the polyhedra that are stored.

It shares nothing with `internav_data.physics`. Numbers that are part of the dataset's physics are
stated again; those of the solver are Bullet's defaults. Bullet has globals that all clients share:
whoever builds a house holds the engine's lock meanwhile.
"""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from internav_data.core.locks import once_per_process
from internav_data.core.temporary import process_folder
from internav_data.verification.replay.standing import SOLID, centre_of, obj_of, turned_deg

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.records import Asset, House, Quaternion, Vec3
    from internav_data.verification.replay.standing import Standing
    from internav_data.verification.shapes import Shapes

STEP_S: Final = 1.0 / 240.0
GRAVITY: Final = 9.81
ROLLING_FRICTION: Final = 0.01
SOLID_FRICTION: Final = 1.0
"""Friction of floor and walls. Bullet multiplies frictions, so an object's own is what acts."""
CONTACT_BREAKS_M: Final = 0.002
"""Distance that a contact may drift before it is found anew, metres. All clients share it."""
FLOOR_HALF_M: Final = (100.0, 100.0, 1.0)


class BulletHouse:
    """Floor and walls of a house, and objects that are put there and taken away again."""

    def __init__(self, house: House, shapes: Shapes) -> None:
        self._shapes = shapes
        self._collision: dict[str, tuple[int, list[float]]] = {}
        self._objects: list[tuple[int, Standing]] = []
        pybullet, client = _client()
        # The simple broadphase keeps no history: findings depend on the episode alone.
        pybullet.resetSimulation(pybullet.RESET_USE_SIMPLE_BROADPHASE, physicsClientId=client)
        pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=STEP_S,
            numSubSteps=0,
            deterministicOverlappingPairs=1,
            contactBreakingThreshold=CONTACT_BREAKS_M,
            physicsClientId=client,
        )
        _box(FLOOR_HALF_M, (0.0, 0.0, -FLOOR_HALF_M[2]))
        for w in house.walls:
            half = ((w.x_max - w.x_min) / 2.0, (w.y_max - w.y_min) / 2.0, (w.z_max - w.z_min) / 2.0)
            _box(half, (w.x_min + half[0], w.y_min + half[1], w.z_min + half[2]))

    def put(self, objects: Sequence[Standing]) -> None:
        """Put objects where they stand, after those that are there."""
        pybullet, client = _client()
        for one in objects:
            shape, centre = self._shape(one.asset_id)
            body = pybullet.createMultiBody(
                one.mass_kg if one.moves else 0.0,
                shape,
                basePosition=(one.pose.x, one.pose.y, one.pose.z),
                baseOrientation=one.pose.quaternion,
                baseInertialFramePosition=centre,
                physicsClientId=client,
            )
            _rub(body, one.friction)
            self._objects.append((body, one))

    def _shape(self, asset_id: str) -> tuple[int, list[float]]:
        """Return an asset's collision shape and its centre of mass, metres."""
        pybullet, client = _client()
        if asset_id not in self._collision:
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_MESH,
                fileName=_file_of(asset_id, self._shapes),
                physicsClientId=client,
            )
            centre = centre_of(self._shapes.solids(asset_id)).tolist()
            self._collision[asset_id] = int(shape), centre
        return self._collision[asset_id]

    def remove(self, count: int) -> None:
        """Take the last objects away."""
        pybullet, client = _client()
        for _ in range(count):  # in reverse, so that the next ones get the same places in Bullet
            pybullet.removeBody(self._objects.pop()[0], physicsClientId=client)

    def contacts(self) -> list[tuple[Standing, str, float]]:
        """Return contacts now: an object that can move, the other's name, the depth in metres."""
        pybullet, client = _client()
        pybullet.performCollisionDetection(client)
        known = dict(self._objects)
        deepest: dict[tuple[int, int], float] = {}
        for body, one in self._objects:
            if one.moves:
                for contact in pybullet.getContactPoints(bodyA=body, physicsClientId=client):
                    pair = (body, contact[2])
                    if pair[::-1] not in deepest:
                        # Column 8 is the distance, negative where bodies overlap.
                        deepest[pair] = max(deepest.get(pair, 0.0), -contact[8])
        return [
            (known[a], known[b].name if b in known else SOLID, depth)
            for (a, b), depth in deepest.items()
        ]

    def drifts(self, seconds: float) -> list[tuple[Standing, float, float]]:
        """Let time pass; return how far each object that can move went, metres and degrees."""
        pybullet, client = _client()

        def places() -> list[tuple[Vec3, Quaternion]]:
            return [
                pybullet.getBasePositionAndOrientation(body, client) for body, _ in self._objects
            ]

        before = places()
        for _ in range(round(seconds / STEP_S)):
            pybullet.stepSimulation(client)
        return [
            (one, math.dist(was[0], now[0]), turned_deg(was[1], now[1]))
            for (_, one), was, now in zip(self._objects, before, places(), strict=True)
            if one.moves
        ]


@once_per_process
def _client() -> tuple[Any, int]:
    """Return pybullet and a client of the validator's own."""
    pybullet: Any = import_module("pybullet")
    return pybullet, int(pybullet.connect(pybullet.DIRECT))


@once_per_process
def _files() -> dict[Asset, str]:
    """Return this process's OBJ files by asset. Bullet remembers them by name: none is changed."""
    return {}


def _file_of(asset_id: str, shapes: Shapes) -> str:
    files, asset = _files(), shapes.assets[asset_id]
    if asset not in files:
        path = process_folder() / f"checked-{len(files)}.obj"
        path.write_text(obj_of(shapes.solids(asset_id)), encoding="ascii")
        files[asset] = str(path)
    return files[asset]


def _box(half_m: Vec3, middle: Vec3) -> None:
    """Add a box that stays."""
    pybullet, client = _client()
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_BOX, halfExtents=half_m, physicsClientId=client
    )
    body = pybullet.createMultiBody(0.0, shape, basePosition=middle, physicsClientId=client)
    _rub(body, SOLID_FRICTION)


def _rub(body: int, friction: float) -> None:
    """Give a body its surface, and let it never sleep: what creeps is to be seen."""
    pybullet, client = _client()
    pybullet.changeDynamics(
        body,
        -1,
        lateralFriction=friction,
        rollingFriction=ROLLING_FRICTION,
        spinningFriction=ROLLING_FRICTION,
        restitution=0.0,
        linearDamping=0.0,
        angularDamping=0.0,
        activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
        physicsClientId=client,
    )
