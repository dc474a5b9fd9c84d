"""`camp` and `hrl`: a global policy that plans Navigate, Push and Pick (section 4)."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, NamedTuple

import torch
from torch import Tensor, nn

from internav_data.camp.agents.intent import IntentConditionedPolicy, IntentPolicy, uniform_intent
from internav_data.camp.agents.options import (
    ACTIONS_OF,
    DONE,
    NAVIGATE,
    OPTION_INPUTS,
    OPTIONS,
    PICK,
    PUSH,
    STOP,
    WAIT,
    action_table,
    follow,
    option_inputs,
    option_step,
    start_chances,
)
from internav_data.camp.agents.protocol import (
    Agent,
    AgentStep,
    Batch,
    Evaluated,
    one_step,
    reset_where_done,
)
from internav_data.camp.networks import Encoder, RecurrentActorCritic, drawn, entropy_of
from internav_data.world.actions import ACTION_COUNT

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Self

    from torch.nn import Parameter

    from internav_data.camp.agents.protocol import State
    from internav_data.camp.config import CampConfig
    from internav_data.camp.networks import EpisodeSegments

GLOBAL, INTENT, GRUS = 3, 4, 5
"""Hidden states: those of the three action policies, numbered as options are, then these."""


class ForwardOutput(NamedTuple):
    """What the networks say of some steps."""

    plan: Tensor
    """(T, n, 4): log-probabilities of options (equation 5)."""
    acts: Tensor
    """(T, n, 4, 12): of actions, by option; Done's is Done."""
    value: Tensor
    """(T, n): by global's critic."""
    meant: Tensor | None
    """(T, n, 4): P(omega') (equation 6), where it was worked out."""
    intent: Tensor
    """(T, n, 12 or 4): P(i) (equation 7)."""
    hidden: Tensor
    """(n, 5, hidden): after the last step."""


