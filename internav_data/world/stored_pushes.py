"""Pushes whose results an episode has stored: its outcomes stand for solving them.

Outcomes are solved at the episode's start and without the agent. So they are the results of pushes
of obstacles as long as nothing has moved, and where the agent's collider is clear of all that the
push covers; a push that fails does so whoever stands there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, get_args

from internav_data.physics.displacement import tilt_deg
from internav_data.physics.pushing import TOPPLED_DEG, Failure, PushResult, stays_clear
from internav_data.physics.registry import get_solver

if TYPE_CHECKING:
    from internav_data.records import Episode, MovedObject, Obstacle, Outcome
    from internav_data.world.house_model import MovableObject
    from internav_data.world.world import World

SIDES: Final = 4
"""Number of sides of a box in the plane."""
FAILURES: Final[tuple[Failure, ...]] = get_args(Failure)


@dataclass(frozen=True, slots=True)
class StoredPushes:
    """Outcomes of an episode for the world in which they hold."""

    items: tuple[MovableObject, ...]
    """Objects of the world at the episode's start: a world replaces them when one moves."""
    obstacles: tuple[Obstacle, ...]

    @staticmethod
    def of(world: World, episode: Episode) -> StoredPushes | None:
        """Return the outcomes of an episode at its start; None if they are of other physics."""
        solver, physics = get_solver(world.engine), episode.physics
        if (solver.name, solver.build) != (physics.engine, physics.build):
            return None
        return StoredPushes(world.items, episode.obstacles)

    def result(self, world: World, index: int, heading: int) -> PushResult | None:
        """Return the result of a push of an object by a world's agent; None if it must be solved.

        Of a failed push only time and reason are stored: nothing moves.
        """
        number = index - len(world.model.items)
        if world.items is not self.items or number < 0:
            return None
        obstacle = self.obstacles[number]
        if not obstacle.outcomes:
            return None
        outcome = obstacle.outcomes[heading]
        if outcome.success:
            return _moved(world, obstacle, outcome)
        return _stayed(obstacle, outcome)


def _moved(world: World, obstacle: Obstacle, outcome: Outcome) -> PushResult | None:
    pose, swept = outcome.pose, outcome.swept
    if pose is None or swept is None or len(swept) != SIDES or outcome.at_rest is None:
        return None
    west, south, east, north = swept
    box = (obstacle.x - west, obstacle.y - south, obstacle.x + east, obstacle.y + north)
    if not stays_clear(box, world.position, world.engine):
        return None
    return PushResult(
        pose=pose,
        displacement_m=outcome.displacement_m,
        seconds=outcome.seconds,
        toppled=tilt_deg(obstacle.quaternion, pose.quaternion) > TOPPLED_DEG,
        moved=tuple((_key(world, other), other.pose) for other in outcome.moved or ()),
        success=True,
        reason="",
        at_rest=outcome.at_rest,
    )


def _stayed(obstacle: Obstacle, outcome: Outcome) -> PushResult | None:
    reason = next((known for known in FAILURES if known == outcome.reason), None)
    if outcome.at_rest is None or reason is None:
        return None
    return PushResult(
        pose=obstacle.pose,
        displacement_m=0.0,
        seconds=outcome.seconds,
        toppled=False,
        moved=(),
        success=False,
        reason=reason,
        at_rest=outcome.at_rest,
    )


def _key(world: World, other: MovedObject) -> int:
    """Return the index of an object that moved among a world's items."""
    if other.object_id is not None:
        return world.model.object_ids.index(other.object_id)
    return len(world.model.items) + (other.obstacle or 0)
