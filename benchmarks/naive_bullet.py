"""Baseline physics: a new Bullet scene with the neighbours, for every obstacle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pybullet as bullet

from internav_data.geometry import part_corners, yaw_quaternion
from internav_data.records import Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    import shapely

    from internav_data.records import Asset, House, Part

NEAR = 0.5
STEP = 1.0 / 240.0
DROP = 0.01


@dataclass(frozen=True)
class SettledPose:
    """Pose at rest, and its certificate."""

    pose: Pose
    seconds: float
    penetration: float


CLIENT = bullet.connect(bullet.DIRECT)


def settle(
    house: House,
    others: Sequence[tuple[Asset, Pose, shapely.Geometry]],
    asset: Asset,
    x: float,
    y: float,
    yaw_deg: float,
    shape: shapely.Geometry,
) -> SettledPose | None:
    """Let an object fall 1 cm among its neighbours; None where it may not stay."""
    bullet.resetSimulation(physicsClientId=CLIENT)
    bullet.setGravity(0, 0, -9.81, physicsClientId=CLIENT)
    bullet.setTimeStep(STEP, physicsClientId=CLIENT)
    # One shared dummy visual: Bullet would otherwise build a mesh to look at for every body.
    visual = bullet.createVisualShape(bullet.GEOM_SPHERE, radius=0.01, physicsClientId=CLIENT)
    plane = bullet.createCollisionShape(bullet.GEOM_PLANE, physicsClientId=CLIENT)
    _surface(bullet.createMultiBody(0, plane, visual, physicsClientId=CLIENT), 1.0)
    low_x, low_y, high_x, high_y = shape.buffer(NEAR).bounds
    for wall in house.walls:
        if wall.x_max < low_x or wall.x_min > high_x or wall.y_max < low_y or wall.y_min > high_y:
            continue
        half = [(wall.x_max - wall.x_min) / 2, (wall.y_max - wall.y_min) / 2]
        half.append((wall.z_max - wall.z_min) / 2)
        centre = [(wall.x_max + wall.x_min) / 2, (wall.y_max + wall.y_min) / 2]
        centre.append((wall.z_max + wall.z_min) / 2)
        solid = bullet.createCollisionShape(
            bullet.GEOM_BOX, halfExtents=half, physicsClientId=CLIENT
        )
        _surface(bullet.createMultiBody(0, solid, visual, centre, physicsClientId=CLIENT), 1.0)
    for thing in house.objects:
        reach = math.hypot(*house.assets[thing.asset_id].size[:2]) / 2
        near_x = low_x - reach < thing.x < high_x + reach
        if near_x and low_y - reach < thing.y < high_y + reach:
            _add(house.assets[thing.asset_id], thing.pose, visual, moves=False)
    for other, pose, outline in others:
        if outline.distance(shape) < NEAR:
            _add(other, pose, visual, moves=False)
    start = Pose(x, y, DROP, yaw_quaternion(yaw_deg))
    return _judged(_add(asset, start, visual, moves=True), asset, start)


def _judged(body: int, asset: Asset, start: Pose) -> SettledPose | None:
    calm = still = steps = 0
    first, latest = (np.zeros(3), np.zeros(3)), None
    # At rest: slow for ten steps at nearly one velocity, or in place over two windows of 24.
    while steps < 240 and calm < 10 and still < 2:
        bullet.stepSimulation(physicsClientId=CLIENT)
        steps += 1
        speed, spin = map(np.array, bullet.getBaseVelocity(body, physicsClientId=CLIENT))
        slow = np.linalg.norm(speed) < 0.0003 and np.linalg.norm(spin) < 0.003
        calm = calm + 1 if slow else 0
        if calm == 1:
            first = speed, spin
        if calm == 10 and not _alike(first, (speed, spin), 0.00024, 0.0024):
            calm, first = 1, (speed, spin)
        if steps % 24 == 0:
            here = tuple(
                map(np.array, bullet.getBasePositionAndOrientation(body, physicsClientId=CLIENT))
            )
            # A quaternion's entries change by half of a small angle.
            still = still + 1 if latest and _alike(latest, here, 0.00003, 0.00015) else 0
            latest = here
    position, turn = bullet.getBasePositionAndOrientation(body, physicsClientId=CLIENT)
    matrix = np.array(bullet.getMatrixFromQuaternion(turn)).reshape(3, 3)
    origin = np.array(position) - matrix @ np.array(_middle(asset))
    depth = max(
        [0.0, *(-c[8] for c in bullet.getContactPoints(bodyA=body, physicsClientId=CLIENT))]
    )
    moved = math.hypot(origin[0] - start.x, origin[1] - start.y)
    tilt = math.degrees(math.acos(max(-1.0, min(1.0, float(matrix[2, 2])))))
    if (calm < 10 and still < 2) or moved > 0.05 or tilt > 5.0 or depth > 0.002:
        return None
    x, y, z = (round(float(v), 4) for v in origin)
    return SettledPose(Pose(x, y, z, tuple(round(q, 6) for q in turn)), steps * STEP, depth)


def _alike(before: Sequence[Any], after: Sequence[Any], first: float, second: float) -> bool:
    """Return whether two pairs of vectors differ by less than these."""
    return bool(
        np.linalg.norm(before[0] - after[0]) < first
        and np.linalg.norm(before[1] - after[1]) < second
    )


def _surface(body: int, friction: float) -> None:
    bullet.changeDynamics(
        body,
        -1,
        lateralFriction=friction,
        rollingFriction=0.01,
        spinningFriction=0.01,
        restitution=0,
        linearDamping=0,
        angularDamping=0,
        physicsClientId=CLIENT,
    )


@lru_cache(maxsize=4096)
def _middle(asset: Asset) -> tuple[float, float, float]:
    """Centre of mass: of the parts' boxes, weighted by volume."""
    weights = np.array([max(1e-9, math.prod(p.size)) for p in asset.parts])
    centres = np.array([p.centre for p in asset.parts])
    x, y, z = (weights[:, None] * centres).sum(axis=0) / weights.sum()
    return float(x), float(y), float(z)


