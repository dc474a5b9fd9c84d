"""Flat agents, one policy over all actions: `ppo`, `ppo-intent` (figure 2c).

Shapes: T steps, n environments, A actions (`ACTION_COUNT`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn

from internav_data.camp import networks
from internav_data.camp.agents.protocol import (
    AgentStep,
    Batch,
    Evaluated,
    RecurrentAgent,
    State,
    StepRecord,
    Uniforms,
)
from internav_data.camp.config import CampConfig
from internav_data.records.errors import UsageError
from internav_data.world.actions import ACTION_COUNT, ACTIONS, Action


@dataclass(frozen=True, slots=True)
class FlatRecord(StepRecord):
    """Action of a flat policy, and inputs that it worked out besides the observation."""

    action_probs: Tensor | None = None
    """P(a), (…, A)."""
    done_probability: Tensor | None = None
    """Probability that the step ends the episode."""
    intent: Tensor | None = None
    """P(i), (…, A), of `ppo-intent`."""
    objects: Tensor | None = None
    """Ids of the nearest objects in sight, (…, K), of `nie`; -1 for none."""
    corners: Tensor | None = None
    """Corners of the boxes round them, (…, K, 8, 3), metres from the eye, of `nie`."""

    def statistics(self) -> dict[str, float]:
        """Return the statistics of a rollout's decisions that are logged; see docs/training.md."""
        found = {}
        if self.done_probability is not None:
            found["done_probability"] = float(self.done_probability.mean())
        if self.action_probs is not None and self.intent is not None:
            found["intent_kl"] = networks.divergence(self.action_probs, self.intent)
        return found


class FlatOutput(NamedTuple):
    """Outputs of the networks over T steps."""

    log_probs: Tensor
    """(T, n, A): log P(a)."""
    value: Tensor
    """(T, n): the critic's values."""
    out: Tensor
    """(T, n, hidden): outputs of the GRU, from which actions and values come."""
    state: State
    """(n, …): memory after the last step."""
    inputs: dict[str, Tensor]
    """(T, n, …): fields of `FlatRecord` that the networks worked out besides the observation."""


class PPOAgent(RecurrentAgent[FlatRecord]):
    """Encoder, GRU, actor and critic.

    Parameters
    ----------
    config
        Training config.
    extra
        Number of further inputs of the GRU.
    """

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

    def step(self, batch: Batch[Any], uniforms: Uniforms) -> AgentStep[FlatRecord]:
        """See `Agent`."""
        ran = self.run(batch)
        log_probs = ran.log_probs[0]
        choice = networks.drawn(log_probs, uniforms[1])
        probs = log_probs.exp()
        inputs = {name: values[0] for name, values in ran.inputs.items()}
        record = FlatRecord(choice, probs, probs[:, Action.DONE], **inputs)
        log_prob = networks.log_prob_of(log_probs, choice)
        return AgentStep(choice, log_prob, ran.value[0], record, ran.state)

    def evaluate(self, batch: Batch[FlatRecord]) -> Evaluated:
        """See `Agent`."""
        ran = self.run(batch)
        log_prob = networks.log_prob_of(ran.log_probs, batch.record.choice)
        entropy = networks.entropy_of(ran.log_probs)
        return Evaluated(log_prob, ran.value, entropy, ran.state, critic_inputs=ran.out)

    def labels(self, actions: Sequence[int]) -> tuple[list[int], FlatRecord]:
        """See `Agent`."""
        return list(actions), FlatRecord(torch.tensor(actions))

    def critics(self) -> list[nn.Module]:
        """See `Agent`."""
        return [self.policy.critic]

    def run(self, batch: Batch[Any]) -> FlatOutput:
        """Run the networks over T steps of n environments; the record of new ones is None."""
        return self.decide(self.encoder(batch.observations), batch)

    def decide(self, features: Tensor, batch: Batch[Any], **inputs: Tensor) -> FlatOutput:
        """Run GRU, actor and critic on features (T, n, …); `inputs` are those to be recorded."""
        out, hidden = batch.segments.run(self.policy.gru, features, batch.state["hidden"])
        log_probs = torch.log_softmax(self.policy.actor(out), -1)
        state = {**batch.state, "hidden": hidden}
        return FlatOutput(log_probs, self.policy.value(out), out, state, inputs)


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

    def run(self, batch: Batch[Any]) -> FlatOutput:
        """See `PPOAgent`."""
        features, hidden = self.encoder(batch.observations), batch.state["intent_hidden"]
        intent = None if batch.record is None else batch.record.intent
        if not self.uses_intent:
            intent = networks.uniform_intent(features, ACTION_COUNT)
        elif intent is None:
            no_mask = features.new_zeros(ACTION_COUNT)
            # With a single policy P(i) is P(omega') itself.
            _, intent, hidden = self.intent(features, hidden, batch.segments, lambda p: p, no_mask)
        inputs = {"intent": intent} if self.uses_intent else {}
        ran = self.decide(self.policy.condition(features, intent), batch, **inputs)
        return ran._replace(state={**ran.state, "intent_hidden": hidden})

    def synchronise(self) -> None:
        """See `Agent`."""
        self.intent.synchronise(self.policy)
