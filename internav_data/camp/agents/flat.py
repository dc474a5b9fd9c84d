"""One policy over the twelve actions: `ppo`, `ppo-intent` (figure 2c), and chance."""

from __future__ import annotations

import copy
import math
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from internav_data.camp.agents.intent import IntentConditionedPolicy, IntentPolicy, uniform_intent
from internav_data.camp.agents.options import DONE
from internav_data.camp.agents.protocol import (
    Agent,
    AgentStep,
    Batch,
    Evaluated,
    one_step,
    reset_where_done,
)
from internav_data.camp.networks import Encoder, RecurrentActorCritic, drawn, entropy_of
from internav_data.records.errors import UsageError
from internav_data.world.actions import ACTION_COUNT

if TYPE_CHECKING:
    from typing import Self

    from torch.nn import Parameter

    from internav_data.camp.agents.protocol import State
    from internav_data.camp.config import CampConfig
    from internav_data.camp.networks import EpisodeSegments


def start_chances(end_chance: float) -> list[float]:
    """Return the chances of the twelve actions at the start: Done, last, ends the episode."""
    rest = (1.0 - end_chance) / (ACTION_COUNT - 1)
    return [rest] * (ACTION_COUNT - 1) + [end_chance]


class PPOAgent(Agent):
    """Encoder, GRU, actor, critic.

    Parameters
    ----------
    config
        Of the run.
    extra
        Further inputs of the GRU.
    """

    def __init__(self, config: CampConfig, extra: int = 0) -> None:
        super().__init__()
        self.hidden = config.network.hidden
        self.encoder = Encoder(config.network)
        self.policy = self._policy(
            self.encoder.size + extra, start_chances(config.agent.initial_done_probability)
        )

    def _policy(self, inputs: int, chances: list[float]) -> RecurrentActorCritic:
        return RecurrentActorCritic(inputs, self.hidden, chances)

    def initial_state(self, count: int) -> State:
        """See `Agent`."""
        weight = self.policy.actor.weight
        return {"hidden": weight.new_zeros(count, self.hidden)}

    def act(
        self, seen: dict[str, Tensor], state: State, starts: Tensor, uniforms: Tensor | None
    ) -> AgentStep:
        """See `Agent`."""
        state = reset_where_done(state, starts)
        out, state, record = self.run(*one_step(seen), state, {})
        log_probs = torch.log_softmax(self.policy.actor(out[0]), -1)
        choice = drawn(log_probs, None if uniforms is None else uniforms[:, 1])
        probs = log_probs.exp()
        record = {name: noted[0] for name, noted in record.items()}
        record |= {"choice": choice, "action_probs": probs, "done_probability": probs[:, DONE]}
        return AgentStep(
            choice,
            log_probs.gather(-1, choice.unsqueeze(-1)).squeeze(-1),
            self.policy.value(out[0]),
            record,
            state,
        )

    def value(self, seen: dict[str, Tensor], state: State) -> Tensor:
        """See `Agent`."""
        out, _, _ = self.run(*one_step(seen), state, {})
        return self.policy.value(out[0])

    def evaluate(self, batch: Batch) -> Evaluated:
        """See `Agent`."""
        out, state, record = self.run(batch.observations, batch.course, batch.state, batch.record)
        log_probs = torch.log_softmax(self.policy.actor(out), -1)
        chosen = log_probs.gather(-1, batch.record["choice"].unsqueeze(-1)).squeeze(-1)
        value, entropy = self.policy.value(out), entropy_of(log_probs)
        return Evaluated(chosen, value, entropy, state, record.get("intent"))

    def critics(self) -> list[Parameter]:
        """See `Agent`."""
        return list(self.policy.critic.parameters())

    def run(
        self,
        seen: dict[str, Tensor],
        course: EpisodeSegments,
        state: State,
        record: dict[str, Tensor],
    ) -> tuple[Tensor, State, dict[str, Tensor]]:
        """Return the GRU's outputs (T, n, hidden), the state after them, and what to record.

        `record` is what was recorded of these steps when they were taken; empty for new ones.
        """
        out, hidden = course.run(self.policy.gru, self.features(seen, record), state["hidden"])
        return out, {"hidden": hidden}, {}

    def features(self, seen: dict[str, Tensor], record: dict[str, Tensor]) -> Tensor:  # noqa: ARG002
        """Return what the GRU is fed, (T, n, inputs)."""
        features: Tensor = self.encoder(seen)
        return features


