"""Settling, again: every obstacle must come to rest as its certificate says.

Stored is where an obstacle lies, not where it was let go: 1 cm above the floor, upright, turned by
a multiple of 15 degrees. Its spot is worked out from the stored pose; falling from there once more
must end at the stored pose, after the stored time and as deep as stored.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import shapely

from internav_data.physics import Body, settle, wall_body
from internav_data.records import Pose
from internav_data.verification.shapes import AGENT_HEIGHT_M, STEP_OVER_M

if TYPE_CHECKING:
    from shapely import Geometry

    from internav_data.physics import SettleResult
    from internav_data.records import Episode, Obstacle
    from internav_data.verification.obstacles import Expect
    from internav_data.verification.replay.checked_scene import CheckedScene

YAW_STEP_DEG = 15
NEAR_M = 0.5
"""What is farther away than this cannot be touched while a thing settles."""
ROUNDED_M = 1.5e-4
"""Where the spot is worked out from the rest, each axis may be a rounding and a half off …"""
ROUNDED = 2e-6
"""… and so may a quaternion."""
TRIES = 3
"""A spot is known better with each fall: what falls among others may be turned aside."""


def check_settling(theatre: CheckedScene, episode: Episode, expect: Expect) -> None:
    """Let every obstacle of an episode fall again, in order."""
    for number, obstacle in enumerate(episode.obstacles):
        what = f"obstacle {number} ({obstacle.asset_id})"
        settled = _fall(theatre, episode, number)
        if not expect(
            not settled.refusal, "physics.settle-refused", f"{what} may stay", settled.refusal
        ):
            continue
        off, turned = _apart(settled.pose, obstacle.pose)
        expect(
            off <= ROUNDED_M and turned <= ROUNDED,
            "physics.settle-pose",
            f"{what} at rest at {settled.pose}",
            obstacle.pose,
        )
        for name, found, stored in (
            ("time", settled.seconds, obstacle.settle_s),
            ("depth", settled.penetration_m, obstacle.settle_penetration_m),
        ):
            expect(found == stored, f"physics.settle-{name}", f"{what}: {found}", stored)


def _fall(theatre: CheckedScene, episode: Episode, number: int) -> SettleResult:
    """Let an obstacle fall from the spot from which it would come to lie where it is stored."""
    obstacle = episode.obstacles[number]
    asset = theatre.assets[obstacle.asset_id]
    x, y, turn = obstacle.x, obstacle.y, _upright(obstacle)
    for _ in range(TRIES):
        spot = Pose(round(x, 4), round(y, 4), 0.0, turn)
        settled = settle(
            asset,
            spot,
            theatre.settings.gap_m,
            lambda: _near(theatre, episode, number, spot),  # noqa: B023 - asked at once
        )
        if _apart(settled.pose, obstacle.pose)[0] <= ROUNDED_M:
            break
        x += obstacle.x - settled.pose.x
        y += obstacle.y - settled.pose.y
    return settled


def _upright(obstacle: Obstacle) -> tuple[float, float, float, float]:
    """Orientation before the fall: the nearest of those that obstacles are let go at."""
    _, _, z, w = obstacle.quaternion
    step = math.radians(YAW_STEP_DEG)
    half = round(2.0 * math.atan2(z, w) / step) * step / 2.0
    sign = -1.0 if math.cos(half) < 0.0 else 1.0
    return 0.0, 0.0, round(sign * math.sin(half), 6), round(sign * math.cos(half), 6)


def _apart(first: Pose, second: Pose) -> tuple[float, float]:
    """Largest difference of two poses along an axis, metres, and of their quaternions."""
    off = max(abs(first.x - second.x), abs(first.y - second.y), abs(first.z - second.z))
    p, q = np.array(first.quaternion), np.array(second.quaternion)
    return off, float(min(np.abs(p - q).max(), np.abs(p + q).max()))


def _near(theatre: CheckedScene, episode: Episode, number: int, spot: Pose) -> list[Body]:
    """Gather what could be touched: things, earlier obstacles, walls, in this order."""
    asset_id = episode.obstacles[number].asset_id
    here = shapely.union_all(list(theatre.footprint(asset_id, spot)))

    def near(plans: list[Geometry] | tuple[Geometry, ...]) -> bool:
        return bool(shapely.dwithin(here, np.array(plans, dtype=object), NEAR_M).any())

    placed = [(thing.asset_id, thing.pose) for thing in theatre.site.house.objects]
    placed += [(o.asset_id, o.pose) for o in episode.obstacles[:number]]
    bodies = [
        Body(theatre.assets[other], pose, moves=False)
        for other, pose in placed
        if near(theatre.footprint(other, pose))
    ]
    walls = [
        wall
        for wall in theatre.site.house.walls
        if wall.z_min < AGENT_HEIGHT_M and wall.z_max > STEP_OVER_M
    ]
    plans = [shapely.box(w.x_min, w.y_min, w.x_max, w.y_max) for w in walls]
    return bodies + [wall_body(w) for w, plan in zip(walls, plans, strict=True) if near([plan])]
