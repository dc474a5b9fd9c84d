"""Drop: the first spot round the agent where a held thing comes to rest."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numba import njit

from internav_data.geometry import (
    Polygons,
    clearance,
    footprint,
    round_m,
    round_quaternion,
)
from internav_data.geometry.headings import TURNS, turned
from internav_data.geometry.planar import segment_polygon_distance
from internav_data.navigation import CLEARANCE_M
from internav_data.physics.engines import DEFAULT_ENGINE
from internav_data.physics.kdop import dop8_of_square
from internav_data.physics.scene import Body
from internav_data.physics.settling import settle
from internav_data.records import Pose
from internav_data.records.agent import AGENT
from internav_data.world.visibility import axis_distance

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from internav_data.core.typing import Floats, Ints
    from internav_data.physics.kdop import Dop8
    from internav_data.physics.settling import SettleResult
    from internav_data.records import Asset, Vec2
    from internav_data.world.house_model import MovableObject

GAPS_M: Final = tuple(round(0.05 * k, 2) for k in range(1, 11))
"""Distances from the agent's disc, nearest first."""
BEARINGS_DEG: Final = (0, *(s * b for b in range(15, 180, 15) for s in (1, -1)), 180)
"""From straight ahead to behind, left first."""
ROOM_M: Final = 0.01
"""Nothing may be nearer than this before it is let go."""
NEAR_M: Final = 0.5
"""What is farther away than this cannot be touched while a thing settles."""
_AHEAD: Final = tuple((math.cos(math.radians(b)), math.sin(math.radians(b))) for b in BEARINGS_DEG)


class DropObstructions(NamedTuple):
    """What a dropped thing must keep clear of."""

    walls: Polygons
    solid: Sequence[Polygons]
    """Footprints of all that is fixed and of all that can move."""
    bodies: Callable[[Dop8], Sequence[Body]]
    """Gathers what reaches into an octagon of the house."""


def drop(
    held: MovableObject,
    agent: Vec2,
    heading: int,
    obstructions: DropObstructions,
    engine: str = DEFAULT_ENGINE,
) -> SettleResult | None:
    """Find room for a held object: gap after gap at bearing after bearing; None without room.

    The object stands upright, turned as the agent is.
    """
    turn = round_quaternion(TURNS[heading])
    plan = _standing(held.asset, heading)
    for gap in GAPS_M:
        for ahead in _AHEAD:
            ux, uy = turned(heading, *ahead)
            spot = _spot(plan, agent, ux, uy, gap)
            pose = Pose(*spot, 0.0, turn)
            if _fits(plan, spot, agent, obstructions):
                body = Body(held.asset, pose, held.dynamics)
                settled = _let_go(body, agent, obstructions, engine)
                if settled is not None:
                    return settled
    return None


@lru_cache(maxsize=4096)
def _standing(asset: Asset, heading: int) -> Polygons:
    return footprint(asset, Pose(0.0, 0.0, 0.0, round_quaternion(TURNS[heading])))


def _spot(plan: Polygons, agent: Vec2, ux: float, uy: float, gap: float) -> Vec2:
    """Where the thing's near side is a gap away from the agent's disc."""
    nearest = min((ux * x + uy * y for x, y in plan.vertices.tolist()), default=0.0)
    far = AGENT.radius_m + gap - nearest
    return round_m(agent[0] + far * ux), round_m(agent[1] + far * uy)


def _fits(plan: Polygons, spot: Vec2, agent: Vec2, obstructions: DropObstructions) -> bool:
    """Whether there is room, and no wall in between."""
    there = Polygons(plan.vertices + np.array(spot), plan.offsets)
    if any(clearance(there, other, ROOM_M) < ROOM_M for other in obstructions.solid):
        return False
    walls = obstructions.walls
    return not _crosses(*agent, *spot, walls.vertices, walls.offsets)


@njit(cache=True)
def _crosses(ax: float, ay: float, bx: float, by: float, vertices: Floats, offsets: Ints) -> bool:
    for k in range(len(offsets) - 1):
        start, stop = offsets[k], offsets[k + 1]
        if segment_polygon_distance(ax, ay, bx, by, vertices, start, stop) == 0.0:
            return True
    return False


def _let_go(
    body: Body, agent: Vec2, obstructions: DropObstructions, engine: str
) -> SettleResult | None:
    asset, pose = body.asset, body.pose
    reach = math.hypot(asset.size[0], asset.size[1]) / 2.0 + NEAR_M
    around = dop8_of_square(pose.x, pose.y, reach)
    settled = settle(body, ROOM_M, lambda: obstructions.bodies(around), engine)
    if settled.refusal:
        return None
    exact = footprint(asset, settled.pose)
    if any(clearance(exact, other, ROOM_M) <= 0.0 for other in obstructions.solid):
        return None
    return settled if axis_distance(*agent, exact) >= CLEARANCE_M else None
