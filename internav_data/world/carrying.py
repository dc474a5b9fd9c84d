"""Carrying: where a held object is, and what it would come into (`world.hands = "real"`).

It is carried upright before the agent, turned with it, above low furniture. A step or a turn that
would bring it into something fails; so does picking up what has no room there.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from internav_data.geometry import Polygons, clearance, footprint, round_quaternion
from internav_data.geometry.headings import TURNS, turned
from internav_data.navigation import SPACING_M
from internav_data.physics.kdop import dop8_of_square
from internav_data.physics.sweep import extent_of
from internav_data.records import Pose
from internav_data.records.agent import AGENT

if TYPE_CHECKING:
    from internav_data.records import Asset, Vec2
    from internav_data.world.world import World

CARRY_LOW_M: Final = 0.8
"""Height of a held object's lowest point, metres: what is lower is carried over."""
CARRY_GAP_M: Final = 0.05
"""Distance between the agent's disc and a held object, metres."""
STEP_SAMPLES: Final = (0.5, 1.0)
"""Shares of a lattice step at which a held object is looked at."""
TURN_SAMPLES: Final = (0.25, 0.5, 0.75, 1.0)
"""Shares of a quarter turn at which it is looked at: an apple swings by 12 cm from one to the next,
so that it passes through no wall's end."""


def carry_offset_m(plan: Polygons) -> float:
    """Return the distance of a held object's origin from the agent's axis, metres."""
    nearest = min((x for x, _ in plan.vertices.tolist()), default=0.0)
    return AGENT.radius_m + CARRY_GAP_M - nearest


def has_room(world: World, index: int, position: Vec2, quarters: float) -> bool:
    """Return whether an object can be carried at a pose of the agent.

    Parameters
    ----------
    world
        World, with all other objects where they lie.
    index
        Index of the object, held or about to be.
    position
        Position of the agent, metres.
    quarters
        Quarter turns of the agent, counter-clockwise from +x; parts of one while it turns.

    """
    asset = world.items[index].asset
    plan = _plan(asset, quarters % 4.0)
    held = Polygons(plan.vertices + np.array(position), plan.offsets)
    x, y = position
    near = world.near(dop8_of_square(x, y, _reach_m(asset)), index)
    top = CARRY_LOW_M + asset.size[2]
    for _, body in near:
        low_m, high_m = _heights_m(body.asset, body.pose)
        if high_m <= CARRY_LOW_M or low_m >= top:
            continue
        if clearance(held, _footprint(body.asset, body.pose), 1.0) <= 0.0:
            return False
    return True


def can_step(world: World, step: tuple[int, int]) -> bool:
    """Return whether the held object has room along a lattice step (di, dj) of the agent."""
    i, j = world.i, world.j
    return all(
        has_room(
            world,
            world.held,
            (SPACING_M * (i + share * step[0]), SPACING_M * (j + share * step[1])),
            world.quarter,
        )
        for share in STEP_SAMPLES
    )


def can_turn(world: World, quarter_turns: int) -> bool:
    """Return whether the held object has room while the agent turns: 1 to the left, 3 right."""
    turn = quarter_turns if quarter_turns == 1 else -1
    return all(
        has_room(world, world.held, world.position, world.quarter + share * turn)
        for share in TURN_SAMPLES
    )


@lru_cache(maxsize=4096)
def _plan(asset: Asset, quarters: float) -> Polygons:
    """Return the plan of a held object about the agent's axis."""
    offset = carry_offset_m(footprint(asset, Pose(0.0, 0.0, CARRY_LOW_M, TURNS[0])))
    if quarters == int(quarters):
        x, y = turned(int(quarters), offset, 0.0)
        turn = round_quaternion(TURNS[int(quarters)])
    else:
        angle = quarters * math.pi / 2.0
        x, y = offset * math.cos(angle), offset * math.sin(angle)
        turn = (0.0, 0.0, math.sin(angle / 2.0), math.cos(angle / 2.0))
    return footprint(asset, Pose(x, y, CARRY_LOW_M, turn))


def _reach_m(asset: Asset) -> float:
    """Return a bound of a held object's distance from the agent's axis, metres."""
    return AGENT.radius_m + CARRY_GAP_M + 2.0 * math.hypot(asset.size[0], asset.size[1])


@lru_cache(maxsize=4096)
def _heights_m(asset: Asset, pose: Pose) -> tuple[float, float]:
    """Return the heights of an object's lowest and highest point, metres."""
    extent = extent_of(asset, pose)
    return extent.low_m, extent.high_m


@lru_cache(maxsize=4096)
def _footprint(asset: Asset, pose: Pose) -> Polygons:
    return footprint(asset, pose)
