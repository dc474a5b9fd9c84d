"""Tasks: the reward, the end and the metrics of one episode.

A task watches one `World`: the environment steps the world and hands each result to `Task.step`.
Rewards are plain arithmetic on distances, so that they can be checked by hand.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, NamedTuple

from internav_data.core.config import Bounds, check_bounds
from internav_data.dataset.summary_statistics import path_efficiency
from internav_data.envs.auxiliary import is_cleared
from internav_data.navigation import SPACING_M
from internav_data.world.actions import INTERACTION_KINDS, ActionKind
from internav_data.world.config import WorldConfig

if TYPE_CHECKING:
    from internav_data.envs.auxiliary import InteractionKind
    from internav_data.envs.source import ShortestPathField
    from internav_data.records import Episode
    from internav_data.world import StepResult, World

STEP: Final = -0.01
"""Reward of every step, the last one and a wait included."""
SUCCESS: Final = 10.0
"""Reward of Done when the task is fulfilled."""
OPENED: Final = 1.0
"""Reward of an interaction that opens a path on the lattice; one that closes it costs as much."""
CHOSEN_ACTION: Final = 0.1
"""r_as, reward of the first successful interaction with an object, and r_af, cost of a failure."""


@dataclass(frozen=True, slots=True)
class TaskConfig:
    """Settings of a task."""

    max_steps: Annotated[int, Bounds(1)] = 500
    """Number of steps after which an episode is truncated."""
    failed_done_reward: Annotated[float, Bounds(-1000.0, 1000.0)] = 0.0
    """Reward of Done away from the goal, besides the step's; -1 in the released configuration."""
    world: WorldConfig = field(default_factory=WorldConfig)
    """Settings of the world."""

    def check(self) -> None:
        """Refuse settings that are out of their bounds.

        Raises
        ------
        UsageError
            A setting is out of its bounds.
        """
        check_bounds(self, "{key}: expected {expected}, got {value}")
        self.world.check("")


class TaskStep(NamedTuple):
    """Reward and ends after one step."""

    reward: float
    terminated: bool
    truncated: bool


@dataclass(slots=True)
class EpisodeStatistics:
    """Counters and sums over an episode."""

    steps: int = 0
    """Steps taken, Done and waits included."""
    moves: int = 0
    """Successful moves."""
    tried: dict[ActionKind, int] = field(
        default_factory=lambda: dict.fromkeys(INTERACTION_KINDS, 0)
    )
    """Interactions by kind."""
    succeeded: dict[ActionKind, int] = field(
        default_factory=lambda: dict.fromkeys(INTERACTION_KINDS, 0)
    )
    """Successful interactions by kind."""
    interaction_m: float = 0.0
    """Sum of the finite drops of the lattice distance by interactions, metres."""
    openings: int = 0
    """Interactions that opened a path to the goal where there was none."""
    closings: int = 0
    """Interactions that closed the last path to the goal."""
    reward: float = 0.0
    """Return so far."""
    auxiliary_reward: float = 0.0
    """Part of the return that only auxiliary tasks pay."""

    def metrics(self) -> dict[str, float | int | bool]:
        """Return the metrics that need no task."""
        return {
            "steps": self.steps,
            "path_m": SPACING_M * self.moves,
            "pushes_tried": self.tried["push"],
            "pushes_done": self.succeeded["push"],
            "picks_tried": self.tried["pick"],
            "picks_done": self.succeeded["pick"],
            "drops_tried": self.tried["drop"],
            "drops_done": self.succeeded["drop"],
            "interaction_reward_m": self.interaction_m,
            "openings": self.openings,
            "closings": self.closings,
            "return": self.reward,
        }


