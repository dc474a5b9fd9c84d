"""Predicates of the obstacles of an episode: assets, poses, certificates of settling."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

import shapely

from internav_data.verification.overlaps import (
    DEPTH_M,
    WALL_ID,
    Solids,
    intrusions,
    overlapping_plans,
)

if TYPE_CHECKING:
    from shapely import Geometry

    from internav_data.records import Episode, Obstacle
    from internav_data.verification.checked_layout import CheckedLayout
    from internav_data.verification.findings import FindingCollector
    from internav_data.verification.shapes import Slab

MAX_SETTLE_S = 1.0
MAX_PENETRATION_M = 0.002
MAX_TILT_DEG = 5.0
FLOOR_M = (-0.0025, 0.005)
"""Bounds of the height of a settled object's lowest corner."""
TILT_SLACK_DEG = 0.001
"""Tolerance of the tilt: quaternions are rounded to 1e-6."""


class Expect(Protocol):
    """Function that checks one predicate of an episode."""

    def __call__(self, holds: object, predicate: str, expected: object, got: object) -> bool:
        """Keep a finding if the predicate does not hold; return whether it holds."""


def check_obstacles(
    layout: CheckedLayout, episode: Episode, report: FindingCollector
) -> list[list[Geometry]] | None:
    """Check the obstacles; return the footprint of each, or None if an asset is unknown."""
    name = episode.episode_id

    def expect(holds: object, predicate: str, expected: object, got: object) -> bool:
        return report.expect(holds, predicate, expected, got, name)

    count = len(episode.obstacles)
    expect(episode.obstacle_count == count, "episode.obstacle-count", count, episode.obstacle_count)
    expect(count > 0, "episode.obstacle-count", "at least one obstacle", count)
    segments = max((len(path.points) - 1 for path in episode.node_paths), default=0)
    footprints: list[list[Geometry]] = []
    bodies: list[tuple[int, list[Slab]]] = []
    for number, obstacle in enumerate(episode.obstacles):
        what = f"obstacle {number} ({obstacle.asset_id})"
        known = obstacle.asset_id in layout.shapes.assets
        if not expect(known, "obstacle.asset", f"{what} in the assets", "no such asset"):
            return None
        _check_asset(layout, obstacle, what, expect)
        expect(
            0 <= obstacle.node_path_segment < segments,
            "obstacle.node_path_segment",
            f"{what}: 0 … {segments - 1}",
            obstacle.node_path_segment,
        )
        _check_rest(obstacle, what, expect)
        slabs = layout.shapes.slabs(obstacle.asset_id, obstacle.pose)
        low = min(slab.low for slab in slabs)
        expect(
            FLOOR_M[0] <= low <= FLOOR_M[1],
            "obstacle.floor",
            f"{what}: lowest corner between {FLOOR_M[0]} and {FLOOR_M[1]} m",
            f"{low:.4f} m",
        )
        footprints.append(layout.shapes.footprint(obstacle.asset_id, obstacle.pose))
        _check_place(layout, footprints, number, what, expect)
        bodies.append((number, slabs))
    _check_hulls(layout, episode, Solids.of(bodies), expect)
    physics = episode.physics
    if episode.obstacles:
        slowest = max(o.settle_s for o in episode.obstacles)
        deepest = max(o.settle_penetration_m for o in episode.obstacles)
        expect(physics.settle_s == slowest, "physics.settle", slowest, physics.settle_s)
        expect(
            physics.penetration_m == deepest,
            "physics.penetration",
            deepest,
            physics.penetration_m,
        )
    expect(bool(physics.engine and physics.build), "physics.engine", "a name and a build", physics)
    return footprints


def _check_asset(layout: CheckedLayout, obstacle: Obstacle, what: str, expect: Expect) -> None:
    asset = layout.shapes.assets[obstacle.asset_id]
    expect(asset.spawnable, "obstacle.spawnable", f"{what}: a spawnable asset", "another")
    expect(obstacle.type == asset.type, "obstacle.type", f"{what}: {asset.type}", obstacle.type)


def _check_rest(obstacle: Obstacle, what: str, expect: Expect) -> None:
    expect(
        0.0 <= obstacle.settle_s <= MAX_SETTLE_S,
        "obstacle.settle",
        f"{what}: at most {MAX_SETTLE_S} s",
        obstacle.settle_s,
    )
    expect(
        obstacle.settle_penetration_m <= MAX_PENETRATION_M,
        "obstacle.penetration",
        f"{what}: at most {MAX_PENETRATION_M} m",
        obstacle.settle_penetration_m,
    )
    x, y, _, _ = obstacle.quaternion
    length = math.hypot(*obstacle.quaternion)
    # The turned z axis has the height 1 - 2 (x² + y²).
    lean = 1.0 - 2.0 * (x * x + y * y) / (length * length)
    tilt = math.degrees(math.acos(max(-1.0, min(1.0, lean))))
    expect(
        tilt <= MAX_TILT_DEG + TILT_SLACK_DEG,
        "obstacle.upright",
        f"{what}: within {MAX_TILT_DEG}°",
        f"{tilt:.3f}°",
    )


def _check_place(
    layout: CheckedLayout, footprints: list[list[Geometry]], number: int, what: str, expect: Expect
) -> None:
    own = footprints[number]
    for plan in own:
        beyond = shapely.area(shapely.difference(plan, layout.outline))
        expect(
            beyond < DEPTH_M**2, "obstacle.inside", f"{what} inside the house", f"{beyond:.6f} m²"
        )
    hits = overlapping_plans(own, layout.blockers)
    expect(
        not hits, "obstacle.overlap-house", f"{what} clear of the house", f"{len(hits)} overlaps"
    )
    for other in range(number):
        hits = overlapping_plans(own, footprints[other])
        expect(
            not hits,
            "obstacle.overlap",
            f"{what} clear of obstacle {other}",
            f"{len(hits)} overlaps",
        )


def _check_hulls(layout: CheckedLayout, episode: Episode, own: Solids, expect: Expect) -> None:
    """Check the obstacles in space: footprints leave out what lies below 2 cm."""
    names = [f"obstacle {k} ({o.asset_id})" for k, o in enumerate(episode.obstacles)]
    clear = f"nowhere over {DEPTH_M} m inside"
    hits = intrusions(own, layout.solids)
    for number, name in enumerate(names):
        within = [b for a, b in hits if a == number]
        things = ", ".join("a wall" if b == WALL_ID else f"object {b}" for b in within)
        expect(
            not within,
            "obstacle.overlap-house-3d",
            f"{name} {clear} the house's walls and objects",
            f"inside {things}",
        )
    pairs = intrusions(own, own)
    for number, name in enumerate(names):
        within = [b for a, b in pairs if a == number]
        expect(
            not within,
            "obstacle.overlap-3d",
            f"{name} {clear} another obstacle",
            f"inside {', '.join(names[b] for b in within)}",
        )
