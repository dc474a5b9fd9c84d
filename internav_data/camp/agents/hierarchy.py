"""`camp` and `hrl`: a global policy chooses Navigate, Push and Pick (section 4 of the paper).

`Hierarchy` is the model itself; `AuxiliaryAgent` trains its action policies one by one in the
auxiliary tasks (section 5.2). Shapes: T steps, n environments.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import torch
from torch import Tensor, nn

from internav_data.camp.agents.options import (
    ACTIONS_OF,
    DONE,
    NAVIGATE,
    OPTION_INPUTS,
    OPTION_NAMES,
    OPTIONS,
    PICK,
    PUSH,
    STOP,
    WAIT,
    HierarchyRecord,
    OptionRecord,
    action_table,
    initial_probabilities,
    option_inputs,
    option_labels,
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
from internav_data.camp.networks import (
    Encoder,
    IntentConditionedPolicy,
    IntentPolicy,
    RecurrentActorCritic,
    drawn,
    entropy_of,
    log_prob_of,
    uniform_intent,
)
from internav_data.world.actions import ACTION_COUNT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from torch.nn import Parameter

    from internav_data.camp.agents.protocol import State
    from internav_data.camp.config import CampConfig
    from internav_data.camp.networks import EpisodeSegments

GLOBAL, INTENT, GRUS = 3, 4, 5
"""Hidden states: those of the three action policies, numbered as options are, then these two."""


class ForwardOutput(NamedTuple):
    """Outputs of all networks over T steps."""

    option_log_probs: Tensor
    """(T, n, 4): log P(omega), equation 5."""
    action_log_probs: Tensor
    """(T, n, 4, 12): log-probabilities of the actions of each option; STOP's is Done."""
    value: Tensor
    """(T, n): the global policy's values."""
    intended_option_probs: Tensor | None
    """(T, n, 4): P(omega'), equation 6; None where the intent was given."""
    intent: Tensor
    """(T, n, 12 or 4): P(i), equation 7."""
    hidden: Tensor
    """(n, 5, hidden): hidden states after the last step."""


