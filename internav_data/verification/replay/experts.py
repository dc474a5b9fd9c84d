"""Experts, again: their actions played in a fresh world, and every step measured by shapely."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import LineString, Point

from internav_data.verification.checked_lattice import KEEP_M, SPACING_M
from internav_data.verification.interactions import (
    ACTIONS,
    DONE,
    DROP,
    MOVE,
    PICK,
    PUSHES,
    ROTATE_LEFT,
    ROTATE_RIGHT,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.records import Episode
    from internav_data.verification.obstacles import Expect
    from internav_data.verification.replay.checked_scene import CheckedScene
    from internav_data.world import MovableObject, World

GOAL_M = 0.2
"""Done succeeds within this of the goal."""
REACH_M = 1.25
"""What is pushed or picked up lies at least in part within this of the agent's axis."""
TURNS = {ROTATE_LEFT: 1, ROTATE_RIGHT: 3}
AHEAD = ((1, 0), (0, 1), (-1, 0), (0, -1))


def check_expert(theatre: CheckedScene, episode: Episode, expect: Expect) -> None:
    """Judge the expert of an episode, where it has one."""
    if episode.expert is None:
        return
    player = _Player(theatre, episode, expect)
    for number, action in enumerate(episode.expert.actions):
        if not player.act(number, action):
            return
    player.arrive(episode.expert.actions)


class _Player:
    """An expert on its way: the shared world, and where the agent must be by the validator."""

    def __init__(self, theatre: CheckedScene, episode: Episode, expect: Expect) -> None:
        self._theatre = theatre
        self._expect = expect
        self._goal = (episode.goal.x, episode.goal.y)
        self._world: World = theatre.world(episode)
        self._node = (episode.start.i, episode.start.j)
        self._quarter = episode.start.yaw_deg // 90
        self._trail = [self._node]
        """Nodes since things last moved."""

    @property
    def _here(self) -> tuple[float, float]:
        return SPACING_M * self._node[0], SPACING_M * self._node[1]

    def act(self, number: int, action: int) -> bool:
        """Play one action; return whether it succeeded."""
        what = f"action {number} ({action})"
        if not self._expect(
            0 <= action < ACTIONS, "physics.expert-action", f"{what}: 0 … {ACTIONS - 1}", action
        ):
            return False
        before = self._world.items
        result = self._world.step(action)
        if not self._expect(
            result.success, "physics.expert-action", f"{what} to succeed", result.reason
        ):
            return False
        if action in TURNS:
            self._quarter = (self._quarter + TURNS[action]) % 4
        elif action == MOVE:
            di, dj = AHEAD[self._quarter]
            self._node = (self._node[0] + di, self._node[1] + dj)
            self._trail.append(self._node)
        elif action in {*PUSHES, PICK, DROP}:
            self._walked(before, what)
            if action != DROP:
                self._reached(before[result.target], what)
        return True

    def arrive(self, actions: Sequence[int]) -> None:
        """Judge the end: Done, at the goal."""
        self._walked(self._world.items, "the last steps")
        left = math.dist(self._here, self._goal)
        self._expect(
            left <= GOAL_M and actions[-1:] == (DONE,),
            "physics.expert-goal",
            f"Done within {GOAL_M} m of the goal",
            f"{left:.3f} m from it after {actions[-1:]}",
        )

    def _walked(self, items: Sequence[MovableObject], what: str) -> None:
        """Judge that the disc kept off all things as they lay since they last moved."""
        scenery = self._theatre.scenery(items, {})
        points = [(SPACING_M * i, SPACING_M * j) for i, j in self._trail]
        line = LineString(points) if len(points) > 1 else Point(points[0])
        things = np.array([*scenery.site.blockers, *scenery.taken], dtype=object)
        near = int(shapely.dwithin(things, line, KEEP_M).sum())
        self._expect(
            not near, "physics.expert-clear", f"nothing within {KEEP_M} m until {what}", near
        )
        self._trail = [self._node]

    def _reached(self, item: MovableObject, what: str) -> None:
        """Judge that what was acted on lay within reach."""
        gap = math.inf
        if item.pose is not None:
            gap = self._theatre.gap(item.asset.asset_id, item.pose, self._here)
        self._expect(gap <= REACH_M, "physics.expert-reach", f"{what}: at most {REACH_M} m", gap)
