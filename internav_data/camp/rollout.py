"""Rollouts: T steps of n environments as an agent took them, and their advantages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor

from internav_data.camp.agents.protocol import Agent, AgentStep, Batch, State, StepRecord
from internav_data.camp.config import PPOConfig
from internav_data.envs.loop import EnvironmentLoop, Environments, LoopStep
from internav_data.records import Purpose, TrainingStream, generator
from internav_data.records.errors import NotFiniteError

if TYPE_CHECKING:
    from internav_data.core.typing import Bools
    from internav_data.envs.slot import EpisodeSnapshot
    from internav_data.envs.types import Actions, Observations


@dataclass(frozen=True, slots=True)
class Finished:
    """Episode that ended during a rollout."""

    environment: int
    step: int
    """Row of the rollout."""
    metrics: dict[str, Any]
    """Metrics of the episode, from the environment."""


@dataclass(frozen=True, slots=True)
class Rollout:
    """Steps, rewards and values that PPO learns from. Tensors are (T, n)."""

    batch: Batch[Any]
    states: Sequence[State]
    """Memory (n, …) before the first step of each of the equal chunks that learning replays."""
    rewards: Tensor
    terminated: Tensor
    truncated: Tensor
    """Whether the episode ended, or was cut off, by the step. Where both are true it ended."""
    values: Tensor
    """Values before each step."""
    log_probs: Tensor
    """Log-probabilities of everything that was drawn."""
    final_values: Tensor
    """Values of the observations after a cut, before the reset; 0 elsewhere."""
    last_value: Tensor
    """(n,): values after the last step; not used where an episode ended there."""
    finished: list[Finished] = field(default_factory=list)
    """Episodes that ended, in the order of their ends."""

    def advantages(self, config: PPOConfig) -> Tensor:
        """Return the generalised advantages (Schulman et al. 2016), (T, n) float32.

        Added to `values` they are the returns.
        """
        over = self.truncated | self.terminated
        following = torch.cat([self.values[1:], self.last_value.unsqueeze(0)])
        following = torch.where(self.truncated, self.final_values, following)
        following = following.masked_fill(self.terminated, 0.0)
        td_errors = self.rewards + config.gamma * following - self.values
        carries = (config.gamma * config.gae_lambda) * (~over).to(self.values.dtype)
        advantages, ahead = torch.empty_like(self.values), torch.zeros_like(self.last_value)
        for t in range(len(advantages) - 1, -1, -1):
            ahead = td_errors[t] + carries[t] * ahead
            advantages[t] = ahead
        return advantages


def uniforms_of(seed: int, rollout: int, environments: Sequence[int], steps: int) -> Tensor:
    """Return the random numbers of a rollout, (T, n, 2) float32 in [0, 1).

    Each environment has its own, so that several ranks draw what one would.
    """
    columns = [
        generator(seed, Purpose.TRAINING, k, TrainingStream.ACTIONS, draw=rollout).random(
            (steps, 2), np.float32
        )
        for k in environments
    ]
    return torch.from_numpy(np.stack(columns, 1))


def orders_of(seed: int, rollout: int, epochs: int, count: int) -> list[list[int]]:
    """Return a permutation of the environments for each epoch of an update."""
    rng = generator(seed, Purpose.TRAINING, attempt=TrainingStream.MINIBATCHES, draw=rollout)
    return [rng.permutation(count).tolist() for _ in range(epochs)]


class Collector:
    """An agent in its environments, rollout after rollout.

    Parameters
    ----------
    env
        Environments; reset `loop`, or `restore`, first.
    agent
        Agent that acts.
    seed
        Seed of environment 0, for messages.
    overwrites
        Write a rollout's observations over those of the one before: fresh memory costs seven times
        as much as the copies into it.

    Attributes
    ----------
    loop
        Environments with the observations that come next.
    state
        Memory of the agent, (n, …).
    """

    def __init__(
        self, env: Environments, agent: Agent[Any], seed: int = 0, *, overwrites: bool = False
    ) -> None:
        self.loop, self.agent, self._seed = EnvironmentLoop(env), agent, seed
        self._rows: dict[str, Tensor] | None = {} if overwrites else None
        self.state = agent.initial_state(env.num_envs)

    def restore(self, states: Sequence[EpisodeSnapshot], episode_starts: Bools) -> None:
        """Go on from snapshots of the environments and their `episode_starts`, (n,) bool."""
        self.loop.restore(states, episode_starts)

    @torch.no_grad()
    def collect(self, uniforms: Tensor, chunk_steps: int = 0) -> Rollout:
        """Take T steps everywhere.

        Parameters
        ----------
        uniforms : (T, n, 2)
            Random numbers of `uniforms_of`.
        chunk_steps
            Number of steps of a chunk (`PPOConfig.chunk_steps`), a divisor of T; 0 for T.

        Raises
        ------
        NotFiniteError
            An observation or a reward is NaN or infinite.
        """
        agent, device, chunk_steps = self.agent, self.agent.device, chunk_steps or len(uniforms)
        states: list[State] = []
        rows = StepRows(len(uniforms), device, self._rows)
        taken: list[AgentStep[Any]] = []
        ends: list[tuple[Tensor, ...]] = []
        finished: list[Finished] = []

        def act(observations: Observations, episode_starts: Bools) -> Actions:
            self._check(observations)
            if len(taken) % chunk_steps == 0:
                states.append(self.state)
            seen, begun = rows.append(observations, episode_starts)
            draws = uniforms[len(taken)].to(device)
            taken.append(agent.act(seen, self.state, begun, draws))
            self.state = taken[-1].state
            actions: Actions = taken[-1].action.cpu().numpy()
            return actions

        for t, step in enumerate(self.loop.run(act, len(uniforms))):
            self._check({"reward": step.rewards})
            cut, final = torch.from_numpy(step.truncated), torch.zeros_like(taken[-1].value)
            if (step.truncated & ~step.terminated).any():
                self._check(step.observations)
                final = self._values() * cut.to(device)
            rewards = torch.from_numpy(step.rewards.astype(np.float32))
            ends.append((rewards, torch.from_numpy(step.terminated), cut, final))
            finished += _finished(t, step)
        rewards, terminated, truncated, final_values = (
            torch.stack(column).to(device) for column in zip(*ends, strict=True)
        )
        return Rollout(
            rows.batch(states[0], [step.record for step in taken]),
            states, rewards, terminated, truncated,
            values=torch.stack([step.value for step in taken]),
            log_probs=torch.stack([step.log_prob for step in taken]),
            final_values=final_values, last_value=self._values(), finished=finished,
        )  # fmt: skip

    def _values(self) -> Tensor:
        """Return the values (n,) of the present observations, after the last step."""
        device, observations = self.agent.device, self.loop.observations
        seen = {name: torch.from_numpy(array).to(device) for name, array in observations.items()}
        return self.agent.value(seen, self.state)

    def _check(self, arrays: Observations) -> None:
        for name, array in arrays.items():
            if array.dtype.kind != "f":
                continue
            sums = array.reshape(len(array), -1).sum(1)  # NaN and infinity outlive a sum
            if not np.isfinite(sums).all():
                k = int(np.flatnonzero(~np.isfinite(sums))[0])
                raise NotFiniteError(
                    f"environment {k} (seed {self._seed + k}): {name} is not finite"
                )


class StepRows:
    """Observations and episode starts of T steps, to become a batch.

    Parameters
    ----------
    steps
        Number of steps T.
    device
        Device of the tensors.
    observations
        Tensors of earlier steps, by sensor, to be overwritten; this object changes it.
    """

    def __init__(
        self, steps: int, device: torch.device, observations: dict[str, Tensor] | None = None
    ) -> None:
        self._steps, self._device = steps, device
        self._observations: dict[str, Tensor] = {} if observations is None else observations
        self._episode_starts: list[Tensor] = []

    def append(
        self, observations: Observations, episode_starts: Bools
    ) -> tuple[dict[str, Tensor], Tensor]:
        """Copy what a step shows, as environments overwrite it; return the copies, (n, …) each."""
        rows, t = self._observations, len(self._episode_starts)
        for name, array in observations.items():
            values = torch.from_numpy(array)
            if name not in rows or len(rows[name]) != self._steps:
                rows[name] = values.new_empty((self._steps, *values.shape), device=self._device)
            rows[name][t].copy_(values)
        self._episode_starts.append(torch.from_numpy(episode_starts).to(self._device))
        return {name: rows[name][t] for name in observations}, self._episode_starts[-1]

    def batch(self, state: State, records: Sequence[StepRecord]) -> Batch[Any]:
        """Return the steps with the memory (n, …) before the first, and their records (n, …)."""
        record = type(records[0]).stack(records).map(lambda values: values.to(self._device))
        return Batch(self._observations, torch.stack(self._episode_starts), state, record)


def _finished(t: int, step: LoopStep) -> list[Finished]:
    """Return the episodes that ended by a step, with those metrics that the environment gave."""
    metrics = step.infos.get("metrics", {})
    names = [name for name in metrics if not name.startswith("_")]
    everywhere = np.ones(len(step.reset_mask), np.bool_)
    return [
        Finished(
            k, t,
            {n: metrics[n][k].item() for n in names if metrics.get(f"_{n}", everywhere)[k]},
        )
        for k in np.flatnonzero(step.reset_mask).tolist()
    ]  # fmt: skip
