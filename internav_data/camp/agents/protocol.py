"""Interface of agents to training and evaluation. Shapes: T steps, n environments.

An agent is parameters and pure functions: its memory of an episode is a `State`, handed in and
out. (The released code keeps the running option on the network: its first defect.)
"""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Generic, Self, TypeVar

import torch
from torch import Tensor, nn

from internav_data.camp import networks
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
    """(T, n, …): records of the steps; None of a new one."""

    @cached_property
    def segments(self) -> EpisodeSegments:
        """Episode segments that GRUs run over."""
        return EpisodeSegments(self.episode_starts)

    def chunked(self, columns: Tensor, states: Sequence[State]) -> Batch[R]:
        """Return the steps of m environments cut into C chunks, each of which is a column.

        Parameters
        ----------
        columns : (m,)
            Numbers of the environments.
        states
            Memory (n, …) before the first step of each of the C chunks; C divides T. `[self.state]`
            for whole steps.

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


@dataclass(frozen=True, slots=True, kw_only=True)
class ForwardOutput:
    """Outputs of an agent's networks over T steps, of which each draws one action.

    An agent of more draws has an output class of its own.
    """

    log_probs: Tensor
    """(T, n, A): log P(a)."""
    value: Tensor
    """(T, n): the critic's values."""
    state: State
    """(n, …): memory after the last step, but for what `Agent.draw` adds."""
    critic_inputs: Tensor | None = None
    """See `Evaluated`."""
    loss: Tensor | None = None
    """See `Evaluated`."""
    recorded: dict[str, Tensor] = field(default_factory=dict)
    """(T, n, …): fields of the record besides the choice."""

    def log_prob(self, record: Any) -> Tensor:  # noqa: ANN401 - of the agent's own class
        """Return the log-probabilities (T, n) of everything that was drawn."""
        return networks.log_prob_of(self.log_probs, record.choice)

    def entropy(self, record: Any) -> Tensor:  # noqa: ANN401, ARG002 - there is one distribution
        """Return the entropies (T, n) of the distributions that were drawn from."""
        return networks.entropy_of(self.log_probs)


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
    """Learner; see `internav_data.camp.agents` for how to add one's own.

    Acting, and evaluating what was done, are one run of its networks each.
    """

    sensors: tuple[str | Sensor, ...] = DEFAULT_SENSORS
    """Sensors that the agent takes, or their names; see `internav_data.envs.sensors`."""
    sensor_encoders: Mapping[str, type[SensorEncoder]] = ENCODERS
    """Encoders of its sensors, by name."""
    record_type: type[StepRecord] = StepRecord
    """Class of its records."""
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
    def run(self, batch: Batch[Any]) -> ForwardOutput:
        """Run the networks over T steps of n environments, with gradients.

        The record of a new step is None. Where it lacks a value that the agent worked out (P(i)),
        it is recomputed.
        """

    def draw(self, ran: Any, state: State, uniforms: Uniforms) -> tuple[Tensor, Any, State]:  # noqa: ANN401, ARG002
        """Draw from what `run` returned for a new step, (1, n, …), after the memory `state`.

        Returns
        -------
        action : (1, n) int64
            Numbers of `ACTIONS`, or -1 to wait.
        record
            Record of the draws, (1, n, …).
        state
            Memory (n, …) that depends on them.
        """
        choice = networks.drawn(ran.log_probs, uniforms[1])
        return choice, self.record_type(choice, **ran.recorded), {}

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
        begun = {
            name: values.masked_fill(episode_starts.reshape(-1, *[1] * (values.ndim - 1)), 0)
            for name, values in state.items()
        }
        draws = (None, None) if uniforms is None else (uniforms[:, 0], uniforms[:, 1])
        ran = self.run(_new_step(observations, begun))
        action, record, after = self.draw(ran, begun, draws)
        return AgentStep(
            action[0], ran.log_prob(record)[0], ran.value[0],
            record.map(lambda values: values[0]), {**ran.state, **after},
        )  # fmt: skip

    def value(self, observations: ObservationTensors, state: State) -> Tensor:
        """Return the critic's values (n,) of observations (n, …) after `state`."""
        return self.run(_new_step(observations, state)).value[0]

    def evaluate(self, batch: Batch[R]) -> Evaluated:
        """Run over recorded steps with the present parameters, with gradients."""
        ran, record = self.run(batch), batch.record
        return Evaluated(
            ran.log_prob(record), ran.value, ran.entropy(record), ran.state, ran.loss,
            ran.critic_inputs,
        )  # fmt: skip

    def labels(self, actions: Sequence[int]) -> tuple[list[int], R]:
        """Return an expert's actions as this agent would take them.

        Returns
        -------
        actions
            Actions of the environment, L of them; an agent may add waits.
        record
            Record (L, …) of the same steps for `evaluate`.
        """
        record: Any = self.record_type(torch.tensor(actions))
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


def _new_step(observations: ObservationTensors, state: State) -> Batch[Any]:
    """Return a new step, (n, …) by sensor, that begins no episode, as a batch (1, n, …)."""
    seen = {name: values.unsqueeze(0) for name, values in observations.items()}
    shown = next(iter(seen.values()))  # of any sensor: an agent need not take the goal
    begun = torch.zeros(shown.shape[:2], dtype=torch.bool, device=shown.device)
    return Batch(seen, begun, state, None)