class Hierarchy(Agent[HierarchyRecord]):
    """Encoders, three action policies, the global policy, and the intent policy that copies it.

    All five GRUs are stepped at every step, each with its own hidden state, whichever policy acts.

    Parameters
    ----------
    config
        Training config.
    temporally_extended
        False for `hrl`: it decides at every step, Push and Pick have no Done, there is no intent.
    """

    mask: Tensor
    table: Tensor
    tail: Tensor

    def __init__(self, config: CampConfig, *, temporally_extended: bool = True) -> None:
        super().__init__()
        network, agent = config.network, config.agent
        self.hidden, self.temporally_extended = network.hidden, temporally_extended
        variant = agent.intent if temporally_extended else "none"
        self.uses_intent = variant != "none"
        count = 1 if network.shared_encoder else 3
        self.encoders = nn.ModuleList(Encoder(network) for _ in range(count))
        size = Encoder.size_of(network)
        moves, options = initial_probabilities(
            agent.initial_done_probability, agent.initial_interaction_probability
        )
        even = [1.0 / len(ACTIONS_OF[PUSH])] * len(ACTIONS_OF[PUSH])  # their Done ends no episode
        self.navigate = RecurrentActorCritic(size, self.hidden, moves)
        self.push = RecurrentActorCritic(size + OPTION_INPUTS, self.hidden, even)
        self.pick = RecurrentActorCritic(size + OPTION_INPUTS, self.hidden, even)
        self.intends_options = variant == "policy"
        intents = OPTIONS if self.intends_options else ACTION_COUNT
        self.plan = IntentConditionedPolicy(size + OPTION_INPUTS, self.hidden, options, intents)
        if self.uses_intent:
            self.intent = IntentPolicy(self.plan, recursive=variant == "recursive")
        mask = torch.zeros(OPTIONS)
        mask[[PUSH if name == "push" else PICK for name in agent.forbidden]] = -torch.inf
        self.register_buffer("mask", mask, persistent=False)
        self.register_buffer("table", action_table(), persistent=False)
        self.register_buffer("tail", torch.tensor([-torch.inf, 0.0]), persistent=False)

    @property
    def policies(self) -> tuple[RecurrentActorCritic, RecurrentActorCritic, RecurrentActorCritic]:
        """Action policies, numbered as options are."""
        return self.navigate, self.push, self.pick

    def initial_state(self, count: int) -> State:
        """See `Agent`: hidden states, the open interaction (0: none), the actions it has used."""
        weight = self.plan.actor.weight
        idle = torch.zeros(count, dtype=torch.int64, device=weight.device)
        hidden = weight.new_zeros(count, GRUS, self.hidden)
        return {"hidden": hidden, "open": idle, "used": idle.clone()}

    def act(
        self,
        observations: dict[str, Tensor],
        state: State,
        starts: Tensor,
        uniforms: Tensor | None,
    ) -> AgentStep[HierarchyRecord]:
        """See `Agent`."""
        state = reset_where_done(state, starts)
        ran = self.run(*one_step(observations), state, state["open"][None], state["used"][None])
        option_log_probs, action_log_probs = ran.option_log_probs[0], ran.action_log_probs[0]
        first, second = (None, None) if uniforms is None else uniforms.unbind(1)
        decide = state["open"] == 0
        option = torch.where(decide, drawn(option_log_probs, first), state["open"])
        choice = drawn(_of_option(action_log_probs, option), second)
        opened, used, handed_back, forced = option_step(option, choice, state["used"])
        if not self.temporally_extended:
            opened, used, forced = opened * 0, used * 0, forced & False
        option_probs, intended = option_log_probs.exp(), ran.intended_option_probs
        # An episode ends by the global policy's Done, or by Navigate and its Done.
        done = action_log_probs[:, NAVIGATE, DONE].exp()
        ending = (option_probs[:, STOP] + option_probs[:, NAVIGATE] * done) * decide
        record = HierarchyRecord(
            choice, option, state["open"], state["used"], decide, ran.intent[0], forced,
            option_probs, None if intended is None else intended[0], ending,
        )  # fmt: skip
        log_prob = _log_prob(option_log_probs, action_log_probs, record)
        after = {"hidden": ran.hidden, "open": opened, "used": used}
        return AgentStep(
            choice.masked_fill(handed_back, WAIT), log_prob, ran.value[0], record, after
        )

    def value(self, observations: dict[str, Tensor], state: State) -> Tensor:
        """See `Agent`."""
        opened, used = state["open"][None], state["used"][None]
        return self.run(*one_step(observations), state, opened, used).value[0]

    def evaluate(self, batch: Batch[HierarchyRecord]) -> Evaluated:
        """See `Agent`."""
        record = batch.record
        ran = self.run(
            batch.observations, batch.segments, batch.state, record.open, record.used, record.intent
        )
        log_prob = _log_prob(ran.option_log_probs, ran.action_log_probs, record)
        acting = _of_option(ran.action_log_probs, record.option)
        entropy = record.decide * entropy_of(ran.option_log_probs) + entropy_of(acting)
        state = {**batch.state, "hidden": ran.hidden}
        return Evaluated(log_prob, ran.value, entropy, state, ran.intent)

    def run(
        self,
        observations: dict[str, Tensor],
        segments: EpisodeSegments,
        state: State,
        opened: Tensor,
        used: Tensor,
        intent: Tensor | None = None,
    ) -> ForwardOutput:
        """Run all networks over T steps of n environments.

        Parameters
        ----------
        observations, segments, state
            Observations (T, n, …), episode starts, and the memory (n, …) before the first step.
        opened, used : (T, n)
            Open interaction before each step, and the actions it has used.
        intent : (T, n, 12 or 4)
            P(i) as it was recorded; None to compute it.
        """
        views = [encoder(observations) for encoder in self.encoders]  # (T, n, size) each
        told = option_inputs(opened, used)
        inputs = [views[0], *(torch.cat([views[k % len(views)], told], -1) for k in (PUSH, PICK))]
        hidden = list(state["hidden"].unbind(1))
        logits = []
        for k, policy in enumerate(self.policies):
            out, hidden[k] = segments.run(policy.gru, inputs[k], hidden[k])
            may_end = k == NAVIGATE or self.temporally_extended
            logits.append(self._action_log_probs(policy, out, may_end=may_end))
        # (T, n, 16 + 2) -> (T, n, 4, 12): the same twelve actions for each option.
        columns = torch.cat([*logits, self.tail.expand(*told.shape[:2], -1)], -1)
        acts = columns.index_select(-1, self.table).view(*told.shape[:2], OPTIONS, ACTION_COUNT)
        features, intended = torch.cat([views[0], told], -1), None
        if not self.uses_intent:
            intent = uniform_intent(features, self.plan.embed.in_features)
        elif intent is None:
            intended, intent, hidden[INTENT] = self.intent(
                features, hidden[INTENT], segments, lambda p: self.mixed(p, acts), self.mask
            )
        conditioned = self.plan.condition(features, intent)
        out, hidden[GLOBAL] = segments.run(self.plan.gru, conditioned, hidden[GLOBAL])
        option_log_probs = torch.log_softmax(self.plan.actor(out) + self.mask, -1)
        value, after = self.plan.value(out), torch.stack(hidden, 1)
        return ForwardOutput(option_log_probs, acts, value, intended, intent, after)

    def mixed(self, intended: Tensor, action_log_probs: Tensor) -> Tensor:
        """Return P(i), (T, n, 12), equation 7: the policies' actions, weighted by P(omega').

        Rotations of Navigate and Pick add; so do the four Dones. Of `--intent policy` it is
        P(omega') itself, (T, n, 4).
        """
        if self.intends_options:
            return intended
        return (intended.unsqueeze(-1) * action_log_probs.exp()).sum(-2)

    def _action_log_probs(
        self, policy: RecurrentActorCritic, out: Tensor, *, may_end: bool
    ) -> Tensor:
        logits: Tensor = policy.actor(out)
        if not may_end:
            logits = torch.cat([logits[..., :-1], self.tail[:1].expand(*out.shape[:2], 1)], -1)
        return torch.log_softmax(logits, -1)

    def labels(self, actions: Sequence[int]) -> tuple[list[int], HierarchyRecord]:
        """See `Agent`."""
        return option_labels(actions, temporally_extended=self.temporally_extended)

    def optimised(self) -> list[Parameter]:
        """See `Agent`: neither the intent policy nor the critics of the policies' pretraining."""
        parts = (self.encoders, self.plan, *(q for p in self.policies for q in (p.gru, p.actor)))
        return [parameter for part in parts for parameter in part.parameters()]

    def critics(self) -> list[Parameter]:
        """See `Agent`."""
        return list(self.plan.critic.parameters())

    def synchronise(self) -> None:
        """See `Agent`."""
        if hasattr(self, "intent"):
            self.intent.synchronise(self.plan)


