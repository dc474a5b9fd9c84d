"""Evaluation of a policy on a split's episodes, many at a time.

Results depend on the policy, the evaluation seed and the episode alone: not on the batch, nor on
the order of episodes. (A network's arithmetic may differ in the last bit
between batch sizes; at an even chance in a million a sampled action can then differ too.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Protocol

import numpy as np

from internav_data.core.config import MAX_SEED, Bounds, check_bounds
from internav_data.envs.loop import EnvironmentLoop
from internav_data.evaluation.metrics import EpisodeResult, result_of
from internav_data.records import EvaluationStream, Purpose, generator
from internav_data.records.errors import UsageError
from internav_data.world.actions import Action

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.random import Generator
    from numpy.typing import NDArray

    from internav_data.core.typing import Bools
    from internav_data.dataset import Dataset
    from internav_data.envs.sensors import Sensor
    from internav_data.envs.types import Actions, Observations
    from internav_data.records import Episode

    Callback = Callable[[int, int], None]
    """Function of the number of episodes that have ended, and of all."""

Note = tuple[str, tuple[str, ...], tuple[float, ...], int]
"""Distribution that a policy drew from: a title, names, a probability for each, and the number of
the one that was drawn (-1: none)."""

STEPS_AT_MOST = 10_000
"""Upper bound of `EvaluationConfig.max_steps`."""


class Policy(Protocol):
    """Policy being evaluated: a trained agent (`camp.policy`) or a reference policy."""

    name: str
    image_size: int
    """Size of the pictures, pixels a side."""
    sensors: Sequence[str | Sensor]
    """Sensors that it takes, or their names; see `internav_data.envs.sensors`."""

    def begin(self, count: int, seed: int) -> None:
        """Begin with `count` slots; randomness derives from `seed` and the episode alone."""

    def start(self, slot: int, episode: Episode) -> None:
        """Clear the memory of a slot: an episode begins there."""

    def act(self, observations: Observations) -> NDArray[np.int64]:
        """Return the actions (count,) of all slots: 0 … 11, or -1 to wait.

        Observations are those of the vector environment, (count, …) each; they are overwritten
        by the next step. Actions of empty slots are ignored.
        """


@dataclass(frozen=True, slots=True)
class EvaluationConfig:
    """Settings of an evaluation."""

    seed: Annotated[int, Bounds(0, MAX_SEED)] = 0
    """Seed that, with the episode, keys the generator of its actions."""
    batch: Annotated[int, Bounds(1)] = 16
    """Number of episodes side by side."""
    workers: Annotated[int, Bounds(0)] = 0
    """Number of processes that step the episodes; 0 for this one."""
    max_steps: Annotated[int, Bounds(1, STEPS_AT_MOST)] = 500
    """Number of steps after which an episode is cut off."""
    limit: Annotated[int | None, Bounds(1)] = None
    """Maximum number of episodes: a fixed random choice, of which a smaller limit's is a part."""

    def check(self) -> None:
        """Check all values.

        Raises
        ------
        UsageError
            A value is out of its bounds.

        """
        check_bounds(self, "{key}: expected {expected}, got {value}")


def episode_generator(seed: int, episode: Episode) -> Generator:
    """Return the random generator of one episode of an evaluation."""
    scene = int(episode.scene_id.rpartition("-")[2])
    return generator(seed, Purpose.EVALUATION, scene, EvaluationStream.ACTIONS, episode.index)


def chosen(count: int, limit: int | None) -> list[int]:
    """Return the numbers of the episodes to play, ascending: all, or a fixed choice of them."""
    if limit is None or limit >= count:
        return list(range(count))
    order = generator(0, Purpose.EVALUATION, attempt=EvaluationStream.SUBSET).permutation(count)
    return sorted(order[:limit].tolist())


