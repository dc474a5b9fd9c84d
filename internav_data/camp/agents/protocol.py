"""Interface of agents to training and evaluation. Shapes: T steps, n environments.

An agent is parameters and pure functions: its memory of an episode is a `State`, handed in and
out. (The released code keeps the running option on the network: its first defect.)
"""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Generic, Self, TypeVar

import torch
from torch import Tensor, nn

from internav_data.camp.networks import ENCODERS, EpisodeSegments, SensorEncoder
from internav_data.envs.sensors import DEFAULT_SENSORS, Sensor
from internav_data.records.errors import UsageError

ObservationTensors = dict[str, Tensor]
"""Observations by sensor: tensors (n, …), or (T, n, …) of several steps."""
State = dict[str, Tensor]
"""Memory of each environment's episode: tensors (n, …) by name; zeros at its start."""
Uniforms = tuple[Tensor | None, Tensor | None]
"""Random numbers (n,) that options and actions are drawn by; None for the most probable."""


@dataclass(frozen=True, slots=True)
class StepRecord:
    """Draws of an agent, as `evaluate` needs them to compute their probability once more.

    An agent of more draws than one action a step has a record class of its own. Fields are tensors
    (n, …) of one step or (T, n, …) of several; None where a value was not worked out.
    """

    choice: Tensor
    """Number of the action that was drawn, int64."""

    def map(self, function: Callable[[Tensor], Tensor]) -> Self:
        """Return the record with a function applied to every tensor, of any shape."""
        tensors = {f.name: getattr(self, f.name) for f in fields(self)}
        return replace(self, **{k: function(v) for k, v in tensors.items() if v is not None})

    @classmethod
    def stack(cls, records: Sequence[Self]) -> Self:
        """Return records as one, with a new first dimension."""
        names = [f.name for f in fields(cls) if getattr(records[0], f.name) is not None]
        return cls(**{name: torch.stack([getattr(r, name) for r in records]) for name in names})

    def statistics(self) -> dict[str, float]:
        """Return the statistics of a rollout's decisions that are logged."""
        return {}


R = TypeVar("R", bound=StepRecord)


@dataclass(frozen=True, slots=True)
class AgentStep(Generic[R]):
    """Actions of an agent in n environments, and their reasons."""

    action: Tensor
    """(n,) int64: numbers of `ACTIONS`, or -1 to wait."""
    log_prob: Tensor
    """(n,): log-probability of everything that was drawn."""
    value: Tensor
    """(n,): the critic's value before the action."""
    record: R
    """(n, …): tensors that `evaluate` needs to recompute the log-probability, and for logs."""
    state: State
    """(n, …): memory after this step."""


@dataclass(frozen=True)
class Batch(Generic[R]):
    """Steps of some environments, to be evaluated once more."""

    observations: ObservationTensors
    """(T, n, …) by sensor."""
    episode_starts: Tensor
    """(T, n) bool: an episode begins at this step."""
    state: State
    """(n, …): memory before the first step."""
    record: R
    """(T, n, …): records of the steps."""

    @cached_property
    def segments(self) -> EpisodeSegments:
        """Episode segments that GRUs run over."""
        return EpisodeSegments(self.episode_starts)

    def select(self, columns: Tensor) -> Batch[R]:
        """Return the steps of some environments, by number (m,)."""
        return Batch(
            {name: values[:, columns] for name, values in self.observations.items()},
            self.episode_starts[:, columns],
            {name: values[columns] for name, values in self.state.items()},
            self.record and self.record.map(lambda values: values[:, columns]),
        )

    def chunked(self, columns: Tensor, states: Sequence[State]) -> Batch[R]:
        """Return the steps of m environments cut into C chunks, each of which is a column.

        Parameters
        ----------
        columns : (m,)
            Numbers of the environments.
        states
            Memory (n, …) before the first step of each of the C chunks; C divides T.

        Returns
        -------
        Batch
            T / C steps of C m columns: the first chunk of every environment, then the second.
        """

        def cut(values: Tensor) -> Tensor:
            rows = values.view(len(states), -1, *values.shape[1:])  # (C, T / C, n, …)
            return rows.transpose(0, 1)[:, :, columns].flatten(1, 2)

        return Batch(
            {name: cut(values) for name, values in self.observations.items()},
            cut(self.episode_starts),
            {name: torch.cat([each[name][columns] for each in states]) for name in self.state},
            self.record and self.record.map(cut),
        )


@dataclass(frozen=True, slots=True)
class Evaluated:
    """Steps that were taken, under an agent's present parameters."""

    log_prob: Tensor
    """(T, n): log-probability of everything that was drawn."""
    value: Tensor
    """(T, n): the critic's values."""
    entropy: Tensor
    """(T, n): entropy of the distributions that were drawn from."""
    state: State
    """(n, …): memory after the last step; without hidden states that were not run again."""
    loss: Tensor | None = None
    """(T, n): loss of other predictions (`nie`)."""
    critic_inputs: Tensor | None = None
    """(T, n, hidden): inputs of the agent's one `ValueHead`, which a new critic is fitted to."""


