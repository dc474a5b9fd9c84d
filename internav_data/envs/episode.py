"""One episode being played: the task over a world, without any picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from internav_data.envs.tasks import (
    STEP,
    SUCCESS,
    EpisodeStatistics,
    interaction_reward,
    metrics,
    move_reward,
)
from internav_data.geometry.headings import HEADINGS
from internav_data.navigation import SPACING_M
from internav_data.records.errors import UsageError
from internav_data.render.camera import CameraView
from internav_data.world import ACTION_COUNT, Action, World
from internav_data.world.actions import INTERACTION_KINDS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.envs.source import LoadedHouse
    from internav_data.navigation import Lattice
    from internav_data.records import Asset, Episode, PushModel
    from internav_data.world import StepResult


@dataclass(frozen=True, slots=True)
class TaskConfig:
    """What a user can set about the task."""

    max_steps: int = 500
    """Steps after which an episode is cut off."""
    failed_done_reward: float = 0.0
    """For Done away from the goal, besides the step's cost; the released configuration has -1."""
    push_model: PushModel = "force"

    def check(self) -> None:
        """Refuse what cannot be meant."""
        if self.max_steps < 1:
            raise UsageError(f"max_steps: expected at least 1, got {self.max_steps}")
        if not math.isfinite(self.failed_done_reward):
            raise UsageError(
                f"failed_done_reward: expected a number, got {self.failed_done_reward}"
            )
        if self.push_model not in {"force", "kick"}:
            raise UsageError(f"push_model: expected 'force' or 'kick', got {self.push_model!r}")


class TaskStep(NamedTuple):
    """What a step gave."""

    reward: float
    terminated: bool
    truncated: bool


class EpisodeRun:
    """An episode from its start; a function of the episode and the actions so far.

    Attributes
    ----------
    world
        What happens.
    actions
        So far; -1 waits.
    start
        Node i, j and quarter turn it began at, where that is not the episode's own.
    stale
        The picture has changed since somebody last set this to False.
    """

    __slots__ = (
        "_clear",
        "_config",
        "_length_m",
        "actions",
        "episode",
        "last",
        "loaded_house",
        "over",
        "props",
        "shortest_path_m",
        "stale",
        "start",
        "statistics",
        "success",
        "world",
    )  # fmt: skip

    def __init__(
        self,
        episode: Episode,
        loaded_house: LoadedHouse,
        assets: Mapping[str, Asset],
        config: TaskConfig,
        start: Sequence[int] | None = None,
    ) -> None:
        self.episode, self.loaded_house, self._config = episode, loaded_house, config
        self.world = World.of_episode(loaded_house.model, episode, assets, config.push_model)
        if start is not None:
            self._stand(start)
        self.props = loaded_house.static_scene.props(
            (assets[o.asset_id], o.pose) for o in episode.obstacles
        )
        self._clear = loaded_house.distance_field((episode.goal.i, episode.goal.j))
        self.shortest_path_m = self._clear.at(self.world.i, self.world.j)
        self._length_m = episode.shortest_path_m if start is None else self.shortest_path_m
        self.start = None if start is None else (start[0], start[1], start[2] % 4)
        self.actions: list[int] = []
        self.statistics = EpisodeStatistics()
        self.success = self.over = False
        self.stale = True
        self.last: StepResult | None = None

    def step(self, action: int) -> TaskStep:
        """Act, and pay for it.

        Raises
        ------
        UsageError
            The episode is over, or there is no such action.
        """
        if self.over:
            raise UsageError("step: the episode is over; call reset() first")
        if not Action.WAIT <= action < ACTION_COUNT:
            raise UsageError(
                f"step: expected an action of 0 … {ACTION_COUNT - 1}, or -1 to wait; got {action}"
            )
        before = self.world.lattice
        known = Action(action)
        self.last = result = self.world.step(known)
        self.actions.append(action)
        reward = STEP
        terminated = known == Action.DONE
        if known.kind == "move":
            reward += self._moved() if result.success else 0.0
        elif known.kind in INTERACTION_KINDS:
            reward += self._interacted(known, result, before)
        elif terminated:
            self.success = result.success
            reward += SUCCESS if result.success else self._config.failed_done_reward
        self.stale |= result.success and known.changes_picture
        truncated = not terminated and len(self.actions) >= self._config.max_steps
        self.over = terminated or truncated
        self.statistics.reward += reward
        return TaskStep(reward, terminated, truncated)

    def _stand(self, start: Sequence[int]) -> None:
        """Put the agent elsewhere: on a free node."""
        free = self.world.lattice.free
        if len(start) != 3 or not (  # noqa: PLR2004 - i, j and quarter
            0 <= start[0] < free.shape[0]
            and 0 <= start[1] < free.shape[1]
            and free[start[0], start[1]]
        ):
            raise UsageError(
                f"options['start']: expected (i, j, quarter) of a free node, got {tuple(start)}; "
                f"the lattice has {free.shape[0]} x {free.shape[1]} nodes"
            )
        self.world.i, self.world.j, self.world.quarter = start[0], start[1], start[2] % 4

    def _moved(self) -> float:
        self.statistics.moves += 1
        after = self._clear.at(self.world.i, self.world.j)
        if math.isinf(after):
            # Furniture was moved and let the agent into what is cut off else: the last distance
            # stands, so that rewards still add up to start minus end on every loop.
            return 0.0
        before, self.shortest_path_m = self.shortest_path_m, after
        return move_reward(before, after)

    def _interacted(self, action: Action, result: StepResult, lattice: Lattice) -> float:
        kind, statistics = action.kind, self.statistics
        statistics.tried[kind] += 1
        if not result.success:
            return 0.0
        statistics.done[kind] += 1
        self._show(result)
        here = (self.world.i, self.world.j)
        before = lattice.distance(here, self.world.goal)
        after = self.world.lattice.distance(here, self.world.goal)
        reward = interaction_reward(before, after)
        if before is not None and after is not None:
            statistics.interaction_m += reward
        statistics.openings += before is None and after is not None
        statistics.closings += before is not None and after is None
        return reward

    def _show(self, result: StepResult) -> None:
        """Bring the camera's props in line with the world."""
        if result.action == Action.PICKUP:
            self.props.hide(self._instance(result.target))
        for item, pose in result.moved:
            self.props.move(self._instance(item), pose)
            self.props.show(self._instance(item))

    def _instance(self, item: int) -> int:
        home = self.loaded_house.instances
        if item < len(home):
            return home[item]
        return len(self.loaded_house.model.house.objects) + item - len(home)

    def metrics(self) -> dict[str, float | int | bool]:
        """Metrics as of now; meant for the end."""
        return metrics(
            self.statistics,
            success=self.success,
            shortest_path_m=self._length_m,
            steps=len(self.actions),
            distance_m=self.shortest_path_m,
        )

    def view(self) -> CameraView:
        """Return what the camera is to draw."""
        world = self.world
        x, y = world.position
        return CameraView(
            self.loaded_house.static_scene,
            self.props,
            x,
            y,
            90.0 * world.quarter,
            world.horizon_deg,
        )

    def point_goal(self) -> tuple[float, float]:
        """Goal from the agent: distance in metres and bearing in (-pi, pi], left positive."""
        world = self.world
        east, north = world.goal[0] - world.i, world.goal[1] - world.j
        # Whole numbers: a goal right behind has bearing pi, never -pi.
        c, s = (int(part) for part in HEADINGS[world.quarter])
        ahead, left = c * east + s * north, c * north - s * east
        return SPACING_M * math.hypot(east, north), math.atan2(left, ahead)