class PPOIntentAgent(PPOAgent):
    """The same, told what its own copy of some rollouts ago is about to do."""

    policy: IntentConditionedPolicy

    def __init__(self, config: CampConfig) -> None:
        super().__init__(config)
        variant = config.agent.intent
        if variant == "policy":
            raise UsageError(
                "agent.intent is 'policy': ppo-intent has one policy, whose intent is an action; "
                "choose 'integrated', 'recursive' or 'none'"
            )
        self.told = variant != "none"
        self.intent = IntentPolicy(self.policy, recursive=variant == "recursive")

    def _policy(self, inputs: int, chances: list[float]) -> RecurrentActorCritic:
        return IntentConditionedPolicy(inputs, self.hidden, chances, ACTION_COUNT)

    def initial_state(self, count: int) -> State:
        """See `Agent`."""
        state = super().initial_state(count)
        return {**state, "meaning": torch.zeros_like(state["hidden"])}

    def run(
        self,
        seen: dict[str, Tensor],
        course: EpisodeSegments,
        state: State,
        record: dict[str, Tensor],
    ) -> tuple[Tensor, State, dict[str, Tensor]]:
        """See `PPOAgent`."""
        features, intent = self.features(seen, record), record.get("intent")
        after, noted = {}, {}
        if not self.told:
            intent = uniform_intent(features, ACTION_COUNT)
            after["meaning"] = state["meaning"]
        elif intent is None:
            _, intent, after["meaning"] = self.intent(
                features, state["meaning"], course, _itself, features.new_zeros(ACTION_COUNT)
            )
            noted["intent"] = intent
        told = self.policy.told(features, intent)
        out, after["hidden"] = course.run(self.policy.gru, told, state["hidden"])
        return out, after, noted

    def synchronise(self) -> None:
        """See `Agent`."""
        self.intent.synchronise(self.policy)

    def without_intent(self) -> Self:
        """Return the same networks fed the plane vector."""
        other = copy.copy(self)
        other.told = False
        return other


class RandomAgent(Agent):
    """Takes each action with the same chance."""

    def __init__(self, config: CampConfig) -> None:  # noqa: ARG002 - as all agents are made
        super().__init__()

    def initial_state(self, count: int) -> State:  # noqa: ARG002
        """See `Agent`."""
        return {}

    def act(
        self,
        seen: dict[str, Tensor],
        state: State,
        starts: Tensor,  # noqa: ARG002 - it remembers nothing
        uniforms: Tensor | None,
    ) -> AgentStep:
        """See `Agent`; even the most probable action has to be drawn: it is the first."""
        flat = torch.full((len(seen["goal"]), ACTION_COUNT), -math.log(ACTION_COUNT))
        flat = flat.to(seen["goal"].device)
        choice = drawn(flat, None if uniforms is None else uniforms[:, 1])
        return AgentStep(
            choice, flat[:, 0], torch.zeros_like(flat[:, 0]), {"choice": choice}, state
        )

    def value(self, seen: dict[str, Tensor], state: State) -> Tensor:  # noqa: ARG002
        """See `Agent`."""
        return torch.zeros(len(seen["goal"]), device=seen["goal"].device)

    def evaluate(self, batch: Batch) -> Evaluated:
        """See `Agent`."""
        nothing = torch.zeros(batch.starts.shape, device=batch.starts.device)
        log = math.log(ACTION_COUNT)
        return Evaluated(nothing - log, nothing, nothing + log, batch.state)


def _itself(meant: Tensor) -> Tensor:
    return meant