def _add(asset: Asset, pose: Pose, visual: int, *, moves: bool) -> int:
    shape = _shape(asset)
    body = bullet.createMultiBody(
        asset.mass_kg if moves else 0.0,
        shape,
        visual,
        basePosition=(pose.x, pose.y, pose.z),
        baseOrientation=pose.quaternion,
        baseInertialFramePosition=_middle(asset),
        physicsClientId=CLIENT,
    )
    _surface(body, asset.friction)
    return int(body)


def _shape(asset: Asset) -> int:
    parts = [_described(part) for part in asset.parts]
    if len(parts) == 1 or any("vertices" in p for p in parts) or len(parts) > 16:
        return _mesh(asset)
    return int(
        bullet.createCollisionShapeArray(
            shapeTypes=[p["type"] for p in parts],
            halfExtents=[p.get("half", [0.1, 0.1, 0.1]) for p in parts],
            radii=[p.get("radius", 0.1) for p in parts],
            lengths=[p.get("length", 0.1) for p in parts],
            collisionFramePositions=[p["at"] for p in parts],
            collisionFrameOrientations=[p["turn"] for p in parts],
            physicsClientId=CLIENT,
        )
    )


def _mesh(asset: Asset) -> int:
    """One convex piece a part, through a file as Bullet's compound meshes need it."""
    return int(
        bullet.createCollisionShape(bullet.GEOM_MESH, fileName=_file(asset), physicsClientId=CLIENT)
    )


@lru_cache(maxsize=4096)
def _file(asset: Asset) -> str:
    import atexit
    import tempfile
    from pathlib import Path

    lines, count = [], 1
    for number, part in enumerate(asset.parts):
        corners = part_corners(part)
        lines.append(f"o part{number}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in corners]
        lines += [f"f {count} {count + k} {count + k + 1}" for k in range(1, len(corners) - 1)]
        count += len(corners)
    with tempfile.NamedTemporaryFile("w", suffix=".obj", delete=False) as file:
        file.write("\n".join(lines))
    atexit.register(Path(file.name).unlink, missing_ok=True)
    return file.name


def _described(part: Part) -> dict[str, Any]:
    found: dict[str, Any] = {"at": part.centre, "turn": part.rotation}
    w, d, h = part.size
    if part.shape == "box":
        return {**found, "type": bullet.GEOM_BOX, "half": [w / 2, d / 2, h / 2]}
    if part.shape == "cylinder" and abs(w - d) < 1e-6:
        return {**found, "type": bullet.GEOM_CYLINDER, "radius": w / 2, "length": h}
    return {**found, "vertices": True}
