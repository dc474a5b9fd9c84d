"""The auxiliary tasks: each action policy learns alone, with a critic of its own (section 5.2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor

from internav_data.camp.agents.options import (
    ACTIONS_OF,
    NAVIGATE,
    OPTION_NAMES,
    option_inputs,
    option_step,
)
from internav_data.camp.agents.protocol import (
    Agent,
    AgentStep,
    Batch,
    Evaluated,
    one_step,
    reset_where_done,
)
from internav_data.camp.networks import drawn, entropy_of
from internav_data.world.actions import ACTION_COUNT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from torch.nn import Parameter

    from internav_data.camp.agents.hierarchy import Hierarchy
    from internav_data.camp.agents.protocol import State
    from internav_data.camp.networks import EpisodeSegments


class Auxiliary(Agent):
    """The action policies of a hierarchy, one in each environment; Done ends the task.

    They are told of the open option as in the whole model: nothing at the first action, then that
    they are open and for how long; after 11 actions they are opened anew.

    Parameters
    ----------
    hierarchy
        Whose policies are trained.
    tasks
        Task of each environment, named after the policy that it trains: "navigate", "push", "pick".
    trained
        Tasks that are trained, here or on other ranks; those of the environments if not given.
    """

    def __init__(
        self, hierarchy: Hierarchy, tasks: Sequence[str], trained: Sequence[str] | None = None
    ) -> None:
        super().__init__()
        self.hierarchy = hierarchy
        number = {str(name): k for k, name in enumerate(OPTION_NAMES)}
        self._tasks = torch.tensor([number[task] for task in tasks], dtype=torch.int64)
        self._trained = sorted({number[task] for task in (trained or tasks)})

    def initial_state(self, count: int) -> State:
        """See `Agent`."""
        state = self.hierarchy.initial_state(count)
        return {**state, "hidden": state["hidden"][:, 0]}

    def act(
        self, seen: dict[str, Tensor], state: State, starts: Tensor, uniforms: Tensor | None
    ) -> AgentStep:
        """See `Agent`."""
        state = reset_where_done(state, starts)
        option = self._tasks.to(starts.device)
        known = {"option": option, "open": state["open"], "used": state["used"]}
        log_probs, value, hidden = self.run(*one_step(seen), state, _row(known))
        choice = drawn(log_probs[0], None if uniforms is None else uniforms[:, 1])
        chosen = log_probs[0].gather(-1, choice.unsqueeze(-1)).squeeze(-1)
        opened, used, _, _ = option_step(option, choice, state["used"])
        if not self.hierarchy.keeps:  # `hrl` is told nothing in its whole model either
            opened, used = opened * 0, used * 0
        after = {"hidden": hidden, "open": opened, "used": used}
        return AgentStep(choice, chosen, value[0], {**known, "choice": choice}, after)

    def value(self, seen: dict[str, Tensor], state: State) -> Tensor:
        """See `Agent`; of all environments, in their order."""
        option = self._tasks.to(seen["goal"].device)
        known = {"option": option, "open": state["open"], "used": state["used"]}
        return self.run(*one_step(seen), state, _row(known))[1][0]

    def evaluate(self, batch: Batch) -> Evaluated:
        """See `Agent`."""
        log_probs, value, hidden = self.run(
            batch.observations, batch.course, batch.state, batch.record
        )
        chosen = log_probs.gather(-1, batch.record["choice"].unsqueeze(-1)).squeeze(-1)
        after = {**batch.state, "hidden": hidden}
        return Evaluated(chosen, value, entropy_of(log_probs), after)

    def run(
        self,
        seen: dict[str, Tensor],
        course: EpisodeSegments,
        state: State,
        record: dict[str, Tensor],
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Return log-probabilities (T, n, 12), values (T, n) and hidden states (n, hidden).

        Each policy runs over its own environments alone.
        """
        option = record["option"][0]
        shape = record["option"].shape
        log_probs = state["hidden"].new_full((*shape, ACTION_COUNT), -torch.inf)
        value, hidden = state["hidden"].new_zeros(shape), torch.zeros_like(state["hidden"])
        for task, policy in enumerate(self.hierarchy.policies):
            columns = (option == task).nonzero().flatten()
            if not len(columns):
                continue
            encoder = self.hierarchy.encoders[task % len(self.hierarchy.encoders)]
            inputs = encoder({name: what[:, columns] for name, what in seen.items()})
            if task != NAVIGATE:
                told = option_inputs(record["open"], record["used"])[:, columns]
                inputs = torch.cat([inputs, told], -1)
            own = course.of(columns)
            out, after = own.run(policy.gru, inputs, state["hidden"][columns])
            actions = torch.tensor(ACTIONS_OF[task], device=out.device)
            own_probs = torch.log_softmax(policy.actor(out), -1).to(log_probs.dtype)
            padded = log_probs[:, columns].index_copy(-1, actions, own_probs)
            log_probs = log_probs.index_copy(1, columns, padded)
            value = value.index_copy(1, columns, policy.value(out))
            hidden = hidden.index_copy(0, columns, after)
        return log_probs, value, hidden

    def labels(self, actions: Sequence[int]) -> dict[str, list[int]]:
        """Refuse: experts are cloned into whole agents."""
        raise NotImplementedError("auxiliary tasks have no expert: clone into the hierarchy")

    def optimised(self) -> list[Parameter]:
        """See `Agent`: encoders and policies that have environments, critics too."""
        encoders = self.hierarchy.encoders
        used = [encoders[k] for k in sorted({task % len(encoders) for task in self._trained})]
        parts = [*used, *(self.hierarchy.policies[task] for task in self._trained)]
        return [parameter for part in parts for parameter in part.parameters()]

    def critics(self) -> list[Parameter]:
        """See `Agent`."""
        return [p for k in self._trained for p in self.hierarchy.policies[k].critic.parameters()]


def _row(known: dict[str, Tensor]) -> dict[str, Tensor]:
    return {name: what.unsqueeze(0) for name, what in known.items()}
