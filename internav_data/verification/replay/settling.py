"""Replay of settling: every obstacle must come to rest as its certificate says.

The data hold the pose at rest, not the spawn pose: 1 cm above the floor, upright, turned by a
multiple of 15 degrees. The spawn pose is derived from the stored one; a fall from there must end
at the stored pose, after the stored time and with the stored penetration.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import shapely

from internav_data.physics import Body, settle, wall_body
from internav_data.records import Pose
from internav_data.verification.findings import ELSEWHERE_M
from internav_data.verification.overlaps import Solids
from internav_data.verification.replay.elsewhere import TURN_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from internav_data.physics import SettleResult
    from internav_data.records import Episode, Obstacle
    from internav_data.verification.obstacles import Expect
    from internav_data.verification.replay.checked_scene import CheckedScene
    from internav_data.verification.shapes import Slab

YAW_STEP_DEG = 15
FALL_M = 0.01
"""Height from which an obstacle falls."""
NEAR_M = 0.5
"""Distance beyond which an object cannot be touched while another one settles."""
ROUNDED_M = 1.5e-4
"""Tolerance along each axis of a pose that falls from a derived spawn pose: 1.5 roundings."""
ROUNDED = 2e-6
"""Tolerance of its quaternion."""
SPOT_M = 5e-4
"""Tolerance of the clearance: the derived spawn pose is rounded, and so was the true one."""
TRIES = 3
"""Number of falls: each improves the spawn pose, as a neighbour may deflect the fall."""


def check_settling(scene: CheckedScene, episode: Episode, expect: Expect) -> None:
    """Let every obstacle of an episode fall again, in order."""
    same = scene.config.same_hardware
    most_m, most_turned = (ROUNDED_M, ROUNDED) if same else (ELSEWHERE_M, TURN_TOLERANCE)
    for number, obstacle in enumerate(episode.obstacles):
        what = f"obstacle {number} ({obstacle.asset_id})"
        settled = fall_again(scene, episode, number)
        if not expect(
            not settled.refusal, "physics.settle-refused", f"{what} may stay", settled.refusal
        ):
            continue
        off, turned = _apart(settled.pose, obstacle.pose)
        expect(
            off <= most_m and turned <= most_turned,
            "physics.settle-pose",
            f"{what} at rest at {settled.pose}",
            obstacle.pose,
        )
        for name, found, stored in (
            ("time", settled.seconds, obstacle.settle_s),
            ("depth", settled.penetration_m, obstacle.settle_penetration_m),
        ):
            expect(found == stored, f"physics.settle-{name}", f"{what}: {found}", stored)


def fall_again(scene: CheckedScene, episode: Episode, number: int) -> SettleResult:
    """Let an obstacle fall from the spawn pose that leads to its stored pose."""
    obstacle = episode.obstacles[number]
    asset = scene.assets[obstacle.asset_id]
    x, y, turn = obstacle.x, obstacle.y, _upright(obstacle)
    earlier = [Body.of_obstacle(o, scene.assets, moves=False) for o in episode.obstacles[:number]]
    for _ in range(TRIES):
        spot = Pose(round(x, 4), round(y, 4), 0.0, turn)
        settled = settle(
            Body(asset, spot, obstacle.dynamics),
            clearance_m(scene, asset.asset_id, spot, earlier),
            lambda: _near(scene, asset.asset_id, spot, earlier),  # noqa: B023 - asked at once
            scene.engine(episode),
        )
        if _apart(settled.pose, obstacle.pose)[0] <= ROUNDED_M:
            break
        x += obstacle.x - settled.pose.x
        y += obstacle.y - settled.pose.y
    return settled


def _upright(obstacle: Obstacle) -> tuple[float, float, float, float]:
    """Return the nearest orientation at which obstacles are spawned."""
    _, _, z, w = obstacle.quaternion
    step = math.radians(YAW_STEP_DEG)
    half = round(2.0 * math.atan2(z, w) / step) * step / 2.0
    sign = -1.0 if math.cos(half) < 0.0 else 1.0
    return 0.0, 0.0, round(sign * math.sin(half), 6), round(sign * math.cos(half), 6)


def _apart(first: Pose, second: Pose) -> tuple[float, float]:
    """Return the largest difference of two poses along an axis, metres, and of quaternions."""
    off = max(abs(first.x - second.x), abs(first.y - second.y), abs(first.z - second.z))
    p, q = np.array(first.quaternion), np.array(second.quaternion)
    return off, float(min(np.abs(p - q).max(), np.abs(p + q).max()))


def clearance_m(scene: CheckedScene, asset_id: str, spot: Pose, earlier: Sequence[Body]) -> float:
    """Return the distance in the plane to all that a fall at a spot could touch, metres.

    At most `gap_m`, which holds for every obstacle of the generator: in space, not of footprints.
    """
    gap = scene.config.gap_m
    shapes = scene.layout.shapes
    own = Solids.of([(0, shapes.slabs(asset_id, spot))])
    others = [scene.layout.solids]
    others += [Solids.of([(0, shapes.slabs(b.asset.asset_id, b.pose))]) for b in earlier]
    grow = (gap, gap, gap, gap, gap, gap + FALL_M)
    least = gap + SPOT_M
    for other in others:
        for a, b in own.near(other, grow):
            plans = own.slabs[a].plan, other.slabs[b].plan
            least = min(least, float(shapely.distance(*plans)))
    return gap if least > gap - SPOT_M else least


def _near(scene: CheckedScene, asset_id: str, spot: Pose, earlier: Sequence[Body]) -> list[Body]:
    """List the bodies that could be touched: objects, earlier obstacles, walls."""
    layout, assets = scene.layout, scene.assets
    here = _plans(layout.shapes.slabs(asset_id, spot))

    def near(slabs: Sequence[Slab]) -> bool:
        return bool(shapely.dwithin(here[:, None], _plans(slabs)[None, :], NEAR_M).any())

    bodies = [
        Body.of_object(o, assets, moves=False)
        for o in layout.house.objects
        if assets[o.asset_id].blocks and near(layout.object_slabs[o.object_id])
    ]
    bodies += [b for b in earlier if near(layout.shapes.slabs(b.asset.asset_id, b.pose))]
    walls = zip(layout.house.walls, layout.wall_slabs, strict=True)
    return bodies + [wall_body(wall) for wall, slab in walls if near([slab])]


def _plans(slabs: Sequence[Slab]) -> NDArray[np.object_]:
    return np.array([slab.plan for slab in slabs], dtype=object)