class Agent(nn.Module, ABC, Generic[R]):
    """Learner; see `internav_data.camp.agents` for how to add one's own."""

    sensors: tuple[str | Sensor, ...] = DEFAULT_SENSORS
    """Sensors that the agent takes, or their names; see `internav_data.envs.sensors`."""
    sensor_encoders: Mapping[str, type[SensorEncoder]] = ENCODERS
    """Encoders of its sensors, by name."""
    uses_intent: bool = False
    """Whether its decisions take an intent P(i)."""

    @property
    def device(self) -> torch.device:
        """Device of the parameters."""
        return next((p.device for p in self.parameters()), torch.device("cpu"))

    @abstractmethod
    def initial_state(self, count: int) -> State:
        """Return the memory of `count` environments whose episodes begin: zeros, (count, …)."""

    @abstractmethod
    def act(
        self,
        observations: ObservationTensors,
        state: State,
        episode_starts: Tensor,
        uniforms: Tensor | None,
    ) -> AgentStep[R]:
        """Choose actions; gradients are not needed.

        Parameters
        ----------
        observations
            Tensors (n, …) by sensor.
        state
            Memory after the step before.
        episode_starts : (n,) bool
            Environments whose episode begins: their memory is cleared.
        uniforms : (n, 2)
            Random numbers in [0, 1) that options and actions are drawn by; None for the most
            probable.
        """

    def value(self, observations: ObservationTensors, state: State) -> Tensor:
        """Return the critic's values (n,) of observations (n, …) after `state`."""
        episode_starts = torch.zeros(
            len(observations["goal"]), dtype=torch.bool, device=self.device
        )
        return self.act(observations, state, episode_starts, None).value

    @abstractmethod
    def evaluate(self, batch: Batch[R]) -> Evaluated:
        """Run over recorded steps with the present parameters, with gradients.

        Where the record lacks a value that the agent worked out (P(i)), it is recomputed.
        """

    def labels(self, actions: Sequence[int]) -> tuple[list[int], R]:
        """Return an expert's actions as this agent would take them.

        Returns
        -------
        actions
            Actions of the environment, L of them; an agent may add waits.
        record
            Record (L, …) of the same steps for `evaluate`.
        """
        record: Any = StepRecord(torch.tensor(actions))
        return list(actions), record

    def optimised(self) -> list[nn.Parameter]:
        """Return the parameters that are trained."""
        return [parameter for parameter in self.parameters() if parameter.requires_grad]

    def critics(self) -> list[nn.Module]:
        """Return the critics' heads, which are trained alone while they are new."""
        return []

    def synchronise(self) -> None:
        """Copy the deciding policy into the intent policy, where there is one."""

    def without_intent(self) -> Self:
        """Return the same networks on the uniform intent (Table 4's test without intent).

        Raises
        ------
        UsageError
            The agent has no intent.
        """
        if not self.uses_intent:
            raise UsageError("this agent has no intent to be evaluated without")
        other = copy.copy(self)
        other.uses_intent = False
        return other


class RecurrentAgent(Agent[R]):
    """Agent whose networks run over a batch, whether its steps are new or recorded."""

    def act(
        self,
        observations: ObservationTensors,
        state: State,
        episode_starts: Tensor,
        uniforms: Tensor | None,
    ) -> AgentStep[R]:
        """See `Agent`."""
        seen, segments = one_step(observations)
        state = reset_where_done(state, episode_starts)
        batch: Batch[Any] = Batch(seen, segments.episode_starts, state, None)
        draws = (None, None) if uniforms is None else (uniforms[:, 0], uniforms[:, 1])
        return self.step(batch, draws)

    @abstractmethod
    def step(self, batch: Batch[Any], uniforms: Uniforms) -> AgentStep[R]:
        """Choose actions (n,) in a batch of one new step, (1, n, …), whose record is None."""


def reset_where_done(state: State, episode_starts: Tensor) -> State:
    """Return a memory (n, …) that is zero where an episode begins; episode_starts (n,) bool."""
    return {
        name: values.masked_fill(episode_starts.reshape(-1, *[1] * (values.ndim - 1)), 0)
        for name, values in state.items()
    }


def one_step(observations: ObservationTensors) -> tuple[ObservationTensors, EpisodeSegments]:
    """Return observations (n, …) as (1, n, …), and the segments of a step without a start."""
    goal = observations["goal"]
    segments = EpisodeSegments(torch.zeros(1, len(goal), dtype=torch.bool, device=goal.device))
    return {name: values.unsqueeze(0) for name, values in observations.items()}, segments
