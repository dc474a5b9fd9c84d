"""Replay of outcomes: every push and pick of every obstacle.

The end poses of a push come from the shared physics. Whether an object can be pushed or picked
up, and the changes of the lattice and Euclidean distances, are derived here.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import shapely

from internav_data.verification.checked_path import CheckedPath
from internav_data.verification.interactions import MAX_REACH, PICK_OUTCOME, PUSH_OUTCOMES
from internav_data.verification.shapes import rotate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from shapely import Geometry

    from internav_data.physics.pushing import PushResult
    from internav_data.records import Asset, Episode, Outcome, Pose, SceneObject
    from internav_data.verification.obstacles import Expect
    from internav_data.verification.replay.checked_scene import Arrangement, CheckedScene
    from internav_data.world import MovableObject, World

SHIFT_M = 3e-4
"""Tolerance of a distance: it, the poses and the centre of mass are rounded to 0.1 mm."""
REST_M = 0.01
"""A rests on B if A's bottom is more than this above B's bottom and not above B's top."""
TOUCH_M = 0.005
"""Maximum distance of touching objects."""
TIE_M = 1e-7
"""Difference that arithmetic alone can make."""
CENTIMETRE = 0.01
"""Step to which sides of swept boxes are rounded up, metres."""
SWEPT_ELSEWHERE_M = 0.03
"""Distance by which sides of swept boxes may differ on other hardware, metres."""
SUNK_M = 0.005
"""Maximum depth in the floor or in anything else of an object that a push has moved."""


def check_outcomes(
    scene: CheckedScene, episode: Episode, expect: Expect, other_engine: str | None = None
) -> None:
    """Check the outcomes of all obstacles that have any.

    Parameters
    ----------
    scene, episode
        Scene and episode to check.
    expect
        Function that counts a predicate.
    other_engine
        Name of the engine whose second opinions are stored; None not to ask it.

    """
    world = scene.world(episode)
    other = None if other_engine is None else scene.world(episode, other_engine)
    first = len(scene.model.items)
    for number, obstacle in enumerate(episode.obstacles):
        for outcome in obstacle.outcomes or ():
            what = f"obstacle {number} ({obstacle.asset_id}), {outcome.action}"
            check = OutcomeCheck(scene, episode, outcome, what, expect)
            check.fixed_stay()
            if outcome.action == PICK_OUTCOME:
                check.pick(world, first + number)
            elif outcome.action in PUSH_OUTCOMES:
                check.push(world, first + number)
                if other is not None and obstacle.pushable:
                    check.second_opinion(other, first + number)


