"""`gymnasium.make("InterNav-v0", dataset=…)`: one agent in one house."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Unpack

import gymnasium
import numpy as np

from internav_data.envs.sensors import DEFAULT_SENSORS
from internav_data.envs.slot import Arguments, EnvSlot, EpisodeSnapshot, check_options, step_info
from internav_data.envs.spaces import ObservationBuffer, observation_space
from internav_data.records.errors import UsageError
from internav_data.render.camera import Camera
from internav_data.world import ACTION_COUNT, Action

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from internav_data.dataset import Dataset
    from internav_data.envs.sensors import Sensor
    from internav_data.records import Episode

RENDER_SIZE = 300
"""Pixels a side of what `render` returns: the paper's."""


class InterNavEnv(gymnasium.Env[dict[str, Any], np.int64]):
    """An agent that walks to a goal, and pushes or carries away what is in its way.

    `docs/environment.md` describes it: actions, observations, rewards, start, end, arguments.

    Parameters
    ----------
    dataset : str, Path or Dataset
        A folder that `internav-gen generate` wrote, or a loaded dataset.
    image_size
        Pixels a side of `rgb` and `depth`.
    render_mode
        None or "rgb_array".
    sensors
        Sensors to observe: names in `internav_data.envs.sensors.SENSORS`, or one's own `Sensor`.
    **arguments
        See `Arguments`.

    Raises
    ------
    CorruptDataError
        No dataset, or a damaged one.
    UsageError
        An argument that cannot be meant.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4}  # noqa: RUF012 - as Gymnasium has it

    def __init__(
        self,
        dataset: str | Path | Dataset[Episode],
        image_size: int = 64,
        render_mode: str | None = None,
        *,
        sensors: Sequence[str | Sensor] = DEFAULT_SENSORS,
        **arguments: Unpack[Arguments],
    ) -> None:
        if render_mode not in {None, "rgb_array"}:
            raise UsageError(f"render_mode: expected None or 'rgb_array', got {render_mode!r}")
        self.render_mode = render_mode
        self.observation_space = observation_space(image_size, sensors)
        self.action_space = gymnasium.spaces.Discrete(ACTION_COUNT)
        (self._slot,) = EnvSlot.make(1, dataset, arguments)
        self._buffer = ObservationBuffer.of(Camera(image_size), 1, sensors)
        self._large: Camera | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin the next episode of the seed's order, or `options["episode_id"]`.

        `options["actions"]` are played at once: with the episode they are a state.
        `options["start"]` = (i, j, quarter) puts the agent elsewhere first.
        """
        chosen = check_options(options, ("episode_id", "actions", "start"))
        super().reset(seed=seed)
        if seed is not None or not self._slot.ordered:
            self._slot.seed(self.np_random_seed)
        self._slot.begin(chosen.get("episode_id"), chosen.get("actions", ()), chosen.get("start"))
        return self._look(), self._whose()

    def step(
        self, action: int | np.int64
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Act: 0 … 11, or -1 to wait."""
        run = self._slot.run
        step = run.step(int(action))
        return self._look(), step.reward, step.terminated, step.truncated, step_info(run, step)

    def wait(self) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Pass a step: for options that hand control back."""
        return self.step(Action.WAIT)

    def state(self) -> EpisodeSnapshot:
        """Return all that this environment is, in a few words."""
        return self._slot.state()

    def restore(self, state: EpisodeSnapshot) -> tuple[dict[str, Any], dict[str, Any]]:
        """Become what `state` returned, here or elsewhere."""
        self._slot.restore(state)
        return self._look(), self._whose()

    def render(self) -> NDArray[np.uint8] | None:
        """Return what the agent sees, large."""
        if self.render_mode is None:
            return None
        if self._large is None:
            self._large = Camera(RENDER_SIZE)
        picture: NDArray[np.uint8] = self._large.render([self._slot.run.view()]).rgb[0]
        return picture

    def _look(self) -> dict[str, Any]:
        self._buffer.write(0, self._slot.run)
        return self._buffer.one()

    def _whose(self) -> dict[str, Any]:
        return {"episode_id": self._slot.run.episode.episode_id}
