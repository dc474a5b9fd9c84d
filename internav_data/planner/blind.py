"""The blind expert: it plans by what can be seen, acts in the true world, and learns by failing.

It knows the house, every pose and every shape as the expert does, but of mass, friction and
fixedness only the averages of a type (`beliefs`). It runs the expert's search in a world of these
beliefs, acts in the true one until something comes otherwise than believed, and searches again.
What it needs more than the expert is the price of what the dataset hides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from internav_data.core.arithmetic import plain_sum
from internav_data.navigation import SPACING_M
from internav_data.planner.beliefs import Experience
from internav_data.planner.knowledge import Knowledge, attempt_of
from internav_data.planner.search import MAX_STEPS, search
from internav_data.records import Expert
from internav_data.world.actions import INTERACTION_KINDS, PUSHES, Action

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.planner.beliefs import TypeBelief
    from internav_data.planner.knowledge import Attempt
    from internav_data.records import Pose
    from internav_data.world import StepResult, World

MAX_PLANS: Final = 60
"""Maximum number of searches in one episode."""
RISK_PRICE: Final = 8
"""Estimated cost of an object that does not yield, actions: the walk to it and another way."""
AS_BELIEVED_M: Final = 0.01
"""Difference of positions (metres) and of quaternions up to which a pose is as believed."""
DID_NOT_YIELD: Final = ("too heavy", "did not move")
"""Reasons of failures that say something about the object, not about what is around it."""
_AGENTS_FAULT: Final = ("the agent is in the way", "would come to lie on the agent")


class BlindRun(NamedTuple):
    """One run of the blind expert."""

    actions: tuple[int, ...]
    """Numbers of the actions, failed ones too; the last one Done only if the goal was reached."""
    reached: bool
    """Whether Done succeeded."""
    world: World
    """World after the actions."""
    plans: int
    """Number of searches."""

    @property
    def expert(self) -> Expert | None:
        """Record of the run, failed interactions counted; None if the goal was not reached."""
        if not self.reached:
            return None
        return Expert(
            actions=self.actions,
            steps=len(self.actions),
            pushes=plain_sum(self.actions.count(push) for push in PUSHES),
            picks=self.actions.count(Action.PICKUP),
            path_m=SPACING_M * self.actions.count(Action.MOVE_AHEAD),
        )


def run_blind(world: World, beliefs: Mapping[str, TypeBelief], limit: int = MAX_STEPS) -> BlindRun:
    """Act from a world on without knowing its objects' dynamics.

    A pure function of the world and the beliefs, bounded by counts and never by time.

    Parameters
    ----------
    world
        World to begin in; it is not changed.
    beliefs
        Beliefs by type, from `type_beliefs`.
    limit
        Maximum number of actions, Done included.

    """
    return _Run(world, beliefs, limit).run()


class _Run:
    def __init__(self, world: World, beliefs: Mapping[str, TypeBelief], limit: int) -> None:
        self.world = world.copy()
        self.limit = limit
        self.experience = Experience(beliefs)
        self.failed: set[Attempt] = set()
        self.actions: list[int] = []

    def run(self) -> BlindRun:
        plans, reached = 0, False
        while plans < MAX_PLANS and len(self.actions) < self.limit and not reached:
            believed = self.experience.believed(self.world)
            plans += 1
            actions = search(believed, self.limit - len(self.actions), self._knowledge())
            if actions is None:
                break
            reached = self._follow(actions, believed)
        return BlindRun(tuple(self.actions), reached, self.world, plans)

    def _knowledge(self) -> Knowledge:
        risks = {
            k: round(RISK_PRICE * (1.0 - self.experience.success(self.world, k)))
            for k in range(len(self.world.items))
        }
        return Knowledge(self.experience.immovable, frozenset(self.failed), risks)

    def _follow(self, actions: Sequence[int], believed: World) -> bool:
        """Act until something comes otherwise than believed; return whether the goal is reached."""
        for action in map(Action, actions):
            before = self.world.copy()
            expected, result = believed.step(action), self.world.step(action)
            self.actions.append(int(action))
            if action.kind in INTERACTION_KINDS:
                self._learn(before, expected, result)
            if not (result.success and _alike(expected, result)):
                return False
        return bool(actions) and actions[-1] == Action.DONE

    def _learn(self, before: World, expected: StepResult, result: StepResult) -> None:
        """Draw conclusions from an interaction in a world, `before` it."""
        action, wanted = result.action, expected.target
        if wanted >= 0 and result.target != wanted:
            # Both worlds show the same shapes: what is no target cannot be acted on.
            self.experience.note(before, wanted, moved=False)
        if result.target >= 0 and action != Action.DROP:
            if result.success:
                self.experience.note(before, result.target, moved=True)
            elif result.reason in DID_NOT_YIELD:
                self.experience.note(before, result.target, moved=False)
        if not result.success and wanted >= 0:
            anywhere = action.kind != "drop" and result.reason not in _AGENTS_FAULT
            self.failed.add(attempt_of(before, action, wanted, anywhere=anywhere))


def _alike(expected: StepResult, result: StepResult) -> bool:
    """Return whether an action ended as believed, within a tolerance of poses."""
    if (expected.success, expected.target) != (result.success, result.target):
        return False
    believed, true = dict(expected.moved), dict(result.moved)
    return believed.keys() == true.keys() and all(_near(believed[k], true[k]) for k in true)


def _near(first: Pose, second: Pose) -> bool:
    pairs = zip(_numbers(first), _numbers(second), strict=True)
    return max(abs(a - b) for a, b in pairs) <= AS_BELIEVED_M


def _numbers(pose: Pose) -> tuple[float, ...]:
    return pose.x, pose.y, pose.z, *pose.quaternion
