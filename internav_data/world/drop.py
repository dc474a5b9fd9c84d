"""Drop: the first spot around the agent at which a held object comes to rest."""

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
from internav_data.physics.fall_clearance import fall_clearance, touches
from internav_data.physics.kdop import dop8_of_square
from internav_data.physics.narrow_phase import joined_prisms, prisms_of
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
"""Distances tried between the agent's disc and the object, metres, nearest first."""
BEARINGS_DEG: Final = (0, *(s * b for b in range(15, 180, 15) for s in (1, -1)), 180)
"""Bearings tried, degrees from straight ahead (left positive): ahead to behind, left first."""
ROOM_M: Final = 0.01
"""Minimum distance to all other objects before the object is released, metres."""
NEAR_M: Final = 0.5
"""Distance beyond which a settling object can touch nothing, metres."""
_AHEAD: Final = tuple((math.cos(math.radians(b)), math.sin(math.radians(b))) for b in BEARINGS_DEG)


class DropObstructions(NamedTuple):
    """Obstructions that a dropped object must keep clear of."""

    walls: Polygons
    solid: Sequence[Polygons]
    """Footprints of all fixed objects and of the movable ones near by."""
    bodies: Callable[[Dop8], Sequence[Body]]
    """Function from an 8-DOP of the house to the bodies that reach into it."""


def drop(
    held: MovableObject,
    agent: Vec2,
    heading: int,
    obstructions: DropObstructions,
    engine: str = DEFAULT_ENGINE,
) -> SettleResult | None:
    """Find room for a held object around the agent.

    All bearings are tried at the smallest gap, then at the next. The object stands upright and
    turned like the agent.

    Parameters
    ----------
    held
        Object to put down.
    agent
        Position of the agent, metres.
    heading
        The agent's quarter turns counter-clockwise from +x.
    obstructions
        Walls, footprints and bodies to keep clear of.
    engine
        Name of the physics engine.

    Returns
    -------
    SettleResult or None
        The object at rest; None if there is no room.

    """
    turn = round_quaternion(TURNS[heading])
    plan = _standing(held.asset, heading)
    for gap in GAPS_M:
        for ahead in _AHEAD:
            # By quarter turns of one table, so that all four headings give the same spots exactly.
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
    """Return the spot along (ux, uy) at which the object is a gap away from the agent's disc."""
    # The object's support towards the agent, from its own origin.
    nearest = min((ux * x + uy * y for x, y in plan.vertices.tolist()), default=0.0)
    far = AGENT.radius_m + gap - nearest
    return round_m(agent[0] + far * ux), round_m(agent[1] + far * uy)


def _fits(plan: Polygons, spot: Vec2, agent: Vec2, obstructions: DropObstructions) -> bool:
    """Return whether there is room and no wall between the agent and the spot."""
    there = Polygons(plan.vertices + np.array(spot), plan.offsets)
    if any(clearance(there, other, ROOM_M) < ROOM_M for other in obstructions.solid):
        return False
    # Nor does the agent reach through a wall into the next room.
    walls = obstructions.walls
    return not _crosses(*agent, *spot, walls.vertices, walls.offsets)


@njit(cache=True)
def _crosses(ax: float, ay: float, bx: float, by: float, vertices: Floats, offsets: Ints) -> bool:
    """Return whether the segment from a to b meets one of some convex polygons."""
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
    near = obstructions.bodies(dop8_of_square(pose.x, pose.y, reach))
    # Footprints leave out what lies below 2 cm: the entire hull must have room, too.
    solid = joined_prisms([prisms_of(other.asset, other.pose) for other in near])
    if fall_clearance(prisms_of(asset, pose), solid, ROOM_M) < ROOM_M:
        return None
    settled = settle(body, ROOM_M, lambda: near, engine)
    if settled.refusal:
        return None
    # Judged again at rest, on the rounded pose: falling, it may have slid or tilted.
    exact = footprint(asset, settled.pose)
    if any(clearance(exact, other, ROOM_M) <= 0.0 for other in obstructions.solid):
        return None
    if touches(prisms_of(asset, settled.pose), solid):
        return None
    return settled if axis_distance(*agent, exact) >= CLEARANCE_M else None
