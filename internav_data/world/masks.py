"""Masks of actions: which could succeed now, by what is known before anything is simulated."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from internav_data.world.actions import ACTIONS, HORIZONS_DEG, Action
from internav_data.world.world import AHEAD, carries

if TYPE_CHECKING:
    from internav_data.core.typing import Bools
    from internav_data.world.world import World


def action_mask(world: World) -> Bools:
    """Return whether each action could succeed, (actions,) bool; Done always can end the episode.

    What is masked out would fail and change nothing. What is not may still fail: a push that
    physics refuses, a drop without room.
    """
    return np.array([_could_succeed(world, action) for action in ACTIONS], np.bool_)


def _could_succeed(world: World, action: Action) -> bool:
    if action.kind == "move":
        return bool(world.lattice.edge_free(world.i, world.j, *AHEAD[world.quarter]))
    if action.kind == "look":
        last = HORIZONS_DEG[-1 if action == Action.LOOK_DOWN else 0]
        return world.horizon_deg != last
    if action.kind == "push":
        return world.target(pick=False) >= 0
    if action.kind == "pick":
        target = world.target(pick=True) if world.held < 0 else -1
        return target >= 0 and not carries(world, target)
    return world.held >= 0 if action.kind == "drop" else True