class Task(ABC):
    """Reward, end and metrics of one episode in one world.

    Parameters
    ----------
    world
        World at the episode's start; a task reads it and never changes it.
    distances
        Euclidean distances to the goal without obstacles.
    config
        Settings.
    shortest_path_m
        L of SPL, the distance from the start; looked up in `distances` if None.

    Attributes
    ----------
    success : bool
        Whether the task was fulfilled; known once Done was taken.
    distance_m : float
        Euclidean distance from the agent to the goal without obstacles, metres.
    statistics : EpisodeStatistics
        Counters and sums so far.
    """

    name: ClassVar[str]
    """Key in `TASKS`, and value of the environments' argument `task`."""
    start_beside: ClassVar[InteractionKind | None] = None
    """Interaction to be learnt; the agent begins beside an obstacle that it would act on."""
    first_position: ClassVar[int] = 0
    """Position of the first episode in the order of episodes."""

    def __init__(
        self,
        world: World,
        distances: ShortestPathField,
        config: TaskConfig,
        shortest_path_m: float | None = None,
    ) -> None:
        self.world, self.distances, self.config = world, distances, config
        self.distance_m = distances.at(world.i, world.j)
        self.shortest_path_m = self.distance_m if shortest_path_m is None else shortest_path_m
        self.success = False
        self.statistics = EpisodeStatistics()
        self._lattice = world.lattice

    @classmethod
    def prepare(cls, episode: Episode) -> Episode:
        """Return the episode as this task has it."""
        return episode

    @abstractmethod
    def step(self, result: StepResult) -> tuple[float, bool]:
        """Return the reward of an action that the world has just taken, and whether it ends."""

    @abstractmethod
    def metrics(self) -> dict[str, float | int | bool]:
        """Return the metrics so far; an environment reports them at the end."""


class InteractiveNavigation(Task):
    """The main task: reach the goal, and move what is in the way (the paper's section 3)."""

    name = "interactive"

    def step(self, result: StepResult) -> tuple[float, bool]:
        """Return the step's reward, and the progress by a move, an interaction or Done."""
        kind, reward = result.action.kind, STEP
        self.statistics.steps += 1
        if kind == "move":
            reward += self._moved() if result.success else 0.0
        elif kind in INTERACTION_KINDS:
            reward += self._interacted(result)
        elif kind == "done":
            reward += self._ended(result)
        self.statistics.reward += reward
        self._lattice = self.world.lattice
        return reward, kind == "done" and result.reason != "hands are full"

    def metrics(self) -> dict[str, float | int | bool]:
        """Return the metrics of the episode; their means over episodes are the paper's."""
        statistics, length_m = self.statistics, self.shortest_path_m
        path_m = SPACING_M * statistics.moves
        return {
            "success": self.success,
            "distance_to_goal_m": self.distance_m,
            "spl": float(path_efficiency(length_m, path_m)) if self.success else 0.0,
            "sts": length_m / SPACING_M / statistics.steps if self.success else 0.0,
            **statistics.metrics(),
        }

    def _moved(self) -> float:
        """Return the drop of the Euclidean distance without obstacles, metres."""
        self.statistics.moves += 1
        after = self.distances.at(self.world.i, self.world.j)
        if math.isinf(after):
            # Moved furniture let the agent into a part that is cut off in the untouched house. The
            # last distance stands: rewards of a loop still add up to start minus end.
            return 0.0
        before, self.distance_m = self.distance_m, after
        return before - after

    def _interacted(self, result: StepResult) -> float:
        """Return what an interaction did to the path on the lattice, in reward."""
        kind, statistics, world = result.action.kind, self.statistics, self.world
        statistics.tried[kind] += 1
        if not result.success:
            return 0.0
        statistics.succeeded[kind] += 1
        here = (world.i, world.j)
        # Lattices are replaced, never changed: the one before the action is still at hand.
        before = self._lattice.distance(here, world.goal)
        after = world.lattice.distance(here, world.goal)
        reward = interaction_reward(before, after)
        if before is not None and after is not None:
            statistics.interaction_m += reward
        statistics.openings += before is None and after is not None
        statistics.closings += before is not None and after is None
        return reward

    def _ended(self, result: StepResult) -> float:
        """Return the reward of Done."""
        self.success = result.success
        if result.reason == "hands are full":
            return 0.0
        return SUCCESS if result.success else self.config.failed_done_reward