class Hierarchy(Agent):
    """Encoders, three action policies, global, and the intent policy that copies global.

    Five GRUs are stepped at every step, each with its own hidden state, whoever acts.

    Parameters
    ----------
    config
        Of the run.
    keeps
        False for `hrl`: it decides at every step, Push and Pick have no Done, there is no intent.
    """

    mask: Tensor
    table: Tensor
    tail: Tensor

    def __init__(self, config: CampConfig, *, keeps: bool = True) -> None:
        super().__init__()
        network, told = config.network, config.agent
        self.hidden, self.keeps = network.hidden, keeps
        variant = told.intent if keeps else "none"
        self.told = variant != "none"
        count = 1 if network.shared_encoder else 3
        self.encoders = nn.ModuleList(Encoder(network) for _ in range(count))
        size = Encoder.size_of(network)
        moves, options = start_chances(
            told.initial_done_probability, told.initial_interaction_probability
        )
        even = [1.0 / len(ACTIONS_OF[PUSH])] * len(ACTIONS_OF[PUSH])  # hand-backs end nothing
        self.navigate = RecurrentActorCritic(size, self.hidden, moves)
        self.push = RecurrentActorCritic(size + OPTION_INPUTS, self.hidden, even)
        self.pick = RecurrentActorCritic(size + OPTION_INPUTS, self.hidden, even)
        self.by_policy = variant == "policy"
        intents = OPTIONS if self.by_policy else ACTION_COUNT
        self.plan = IntentConditionedPolicy(size + OPTION_INPUTS, self.hidden, options, intents)
        if self.told:
            self.intent = IntentPolicy(self.plan, recursive=variant == "recursive")
        mask = torch.zeros(OPTIONS)
        mask[[PUSH if name == "push" else PICK for name in told.forbidden]] = -torch.inf
        self.register_buffer("mask", mask, persistent=False)
        self.register_buffer("table", action_table(), persistent=False)
        self.register_buffer("tail", torch.tensor([-torch.inf, 0.0]), persistent=False)

    @property
    def policies(self) -> tuple[RecurrentActorCritic, RecurrentActorCritic, RecurrentActorCritic]:
        """The action policies, numbered as options are."""
        return self.navigate, self.push, self.pick

    def initial_state(self, count: int) -> State:
        """See `Agent`: hidden states, the open option (0: none), and how many actions it took."""
        weight = self.plan.actor.weight
        idle = torch.zeros(count, dtype=torch.int64, device=weight.device)
        hidden = weight.new_zeros(count, GRUS, self.hidden)
        return {"hidden": hidden, "open": idle, "used": idle.clone()}

    def act(
        self, seen: dict[str, Tensor], state: State, starts: Tensor, uniforms: Tensor | None
    ) -> AgentStep:
        """See `Agent`."""
        state = reset_where_done(state, starts)
        first, second = (None, None) if uniforms is None else uniforms.unbind(1)
        ran = self.run(*one_step(seen), state, {key: state[key][None] for key in ("open", "used")})
        plan, acts = ran.plan[0], ran.acts[0]
        decide = state["open"] == 0
        option = torch.where(decide, drawn(plan, first), state["open"])
        choice = drawn(_of_option(acts, option), second)
        record = {"choice": choice, "option": option, "decide": decide}
        record |= {"open": state["open"], "used": state["used"], "intent": ran.intent[0]}
        log_prob = _log_prob(plan, acts, record)
        opened, used, handed, forced = option_step(option, choice, state["used"])
        if not self.keeps:
            opened, used, forced = opened * 0, used * 0, forced & False
        # For logs alone: what is planned, what was meant, and the chance that this ends it all.
        ending = (plan[:, STOP].exp() + plan[:, NAVIGATE].exp() * acts[:, 0, DONE].exp()) * decide
        record |= {"forced": forced, "plan": plan.exp(), "done_probability": ending}
        if ran.meant is not None:
            record["meant"] = ran.meant[0]
        after = {"hidden": ran.hidden, "open": opened, "used": used}
        return AgentStep(choice.masked_fill(handed, WAIT), log_prob, ran.value[0], record, after)

    def value(self, seen: dict[str, Tensor], state: State) -> Tensor:
        """See `Agent`."""
        known = {key: state[key][None] for key in ("open", "used")}
        return self.run(*one_step(seen), state, known).value[0]

    def evaluate(self, batch: Batch) -> Evaluated:
        """See `Agent`."""
        ran = self.run(batch.observations, batch.course, batch.state, batch.record)
        record = batch.record
        of_option = _of_option(ran.acts, record["option"])
        entropy = record["decide"] * entropy_of(ran.plan) + entropy_of(of_option)
        log_prob = _log_prob(ran.plan, ran.acts, record)
        after = {**batch.state, "hidden": ran.hidden}
        return Evaluated(log_prob, ran.value, entropy, after, ran.intent)

    def run(
        self,
        seen: dict[str, Tensor],
        course: EpisodeSegments,
        state: State,
        record: dict[str, Tensor],
    ) -> ForwardOutput:
        """Run all networks over some steps.

        Parameters
        ----------
        seen, course, state
            Of T steps of n environments.
        record
            "open" and "used" before each step, (T, n); "intent", if it is to be read back.
        """
        views = [encoder(seen) for encoder in self.encoders]
        told = option_inputs(record["open"], record["used"])
        inputs = [views[0], *(torch.cat([views[k % len(views)], told], -1) for k in (PUSH, PICK))]
        hidden = list(state["hidden"].unbind(1))
        logits = []
        for k, policy in enumerate(self.policies):
            out, hidden[k] = course.run(policy.gru, inputs[k], hidden[k])
            logits.append(self._log_probs(policy, out, hands_back=k == NAVIGATE or self.keeps))
        acts = torch.cat([*logits, self.tail.expand(*told.shape[:2], -1)], -1)
        acts = acts.index_select(-1, self.table).reshape(*told.shape[:2], OPTIONS, ACTION_COUNT)
        features, meant = torch.cat([views[0], told], -1), None
        intent = record.get("intent")
        if not self.told:
            intent = uniform_intent(features, self.plan.embed.in_features)
        elif intent is None:
            meant, intent, hidden[INTENT] = self.intent(
                features, hidden[INTENT], course, lambda p: self.mixed(p, acts), self.mask
            )
        out, hidden[GLOBAL] = course.run(
            self.plan.gru, self.plan.told(features, intent), hidden[GLOBAL]
        )
        plan = torch.log_softmax(self.plan.actor(out) + self.mask, -1)
        value = self.plan.value(out)
        return ForwardOutput(plan, acts, value, meant, intent, torch.stack(hidden, 1))

    def mixed(self, meant: Tensor, acts: Tensor) -> Tensor:
        """Return P(i) of P(omega') and the policies' log-probabilities: equation 7.

        Rotations of Navigate and Pick add; so do the four Dones.
        """
        return meant if self.by_policy else (meant.unsqueeze(-1) * acts.exp()).sum(-2)

    def _log_probs(self, policy: RecurrentActorCritic, out: Tensor, *, hands_back: bool) -> Tensor:
        logits: Tensor = policy.actor(out)
        if not hands_back:
            logits = torch.cat([logits[..., :-1], self.tail[:1].expand(*out.shape[:2], 1)], -1)
        return torch.log_softmax(logits, -1)

    def labels(self, actions: Sequence[int]) -> dict[str, list[int]]:
        """See `Agent`."""
        return follow(actions, keeps=self.keeps)

    def optimised(self) -> list[Parameter]:
        """See `Agent`: not the intent policy, nor the critics of the policies' pretraining."""
        parts = (self.encoders, self.plan, *(q for p in self.policies for q in (p.gru, p.actor)))
        return [parameter for part in parts for parameter in part.parameters()]

    def critics(self) -> list[Parameter]:
        """See `Agent`."""
        return list(self.plan.critic.parameters())

    def synchronise(self) -> None:
        """See `Agent`."""
        if hasattr(self, "intent"):
            self.intent.synchronise(self.plan)

    def without_intent(self) -> Self:
        """Return the same networks fed the plane vector (Table 4's test without intent)."""
        other = copy.copy(self)
        other.told = False
        return other


def _of_option(acts: Tensor, option: Tensor) -> Tensor:
    """Return the log-probabilities (…, 12) of the option that acts, of (…, 4, 12)."""
    index = option[..., None, None].expand(*option.shape, 1, ACTION_COUNT)
    return acts.gather(-2, index).squeeze(-2)


def _log_prob(plan: Tensor, acts: Tensor, record: dict[str, Tensor]) -> Tensor:
    """Return decide * log pi_Omega(omega) + log pi_omega(a); the second is 0 for omega = Done."""
    option, choice = record["option"].unsqueeze(-1), record["choice"].unsqueeze(-1)
    planned = plan.gather(-1, option).squeeze(-1)
    done = _of_option(acts, record["option"]).gather(-1, choice).squeeze(-1)
    return torch.where(record["decide"].bool(), planned, 0.0) + done
