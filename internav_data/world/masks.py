"""Masks of actions: which could succeed now, by what is known before anything is simulated."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from internav_data.world.actions import ACTIONS, HORIZONS_DEG, Action
from internav_data.world.carrying import can_step, can_turn, has_room
from internav_data.world.world import AHEAD, carries

if TYPE_CHECKING:
    from internav_data.core.typing import Bools
    from internav_data.world.world import World


def action_mask(world: World) -> Bools:
    """Return whether each action could succeed, (actions,) bool.

    Done always can end the episode, unless hands are real and full. What is masked out would fail
    and change nothing. What is not may still fail: a push that physics refuses, a drop without
    room.
    """
    return np.array([_could_succeed(world, action) for action in ACTIONS], np.bool_)


def _could_succeed(world: World, action: Action) -> bool:
    kind = action.kind
    if kind == "move":
        ahead = AHEAD[world.quarter]
        free = bool(world.lattice.edge_free(world.i, world.j, *ahead))
        return free and (not world.carrying or can_step(world, ahead))
    if kind == "turn":
        return not world.carrying or can_turn(world, action.quarter_turns)
    if kind == "look":
        last = HORIZONS_DEG[-1 if action == Action.LOOK_DOWN else 0]
        return world.horizon_deg != last
    if kind == "push":
        return world.target(pick=False) >= 0
    if kind == "pick":
        return _could_pick(world)
    return not world.carrying if kind == "done" else world.held >= 0


def _could_pick(world: World) -> bool:
    target = world.target(pick=True) if world.held < 0 else -1
    if target < 0 or carries(world, target):
        return False
    real = world.config.hands == "real"
    return not real or has_room(world, target, world.position, world.quarter)
