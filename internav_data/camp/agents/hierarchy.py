"""`camp` and `hrl`: a global policy chooses the options Navigate, Push and Pick (section 4).

`Hierarchy` is the model itself; `AuxiliaryAgent` trains its action policies one by one in the
auxiliary tasks (section 5.2). Shapes: T steps, n environments, A actions (`ACTION_COUNT`).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

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
from internav_data.camp.config import INTERACTION_ACTIONS, CampConfig
from internav_data.records.errors import UsageError
from internav_data.world.actions import ACTION_COUNT, Action, OptionName, actions_of_option

NAVIGATE, PUSH, PICK, STOP = range(4)
"""Options in the order of the global policy's logits. STOP executes Done. (0 in a state: no
interaction is open.)"""
OPTION_NAMES: Final[tuple[OptionName, ...]] = ("navigate", "push", "pick", "done")
"""Options by number."""
OPTIONS: Final = len(OPTION_NAMES)
OPTION_INPUTS: Final = 3
"""Number of inputs that tell of the open option; see `option_inputs`."""
DONE: Final = int(Action.DONE)
WAIT: Final = int(Action.WAIT)
"""Action of the step at which an interaction hands control back."""
ACTIONS_OF: Final[tuple[tuple[int, ...], ...]] = tuple(
    tuple(int(action) for action in actions_of_option(option)) for option in OPTION_NAMES[:STOP]
)
"""Actions of the three policies (table 1), in the order of their logits; Done is the last."""


def _letters(actions: Iterable[int]) -> str:
    """Return one letter for each action, so that regular expressions find runs of them."""
    return "".join(chr(ord("a") + action) for action in actions)


def _run_of(option: OptionName) -> str:
    """Return the pattern of an option's runs: own actions, borrowed ones only in between."""
    taken = [action for action in actions_of_option(option) if action != Action.DONE]
    own = _letters(action for action in taken if action.options[0] == option)
    return f"[{own}](?:[{_letters(taken)}]*[{own}])?"


_RUNS: Final = re.compile(f"(?P<push>{_run_of('push')})|(?P<pick>{_run_of('pick')})|(?P<else>.)")
"""Runs of pushes; of pickups, drops and the turns between them; anything else."""


@dataclass(frozen=True, slots=True)
class OptionRecord(StepRecord):
    """Action of an option, and the option's state before it."""

    option: Tensor
    """Option that acts, int64."""
    open: Tensor
    """Interaction that was open before the step; 0 for none, int64."""
    used: Tensor
    """Actions that the open interaction has taken, int64."""


@dataclass(frozen=True, slots=True)
class HierarchyRecord(OptionRecord):
    """Decision of the global policy and action of the option; the later fields are for logs."""

    decide: Tensor
    """Whether the global policy decided, bool."""
    intent: Tensor | None = None
    """P(i), (…, A or 4): equation 7."""
    forced: Tensor | None = None
    """Whether the interaction was closed by its 11th action, bool."""
    option_probs: Tensor | None = None
    """P(omega), (…, 4): equation 5."""
    intended_option_probs: Tensor | None = None
    """P(omega'), (…, 4): equation 6."""
    done_probability: Tensor | None = None
    """Probability that the step ends the episode."""

    def statistics(self) -> dict[str, float]:
        """Return the statistics of a rollout's decisions that are logged; see docs/training.md."""
        decide, found = self.decide, {}
        for number, name in enumerate(OPTION_NAMES):
            found[f"share_{name}"] = float((self.option == number).float().mean())
        found["done_probability"] = 0.0
        if self.done_probability is not None and decide.any():
            found["done_probability"] = float(self.done_probability[decide].mean())
        interacting = (self.option == PUSH) | (self.option == PICK)
        found["interactions"] = opened = int((interacting & decide).sum())
        if opened:
            found["interaction_length"] = float(interacting.sum()) / opened
        forced = 0 if self.forced is None else int(self.forced.sum())
        ended = forced + int((interacting & (self.choice == DONE)).sum())
        if ended:
            found["forced_share"] = forced / ended
        chosen, intended = self.option_probs, self.intended_option_probs
        if chosen is not None and intended is not None and decide.any():
            found["intent_kl"] = networks.divergence(chosen[decide], intended[decide])
        return found


