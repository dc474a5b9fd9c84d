"""The loop of an agent in a vector environment: act, step, reset where an episode is over.

Training, cloning and evaluation all run it. It needs numpy alone: what acts may be a network, a
recorded expert or a reference policy.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from internav_data.core.typing import Bools, Floats
    from internav_data.envs.slot import EpisodeSnapshot
    from internav_data.envs.types import Actions, Observations, Stepped
    from internav_data.physics.cache import SolverCounts

    Act = Callable[[Observations, Bools], Actions]
    """Function that chooses the actions (n,) of n environments, from their observations and where
    an episode begins, (n,)."""


class Environments(Protocol):
    """Vector environment that resets nothing by itself; it may overwrite its observations."""

    num_envs: int

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin an episode everywhere, or where `options["reset_mask"]` (n,) is true.

        Returns observations (n, …) by sensor, and infos.
        """

    def step(self, actions: Actions) -> Stepped:
        """Take actions (n,), -1 to wait; return what `VectorEnv.step` returns, arrays (n, …)."""

    def solver_counts(self) -> SolverCounts:
        """Return the counters of the environments' pushes."""

    def state(self) -> Sequence[EpisodeSnapshot]:
        """Return a snapshot of each environment."""

    def restore(self, states: Sequence[EpisodeSnapshot]) -> tuple[Observations, dict[str, Any]]:
        """Restore environments of snapshots; return observations (n, …) by sensor, and infos."""

    def close(self) -> None:
        """End the environments' processes."""


@dataclass(frozen=True, slots=True)
class LoopStep:
    """Step of all n environments, before the next episode begins where one is over."""

    actions: Actions
    observations: Observations
    """Observations after the actions; the next step may overwrite them."""
    rewards: Floats
    terminated: Bools
    truncated: Bools
    infos: dict[str, Any]
    reset_mask: Bools
    """Environments that are reset after this step, (n,); the caller may add some."""
    reset_options: dict[str, Any] = field(default_factory=dict)
    """Further options of that reset; the caller may add some, as "episode_id"."""


class EnvironmentLoop:
    """An agent's place in a vector environment.

    Parameters
    ----------
    env
        Environments; `reset` or `restore` comes first.

    Attributes
    ----------
    observations
        Observations that the next actions are chosen from.
    episode_starts : (n,) bool
        Environments whose next step is the first of an episode.
    infos
        Infos of the last reset.
    env_s
        Seconds that the environments took.
    """

    def __init__(self, env: Environments) -> None:
        self.env, self.env_s = env, 0.0
        self.observations: Observations = {}
        self.infos: dict[str, Any] = {}
        self.episode_starts = np.ones(env.num_envs, np.bool_)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        """Begin an episode everywhere."""
        self.observations, self.infos = self.env.reset(seed=seed, options=options)
        self.episode_starts = np.ones(self.env.num_envs, np.bool_)

    def restore(self, states: Sequence[EpisodeSnapshot], episode_starts: Bools) -> None:
        """Continue from snapshots of the environments, with their `episode_starts` (n,) bool."""
        self.observations, self.infos = self.env.restore(states)
        self.episode_starts = episode_starts

    def run(self, act: Act, steps: int | None = None) -> Iterator[LoopStep]:
        """Yield one step after another; the next episode begins once the caller asks for more.

        Parameters
        ----------
        act
            Function that chooses actions.
        steps
            Number of steps; None for as many as the caller asks for.
        """
        taken = 0
        while steps is None or taken < steps:
            actions = act(self.observations, self.episode_starts)
            began = time.perf_counter()
            observations, rewards, terminated, truncated, infos = self.env.step(actions)
            self.env_s += time.perf_counter() - began
            reset_mask = terminated | truncated
            self.observations = observations
            step = LoopStep(
                actions, observations, rewards, terminated, truncated, infos, reset_mask
            )
            yield step
            self.episode_starts = step.reset_mask
            if step.reset_mask.any():
                began = time.perf_counter()
                options = {"reset_mask": step.reset_mask, **step.reset_options}
                self.observations, self.infos = self.env.reset(options=options)
                self.env_s += time.perf_counter() - began
            taken += 1
