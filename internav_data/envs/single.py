"""Environment `InterNav-v0`: one agent in one house."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Unpack

import gymnasium
import numpy as np

from internav_data.dataset.location import MINI
from internav_data.envs.copies import Rebuilt, with_absolute_path
from internav_data.envs.slot import (
    Arguments,
    EnvSlot,
    EpisodeSnapshot,
    check_choice,
    check_options,
    check_render_mode,
    check_seed,
    step_info,
    take_sensors,
)
from internav_data.envs.spaces import RENDER_SIZE, ObservationBuffer, observation_space
from internav_data.render.camera import Camera
from internav_data.world import ACTION_COUNT, Action
from internav_data.world.masks import action_mask

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from internav_data.core.typing import Bools
    from internav_data.dataset import Dataset
    from internav_data.envs.sensors import Sensor
    from internav_data.records import Episode


class InterNavEnv(Rebuilt, gymnasium.Env[dict[str, Any], np.int64]):
    """Interactive navigation: an agent walks to a goal, and pushes or carries obstacles aside.

    `docs/environment.md` describes actions, observations, rewards, start, end and arguments.

    Parameters
    ----------
    dataset : str, Path or Dataset
        Directory of a dataset, or a loaded dataset; the one that ships with the package if not
        given.
    image_size
        Size of the pictures, pixels a side.
    render_mode
        None or "rgb_array".
    sensors
        Sensors to observe: names in `internav_data.envs.sensors.SENSORS`, or one's own `Sensor`;
        those of `observation` if not given.
    **arguments
        Further arguments by name: those of `docs/environment.md`.

    Raises
    ------
    CorruptDataError
        There is no dataset, or it is damaged.
    UsageError
        An argument is out of its bounds or unknown.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4}  # noqa: RUF012 - as Gymnasium has it

    def __init__(
        self,
        dataset: str | Path | Dataset[Episode] = MINI,
        image_size: int = 64,
        render_mode: str | None = None,
        *,
        sensors: Sequence[str | Sensor] | None = None,
        **arguments: Unpack[Arguments],
    ) -> None:
        check_render_mode(render_mode)
        self.render_mode = render_mode
        dataset, sensors = with_absolute_path(dataset), take_sensors(sensors, arguments)
        self._arguments = dict(
            arguments, dataset=dataset, image_size=image_size, render_mode=render_mode,
            sensors=sensors,
        )  # fmt: skip
        self.observation_space = observation_space(image_size, sensors)
        self.action_space = gymnasium.spaces.Discrete(ACTION_COUNT)
        (self._slot,) = EnvSlot.make(1, dataset, arguments)
        self._buffer = ObservationBuffer.of(Camera(image_size), 1, sensors)
        self._large: Camera | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin the next episode of the seed's order, or a named one.

        Parameters
        ----------
        seed
            Seed of the order of episodes; None goes on in the present order.
        options
            `episode_id`: episode to begin. `actions`: actions to take at once; with the episode
            they make up a state. `start`: node and quarter turns (i, j, quarter) to begin at.

        Raises
        ------
        UsageError
            The seed or an option is wrong, or there is no such episode.
        """
        chosen = check_options(options, ("episode_id", "actions", "start"))
        episode_id = chosen.get("episode_id")
        actions, start = check_choice(episode_id, chosen.get("actions", ()), chosen.get("start"))
        seed = check_seed(seed)
        super().reset(seed=seed)
        if seed is not None or not self._slot.ordered:
            self._slot.seed(self.np_random_seed)
        self._slot.begin(episode_id, actions, start)
        return self._observation(), self._info()

    def step(
        self, action: int | np.int64
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Take an action, 0 … 11, or -1 to wait.

        Raises
        ------
        UsageError
            The episode has ended, or there is no such action.
        """
        run = self._slot.run
        # `item` makes numbers of arrays of one; what is no number is refused by the run.
        step = run.step(action.item() if isinstance(action, np.generic | np.ndarray) else action)
        # Metrics at every step: a wrapper as TimeLimit may make any step the last one.
        info = {**step_info(run, step), "metrics": run.task.metrics()}
        return self._observation(), step.reward, step.terminated, step.truncated, info

    def wait(self) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Let a step pass, for options that hand control back."""
        return self.step(Action.WAIT)

    def state(self) -> EpisodeSnapshot:
        """Return a snapshot: the episode, the actions so far, and the place in the order."""
        return self._slot.state()

    def restore(self, state: EpisodeSnapshot) -> tuple[dict[str, Any], dict[str, Any]]:
        """Become the environment of a snapshot, taken in this process or another one."""
        self._slot.restore(state)
        return self._observation(), self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """Return the agent's view, (300, 300, 3) uint8; None without a render mode."""
        if self.render_mode is None:
            return None
        if self._large is None:
            self._large = Camera(RENDER_SIZE)
        picture: NDArray[np.uint8] = self._large.render([self._slot.run.view()]).rgb[0]
        return picture

    def action_masks(self) -> Bools:
        """Return which actions could succeed now, (actions,) bool: `internav_data.world.masks`."""
        return action_mask(self._slot.run.world)

    def snapshots(self) -> list[EpisodeSnapshot | None]:
        """Return the snapshot of the episode under way, if any, as a list of one."""
        return [self._slot.state() if self._slot.has_episode else None]

    def restore_snapshots(self, snapshots: Sequence[EpisodeSnapshot | None]) -> None:
        """Restore what `snapshots` returned."""
        if snapshots[0] is not None:
            self._slot.restore(snapshots[0])

    def _observation(self) -> dict[str, Any]:
        self._buffer.write(0, self._slot.run)
        return self._buffer.one()

    def _info(self) -> dict[str, Any]:
        return {"episode_id": self._slot.run.episode.episode_id}
