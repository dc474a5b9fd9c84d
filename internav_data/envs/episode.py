"""Run of one episode: world, task and the camera's props; nothing is drawn here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from internav_data.envs.house_map import HouseMap, MapMoment
from internav_data.envs.tasks import InteractiveNavigation, TaskConfig, TaskStep
from internav_data.records.errors import UsageError
from internav_data.render.camera import CameraView
from internav_data.world import ACTION_COUNT, Action, World

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.envs.source import LoadedHouse
    from internav_data.envs.tasks import Task
    from internav_data.records import Asset, Episode
    from internav_data.world import StepResult


WHOLE: Final = (int, np.integer)
"""Types of whole numbers."""
_FIRST: Final = int(Action.WAIT)


def check_actions(actions: Sequence[Any], name: str = "step") -> list[int]:
    """Return actions as integers; none is taken before all are known to exist.

    Parameters
    ----------
    actions
        Actions, of any type.
    name
        Argument that holds them, for the error.

    Raises
    ------
    UsageError
        One is no whole number, or there is no such action.
    """
    for action in actions:
        if not isinstance(action, WHOLE) or not _FIRST <= action < ACTION_COUNT:
            raise UsageError(
                f"{name}: expected an action of 0 … {ACTION_COUNT - 1}, or -1 to wait; "
                f"got {action!r}"
            )
    return [int(action) for action in actions]


class EpisodeRun:
    """Episode being played; a function of the episode and the actions so far.

    Parameters
    ----------
    episode
        The episode.
    loaded_house
        House of the episode.
    assets
        Assets of its obstacles, by id.
    config
        Settings of the task.
    start
        Node i, j and quarter turn to begin at; None for the episode's own.
    task
        Class of the task.

    Attributes
    ----------
    world : World
        State of the house and the agent.
    task : Task
        Reward, end and metrics.
    props : Props
        Objects as the camera sees them.
    actions : list of int
        Actions so far; -1 waits.
    start : (int, int, int) or None
        Node i, j and quarter turn of the start; None if it is the episode's own.
    last : StepResult or None
        Result of the last action.
    done : bool
        Whether the episode has ended.
    stale : bool
        Whether the picture has changed since it was drawn; the drawing code sets it to False.
    moments : list of MapMoment
        State at the start and after every action, for maps.

    Raises
    ------
    UsageError
        The start is not a free node.
    """

    __slots__ = (
        "_config",
        "_maps",
        "actions",
        "done",
        "episode",
        "last",
        "loaded_house",
        "moments",
        "props",
        "stale",
        "start",
        "task",
        "world",
    )

    def __init__(
        self,
        episode: Episode,
        loaded_house: LoadedHouse,
        assets: Mapping[str, Asset],
        config: TaskConfig,
        start: Sequence[int] | None = None,
        task: type[Task] = InteractiveNavigation,
        *,
        stored_outcomes: bool = False,
    ) -> None:
        episode = task.prepare(episode)
        self.episode, self.loaded_house, self._config = episode, loaded_house, config
        self.world = World.of_episode(
            *(loaded_house.model, episode, assets, config.world), stored_outcomes=stored_outcomes
        )
        if start is not None:
            self._place_agent(start)
        self.start = None if start is None else (start[0], start[1], start[2] % 4)
        obstacles = ((assets[o.asset_id], o.pose) for o in episode.obstacles)
        self.props = loaded_house.static_scene.props(obstacles)
        distances = loaded_house.distance_field((episode.goal.i, episode.goal.j))
        # The stored L of SPL belongs to the stored start; the task looks up that of another one.
        own = episode.shortest_path_m if start is None else None
        self.task = task(self.world, distances, config, own)
        self.actions: list[int] = []
        self.done, self.stale = False, True
        self.last: StepResult | None = None
        self.moments = [self._moment()]
        self._maps: dict[bool, HouseMap] = {}

    def step(self, action: int) -> TaskStep:
        """Take an action; return the reward and whether the episode ends.

        Raises
        ------
        UsageError
            The episode has ended, or there is no such action.
        """
        if self.done:
            raise UsageError("step: the episode is over; call reset() first")
        # A list to check costs 1 % of a step: only for what is no plain action.
        if type(action) is not int or not _FIRST <= action < ACTION_COUNT:
            check_actions([action])
        self.last = result = self.world.step(action)
        self.actions.append(action)
        self.moments.append(self._moment())
        if result.success and result.action.changes_picture:
            self.stale = True
            self._update_props(result)
        # Done in the last step allowed ends the episode; only what goes on is cut off.
        reward, terminated = self.task.step(result)
        truncated = not terminated and len(self.actions) >= self._config.max_steps
        self.done = terminated or truncated
        return TaskStep(reward, terminated, truncated)

    def house_map(self, *, occlusion: bool) -> HouseMap:
        """Return the map of the house as it is now, or (occlusion) as the agent has seen it."""
        found = self._maps.get(occlusion)
        if found is None:
            home, goal = self.loaded_house, self.world.goal
            found = HouseMap(
                *(home.raster, home.affordances, goal, self.moments[0]), occlusion=occlusion
            )
            self._maps[occlusion] = found
        found.follow(self.moments)
        return found

    def _moment(self) -> MapMoment:
        world = self.world
        return MapMoment(world.i, world.j, world.quarter, world.items, self.last)

    def _place_agent(self, start: Sequence[int]) -> None:
        """Put the agent on another free node."""
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

    def _update_props(self, result: StepResult) -> None:
        """Bring the camera's props in line with the world."""
        if result.target >= 0 and self.world.held == result.target:
            self.props.hide(self._instance(result.target))
        for item, pose in result.moved:
            self.props.move(self._instance(item), pose)
            self.props.show(self._instance(item))

    def _instance(self, item: int) -> int:
        """Return the camera's number of an object of the world."""
        home = self.loaded_house.instances
        if item < len(home):
            return home[item]
        return len(self.loaded_house.model.house.objects) + item - len(home)

    def view(self) -> CameraView:
        """Return the agent's view, for the camera."""
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
