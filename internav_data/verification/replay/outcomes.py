"""Outcomes, again: every push and pick of every obstacle, distances by the validator's own means.

Where a push leads is asked of the shared physics; who can be pushed or picked up, what that does to
the lattice and to the any-angle way, is judged here.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import shapely

from internav_data.verification.interactions import PICK_OUTCOME, PUSH_OUTCOMES
from internav_data.verification.lengths import Between

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Geometry

    from internav_data.records import Episode, Outcome, Pose
    from internav_data.verification.obstacles import Expect
    from internav_data.verification.replay.checked_scene import CheckedScene, Scenery
    from internav_data.world import MovableObject, World

REST_M = 0.01
"""What begins this much above another thing's lowest point, and not above its top, rests on it."""
TOUCH_M = 0.005
"""Things this near touch."""
SUNK_M = 0.01
"""What comes to rest deeper in the floor or a wall is not where a push could lead."""


def check_outcomes(theatre: CheckedScene, episode: Episode, expect: Expect) -> None:
    """Judge the outcomes of all obstacles that have any."""
    world = theatre.world(episode)
    first = len(theatre.stage.items)
    for number, obstacle in enumerate(episode.obstacles):
        for outcome in obstacle.outcomes or ():
            what = f"obstacle {number} ({obstacle.asset_id}), {outcome.action}"
            judge = _Judge(theatre, episode, outcome, what, expect)
            if outcome.action == PICK_OUTCOME:
                judge.pick(world, first + number)
            elif outcome.action in PUSH_OUTCOMES:
                judge.push(world, first + number)


class _Judge:
    """One outcome before its predicates."""

    def __init__(
        self, theatre: CheckedScene, episode: Episode, outcome: Outcome, what: str, expect: Expect
    ) -> None:
        self.theatre = theatre
        self.episode = episode
        self.outcome = outcome
        self.what = what
        self._expect = expect

    def expect(
        self, name: str, expected: object, got: object, *, holds: bool | None = None
    ) -> bool:
        """Judge one predicate: whether two values are equal, unless `holds` is given."""
        true = expected == got if holds is None else holds
        return self._expect(true, f"physics.outcome-{name}", f"{self.what}: {expected}", got)

    def push(self, world: World, index: int) -> None:
        """Push an obstacle again and compare."""
        item, outcome = world.items[index], self.outcome
        if not item.asset.pushable:
            self._ends("not pushable", 0.0, 0.0)
            return
        pushed = world.simulate_push(index, PUSH_OUTCOMES.index(outcome.action), agent=False)
        far = pushed.displacement_m if pushed.success else 0.0
        if self._ends(pushed.reason, far, pushed.seconds) and pushed.success:
            ends: dict[int, Pose | None] = {index: pushed.pose, **dict(pushed.moved)}
            self._above_ground(world, ends)
            self._distances(world, ends)

    def pick(self, world: World, index: int) -> None:
        """Take an obstacle away and compare."""
        if not world.items[index].asset.pickable:
            reason = "not pickable"
        else:
            reason = "something rests on it" if self._carries(world.items, index) else ""
        if self._ends(reason, 0.0, 0.0) and not reason:
            self._distances(world, {index: None})

    def _ends(self, reason: str, displacement_m: float, seconds: float) -> bool:
        """Judge what does not depend on distances; return whether success is as stated."""
        outcome = self.outcome
        self.expect("reason", repr(reason), repr(outcome.reason))
        self.expect("displacement", displacement_m, outcome.displacement_m)
        self.expect("seconds", seconds, outcome.seconds)
        return self.expect("success", not reason, outcome.success)

    def _carries(self, items: Sequence[MovableObject], index: int) -> bool:
        """Whether another movable thing rests on a thing."""
        placed = {
            k: (item.asset.asset_id, item.pose)
            for k, item in enumerate(items)
            if item.pose is not None
        }
        below = placed[index]
        low, high = self.theatre.span(*below)
        on = [
            self._plan(*other)
            for other in placed.values()
            if low + REST_M < self.theatre.span(*other)[0] <= high + TOUCH_M
        ]
        return any(shapely.dwithin(self._plan(*below), plan, TOUCH_M) for plan in on)

    def _plan(self, asset_id: str, pose: Pose) -> Geometry:
        return shapely.union_all(list(self.theatre.footprint(asset_id, pose)))

    def _above_ground(self, world: World, ends: dict[int, Pose | None]) -> None:
        """Judge that nothing was pushed into the floor or a wall."""
        theatre = self.theatre
        for k, pose in ends.items():
            asset_id = world.items[k].asset.asset_id
            if pose is None:
                continue
            low, _ = theatre.span(asset_id, pose)
            name = f"{asset_id} ends above the floor"
            self.expect("sunk", name, f"{low:.4f} m", holds=low >= -SUNK_M)
            inside = theatre.in_walls(asset_id, pose, SUNK_M)
            self.expect("sunk", f"{asset_id} ends clear of walls", "in one", holds=not inside)

    def _distances(self, world: World, changes: dict[int, Pose | None]) -> None:
        """Judge both distances with things where they came to rest."""
        theatre, episode, outcome = self.theatre, self.episode, self.outcome
        scenery = theatre.scenery(world.items, changes)
        ground = scenery.site.ground
        start = ground.node(episode.start.i, episode.start.j)
        goal = ground.node(episode.goal.i, episode.goal.j)
        free = ground.with_obstacles(scenery.taken)
        found = ground.distances(goal, free)[start]
        self.expect("steps", int(found) if math.isfinite(found) else None, outcome.path_steps_after)
        self._way(scenery)

    def _way(self, scenery: Scenery) -> None:
        episode, stated = self.episode, self.outcome.path_m_after
        here, there = (episode.start.x, episode.start.y), (episode.goal.x, episode.goal.y)
        way = Between(scenery.site, here, there, scenery.taken)
        if stated is None:
            shut = not way.connected(stated=False)
            self.expect("way-m", "a way for the disc", "none", holds=shut)
        elif way.agrees(stated):
            self.expect("way-m", stated, stated)
        else:
            self.expect("way-m", f"{way.length():.4f} m", stated, holds=False)
