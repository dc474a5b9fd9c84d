"""What training and evaluation know of an agent. Shapes: T steps, n environments.

An agent is parameters and pure functions: what it remembers of an episode is a `State`, handed in
and out. (The released code keeps the running option on the network: its first defect.)
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import torch
from torch import Tensor, nn

from internav_data.camp.networks import EpisodeSegments
from internav_data.envs.sensors import DEFAULT_SENSORS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from torch.nn import Parameter

State = dict[str, Tensor]
"""What an agent remembers of each environment's episode: (n, …) by name; zeros at its start."""


@dataclass(frozen=True, slots=True)
class AgentStep:
    """What an agent does in each environment, and why."""

    action: Tensor
    """(n,) int64: 0 … 11, or -1 to wait."""
    log_prob: Tensor
    """(n,): of all that was drawn."""
    value: Tensor
    """(n,): what the critic expects from here on."""
    record: dict[str, Tensor]
    """(n, …): what `evaluate` needs to tell the same story again, and what logs are made of."""
    state: State
    """After this step."""


@dataclass(frozen=True)
class Batch:
    """Steps of some environments, to be lived through again."""

    observations: dict[str, Tensor]
    """(T, n, …)"""
    starts: Tensor
    """(T, n) bool: an episode begins at this step."""
    state: State
    """(n, …): before the first step."""
    record: dict[str, Tensor]
    """(T, n, …): those of the steps."""

    @cached_property
    def course(self) -> EpisodeSegments:
        """How GRUs go over these steps."""
        return EpisodeSegments(self.starts)

    def of(self, columns: Tensor) -> Batch:
        """Return some of the environments; columns are their numbers, (m,)."""
        return Batch(
            {name: seen[:, columns] for name, seen in self.observations.items()},
            self.starts[:, columns],
            {name: kept[columns] for name, kept in self.state.items()},
            {name: noted[:, columns] for name, noted in self.record.items()},
        )


@dataclass(frozen=True, slots=True)
class Evaluated:
    """What an agent's present parameters say of steps that were taken."""

    log_prob: Tensor
    """(T, n): of all that was drawn."""
    value: Tensor
    """(T, n)"""
    entropy: Tensor
    """(T, n): of all that could have been drawn."""
    state: State
    """(n, …): hidden states after the last step; without those that are not run again."""
    intent: Tensor | None = None
    """(T, n, …): P(i), where it was worked out anew."""
    loss: Tensor | None = None
    """(T, n): of what else is predicted (`nie`)."""


class Agent(nn.Module, ABC):
    """A learner; see `internav_data.camp.agents` for how one's own joins."""

    sensors: ClassVar[tuple[str, ...]] = DEFAULT_SENSORS
    """Names of the sensors that it takes; see `internav_data.envs.sensors`."""

    @property
    def device(self) -> torch.device:
        """Where the parameters lie."""
        return next((p.device for p in self.parameters()), torch.device("cpu"))

    @abstractmethod
    def initial_state(self, count: int) -> State:
        """Return the state of `count` environments that are about to begin: zeros."""

    @abstractmethod
    def act(
        self,
        seen: dict[str, Tensor],
        state: State,
        starts: Tensor,
        uniforms: Tensor | None,
    ) -> AgentStep:
        """Choose actions; gradients are not needed.

        Parameters
        ----------
        seen
            Observations, (n, …) by name.
        state
            After the step before.
        starts : (n,) bool
            An episode begins here: its state is forgotten.
        uniforms : (n, 2)
            In [0, 1): what options and what actions are drawn by; None for the most probable.
        """

    @abstractmethod
    def value(self, seen: dict[str, Tensor], state: State) -> Tensor:
        """Return what the critic expects of observations (n, …) after `state`: (n,)."""

    @abstractmethod
    def evaluate(self, batch: Batch) -> Evaluated:
        """Live through steps again, with gradients.

        Where `record` lacks what the agent made up on the way (P(i)), it is worked out anew.
        """

    def labels(self, actions: Sequence[int]) -> dict[str, list[int]]:
        """Return an expert's actions as this agent would take them.

        "action" is what the environment gets; the rest is `record` for `evaluate`.
        """
        return {"action": list(actions), "choice": list(actions)}

    def optimised(self) -> list[Parameter]:
        """Return the parameters that are trained."""
        return [parameter for parameter in self.parameters() if parameter.requires_grad]

    def critics(self) -> list[Parameter]:
        """Return the parameters of the critics: all that is trained while they are new."""
        return []

    def synchronise(self) -> None:
        """Copy the deciding network into the intent network, where there is one."""


def reset_where_done(state: State, starts: Tensor) -> State:
    """Return a state that has forgotten the episodes that are over; starts (n,) bool."""
    return {
        name: kept.masked_fill(starts.reshape(-1, *[1] * (kept.ndim - 1)), 0)
        for name, kept in state.items()
    }


def one_step(seen: dict[str, Tensor]) -> tuple[dict[str, Tensor], EpisodeSegments]:
    """Return observations (n, …) as (1, n, …), and the course of a step at which nobody begins."""
    starts = torch.zeros(1, len(seen["goal"]), dtype=torch.bool, device=seen["goal"].device)
    return {name: what.unsqueeze(0) for name, what in seen.items()}, EpisodeSegments(starts)