def evaluate(
    policy: Policy,
    dataset: Dataset[Episode],
    settings: EvaluationConfig | None = None,
    callback: Callback | None = None,
) -> list[EpisodeResult]:
    """Evaluate a policy on the episodes of a dataset; results come in the dataset's order.

    Parameters
    ----------
    policy
        Policy under evaluation.
    dataset
        Split, with its filters, as `load_dataset` returns it.
    settings
        Settings of the evaluation; the defaults if not given.
    callback
        Function that is called with the number of episodes that have ended, and of all.

    Raises
    ------
    UsageError
        Nothing is selected, or a setting is out of its bounds.
    """
    from internav_data.envs.make import make_vector  # noqa: PLC0415 - the camera's kernels

    settings = settings or EvaluationConfig()
    settings.check()
    if not len(dataset):
        raise UsageError(
            f"{dataset.path}: no episode is left of split={dataset.split!r}, "
            f"filters={dataset.filters!r}; choose others: "
            "`internav-gen stats` tells what the dataset holds"
        )
    numbers = chosen(len(dataset), settings.limit)
    count = min(settings.batch, len(numbers))
    env = make_vector(
        count, dataset, min(settings.workers, count), image_size=policy.image_size,
        sensors=policy.sensors, autoreset_mode="Disabled", copy=False, max_steps=settings.max_steps,
    )  # fmt: skip
    try:
        policy.begin(count, settings.seed)
        return _Round(env, policy, dataset, numbers, settings.seed).run(callback)
    finally:
        env.close()


class _Round:
    """One evaluation under way: the episode of each slot, and its actions so far."""

    def __init__(
        self,
        env: Any,  # noqa: ANN401 - either vector environment
        policy: Policy,
        dataset: Dataset[Episode],
        numbers: Sequence[int],
        seed: int,
    ) -> None:
        self._env, self._policy, self._dataset, self._seed = env, policy, dataset, seed
        self._numbers, self._next = numbers, 0
        self._episodes: list[Episode | None] = [None] * env.num_envs
        self._ids: list[str] = [""] * env.num_envs
        self._actions: list[list[int]] = [[] for _ in range(env.num_envs)]
        self._playing = [0] * env.num_envs
        self._found: dict[int, EpisodeResult] = {}

    def run(self, callback: Callback | None) -> list[EpisodeResult]:
        loop = EnvironmentLoop(self._env)
        for slot in range(self._env.num_envs):
            self._fill_slot(slot)
        loop.reset(seed=self._seed, options={"episode_id": self._ids})
        for step in loop.run(self._act):
            for slot in np.flatnonzero(step.reset_mask).tolist():
                self._ended(slot, step.infos)
                self._fill_slot(slot)
            step.reset_options["episode_id"] = self._ids
            if callback is not None and step.reset_mask.any():
                callback(len(self._found), len(self._numbers))
            if all(episode is None for episode in self._episodes):
                break
        return [self._found[number] for number in self._numbers]

    def _act(self, observations: Observations, episode_starts: Bools) -> Actions:  # noqa: ARG002
        actions = np.array(self._policy.act(observations), dtype=np.int64)
        idle = [episode is None for episode in self._episodes]
        actions[idle] = Action.WAIT
        for slot, action in enumerate(actions.tolist()):
            self._actions[slot].append(action)
        return actions

    def _fill_slot(self, slot: int) -> None:
        """Give a slot the next episode; without one it keeps its last, and waits."""
        self._actions[slot] = []
        if self._next == len(self._numbers):
            self._episodes[slot] = None
            return
        self._playing[slot] = number = self._numbers[self._next]
        episode = self._dataset[number]
        self._next += 1
        self._episodes[slot], self._ids[slot] = episode, episode.episode_id
        self._policy.start(slot, episode)

    def _ended(self, slot: int, infos: Mapping[str, Any]) -> None:
        episode = self._episodes[slot]
        if episode is None:
            return
        metrics = {
            name: values[slot] for name, values in infos["metrics"].items() if name[0] != "_"
        }
        self._found[self._playing[slot]] = result_of(episode, metrics, self._actions[slot])