class AuxiliaryAgent(Agent[OptionRecord]):
    """Action policies of a hierarchy, one in each environment, with critics of their own.

    Done ends the task. The policies' inputs on the open option are those of the whole model: none
    at the first action, then that it is open and for how long; after 11 actions it opens anew.

    Parameters
    ----------
    hierarchy
        Model whose policies are trained.
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
        self._option = torch.tensor([number[task] for task in tasks], device=hierarchy.device)
        self._trained = sorted({number[task] for task in (trained or tasks)})

    def initial_state(self, count: int) -> State:
        """See `Agent`: one hidden state an environment."""
        state = self.hierarchy.initial_state(count)
        return {**state, "hidden": state["hidden"][:, 0]}

    def act(
        self,
        observations: dict[str, Tensor],
        state: State,
        starts: Tensor,
        uniforms: Tensor | None,
    ) -> AgentStep[OptionRecord]:
        """See `Agent`."""
        state = reset_where_done(state, starts)
        option, opened, used = self._option, state["open"], state["used"]
        log_probs, value, hidden = self.run(
            *one_step(observations), state, opened[None], used[None]
        )
        choice = drawn(log_probs[0], None if uniforms is None else uniforms[:, 1])
        record = OptionRecord(choice, option, opened, used)
        opened, used, _, _ = option_step(option, choice, used)
        if not self.hierarchy.temporally_extended:  # `hrl` has no such inputs later either
            opened, used = opened * 0, used * 0
        after = {"hidden": hidden, "open": opened, "used": used}
        return AgentStep(choice, log_prob_of(log_probs[0], choice), value[0], record, after)

    def value(self, observations: dict[str, Tensor], state: State) -> Tensor:
        """See `Agent`; of all environments, in their order."""
        opened, used = state["open"][None], state["used"][None]
        return self.run(*one_step(observations), state, opened, used)[1][0]

    def evaluate(self, batch: Batch[OptionRecord]) -> Evaluated:
        """See `Agent`."""
        record = batch.record
        log_probs, value, hidden = self.run(
            batch.observations, batch.segments, batch.state, record.open, record.used,
            record.option[0],
        )  # fmt: skip
        log_prob, state = log_prob_of(log_probs, record.choice), {**batch.state, "hidden": hidden}
        return Evaluated(log_prob, value, entropy_of(log_probs), state)

    def run(
        self,
        observations: dict[str, Tensor],
        segments: EpisodeSegments,
        state: State,
        opened: Tensor,
        used: Tensor,
        option: Tensor | None = None,
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Run each policy over its own environments, `option` (n,), all of them by default.

        Returns
        -------
        log_probs : (T, n, 12)
            Log-probabilities of the actions.
        value : (T, n)
            Values by the policies' own critics.
        hidden : (n, hidden)
            Hidden states after the last step.
        """
        option = self._option if option is None else option
        log_probs = state["hidden"].new_full((*opened.shape, ACTION_COUNT), -torch.inf)
        value, hidden = state["hidden"].new_zeros(opened.shape), torch.zeros_like(state["hidden"])
        for task, policy in enumerate(self.hierarchy.policies):
            columns = (option == task).nonzero().flatten()
            if not len(columns):
                continue
            encoder = self.hierarchy.encoders[task % len(self.hierarchy.encoders)]
            inputs = encoder({name: values[:, columns] for name, values in observations.items()})
            if task != NAVIGATE:
                inputs = torch.cat([inputs, option_inputs(opened, used)[:, columns]], -1)
            own = segments.select(columns)
            out, after = own.run(policy.gru, inputs, state["hidden"][columns])
            actions = torch.tensor(ACTIONS_OF[task], device=out.device)
            own_log_probs = torch.log_softmax(policy.actor(out), -1).to(log_probs.dtype)
            padded = log_probs[:, columns].index_copy(-1, actions, own_log_probs)
            log_probs = log_probs.index_copy(1, columns, padded)
            value = value.index_copy(1, columns, policy.value(out))
            hidden = hidden.index_copy(0, columns, after)
        return log_probs, value, hidden

    def labels(self, actions: Sequence[int]) -> tuple[list[int], OptionRecord]:
        """Refuse: experts are cloned into whole agents.

        Raises
        ------
        NotImplementedError
            Always.
        """
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


def _of_option(action_log_probs: Tensor, option: Tensor) -> Tensor:
    """Return the log-probabilities (…, 12) of the option that acts, of (…, 4, 12)."""
    index = option[..., None, None].expand(*option.shape, 1, ACTION_COUNT)
    return action_log_probs.gather(-2, index).squeeze(-2)


def _log_prob(
    option_log_probs: Tensor, action_log_probs: Tensor, record: HierarchyRecord
) -> Tensor:
    """Return decide * log pi_Omega(omega) + log pi_omega(a); the second is 0 for omega = Done."""
    decided = log_prob_of(option_log_probs, record.option)
    acted = log_prob_of(_of_option(action_log_probs, record.option), record.choice)
    return torch.where(record.decide, decided, 0.0) + acted
