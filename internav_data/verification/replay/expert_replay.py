"""Replay of experts: their actions in a fresh world, every step measured by shapely."""

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
from internav_data.verification.replay.carrying import what_is_in_the_way

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.records import Episode
    from internav_data.verification.obstacles import Expect
    from internav_data.verification.replay.checked_scene import CheckedScene
    from internav_data.world import MovableObject, World

GOAL_M = 0.2
"""Maximum distance from the goal at which Done succeeds."""
REACH_M = 1.25
"""Maximum distance of the target of an interaction from the agent's axis."""
TURNS = {ROTATE_LEFT: 1, ROTATE_RIGHT: 3}
AHEAD = ((1, 0), (0, 1), (-1, 0), (0, -1))


def check_experts(scene: CheckedScene, episode: Episode, expect: Expect) -> None:
    """Check the expert of an episode and its blind expert, if it has them."""
    for expert, prefix in (
        (episode.expert, "physics.expert"),
        (episode.blind_expert, "physics.blind-expert"),
    ):
        if expert is not None:
            replay = ExpertReplay(scene, episode, expect, prefix)
            if all(replay.act(number, action) for number, action in enumerate(expert.actions)):
                replay.check_goal(expert.actions)


class ExpertReplay:
    """Replay of one expert: the shared world beside the validator's own agent pose."""

    def __init__(self, scene: CheckedScene, episode: Episode, expect: Expect, prefix: str) -> None:
        self._prefix = prefix
        self._may_fail = prefix == "physics.blind-expert"
        self._theatre = scene
        self._expect = expect
        self._goal = (episode.goal.x, episode.goal.y)
        self._world: World = scene.world(episode)
        self._node = (episode.start.i, episode.start.j)
        self._quarter = episode.start.yaw_deg // 90
        self._trail = [self._node]
        """Nodes visited since objects last moved."""
        self._held = -1

    @property
    def _position(self) -> tuple[float, float]:
        return SPACING_M * self._node[0], SPACING_M * self._node[1]

    def act(self, number: int, action: int) -> bool:
        """Execute one action; return whether it went as an expert's may go."""
        what = f"action {number} ({action})"
        if not self._expect(
            0 <= action < ACTIONS, f"{self._prefix}-action", f"{what}: 0 … {ACTIONS - 1}", action
        ):
            return False
        before = self._world.items
        result = self._world.step(action)
        if not result.success and self._may_fail and action in {*PUSHES, PICK, DROP}:
            return True
        if not self._expect(
            result.success, f"{self._prefix}-action", f"{what} to succeed", result.reason
        ):
            return False
        self._check_fixed(before, what)
        if action in TURNS:
            self._quarter = (self._quarter + TURNS[action]) % 4
        elif action == MOVE:
            di, dj = AHEAD[self._quarter]
            self._node = (self._node[0] + di, self._node[1] + dj)
            self._trail.append(self._node)
        elif action in {*PUSHES, PICK, DROP}:
            self._check_clear(before, what)
            if action != DROP:
                self._check_reach(before[result.target], what)
            if action in {PICK, DROP}:
                self._held = result.target if action == PICK else -1
        self._check_hands(action, what)
        return True

    def _check_hands(self, action: int, what: str) -> None:
        """Check that what is held is in nothing, and that nothing is held at Done."""
        if self._held < 0 or self._theatre.config.hands == "free":
            return
        where = (self._held, self._position, self._quarter)
        met = what_is_in_the_way(self._theatre, self._world.items, *where)
        self._expect(not met, f"{self._prefix}-hands", f"{what}: room for what is held", met)
        self._expect(action != DONE, f"{self._prefix}-hands", f"{what}: empty hands", "full ones")

    def check_goal(self, actions: Sequence[int]) -> None:
        """Check the end: Done, at the goal."""
        self._check_clear(self._world.items, "the last steps")
        left = math.dist(self._position, self._goal)
        self._expect(
            left <= GOAL_M and actions[-1:] == (DONE,),
            f"{self._prefix}-goal",
            f"Done within {GOAL_M} m of the goal",
            f"{left:.3f} m from it after {actions[-1:]}",
        )

    def _check_clear(self, items: Sequence[MovableObject], what: str) -> None:
        """Check that the disc kept clear of all objects since they last moved."""
        arrangement = self._theatre.rearranged(items, {})
        points = [(SPACING_M * i, SPACING_M * j) for i, j in self._trail]
        line = LineString(points) if len(points) > 1 else Point(points[0])
        blockers = np.array([*arrangement.layout.blockers, *arrangement.obstacles], dtype=object)
        near = int(shapely.dwithin(blockers, line, KEEP_M).sum())
        self._expect(
            not near, f"{self._prefix}-clear", f"nothing within {KEEP_M} m until {what}", near
        )
        self._trail = [self._node]

    def _check_fixed(self, before: Sequence[MovableObject], what: str) -> None:
        """Check that an action moved nothing that can be neither pushed nor picked up."""
        for k, (was, now) in enumerate(zip(before, self._world.items, strict=True)):
            if was.pose != now.pose:
                self._expect(
                    now.dynamics.pushable or now.dynamics.pickable,
                    f"{self._prefix}-fixed",
                    f"{what}: item {k} ({now.asset.asset_id}) stays, which is fixed",
                    "moved",
                )

    def _check_reach(self, item: MovableObject, what: str) -> None:
        """Check that the target of an interaction lay within reach."""
        gap = math.inf
        if item.pose is not None:
            gap = self._theatre.gap(item.asset.asset_id, item.pose, self._position)
        self._expect(gap <= REACH_M, f"{self._prefix}-reach", f"{what}: at most {REACH_M} m", gap)