def initial_probabilities(end: float, interact: float) -> tuple[list[float], list[float]]:
    """Return the initial probabilities of Navigate's actions and of the options.

    Done by the global policy and Done by Navigate end an episode with probability `end` together,
    half each; the other options are as 1 - 2 interact - end : interact : interact
    (.9 : .045 : .045).
    """
    weights = [1.0 - 2.0 * interact - end, interact, interact]
    options = [(1.0 - end / 2.0) * weight / sum(weights) for weight in weights]
    done = end / 2.0 / options[NAVIGATE]
    moves = len(ACTIONS_OF[NAVIGATE]) - 1
    return [(1.0 - done) / moves] * moves + [done], [*options, end / 2.0]


def action_log_probs_of(option: int, logits: Tensor, *, may_end: bool = True) -> Tensor:
    """Return log-probabilities (T, n, A) of all actions from an option's logits (T, n, k).

    The last of its k actions is Done; if it may not end, Done has no probability.
    """
    if not may_end:
        logits = torch.cat([logits[..., :-1], torch.full_like(logits[..., -1:], -torch.inf)], -1)
    actions = torch.tensor(ACTIONS_OF[option], device=logits.device)
    blank = logits.new_full((*logits.shape[:2], ACTION_COUNT), -torch.inf)
    return blank.index_copy(-1, actions, torch.log_softmax(logits, -1))


def option_inputs(opened: Tensor, used: Tensor) -> Tensor:
    """Return inputs on the open option, (…, 3): Push open, Pick open, actions used / 11.

    The global, intent, Push and Pick policies take them.
    """
    parts = (opened == PUSH, opened == PICK, used / INTERACTION_ACTIONS)
    return torch.stack([part.to(torch.float32) for part in parts], -1)


