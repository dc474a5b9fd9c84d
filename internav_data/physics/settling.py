"""Settle: the pose at which a spawned object comes to rest, and whether it may stay there."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from internav_data.geometry import multiply, rotation_matrix, round_m, round_quaternion
from internav_data.physics.engines import DEFAULT_ENGINE
from internav_data.physics.fall_clearance import DROP_M
from internav_data.physics.registry import get_solver
from internav_data.physics.scene import UPRIGHT, Body, PhysicsScene
from internav_data.records import Pose

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from internav_data.physics.scene import SettleSolution

MAX_SHIFT_M = 0.05
MAX_TILT_DEG = 5.0
MAX_PENETRATION_M = 0.002


@dataclass(frozen=True, slots=True)
class SettleResult:
    """An object at rest, with its certificate: values rounded as they are stored."""

    pose: Pose
    seconds: float
    """Simulated time until rest."""
    penetration_m: float
    """Deepest contact at rest, metres."""
    refusal: str
    """Reason for which the object may not stay; empty if it may."""


def settle(
    body: Body,
    clearance_m: float,
    neighbours: Callable[[], Sequence[Body]],
    engine: str = DEFAULT_ENGINE,
) -> SettleResult:
    """Let an object fall 1 cm onto the floor from an upright pose.

    The problem is solved in the object's own frame. While the object moves less than
    `clearance_m`, it touches nothing and falls as if alone: that solution is computed once per
    asset and dynamics and moved into place.

    Parameters
    ----------
    body
        Object to release at an upright pose; z is the height of the floor below it.
    clearance_m
        Distance in the plane from its parts to everything that they could touch, metres, at every
        height: that of `fall_clearance`, as a footprint leaves out what lies below 2 cm.
    neighbours
        Gathers the objects and walls that can be touched; called only if the free fall reaches
        farther than the clearance less the engine's contact margin.
    engine
        Name of the physics engine.

    Raises
    ------
    UsageError
        No engine has this name.

    """
    solver = get_solver(engine)
    falling = Body(body.asset, _START, body.dynamics)
    solution = solver.settle(PhysicsScene((falling,)))
    if solution.reach_m + solver.contact_margin_m > clearance_m:
        solution = solver.settle(_scene(falling, body.pose, neighbours()))
    return _judged(body.pose, solution)


_START = Pose(0.0, 0.0, DROP_M, UPRIGHT)


def _scene(falling: Body, frame: Pose, neighbours: Sequence[Body]) -> PhysicsScene:
    fixed = (replace(b, pose=_seen_from(frame, b.pose), moves=False) for b in neighbours)
    return PhysicsScene((falling, *fixed))


def _seen_from(frame: Pose, pose: Pose) -> Pose:
    """Return a neighbour's pose in the frame of an upright object, rounded."""
    # The conjugate of a unit quaternion is its inverse.
    x, y, z, w = frame.quaternion
    back = (-x, -y, -z, w)
    dx, dy, dz = pose.x - frame.x, pose.y - frame.y, pose.z - frame.z
    px, py, pz = (row[0] * dx + row[1] * dy + row[2] * dz for row in rotation_matrix(back))
    turned = round_quaternion(multiply(back, pose.quaternion))
    return Pose(round_m(px), round_m(py), round_m(pz), turned)


def _judged(pose: Pose, solution: SettleSolution) -> SettleResult:
    """Move a solution from the object's own frame into the house, round it, and judge it."""
    shift = solution.pose
    dx, dy, dz = (
        row[0] * shift.x + row[1] * shift.y + row[2] * shift.z
        for row in rotation_matrix(pose.quaternion)
    )
    settled = Pose(
        round_m(pose.x + dx),
        round_m(pose.y + dy),
        round_m(pose.z + dz),
        round_quaternion(multiply(pose.quaternion, shift.quaternion)),
    )
    # Element (2, 2) of the rotation is the cosine between the object's upward axis and the world's.
    tilt = math.degrees(
        math.acos(max(-1.0, min(1.0, float(rotation_matrix(shift.quaternion)[2, 2]))))
    )
    refusal = ""
    if not solution.at_rest:
        refusal = "did not come to rest"
    elif math.hypot(shift.x, shift.y) > MAX_SHIFT_M:
        refusal = "moved too far"
    elif tilt > MAX_TILT_DEG:
        refusal = "tilted too far"
    elif solution.penetration_m > MAX_PENETRATION_M:
        refusal = "sank in too deep"
    return SettleResult(
        settled, round(solution.seconds, 6), round(solution.penetration_m, 6), refusal
    )
