"""Flat agents, one policy over all actions: `ppo`, `ppo-intent` (figure 2c).

Shapes: T steps, n environments, A actions (`ACTION_COUNT`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn

from internav_data.camp import networks
from internav_data.camp.agents.protocol import (
    Agent,
    Batch,
    ForwardOutput,
    State,
    StepRecord,
)
from internav_data.camp.config import CampConfig
from internav_data.records.errors import UsageError
from internav_data.world.actions import ACTION_COUNT, ACTIONS, Action


@dataclass(frozen=True, slots=True)
class FlatRecord(StepRecord):
    """Action of a flat policy, and inputs that it worked out besides the observation."""

    action_probs: Tensor | None = None
    """P(a), (…, A)."""
    intent: Tensor | None = None
    """P(i), (…, A), of `ppo-intent`."""
    objects: Tensor | None = None
    """Ids of the nearest objects in sight, (…, K), of `nie`; -1 for none."""
    corners: Tensor | None = None
    """Corners of the boxes round them, (…, K, 8, 3), metres from the eye, of `nie`."""

    def statistics(self) -> dict[str, float]:
        """Return the statistics of a rollout's decisions that are logged; see docs/training.md."""
        if self.action_probs is None:
            return {}
        found = {"done_probability": float(self.action_probs[..., Action.DONE].contiguous().mean())}
        if self.intent is not None:
            found["intent_kl"] = networks.divergence(self.action_probs, self.intent)
        return found


class PPOAgent(Agent[FlatRecord]):
    """Encoder, GRU, actor and critic.

    Parameters
    ----------
    config
        Training config.
    extra
        Number of further inputs of the GRU.
    """

    record_type = FlatRecord

    def __init__(self, config: CampConfig, extra: int = 0) -> None:
        super().__init__()
        self.hidden = config.network.hidden
        self.sensors = networks.observation_sensors(config.network, self.sensors)
        self.encoder = networks.Encoder(config.network, self.sensors, self.sensor_encoders)
        done = config.agent.initial_done_probability
        other = (1.0 - done) / (ACTION_COUNT - 1)
        probabilities = [done if action == Action.DONE else other for action in ACTIONS]
        self.policy = self._policy(self.encoder.size + extra, probabilities)

    def _policy(self, inputs: int, probabilities: list[float]) -> networks.RecurrentActorCritic:
        return networks.RecurrentActorCritic(inputs, self.hidden, probabilities)

    def initial_state(self, count: int) -> State:
        """See `Agent`."""
        weight = self.policy.actor.weight
        return {"hidden": weight.new_zeros(count, self.hidden)}

    def critics(self) -> list[nn.Module]:
        """See `Agent`."""
        return [self.policy.critic]

    def run(self, batch: Batch[Any]) -> ForwardOutput:
        """See `Agent`."""
        return self.decide(self.encoder(batch.observations), batch)

    def decide(self, features: Tensor, batch: Batch[Any], **recorded: Tensor) -> ForwardOutput:
        """Run GRU, actor and critic on features (T, n, …); `recorded` is what the record keeps."""
        out, hidden = batch.segments.run(self.policy.gru, features, batch.state["hidden"])
        log_probs = torch.log_softmax(self.policy.actor(out), -1)
        return ForwardOutput(
            log_probs=log_probs, value=self.policy.critic(out),
            state={**batch.state, "hidden": hidden}, critic_inputs=out,
            recorded={"action_probs": log_probs.detach().exp(), **recorded},
        )  # fmt: skip


class PPOIntentAgent(PPOAgent):
    """`ppo` that takes an intent: the next action of its own copy of some rollouts ago."""

    policy: networks.IntentConditionedPolicy

    def __init__(self, config: CampConfig) -> None:
        super().__init__(config)
        variant = config.agent.intent
        if variant == "policy":
            raise UsageError(
                "agent.intent is 'policy': ppo-intent has one policy, whose intent is an action; "
                "choose 'integrated', 'recursive' or 'none'"
            )
        self.uses_intent = variant != "none"
        self.intent = networks.IntentPolicy(self.policy, recursive=variant == "recursive")

    def _policy(self, inputs: int, probabilities: list[float]) -> networks.RecurrentActorCritic:
        return networks.IntentConditionedPolicy(inputs, self.hidden, probabilities, ACTION_COUNT)

    def initial_state(self, count: int) -> State:
        """See `Agent`."""
        state = super().initial_state(count)
        return {**state, "intent_hidden": torch.zeros_like(state["hidden"])}

    def run(self, batch: Batch[Any]) -> ForwardOutput:
        """See `PPOAgent`."""
        features, hidden = self.encoder(batch.observations), batch.state["intent_hidden"]
        intent = None if batch.record is None else batch.record.intent
        if not self.uses_intent:
            intent = networks.uniform_intent(features, ACTION_COUNT)
        elif intent is None:
            no_mask = features.new_zeros(ACTION_COUNT)
            # With a single policy P(i) is P(omega') itself.
            _, intent, hidden = self.intent(features, hidden, batch.segments, lambda p: p, no_mask)
        recorded = {"intent": intent} if self.uses_intent else {}
        ran = self.decide(self.policy.condition(features, intent), batch, **recorded)
        ran.state["intent_hidden"] = hidden
        return ran

    def synchronise(self) -> None:
        """See `Agent`."""
        self.intent.synchronise(self.policy)
