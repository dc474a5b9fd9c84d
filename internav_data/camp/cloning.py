"""Cloning: a dataset's experts act, and their actions are made likely (`--pretrain bc`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import torch

from internav_data.camp.agents.protocol import Agent, Batch, StepRecord
from internav_data.camp.ppo import Reduce, alone, check_finite, step
from internav_data.camp.rollout import StepRows
from internav_data.envs.loop import EnvironmentLoop, Environments
from internav_data.records import Episode
from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from internav_data.camp.config import ExpertColumn
    from internav_data.core.typing import Bools
    from internav_data.dataset import Dataset
    from internav_data.envs.slot import EpisodeSnapshot
    from internav_data.envs.types import Actions, Observations
    from internav_data.records import Expert

Experts = Callable[[str], Sequence[int]]
"""Function of an episode's id that returns its expert's actions."""


MAX_GRAD_NORM: Final = 0.5


def experts_of(dataset: Dataset[Episode], column: ExpertColumn = "expert") -> Experts:
    """Return the experts, in a column, of a dataset each of whose episodes has one."""
    from internav_data.envs.source import open_source  # noqa: PLC0415 - the camera's kernels

    source = open_source(dataset)

    def actions(episode_id: str) -> Sequence[int]:
        expert: Expert = getattr(source.episode(source.number_of(episode_id)), column)
        return expert.actions

    return actions


class Demonstrations:
    """Experts in their environments, labelled as an agent would take their actions.

    Parameters
    ----------
    env
        Environments; reset `loop`, or `restore`, first.
    agent
        Agent that learns; with options, labels have hand-backs.
    experts
        Actions by episode.

    Attributes
    ----------
    loop
        Environments with the observations that come next.
    state
        Memory of the agent after the steps so far, (n, …).
    """

    def __init__(self, env: Environments, agent: Agent[Any], experts: Experts) -> None:
        self.loop, self.agent, self._experts = EnvironmentLoop(env), agent, experts
        self.state = agent.initial_state(env.num_envs)
        self._actions: list[Sequence[int]] = [()] * env.num_envs
        self._records: list[Any] = [None] * env.num_envs
        self._taken = [0] * env.num_envs

    def restore(self, states: Sequence[EpisodeSnapshot], episode_starts: Bools) -> None:
        """Go on from snapshots of the environments and their `episode_starts`, (n,) bool.

        Raises
        ------
        CorruptDataError
            A snapshot has more actions than its expert.
        """
        self.loop.restore(states, episode_starts)
        for k, state in enumerate(states):
            self._begin(k, state.episode_id)
            self._taken[k] = len(state.actions)
            if self._taken[k] >= len(self._actions[k]):
                raise CorruptDataError(
                    f"checkpoint: environments: {self._taken[k]} actions were taken, the expert "
                    f"has {len(self._actions[k])}"
                )

    def collect(self, steps: int) -> Batch[Any]:
        """Take T steps everywhere; the batch begins with the memory in `state`."""
        seen = StepRows(steps, self.agent.device)
        records: list[StepRecord] = []

        def act(observations: Observations, episode_starts: Bools) -> Actions:
            seen.append(observations, episode_starts)
            for k in np.flatnonzero(episode_starts).tolist():
                self._begin(k, str(self.loop.infos["episode_id"][k]))
            rows = [_row(own, t) for own, t in zip(self._records, self._taken, strict=True)]
            records.append(type(rows[0]).stack(rows))
            return np.array([own[t] for own, t in zip(self._actions, self._taken, strict=True)])

        for taken_step in self.loop.run(act, steps):
            self._taken = [taken + 1 for taken in self._taken]
            for k, taken in enumerate(self._taken):
                taken_step.reset_mask[k] |= taken == len(self._actions[k])
        return seen.batch(self.state, records)

    def _begin(self, k: int, episode_id: str) -> None:
        self._actions[k], self._records[k] = self.agent.labels(self._experts(episode_id))
        self._taken[k] = 0


def _row(record: StepRecord, t: int) -> StepRecord:
    return record.map(lambda values: values[t])


def update(
    agent: Agent[Any],
    optimiser: torch.optim.Optimizer,
    demonstrations: Demonstrations,
    steps: int,
    reduce: Reduce = alone,
) -> dict[str, float]:
    """Make the experts' next T steps likelier.

    The loss is the mean of the negated log-probability that the ratio of PPO has too: an agent
    of options decides, ends an option or does not, and acts. Hidden states go on from one update
    to the next, without gradient.

    Parameters
    ----------
    agent, optimiser
        Agent to update and its optimiser (must hold `agent.optimised()`).
    demonstrations
        Expert trajectories to imitate.
    steps
        Number of steps T of each environment.
    reduce
        All-reduce sum across ranks.

    Returns
    -------
    dict
        `loss` and `grad_norm`.

    Raises
    ------
    NotFiniteError
        The loss or its gradient is NaN or infinite: the step is not taken.
    """
    found = agent.evaluate(demonstrations.collect(steps))
    frames = reduce(found.log_prob.new_tensor(float(found.log_prob.numel())))
    losses = -found.log_prob if found.loss is None else found.loss - found.log_prob  # (T, n)
    check_finite(torch.arange(losses.shape[1]), losses)
    loss = losses.sum() / frames
    norm = step(optimiser, loss, agent.optimised(), MAX_GRAD_NORM, reduce)
    demonstrations.state = {name: values.detach() for name, values in found.state.items()}
    return {"loss": float(reduce(loss.detach().clone())), "grad_norm": norm}
