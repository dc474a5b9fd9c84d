"""Spawning: obstacles on the path until it is blocked or longer (paper, section 5.1)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from internav_data.core.arithmetic import plain_sum
from internav_data.geometry import (
    Polygons,
    clearance,
    footprint,
    round_m,
    yaw_quaternion,
)
from internav_data.navigation import room_of
from internav_data.physics import Body, settle, wall_body
from internav_data.physics.fall_clearance import fall_clearance, touches
from internav_data.physics.narrow_phase import prisms_of
from internav_data.records import Pose

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.random import Generator

    from internav_data.core.typing import Floats
    from internav_data.episodes.config import EpisodeConfig
    from internav_data.episodes.pool import ObstaclePool
    from internav_data.episodes.site import SpawnSite
    from internav_data.navigation import Lattice
    from internav_data.physics import SettleResult
    from internav_data.physics.narrow_phase import ConvexPrisms
    from internav_data.records import Affordance, Asset, Dynamics, Mode, NodePath, Vec2

YAW_STEP_DEG = 15
"""Step of the headings at which obstacles stand, degrees."""
NEAR_M = 0.5
"""Distance beyond which a settling object can touch nothing, metres."""
APART_M = 1e-6
"""Smallest gap asked for, metres: with 0, what overlaps would be no nearer than allowed."""


@dataclass(frozen=True, slots=True)
class Spawned:
    """An obstacle at rest."""

    asset: Asset
    dynamics: Dynamics
    spot: Pose
    """Pose from which it fell, on the floor."""
    settled: SettleResult
    segment: int
    """Segment of the node path on which it was spawned, 0 at the start."""
    footprint: Polygons
    """Footprint at the rounded pose, as a reader of the file derives it, metres."""
    prisms: ConvexPrisms
    """Prisms of its entire hull at the rounded pose."""
    affordance: Affordance | None = None
    """Affordance of its type, where attributes are hidden."""

    @property
    def body(self) -> Body:
        """The obstacle at rest, as a body of physics."""
        return Body(self.asset, self.settled.pose, self.dynamics)


@dataclass(slots=True)
class EpisodeDraft:
    """An episode in the making: a start, a goal and the obstacles so far."""

    site: SpawnSite
    config: EpisodeConfig
    mode: Mode
    start: tuple[int, int]
    goal: tuple[int, int]
    start_room: int
    goal_room: int
    room_paths: tuple[tuple[int, ...], ...]
    room_paths_truncated: bool
    node_paths: tuple[NodePath, ...]
    node_paths_truncated: bool
    lattice: Lattice
    """Lattice with the obstacles so far."""
    shortest_path_m: float
    shortest_path_steps: int
    steps: int | None
    """Lattice distance among the obstacles so far; None when cut off."""
    attribute_draws: Floats | None = None
    """Random numbers of the hidden attributes, (obstacles, `DRAWS`) float64: a row for each
    obstacle in order of spawning; None where the look tells the attributes."""
    quarter: int = 0
    """Heading of the agent at the start, quarter turns counter-clockwise from +x."""
    obstacles: list[Spawned] = field(default_factory=list)

    @property
    def done(self) -> bool:
        """Whether the condition of the mode holds."""
        if self.mode == "blocked":
            return self.steps is None
        # A detour has an even number of steps: every way round takes as many back as forth.
        longer = self.shortest_path_steps + self.config.min_detour_steps
        return self.steps is not None and self.steps >= longer


@lru_cache(maxsize=4096)
def _standing(asset: Asset, yaw_deg: int) -> Polygons:
    """Return the footprint of an upright asset at the origin, for a test before the exact one."""
    return footprint(asset, Pose(0.0, 0.0, 0.0, yaw_quaternion(yaw_deg)))


def spawn(draft: EpisodeDraft, pool: ObstaclePool, rng: Generator) -> bool:
    """Put obstacles on the paths of a draft until the condition of its mode holds.

    Parameters
    ----------
    draft
        Episode in the making; obstacles are added to it.
    pool
        Assets to draw from.
    rng
        Source of random numbers.

    Returns
    -------
    bool
        Whether the condition holds; False if tries or obstacles ran out.

    """
    limit = draft.config.max_obstacles_for(len(draft.site.house.rooms))
    for _ in range(draft.config.max_spawn_tries):
        if draft.done:
            return True
        if len(draft.obstacles) == limit:
            return False
        _try_spot(draft, pool, rng)
    return draft.done


def _try_spot(draft: EpisodeDraft, pool: ObstaclePool, rng: Generator) -> None:
    """Draw an asset and a spot, and add the obstacle if it fits.

    Each try takes the same number of random numbers, whether it succeeds or not.
    """
    asset = pool.draw(rng)
    path = draft.node_paths[int(rng.integers(len(draft.node_paths)))]
    segment = int(rng.integers(len(path.points) - 1))
    # Uniform along the path, normally distributed across it (paper, section 5.1).
    along, lateral = float(rng.random()), float(rng.standard_normal()) * draft.config.lateral_std_m
    yaw_deg = YAW_STEP_DEG * int(rng.integers(360 // YAW_STEP_DEG))
    spot = _spot(draft.site, path.points[segment], path.points[segment + 1], along, lateral)
    if spot is None:
        return
    pose = Pose(round_m(spot[0]), round_m(spot[1]), 0.0, yaw_quaternion(yaw_deg))
    # Cheapest test first: upright footprint, entire hull, physics, then both at the rounded rest.
    gap = max(draft.config.gap_m, APART_M)
    standing = _standing(asset, yaw_deg)
    shifted = Polygons(standing.vertices + np.array([pose.x, pose.y]), standing.offsets)
    if _distance(draft, shifted, gap) < gap:
        return
    upright = prisms_of(asset, pose)
    if any(fall_clearance(upright, other, gap) < gap for other in _solids(draft)):
        return
    dynamics = _dynamics(draft, asset)
    settled = settled_at(draft, Body(asset, pose, dynamics))
    if settled.refusal:
        return
    # Settling may have moved it by up to 5 cm: it must still not touch anything.
    exact, entire = footprint(asset, settled.pose), prisms_of(asset, settled.pose)
    if _distance(draft, exact, gap) <= 0.0 or any(touches(entire, s) for s in _solids(draft)):
        return
    hidden = draft.site.hidden
    affordance = None if hidden is None else hidden.affordance(asset)
    _place(draft, Spawned(asset, dynamics, pose, settled, segment, exact, entire, affordance))


def _dynamics(draft: EpisodeDraft, asset: Asset) -> Dynamics:
    """Return the dynamics of the next obstacle, if it is of an asset."""
    hidden, draws = draft.site.hidden, draft.attribute_draws
    if hidden is None or draws is None:
        return asset.dynamics
    # By the obstacle's number, whatever asset is tried: attributes have no part in the choice.
    return hidden.dynamics(asset, draws[len(draft.obstacles)].tolist())


def settled_at(draft: EpisodeDraft, body: Body) -> SettleResult:
    """Let a body fall from its upright pose among the house and the obstacles of a draft."""
    return settle(
        body,
        draft.config.gap_m,
        lambda: _near(draft, prisms_of(body.asset, body.pose)),
        draft.site.physics.engine,
    )


def _spot(
    site: SpawnSite, first: Vec2, second: Vec2, along: float, lateral: float
) -> tuple[float, float] | None:
    """Return the point at a share of a path's length, moved sideways; None if in another room."""
    points = site.path_between(first, second)
    left = along * plain_sum(math.dist(a, b) for a, b in pairwise(points))
    for a, b in pairwise(points):
        leg = math.dist(a, b)
        if left <= leg and leg > 0.0:
            ux, uy = (b[0] - a[0]) / leg, (b[1] - a[1]) / leg
            x, y = a[0] + left * ux, a[1] + left * uy
            # (-uy, ux) is the leg's normal, to the left.
            spot = (x - lateral * uy, y + lateral * ux)
            return spot if room_of(site.house, *spot) == room_of(site.house, x, y) else None
        left -= leg
    return None


