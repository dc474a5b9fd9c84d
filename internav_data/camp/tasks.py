"""What agents are trained in: environments that can be told and built again."""

from __future__ import annotations

import time
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Final, Protocol

from internav_data.dataset import Dataset
from internav_data.envs.make import make_vector
from internav_data.envs.slot import EpisodeSnapshot
from internav_data.records import Episode
from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from internav_data.envs.types import Observations, Stepped

_ACTIONS_AT_MOST: Final = 100_000


class Task(Protocol):
    """Environments that can say what they are, as plain JSON, and become that again."""

    num_envs: int

    def begin(self, seed: int) -> Observations:
        """Begin everywhere."""

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """See `Environments`."""

    def step(self, actions: NDArray[np.int64]) -> Stepped:
        """See `Environments`."""

    def state(self) -> list[dict[str, Any]]:
        """Return what each environment is: its episode, the actions so far, its order."""

    def restore(self, states: Sequence[Mapping[str, Any]]) -> Observations:
        """Play again what `state` returned."""

    def close(self) -> None:
        """End its processes."""


class MainTask:
    """The task itself, in this process or in others.

    Parameters
    ----------
    dataset
        Whose episodes.
    count
        Environments.
    workers
        Processes; 0: this one.
    **arguments
        Of the environment.
    """

    def __init__(
        self,
        dataset: Dataset[Episode],
        count: int,
        workers: int = 0,
        **arguments: Any,  # noqa: ANN401 - those of `InterNavVectorEnv`
    ) -> None:
        self.num_envs = count
        self._env: Any = make_vector(
            count, dataset, min(workers, count), autoreset=False, copy=False, **arguments
        )

    def begin(self, seed: int) -> Observations:
        """See `Task`."""
        seen: Observations = self._env.reset(seed=seed)[0]
        return seen

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """See `Task`."""
        found: tuple[Observations, dict[str, Any]] = self._env.reset(seed=seed, options=options)
        return found

    def step(self, actions: NDArray[np.int64]) -> Stepped:
        """See `Task`."""
        found: Stepped = self._env.step(actions)
        return found

    def state(self) -> list[dict[str, Any]]:
        """See `Task`."""
        return [asdict(state) for state in self._env.state()]

    def restore(self, states: Sequence[Mapping[str, Any]]) -> Observations:
        """See `Task`."""
        seen: Observations = self._env.restore([env_state(state) for state in states])[0]
        return seen

    def close(self) -> None:
        """See `Task`."""
        self._env.close()


class WithoutObstacles(Dataset[Episode]):
    """The same episodes with nothing in the way: point navigation."""

    def __getitem__(self, item: Any) -> Any:  # noqa: ANN401 - a number or a slice, as Dataset has it
        """Return an episode, or some."""
        found = super().__getitem__(item)
        if isinstance(found, Episode):
            return replace(found, obstacles=(), obstacle_count=0)
        return [replace(episode, obstacles=(), obstacle_count=0) for episode in found]


class Timed:
    """A task, and the seconds that its environments took."""

    def __init__(self, task: Task) -> None:
        self.task, self.num_envs, self.spent_s = task, task.num_envs, 0.0

    def reset(self, **given: Any) -> Any:  # noqa: ANN401 - as `Task` has it
        """See `Task`."""
        return self._timed(self.task.reset, **given)

    def step(self, actions: Any) -> Any:  # noqa: ANN401 - as `Task` has it
        """See `Task`."""
        return self._timed(self.task.step, actions)

    def _timed(self, call: Callable[..., Any], *given: Any, **named: Any) -> Any:  # noqa: ANN401
        began = time.perf_counter()
        found = call(*given, **named)
        self.spent_s += time.perf_counter() - began
        return found


def env_state(said: Mapping[str, Any]) -> EpisodeSnapshot:
    """Return what an environment is, from a checkpoint.

    Raises
    ------
    CorruptDataError
        These are no episode and actions.
    """
    try:
        actions = tuple(int(action) for action in said["actions"][:_ACTIONS_AT_MOST])
        start = said["start"]
        where = None if start is None else (int(start[0]), int(start[1]), int(start[2]))
        seed, position = int(said["seed"]), int(said["position"])
        return EpisodeSnapshot(str(said["episode_id"]), actions, seed, position, where)
    except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
        raise CorruptDataError(f"environments: {error!r}: no state of an environment") from error
