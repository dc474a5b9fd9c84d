"""Predicates of outcomes that follow from the poses stored with them: no physics is asked."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from internav_data.verification.checked_path import CheckedPath
from internav_data.verification.interactions import BOX_SIDES, PICK_OUTCOME, PUSHED_M
from internav_data.verification.shapes import rotate

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from shapely import Geometry

    from internav_data.records import Episode, MovedObject, Obstacle, Outcome, Pose, SceneObject
    from internav_data.verification.checked_layout import CheckedLayout
    from internav_data.verification.findings import FindingCollector

Scope = Literal["poses", "sample", "all"]
"""Outcomes whose distances are derived: none (poses alone are checked), a sample, or all.

A sample is the lattice distance of each outcome that moves no furniture, and the Euclidean one of
one of them: a visibility graph takes ten milliseconds, a house without a piece of furniture more.
"""
DISPLACED_M: Final = 3e-4
"""Tolerance of a displacement: it, the poses and the centre of mass are rounded to 0.1 mm."""
MOVED_M: Final = 5e-4
"""Distance from which another object counts as moved, metres."""
MOVED_RAD: Final = 1e-3
"""Angle from which another object counts as moved, radians."""
SWEPT_M: Final = 5e-4
"""Tolerance of a swept box: it is of poses before they are rounded."""
TIE: Final = 1e-9
"""Difference that arithmetic alone can make, metres and radians."""


def check_outcomes(
    layout: CheckedLayout, episode: Episode, report: FindingCollector, scope: Scope = "all"
) -> None:
    """Check the stored outcomes of an episode whose geometry is true.

    Outcomes of earlier releases have no poses: of these only those of picks are checked.
    """
    before = sum(report.by_predicate.values())
    check = _OutcomeCheck(layout, episode, report)
    for number, obstacle in enumerate(episode.obstacles):
        for outcome in obstacle.outcomes or ():
            if outcome.success:
                check.poses(number, obstacle, outcome)
            if outcome.other_pose is not None:
                check.other_end(number, obstacle, outcome)
    # What is not there cannot be moved away.
    if scope != "poses" and sum(report.by_predicate.values()) == before:
        check.distances(scope)


class _OutcomeCheck:
    """Check of one episode's outcomes."""

    def __init__(self, layout: CheckedLayout, episode: Episode, report: FindingCollector) -> None:
        self.layout = layout
        self.episode = episode
        self._report = report
        self._objects = {placed.object_id: placed for placed in layout.house.objects}

    @cached_property
    def _plans(self) -> list[list[Geometry]]:
        """Footprints of the obstacles at the start of the episode."""
        footprint = self.layout.shapes.footprint
        return [footprint(one.asset_id, one.pose) for one in self.episode.obstacles]

    def expect(self, holds: object, name: str, expected: object, got: object) -> bool:
        return self._report.expect(holds, f"outcome.{name}", expected, got, self.episode.episode_id)

    def poses(self, number: int, obstacle: Obstacle, outcome: Outcome) -> None:
        """Check the displacement of a push, and that all others that it moved can move and did."""
        what = _name(number, obstacle, outcome)
        if outcome.pose is not None:
            found = self._displacement_m(obstacle, outcome.pose)
            self.expect(
                abs(found - outcome.displacement_m) <= DISPLACED_M,
                "displacement",
                f"{what}: {found:.4f} m",
                outcome.displacement_m,
            )
        ends = [(obstacle.asset_id, obstacle.pose, outcome.pose)]
        for other in outcome.moved or ():
            if self.expect(self._can_move(other), "moved", f"{what}: objects that can move", other):
                self.expect(self._has_moved(other), "moved", f"{what}: objects that moved", other)
                before = self._before(other)
                ends.append((before.asset_id, before.pose, other.pose))
        self._swept(obstacle, outcome, what, ends)

    def _swept(
        self,
        obstacle: Obstacle,
        outcome: Outcome,
        what: str,
        ends: Sequence[tuple[str, Pose, Pose | None]],
    ) -> None:
        """Check that the box of a push holds what moved where it began and where it ended."""
        if outcome.swept is None or len(outcome.swept) != BOX_SIDES:
            return
        corners = self.layout.shapes.corners
        points = np.vstack([corners(name, p)[:, :2] for name, *at in ends for p in at if p])
        (x_min, y_min), (x_max, y_max) = points.min(axis=0), points.max(axis=0)
        found = (obstacle.x - x_min, obstacle.y - y_min, x_max - obstacle.x, y_max - obstacle.y)
        self.expect(
            all(far <= side + SWEPT_M for far, side in zip(found, outcome.swept, strict=True)),
            "swept",
            f"{what}: at least {', '.join(f'{far:.4f}' for far in found)} m",
            outcome.swept,
        )

    def other_end(self, number: int, obstacle: Obstacle, outcome: Outcome) -> None:
        """Check that the other engine moved the obstacle as far as its success says."""
        if outcome.other_pose is not None:
            found = self._displacement_m(obstacle, outcome.other_pose)
            self.expect(
                found >= PUSHED_M - DISPLACED_M,
                "other-displacement",
                f"{_name(number, obstacle, outcome)}: {PUSHED_M} m or more by the other engine",
                f"{found:.4f} m",
            )

    def _displacement_m(self, obstacle: Obstacle, end: Pose) -> float:
        middle = self.layout.shapes.centre_of_mass(obstacle.asset_id)[None]
        before, after = (
            rotate(middle, pose.quaternion)[0] + (pose.x, pose.y, pose.z)
            for pose in (obstacle.pose, end)
        )
        return math.dist(before[:2], after[:2])

    def _can_move(self, other: MovedObject) -> bool:
        if other.obstacle is not None:
            obstacles = self.episode.obstacles
            known = 0 <= other.obstacle < len(obstacles)
            return known and not obstacles[other.obstacle].dynamics.fixed
        placed = self._objects.get(-1 if other.object_id is None else other.object_id)
        if placed is None:
            return False
        asset = self.layout.shapes.assets[placed.asset_id]
        own = placed.dynamics or asset.dynamics
        of_obstacles = asset.spawnable or placed.affordance is not None
        return of_obstacles and not own.fixed

    def _before(self, other: MovedObject) -> Obstacle | SceneObject:
        """Return what an object that moved was before."""
        if other.obstacle is not None:
            return self.episode.obstacles[other.obstacle]
        return self._objects[-1 if other.object_id is None else other.object_id]

    def _has_moved(self, other: MovedObject) -> bool:
        before, after = self._before(other).pose, other.pose
        far = math.dist((before.x, before.y, before.z), (after.x, after.y, after.z))
        turn = Rotation.from_quat(before.quaternion).inv() * Rotation.from_quat(after.quaternion)
        return far >= MOVED_M - TIE or float(turn.magnitude()) >= MOVED_RAD - TIE

    def distances(self, scope: Scope) -> None:
        """Derive the distances after the outcomes of a scope."""
        chosen = [
            (name, outcome, gone, plans)
            for name, outcome, gone, plans in self._arrangements()
            if scope == "all" or not gone
        ]
        # Another one from episode to episode.
        lengthy = self.episode.index % max(1, len(chosen))
        for k, (what, outcome, gone, plans) in enumerate(chosen):
            layout = self.layout.without(gone)
            self._steps(layout, plans, outcome, what)
            if scope == "all" or k == lengthy:
                self._length(layout, plans, outcome, what)

    def _arrangements(
        self,
    ) -> Iterator[tuple[str, Outcome, frozenset[int], list[Geometry]]]:
        """Yield each successful outcome: name, outcome, moved furniture, loose footprints."""
        for number, obstacle in enumerate(self.episode.obstacles):
            for outcome in obstacle.outcomes or ():
                push = outcome.action != PICK_OUTCOME
                if not outcome.success or (push and outcome.pose is None):
                    continue
                gone, plans = self._after(number, outcome)
                yield _name(number, obstacle, outcome), outcome, gone, plans

    def _after(self, number: int, outcome: Outcome) -> tuple[frozenset[int], list[Geometry]]:
        """Return the ids of the furniture that moved, and all footprints of what is loose."""
        shapes, plans = self.layout.shapes, list(self._plans)
        asset_id = self.episode.obstacles[number].asset_id
        plans[number] = [] if outcome.pose is None else shapes.footprint(asset_id, outcome.pose)
        gone: set[int] = set()
        for other in outcome.moved or ():
            if other.obstacle is not None:
                asset_id = self.episode.obstacles[other.obstacle].asset_id
                plans[other.obstacle] = shapes.footprint(asset_id, other.pose)
            elif other.object_id is not None:
                gone.add(other.object_id)
                plans.append(shapes.footprint(self._objects[other.object_id].asset_id, other.pose))
        return frozenset(gone), [plan for own in plans for plan in own]

    def _steps(
        self, layout: CheckedLayout, plans: list[Geometry], outcome: Outcome, what: str
    ) -> None:
        lattice, start, goal = layout.lattice, self.episode.start, self.episode.goal
        free = lattice.with_obstacles(plans)
        steps = lattice.distances(lattice.node(goal.i, goal.j), free)
        found = steps[lattice.node(start.i, start.j)]
        expected = int(found) if math.isfinite(found) else None
        stated = outcome.path_steps_after
        self.expect(expected == stated, "path-steps-after", f"{what}: {expected}", stated)

    def _length(
        self, layout: CheckedLayout, plans: list[Geometry], outcome: Outcome, what: str
    ) -> None:
        start, goal, stated = self.episode.start, self.episode.goal, outcome.path_m_after
        path = CheckedPath(layout, (start.x, start.y), (goal.x, goal.y), plans)
        if stated is None:
            holds, expected = not path.connected(stated=False), "a way for the disc"
        else:
            holds = path.agrees(stated)
            expected = "" if holds else f"{path.length():.4f} m"
        self.expect(holds, "path-m-after", f"{what}: {expected}", stated)


def _name(number: int, obstacle: Obstacle, outcome: Outcome) -> str:
    return f"obstacle {number} ({obstacle.asset_id}), {outcome.action}"