def _distance(draft: EpisodeDraft, polygons: Polygons, stop_at: float) -> float:
    """Return the distance to the house and the other obstacles, metres, at most `stop_at`."""
    near = clearance(polygons, draft.site.footprints, stop_at)
    for other in draft.obstacles:
        near = min(near, clearance(polygons, other.footprint, stop_at))
    return near


def _place(draft: EpisodeDraft, spawned: Spawned) -> None:
    """Add an obstacle unless it covers start or goal, or cuts off a path to be lengthened."""
    # On trial: the lattice counts its blockers, so that removing it again restores every count.
    handle = draft.lattice.add(spawned.footprint)
    free = draft.lattice.free
    steps = draft.lattice.distance(draft.start, draft.goal)
    cuts = steps is None and draft.mode == "lengthened"
    if not free[draft.start] or not free[draft.goal] or cuts:
        draft.lattice.remove(handle)
        return
    draft.obstacles.append(spawned)
    draft.steps = steps


def _solids(draft: EpisodeDraft) -> Iterator[ConvexPrisms]:
    """Yield the prisms of the house, then those of each obstacle so far."""
    yield draft.site.prisms
    for other in draft.obstacles:
        yield other.prisms


def _near(draft: EpisodeDraft, here: ConvexPrisms) -> list[Body]:
    """Return the furniture, obstacles and walls whose plans are near an object's, fixed."""
    house = draft.site.house
    bodies = [
        Body.of_object(placed, house.assets, moves=False)
        for placed in house.objects
        if house.assets[placed.asset_id].blocks
    ]
    bodies += [replace(other.body, moves=False) for other in draft.obstacles]
    bodies += [wall_body(wall) for wall in house.walls]
    return [body for body in bodies if _is_near(here, prisms_of(body.asset, body.pose))]


def _is_near(here: ConvexPrisms, there: ConvexPrisms) -> bool:
    """Return whether the plans of two objects come near, at whatever heights their parts are."""
    plans = Polygons(here.vertices, here.starts), Polygons(there.vertices, there.starts)
    return clearance(*plans, NEAR_M) < NEAR_M