class OutcomeCheck:
    """Check of one outcome."""

    def __init__(
        self, scene: CheckedScene, episode: Episode, outcome: Outcome, what: str, expect: Expect
    ) -> None:
        self.scene = scene
        self.episode = episode
        self.outcome = outcome
        self.what = what
        self._expect = expect

    def expect(
        self, name: str, expected: object, got: object, *, holds: bool | None = None
    ) -> bool:
        """Check one predicate: that two values are equal, unless `holds` is given."""
        true = expected == got if holds is None else holds
        return self._expect(true, f"physics.outcome-{name}", f"{self.what}: {expected}", got)

    def fixed_stay(self) -> None:
        """Check that nothing moved that the agent can neither push nor pick up."""
        assets, house = self.scene.assets, self.scene.layout.house
        furniture = {o.object_id for o in house.objects if _is_movable(o, assets[o.asset_id])}
        for other in self.outcome.moved or ():
            if other.obstacle is not None:
                own = self.episode.obstacles[other.obstacle]
                name, movable = f"obstacle {other.obstacle}", own.pushable or own.pickable
            else:
                name, movable = f"object {other.object_id}", other.object_id in furniture
            self.expect("fixed", f"{name} stays, for it is fixed", "moved", holds=movable)

    def push(self, world: World, index: int) -> None:
        """Push an obstacle again and compare."""
        item, outcome = world.items[index], self.outcome
        if not item.dynamics.pushable:
            self._ends("not pushable", 0.0, 0.0)
            self._poses(None, (), at_rest=True)
            return
        pushed = world.simulate_push(index, PUSH_OUTCOMES.index(outcome.action), agent=False)
        far = pushed.displacement_m if pushed.success else 0.0
        if self._ends(pushed.reason, far, pushed.seconds) and pushed.success:
            ends: dict[int, Pose | None] = {index: pushed.pose, **dict(pushed.moved)}
            self._poses(pushed.pose, pushed.moved, at_rest=pushed.at_rest)
            self._swept(world.items[index].pose, pushed)
            self._not_sunk(world, ends)
            if outcome.moved is None or not self.scene.config.same_hardware:
                # Else the stored poses are these, and give the distances without physics.
                self._distances(world, ends)
            self._reach(world, index, pushed)
        else:
            self._poses(None, (), at_rest=pushed.at_rest)

    def second_opinion(self, other: World, index: int) -> None:
        """Push an obstacle again by the other engine, and compare with what it said."""
        success, opened, pose = self.ask(other, index)
        agrees = (success, opened) == (self.outcome.success, self.outcome.opened)
        self.expect("agrees", agrees, self.outcome.agrees)
        self.expect("other-pose", pose, self.outcome.other_pose)

    def ask(self, world: World, index: int) -> tuple[bool, bool, Pose | None]:
        """Return whether a push of an obstacle succeeds and opens, and where it ends if it does."""
        heading = PUSH_OUTCOMES.index(self.outcome.action)
        pushed = world.simulate_push(index, heading, agent=False)
        if not pushed.success:
            return False, False, None
        opened = False
        if self.episode.obstructed_path_steps is None:
            ends: dict[int, Pose | None] = {index: pushed.pose, **dict(pushed.moved)}
            opened = math.isfinite(self._steps(world.items, ends))
        return True, opened, pushed.pose

    def _swept(self, start: Pose | None, pushed: PushResult) -> None:
        """Check that the box holds all of the way, and is wider by less than 1 cm on each side."""
        stored = self.outcome.swept
        if stored is None or start is None or pushed.swept is None:
            return
        (x_min, y_min, x_max, y_max), (x, y) = pushed.swept, (start.x, start.y)
        found = (x - x_min, y - y_min, x_max - x, y_max - y)
        wider = [side - far for side, far in zip(stored, found, strict=True)]
        # The same end is reached by ways that differ more than ends do.
        slack = TIE_M if self.scene.config.same_hardware else SWEPT_ELSEWHERE_M
        near = all(-slack <= more < CENTIMETRE + slack for more in wider)
        self.expect("swept", tuple(round(far, 4) for far in found), stored, holds=near)

    def _reach(self, world: World, index: int, pushed: PushResult) -> None:
        """Push on where pushes end after a step, and compare how far and what it opens."""
        outcome = self.outcome
        if self.scene.config.push_model != "step":
            self.expect("reach", None, outcome.reach_m)
            return
        there, items = world.copy(), world.items
        reach, opened = [outcome.displacement_m], None
        ends: dict[int, Pose | None] = {}
        while True:
            ends |= {index: pushed.pose, **dict(pushed.moved)}
            if self.episode.obstructed_path_steps is None and opened is None:
                opened = len(reach) if math.isfinite(self._steps(items, ends)) else None
            if len(reach) == MAX_REACH:
                break
            there.put([(index, pushed.pose), *pushed.moved])
            pushed = there.simulate_push(index, PUSH_OUTCOMES.index(outcome.action), agent=False)
            if not pushed.success:
                break
            reach.append(self._shift_m(items[index], pushed.pose))
        stored = outcome.reach_m or ()
        near = len(stored) == len(reach) and all(
            abs(a - b) <= SHIFT_M for a, b in zip(stored, reach, strict=True)
        )
        self.expect("reach", reach, stored, holds=near)
        self.expect("reach-opened", opened, outcome.reach_opened)

    def _shift_m(self, item: MovableObject, end: Pose) -> float:
        """Return the distance in the plane of a centre of mass from where it began, metres."""
        middle = self.scene.layout.shapes.centre_of_mass(item.asset.asset_id)[None]
        before, after = (
            rotate(middle, pose.quaternion)[0] + (pose.x, pose.y, pose.z)
            for pose in (item.pose, end)
            if pose is not None
        )
        return math.dist(before[:2], after[:2])

    def _steps(self, items: Sequence[MovableObject], changes: Mapping[int, Pose | None]) -> float:
        """Return the lattice distance to the goal with some items elsewhere; inf if cut off."""
        arrangement = self.scene.rearranged(items, dict(changes))
        lattice, episode = arrangement.layout.lattice, self.episode
        start = lattice.node(episode.start.i, episode.start.j)
        goal = lattice.node(episode.goal.i, episode.goal.j)
        return float(lattice.distances(goal, lattice.with_obstacles(arrangement.obstacles))[start])

    def pick(self, world: World, index: int) -> None:
        """Remove an obstacle and compare."""
        if not world.items[index].dynamics.pickable:
            reason = "not pickable"
        else:
            reason = "something rests on it" if self.carries(world.items, index) else ""
        self._poses(None, (), at_rest=True)
        self._ends(reason, 0.0, 0.0)

    def _ends(self, reason: str, displacement_m: float, seconds: float) -> bool:
        """Check reason, displacement and time; return whether success is as stated."""
        outcome = self.outcome
        self.expect("reason", repr(reason), repr(outcome.reason))
        self.expect("displacement", displacement_m, outcome.displacement_m)
        self.expect("seconds", seconds, outcome.seconds)
        return self.expect("success", not reason, outcome.success)

    def _poses(
        self, pose: Pose | None, moved: Sequence[tuple[int, Pose]], *, at_rest: bool
    ) -> None:
        """Check where everything ends, unless an earlier release stored no poses."""
        outcome, ids = self.outcome, self.scene.model.object_ids
        if outcome.moved is None:
            return
        self.expect("pose", pose, outcome.pose)
        named = [(ids[k], None) if k < len(ids) else (None, k - len(ids)) for k, _ in moved]
        ends = [(*name, end) for name, (_, end) in zip(named, moved, strict=True)]
        stored = [(o.object_id, o.obstacle, o.pose) for o in outcome.moved]
        self.expect("moved", ends, stored)
        self.expect("at-rest", at_rest, outcome.at_rest)

    def carries(self, items: Sequence[MovableObject], index: int) -> bool:
        """Return whether another movable object rests on an item."""
        placed = {
            k: (item.asset.asset_id, item.pose)
            for k, item in enumerate(items)
            if item.pose is not None
        }
        below = placed[index]
        low, high = self.scene.span(*below)
        on = [
            self._plan(*other)
            for other in placed.values()
            if low + REST_M < self.scene.span(*other)[0] <= high + TOUCH_M
        ]
        return any(shapely.dwithin(self._plan(*below), plan, TOUCH_M) for plan in on)

    def _plan(self, asset_id: str, pose: Pose) -> Geometry:
        return shapely.union_all(list(self.scene.footprint(asset_id, pose)))

    def _not_sunk(self, world: World, ends: dict[int, Pose | None]) -> None:
        """Check that nothing was pushed into the floor, a wall or another object."""
        scene = self.scene
        moved = {k: pose for k, pose in ends.items() if pose is not None}
        inside = dict(scene.intrusions(world.items, moved, SUNK_M))
        for k, pose in moved.items():
            asset_id = world.items[k].asset.asset_id
            low, _ = scene.span(asset_id, pose)
            name = f"{asset_id} ends above the floor"
            self.expect("sunk", name, f"{low:.4f} m", holds=low >= -SUNK_M)
            name = f"{asset_id} ends inside nothing"
            self.expect("sunk", name, f"inside {inside.get(k)}", holds=k not in inside)

    def _distances(self, world: World, changes: dict[int, Pose | None]) -> None:
        """Check both distances with objects where they came to rest."""
        scene, episode, outcome = self.scene, self.episode, self.outcome
        arrangement = scene.rearranged(world.items, changes)
        lattice = arrangement.layout.lattice
        start = lattice.node(episode.start.i, episode.start.j)
        goal = lattice.node(episode.goal.i, episode.goal.j)
        free = lattice.with_obstacles(arrangement.obstacles)
        found = lattice.distances(goal, free)[start]
        if not scene.config.same_hardware:
            opened = episode.obstructed_path_steps is None and math.isfinite(found)
            self.expect("opened", opened, outcome.opened)
        self.expect(
            "path-steps-after",
            int(found) if math.isfinite(found) else None,
            outcome.path_steps_after,
        )
        self._path(arrangement)

    def _path(self, arrangement: Arrangement) -> None:
        episode, stated = self.episode, self.outcome.path_m_after
        start_xy, goal_xy = (episode.start.x, episode.start.y), (episode.goal.x, episode.goal.y)
        path = CheckedPath(arrangement.layout, start_xy, goal_xy, arrangement.obstacles)
        if stated is None:
            shut = not path.connected(stated=False)
            self.expect("path-m-after", "a way for the disc", "none", holds=shut)
        elif path.agrees(stated):
            self.expect("path-m-after", stated, stated)
        else:
            self.expect("path-m-after", f"{path.length():.4f} m", stated, holds=False)


def _is_movable(placed: SceneObject, asset: Asset) -> bool:
    """Return whether furniture can move: a type of obstacles, with dynamics that let it."""
    own = placed.dynamics or asset.dynamics
    return asset.spawnable and (own.pushable or own.pickable)