class PointNavigation(InteractiveNavigation):
    """Auxiliary task of Navigate: reach the goal, no obstacle about (the paper's section 5.2)."""

    name = "navigate"
    # Published training numbers left out the first episode of each order.
    first_position = 1

    @classmethod
    def prepare(cls, episode: Episode) -> Episode:
        """Return the episode without its obstacles."""
        return replace(episode, obstacles=(), obstacle_count=0)

    def metrics(self) -> dict[str, float | int | bool]:
        """Return the main task's metrics, and success under the task's name."""
        return {**super().metrics(), "auxiliary_reward": 0.0, "success_navigate": self.success}


class _MoveAside(InteractiveNavigation):
    """Auxiliary task: clear an obstacle away, and say Done (the paper's section 5.2).

    It begins beside an obstacle, and Done is worth `SUCCESS` once the path from there is open, or
    shorter by 0.25 m. The first success with each object pays r_as, each failure costs r_af.
    """

    def __init__(
        self,
        world: World,
        distances: ShortestPathField,
        config: TaskConfig,
        shortest_path_m: float | None = None,
    ) -> None:
        super().__init__(world, distances, config, shortest_path_m)
        self._start = (world.i, world.j)
        self._steps_before = self._path_steps()
        self._rewarded: set[int] = set()

    def step(self, result: StepResult) -> tuple[float, bool]:
        """Return the main task's reward, plus r_as or minus r_af for an interaction."""
        reward, ended = super().step(result)
        if result.action.kind in INTERACTION_KINDS:
            extra = self._chosen(result)
            self.statistics.auxiliary_reward += extra
            self.statistics.reward += extra
            reward += extra
        # Full hands refuse the main task's Done, at its goal alone: here it is paid, and ends.
        return reward, ended or result.action.kind == "done"

    def metrics(self) -> dict[str, float | int | bool]:
        """Return the metrics of the episode; it has no path to the goal, so no SPL and no STS."""
        found = super().metrics()
        del found["spl"], found["sts"]
        extra = self.statistics.auxiliary_reward
        return {**found, "auxiliary_reward": extra, f"success_{self.name}": self.success}

    def _ended(self, result: StepResult) -> float:  # noqa: ARG002 - the goal is another one
        self.success = is_cleared(self._steps_before, self._path_steps())
        return SUCCESS * self.success

    def _chosen(self, result: StepResult) -> float:
        """Return r_as - r_af."""
        if not result.success:
            return -CHOSEN_ACTION
        if result.target in self._rewarded:
            return 0.0
        self._rewarded.add(result.target)
        return CHOSEN_ACTION

    def _path_steps(self) -> int | None:
        """Return the lattice distance from the start to the goal, objects as they lie."""
        return self.world.lattice.distance(self._start, self.world.goal)


class PushAside(_MoveAside):
    """Auxiliary task of Push: push an obstacle out of the way."""

    name = "push"
    start_beside = "push"


class PickAside(_MoveAside):
    """Auxiliary task of Pick: carry an obstacle out of the way."""

    name = "pick"
    start_beside = "pick"


TASKS: Final[dict[str, type[Task]]] = {
    task.name: task for task in (InteractiveNavigation, PointNavigation, PushAside, PickAside)
}
"""Tasks by name."""


def interaction_reward(before: int | None, after: int | None) -> float:
    """Return what an interaction pays for its effect on the lattice distance to the goal.

    Parameters
    ----------
    before, after
        Lattice distance in steps; None where the goal is cut off.

    Returns
    -------
    float
        The drop in metres while both are finite, +1 for opening the path, -1 for closing it.
    """
    if before is None:
        return 0.0 if after is None else OPENED
    return -OPENED if after is None else SPACING_M * (before - after)