def option_step(
    option: Tensor, choice: Tensor, used: Tensor
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Return the option state after an action; all (n,).

    Done of Push or Pick hands control back, even as the first action; after its 11th action an
    interaction closes.

    Returns
    -------
    open, used
        Open interaction (0 for none) and the actions that it has used.
    handed_back, forced
        Whether the interaction was closed by its Done, or by its 11th action.
    """
    interacting = (option == PUSH) | (option == PICK)
    handed_back = interacting & (choice == DONE)
    spent = used + 1
    forced = interacting & ~handed_back & (spent >= INTERACTION_ACTIONS)
    still = (interacting & ~handed_back & ~forced).to(option.dtype)
    return option * still, spent * still, handed_back, forced


def option_labels(
    actions: Sequence[int], *, temporally_extended: bool
) -> tuple[list[int], HierarchyRecord]:
    """Return an expert's actions as options take them, for cloning.

    A maximal run of pushes is Push; pickups, drops and the rotations between them are Pick; Done is
    the global policy's; the rest is Navigate. Temporally extended interactions are followed by a
    hand-back, save one that its 11th action closed.

    Returns
    -------
    actions
        Actions of the environment, L of them, waits included.
    record
        Record (L,) of the same steps.

    Raises
    ------
    UsageError
        No option can take an action, so that cloning could not make it likely.
    """
    rows: list[tuple[int, int, int, int]] = []  # choice, option, open, used
    for run in _RUNS.finditer(_letters(actions)):
        acting = {"push": PUSH, "pick": PICK}.get(run.lastgroup or "", NAVIGATE)
        taken = list(actions[run.start() : run.end()])
        if strange := [action for action in taken if action not in ACTIONS_OF[acting]]:
            raise UsageError(
                f"expert's action {Action(strange[0]).label}: cannot be cloned: option "
                f"{OPTION_NAMES[acting]!r} cannot take it (`Action.options`)"
            )
        if acting == NAVIGATE:
            rows.append((taken[0], STOP if taken[0] == DONE else NAVIGATE, NAVIGATE, 0))
            continue
        if temporally_extended and len(taken) % INTERACTION_ACTIONS:
            taken.append(DONE)
        for number, action in enumerate(taken):
            spent = number % INTERACTION_ACTIONS if temporally_extended else 0
            rows.append((action, acting, acting if spent else NAVIGATE, spent))
    choice, option, opened, used = torch.tensor(rows).reshape(-1, 4).unbind(1)
    waits = (choice == DONE) & (option != STOP)
    record = HierarchyRecord(choice, option, opened, used, decide=used == 0)
    return choice.masked_fill(waits, WAIT).tolist(), record


GLOBAL, INTENT, GRUS = 3, 4, 5
"""Hidden states: those of the three action policies, numbered as options are, then these two."""


class ForwardOutput(NamedTuple):
    """Outputs of all networks over T steps."""

    option_log_probs: Tensor
    """(T, n, 4): log P(omega), equation 5."""
    action_log_probs: Tensor
    """(T, n, 4, A): log-probabilities of the actions of each option; STOP's is Done."""
    value: Tensor
    """(T, n): the global policy's values."""
    intended_option_probs: Tensor | None
    """(T, n, 4): P(omega'), equation 6; None where the intent was given."""
    intent: Tensor
    """(T, n, A or 4): P(i), equation 7."""
    hidden: Tensor
    """(n, 5, hidden): hidden states after the last step."""


class Hierarchy(RecurrentAgent[HierarchyRecord]):
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
    done: Tensor

    def __init__(self, config: CampConfig, *, temporally_extended: bool = True) -> None:
        super().__init__()
        network, agent = config.network, config.agent
        self.hidden, self.temporally_extended = network.hidden, temporally_extended
        variant = agent.intent if temporally_extended else "none"
        self.uses_intent = variant != "none"
        count = 1 if network.shared_encoder else 3
        encoders = [networks.Encoder(network, self.sensors) for _ in range(count)]
        self.encoders, size = nn.ModuleList(encoders), encoders[0].size
        moves, options = initial_probabilities(
            agent.initial_done_probability, agent.initial_interaction_probability
        )
        # Done of Push and Pick ends no episode: it is as probable as any other action.
        counts = [len(ACTIONS_OF[option]) for option in (PUSH, PICK)]
        push, pick = ([1.0 / count] * count for count in counts)
        self.navigate = networks.RecurrentActorCritic(size, self.hidden, moves)
        self.push = networks.RecurrentActorCritic(size + OPTION_INPUTS, self.hidden, push)
        self.pick = networks.RecurrentActorCritic(size + OPTION_INPUTS, self.hidden, pick)
        self.intends_options = variant == "policy"
        intents = OPTIONS if self.intends_options else ACTION_COUNT
        self.global_policy = networks.IntentConditionedPolicy(
            size + OPTION_INPUTS, self.hidden, options, intents
        )
        if self.uses_intent:
            recursive = variant == "recursive"
            self.intent = networks.IntentPolicy(self.global_policy, recursive=recursive)
        mask = torch.zeros(OPTIONS)
        mask[[PUSH if name == "push" else PICK for name in agent.forbidden]] = -torch.inf
        self.register_buffer("mask", mask, persistent=False)
        done = torch.full((ACTION_COUNT,), -torch.inf)
        done[DONE] = 0.0
        self.register_buffer("done", done, persistent=False)

    @property
    def policies(self) -> tuple[networks.RecurrentActorCritic, ...]:
        """Action policies, numbered as options are."""
        return self.navigate, self.push, self.pick

    def initial_state(self, count: int) -> State:
        """See `Agent`: hidden states, the open interaction (0: none), the actions it has used."""
        weight = self.global_policy.actor.weight
        idle = torch.zeros(count, dtype=torch.int64, device=weight.device)
        hidden = weight.new_zeros(count, GRUS, self.hidden)
        return {"hidden": hidden, "open": idle, "used": idle.clone()}

    def step(self, batch: Batch[Any], uniforms: Uniforms) -> AgentStep[HierarchyRecord]:
        """See `Agent`."""
        state = batch.state
        ran = self.run(batch, option_inputs(state["open"], state["used"])[None])
        option_log_probs, action_log_probs = ran.option_log_probs[0], ran.action_log_probs[0]
        decide = state["open"] == 0
        option = torch.where(decide, networks.drawn(option_log_probs, uniforms[0]), state["open"])
        choice = networks.drawn(_of_option(action_log_probs, option), uniforms[1])
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

    def evaluate(self, batch: Batch[HierarchyRecord]) -> Evaluated:
        """See `Agent`."""
        record = batch.record
        ran = self.run(batch, option_inputs(record.open, record.used), record.intent)
        log_prob = _log_prob(ran.option_log_probs, ran.action_log_probs, record)
        decided = record.decide * networks.entropy_of(ran.option_log_probs)
        acted = networks.entropy_of(_of_option(ran.action_log_probs, record.option))
        state = {**batch.state, "hidden": ran.hidden}
        return Evaluated(log_prob, ran.value, decided + acted, state, ran.intent)

    def run(
        self, batch: Batch[Any], option_features: Tensor, intent: Tensor | None = None
    ) -> ForwardOutput:
        """Run all networks over T steps of n environments.

        Parameters
        ----------
        batch
            Steps; their record is not read.
        option_features : (T, n, 3)
            `option_inputs` before each step.
        intent : (T, n, A or 4)
            P(i) as it was recorded; None to compute it.
        """
        segments = batch.segments
        views = [encoder(batch.observations) for encoder in self.encoders]  # (T, n, size) each
        inputs = [
            views[0],
            *(torch.cat([views[k % len(views)], option_features], -1) for k in (PUSH, PICK)),
        ]
        hidden, log_probs = list(batch.state["hidden"].unbind(1)), []
        for k, policy in enumerate(self.policies):
            out, hidden[k] = segments.run(policy.gru, inputs[k], hidden[k])
            may_end = k == NAVIGATE or self.temporally_extended
            log_probs.append(action_log_probs_of(k, policy.actor(out), may_end=may_end))
        acts = torch.stack([*log_probs, self.done.expand_as(log_probs[0])], -2)  # (T, n, 4, A)
        features, intended = torch.cat([views[0], option_features], -1), None
        if not self.uses_intent:
            intent = networks.uniform_intent(features, self.global_policy.embed.in_features)
        elif intent is None:
            intended, intent, hidden[INTENT] = self.intent(
                features, hidden[INTENT], segments, lambda p: self.mixed(p, acts), self.mask
            )
        conditioned = self.global_policy.condition(features, intent)
        out, hidden[GLOBAL] = segments.run(self.global_policy.gru, conditioned, hidden[GLOBAL])
        option_log_probs = torch.log_softmax(self.global_policy.actor(out) + self.mask, -1)
        value, after = self.global_policy.value(out), torch.stack(hidden, 1)
        return ForwardOutput(option_log_probs, acts, value, intended, intent, after)

    def mixed(self, intended: Tensor, action_log_probs: Tensor) -> Tensor:
        """Return P(i), (T, n, A), equation 7: the policies' actions, weighted by P(omega').

        Rotations of Navigate and Pick add; so do the four Dones. Of `--intent policy` it is
        P(omega') itself, (T, n, 4).
        """
        if self.intends_options:
            return intended
        return (intended.unsqueeze(-1) * action_log_probs.exp()).sum(-2)

    def labels(self, actions: Sequence[int]) -> tuple[list[int], HierarchyRecord]:
        """See `Agent`."""
        return option_labels(actions, temporally_extended=self.temporally_extended)

    def optimised(self) -> list[nn.Parameter]:
        """See `Agent`: neither the intent policy nor the critics of the policies' pretraining."""
        parts = (
            self.encoders,
            self.global_policy,
            *(q for p in self.policies for q in (p.gru, p.actor)),
        )
        return [parameter for part in parts for parameter in part.parameters()]

    def critics(self) -> list[nn.Parameter]:
        """See `Agent`."""
        return list(self.global_policy.critic.parameters())

    def synchronise(self) -> None:
        """See `Agent`."""
        if hasattr(self, "intent"):
            self.intent.synchronise(self.global_policy)


class AuxiliaryAgent(RecurrentAgent[OptionRecord]):
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

    def step(self, batch: Batch[Any], uniforms: Uniforms) -> AgentStep[OptionRecord]:
        """See `Agent`."""
        option, opened, used = self._option, batch.state["open"], batch.state["used"]
        log_probs, value, hidden = self.run(batch, option_inputs(opened, used)[None], option)
        choice = networks.drawn(log_probs[0], uniforms[1])
        record = OptionRecord(choice, option, opened, used)
        opened, used, _, _ = option_step(option, choice, used)
        if not self.hierarchy.temporally_extended:  # `hrl` has no such inputs later either
            opened, used = opened * 0, used * 0
        after = {"hidden": hidden, "open": opened, "used": used}
        log_prob = networks.log_prob_of(log_probs[0], choice)
        return AgentStep(choice, log_prob, value[0], record, after)

    def evaluate(self, batch: Batch[OptionRecord]) -> Evaluated:
        """See `Agent`."""
        record = batch.record
        option_features = option_inputs(record.open, record.used)
        log_probs, value, hidden = self.run(batch, option_features, record.option[0])
        log_prob = networks.log_prob_of(log_probs, record.choice)
        state = {**batch.state, "hidden": hidden}
        return Evaluated(log_prob, value, networks.entropy_of(log_probs), state)

    def run(
        self, batch: Batch[Any], option_features: Tensor, option: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Run each policy over its own environments.

        Parameters
        ----------
        batch
            Steps; their record is not read.
        option_features : (T, n, 3)
            `option_inputs` before each step.
        option : (n,)
            Policy that acts in each environment.

        Returns
        -------
        log_probs : (T, n, A)
            Log-probabilities of the actions.
        value : (T, n)
            Values by the policies' own critics.
        hidden : (n, hidden)
            Hidden states after the last step.
        """
        before, (steps, count, _) = batch.state["hidden"], option_features.shape
        log_probs = before.new_full((steps, count, ACTION_COUNT), -torch.inf)
        value, hidden = before.new_zeros(steps, count), torch.zeros_like(before)
        for task, policy in enumerate(self.hierarchy.policies):
            columns = (option == task).nonzero().flatten()
            if not len(columns):
                continue
            encoder = self.hierarchy.encoders[task % len(self.hierarchy.encoders)]
            own = batch.select(columns)
            inputs = encoder(own.observations)
            if task != NAVIGATE:
                inputs = torch.cat([inputs, option_features[:, columns]], -1)
            out, after = own.segments.run(policy.gru, inputs, own.state["hidden"])
            own_log_probs = action_log_probs_of(task, policy.actor(out))
            log_probs = log_probs.index_copy(1, columns, own_log_probs)
            value = value.index_copy(1, columns, policy.value(out))
            hidden = hidden.index_copy(0, columns, after)
        return log_probs, value, hidden

    def optimised(self) -> list[nn.Parameter]:
        """See `Agent`: encoders and policies that have environments, critics too."""
        encoders = self.hierarchy.encoders
        used = [encoders[k] for k in sorted({task % len(encoders) for task in self._trained})]
        parts = [*used, *(self.hierarchy.policies[task] for task in self._trained)]
        return [parameter for part in parts for parameter in part.parameters()]

    def critics(self) -> list[nn.Parameter]:
        """See `Agent`."""
        return [p for k in self._trained for p in self.hierarchy.policies[k].critic.parameters()]


def _of_option(action_log_probs: Tensor, option: Tensor) -> Tensor:
    """Return the log-probabilities (…, A) of the option that acts, of (…, 4, A)."""
    return action_log_probs.take_along_dim(option[..., None, None], -2).squeeze(-2)


def _log_prob(
    option_log_probs: Tensor, action_log_probs: Tensor, record: HierarchyRecord
) -> Tensor:
    """Return decide * log pi_Omega(omega) + log pi_omega(a); the second is 0 for omega = Done."""
    decided = networks.log_prob_of(option_log_probs, record.option)
    acted = networks.log_prob_of(_of_option(action_log_probs, record.option), record.choice)
    return torch.where(record.decide, decided, 0.0) + acted
