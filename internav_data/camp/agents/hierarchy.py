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
from torch.nn import functional

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
STAY: Final = OPTIONS
"""Decision that the open interaction goes on, after those for the options."""
OPTION_INPUTS: Final = 3
"""Number of inputs that tell of the open option; see `option_inputs`."""
DONE: Final = int(Action.DONE)
WAIT: Final = int(Action.WAIT)
"""Action of the step at which an interaction hands control back (`agent.hand_back_step`)."""
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
        handed_back = (interacting & (self.choice == DONE)) | (decide & (self.open != 0))
        ended = forced + int(handed_back.sum())
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

    After its 11th action an interaction closes; Done of Push or Pick, which is an action only where
    a hand-back is a step, closes it too, even as the first one.

    Parameters
    ----------
    option, choice
        Option that acted, and its action.
    used
        Actions that it had used before: 0 if it has just been opened.

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
    actions: Sequence[int], *, temporally_extended: bool, hand_back_step: bool = False
) -> tuple[list[int], HierarchyRecord]:
    """Return an expert's actions as options take them, for cloning.

    A maximal run of pushes is Push; pickups, drops and the rotations between them are Pick; the
    rest is Navigate, Done at the goal too, which Navigate's auxiliary task pays. A temporally
    extended interaction terminates on arrival at the next option's step, or at a step of its own.

    Parameters
    ----------
    actions
        Actions of the environment.
    temporally_extended
        Whether interactions stay open over several actions.
    hand_back_step
        Whether those that their 11th action has not closed end by a step of waiting.

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
    rows: list[tuple[int, int, int, int, bool]] = []  # choice, option, open, used, decide
    opened, used = NAVIGATE, 0
    for run in _RUNS.finditer(_letters(actions)):
        acting = {"push": PUSH, "pick": PICK}.get(run.lastgroup or "", NAVIGATE)
        taken = list(actions[run.start() : run.end()])
        if strange := [action for action in taken if action not in ACTIONS_OF[acting]]:
            raise UsageError(
                f"expert's action {Action(strange[0]).label}: cannot be cloned: option "
                f"{OPTION_NAMES[acting]!r} cannot take it (`Action.options`)"
            )
        extended = temporally_extended and acting != NAVIGATE
        if extended and hand_back_step and len(taken) % INTERACTION_ACTIONS:
            taken.append(DONE)
        for number, action in enumerate(taken):
            decide = not extended or number % INTERACTION_ACTIONS == 0
            rows.append((action, acting, opened, used, decide))
            spent = 1 if decide else used + 1
            still = extended and spent < INTERACTION_ACTIONS and action != DONE
            opened, used = (acting, spent) if still else (NAVIGATE, 0)
    choice, option, opens, uses, decides = torch.tensor(rows).reshape(-1, 5).unbind(1)
    waits = (choice == DONE) & (option != NAVIGATE)
    record = HierarchyRecord(choice, option, opens, uses, decide=decides.bool())
    return choice.masked_fill(waits, WAIT).tolist(), record


GLOBAL, INTENT, GRUS = 3, 4, 5
"""Hidden states: those of the three action policies, numbered as options are, then these two."""


class ForwardOutput(NamedTuple):
    """Outputs of all networks over T steps."""

    option_log_probs: Tensor
    """(T, n, 4): log P(omega), equation 5."""
    action_log_probs: Tensor
    """(T, n, 4, A): log-probabilities of the actions of each option; STOP's is Done."""
    termination: Tensor
    """(T, n, 3): logits of beta, the probability that Navigate, Push, Pick end on arrival."""
    value: Tensor
    """(T, n): the global policy's values."""
    out: Tensor
    """(T, n, hidden): outputs of the global policy's GRU."""
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

    Notes
    -----
    Done of Push and of Pick is their termination beta(s), as in the options framework (Sutton,
    Precup and Singh 1999): it is drawn on arrival at a state, and where it ends the interaction
    global decides and the chosen policy acts in the same step. With `agent.hand_back_step` it is an
    action of its own instead, which waits.
    """

    mask: Tensor
    done: Tensor

    def __init__(self, config: CampConfig, *, temporally_extended: bool = True) -> None:
        super().__init__()
        network, agent = config.network, config.agent
        self.hidden, self.temporally_extended = network.hidden, temporally_extended
        self.hand_back_step = temporally_extended and agent.hand_back_step
        variant = agent.intent if temporally_extended else "none"
        self.uses_intent = variant != "none"
        self.sensors = networks.observation_sensors(network)
        count = 1 if network.shared_encoder else 3
        encoders = [
            networks.Encoder(network, self.sensors, self.sensor_encoders) for _ in range(count)
        ]
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
        before, used = batch.state["open"], batch.state["used"]
        ran = self.run(batch, option_inputs(before, used)[None])
        decisions, ends = (values[0] for values in self.decisions(ran, before[None]))
        action_log_probs = ran.action_log_probs[0]
        decision = networks.drawn(decisions, uniforms[0])
        decide = decision != STAY
        option = torch.where(decide, decision, before)
        choice = networks.drawn(_of_option(action_log_probs, option), uniforms[1])
        opened, spent, handed_back, forced = option_step(
            option, choice, used.masked_fill(decide, 0)
        )
        if not self.temporally_extended:
            opened, spent, forced = opened * 0, spent * 0, forced & False
        option_probs, intended = ran.option_log_probs[0].exp(), ran.intended_option_probs
        # An episode ends by the global policy's Done, or by Navigate and its Done.
        done = action_log_probs[:, NAVIGATE, DONE].exp()
        ending = (option_probs[:, STOP] + option_probs[:, NAVIGATE] * done) * ends[:, 0].exp()
        record = HierarchyRecord(
            choice, option, before, used, decide, ran.intent[0], forced,
            option_probs, None if intended is None else intended[0], ending,
        )  # fmt: skip
        log_prob = _log_prob(decisions, action_log_probs, record)
        after = {"hidden": ran.hidden, "open": opened, "used": spent}
        return AgentStep(
            choice.masked_fill(handed_back, WAIT), log_prob, ran.value[0], record, after
        )

    def evaluate(self, batch: Batch[HierarchyRecord]) -> Evaluated:
        """See `Agent`."""
        record = batch.record
        ran = self.run(batch, option_inputs(record.open, record.used), record.intent)
        decisions, ends = self.decisions(ran, record.open)
        log_prob = _log_prob(decisions, ran.action_log_probs, record)
        decided = record.decide * networks.entropy_of(ran.option_log_probs)
        acted = networks.entropy_of(_of_option(ran.action_log_probs, record.option))
        state = {**batch.state, "hidden": ran.hidden}
        entropy = networks.entropy_of(ends) + decided + acted
        return Evaluated(log_prob, ran.value, entropy, state, critic_inputs=ran.out)

    def decisions(self, ran: ForwardOutput, opened: Tensor) -> tuple[Tensor, Tensor]:
        """Return what is decided on arrival, where interactions `opened` (T, n) are open.

        Returns
        -------
        decisions : (T, n, 5)
            Log-probabilities that the global policy takes each option, and that the open one
            stays: log beta + log pi_Omega(omega), and log(1 - beta).
        ends : (T, n, 2)
            log beta and log(1 - beta): 0 and minus infinity where none is open.
        """
        is_open = opened != NAVIGATE
        if self.hand_back_step:  # its own Done closes it, after the step
            logit = torch.full_like(ran.value, -torch.inf)
            ends = torch.stack([logit, torch.zeros_like(logit)], -1)
        else:
            logit = ran.termination.take_along_dim(opened.unsqueeze(-1), -1)
            ends = functional.logsigmoid(torch.cat([logit, -logit], -1))
        none = ends.new_tensor([0.0, -torch.inf])
        ends = torch.where(is_open.unsqueeze(-1), ends, none)
        return torch.cat([ran.option_log_probs + ends[..., :1], ends[..., 1:]], -1), ends

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
        policies: list[networks.RecurrentActorCritic] = list(self.policies)
        views = [encoder(batch.observations) for encoder in self.encoders]  # (T, n, size) each
        inputs = [
            views[0],
            *(torch.cat([views[k % len(views)], option_features], -1) for k in (PUSH, PICK)),
        ]
        features, intended = torch.cat([views[0], option_features], -1), None
        if not self.uses_intent:
            intent = networks.uniform_intent(features, self.global_policy.embed.in_features)
        if intent is not None:  # else the action policies must run first
            policies.append(self.global_policy)
            inputs.append(self.global_policy.condition(features, intent))
        hidden = list(batch.state["hidden"].unbind(1))
        grus = [policy.gru for policy in policies]
        outs, hidden[: len(grus)] = segments.run_together(grus, inputs, hidden[: len(grus)])
        log_probs, terminations = [], []
        for k, policy in enumerate(self.policies):
            logits = policy.actor(outs[k])
            may_end = k == NAVIGATE or self.hand_back_step
            log_probs.append(action_log_probs_of(k, logits, may_end=may_end))
            terminations.append(logits[..., -1] - logits[..., :-1].logsumexp(-1))
        termination = torch.stack(terminations, -1)
        acts = torch.stack([*log_probs, self.done.expand_as(log_probs[0])], -2)  # (T, n, 4, A)
        if intent is None:
            intended, intent, hidden[INTENT] = self.intent(
                features, hidden[INTENT], segments, lambda p: self.mixed(p, acts), self.mask
            )
            conditioned = self.global_policy.condition(features, intent)
            out, hidden[GLOBAL] = segments.run(self.global_policy.gru, conditioned, hidden[GLOBAL])
            outs.append(out)
        out = outs[GLOBAL]
        option_log_probs = torch.log_softmax(self.global_policy.actor(out) + self.mask, -1)
        value, after = self.global_policy.value(out), torch.stack(hidden, 1)
        return ForwardOutput(
            option_log_probs, acts, termination, value, out, intended, intent, after
        )

    def mixed(self, intended: Tensor, action_log_probs: Tensor) -> Tensor:
        """Return P(i), (T, n, A), equation 7: the policies' actions, weighted by P(omega').

        Rotations of Navigate and Pick add; so do the Dones of Navigate and global, and those of
        Push and Pick where a step hands back. Of `--intent policy` it is P(omega') itself,
        (T, n, 4).
        """
        if self.intends_options:
            return intended
        return (intended.unsqueeze(-1) * action_log_probs.exp()).sum(-2)

    def labels(self, actions: Sequence[int]) -> tuple[list[int], HierarchyRecord]:
        """See `Agent`."""
        return option_labels(
            actions,
            temporally_extended=self.temporally_extended,
            hand_back_step=self.hand_back_step,
        )

    def optimised(self) -> list[nn.Parameter]:
        """See `Agent`: neither the intent policy nor the critics of the policies' pretraining."""
        parts = (
            self.encoders,
            self.global_policy,
            *(q for p in self.policies for q in (p.gru, p.actor)),
        )
        return [parameter for part in parts for parameter in part.parameters()]

    def critics(self) -> list[nn.Module]:
        """See `Agent`."""
        return [self.global_policy.critic]

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
        parts: list[tuple[Tensor, Tensor, Tensor]] = []
        columns = [(option == task).nonzero().flatten() for task in (NAVIGATE, PUSH, PICK)]
        for task in (task for task, numbers in enumerate(columns) if len(numbers)):
            policy, own = self.hierarchy.policies[task], batch.select(columns[task])
            inputs = self.hierarchy.encoders[task % len(self.hierarchy.encoders)](own.observations)
            if task != NAVIGATE:
                inputs = torch.cat([inputs, option_features[:, columns[task]]], -1)
            out, after = own.segments.run(policy.gru, inputs, own.state["hidden"])
            parts.append((action_log_probs_of(task, policy.actor(out)), policy.value(out), after))
        order = torch.cat(columns).argsort()
        log_probs, value, hidden = zip(*parts, strict=True)
        return (
            torch.cat(log_probs, 1)[:, order],
            torch.cat(value, 1)[:, order],
            torch.cat(hidden)[order],
        )

    def optimised(self) -> list[nn.Parameter]:
        """See `Agent`: encoders and policies that have environments, critics too."""
        encoders = self.hierarchy.encoders
        used = [encoders[k] for k in sorted({task % len(encoders) for task in self._trained})]
        parts = [*used, *(self.hierarchy.policies[task] for task in self._trained)]
        return [parameter for part in parts for parameter in part.parameters()]

    def critics(self) -> list[nn.Module]:
        """See `Agent`."""
        return [self.hierarchy.policies[task].critic for task in self._trained]


def _of_option(action_log_probs: Tensor, option: Tensor) -> Tensor:
    """Return the log-probabilities (…, A) of the option that acts, of (…, 4, A)."""
    return action_log_probs.take_along_dim(option[..., None, None], -2).squeeze(-2)


def _log_prob(decisions: Tensor, action_log_probs: Tensor, record: HierarchyRecord) -> Tensor:
    """Return the log-probability of all draws of a step.

    [open] (log beta or log(1 - beta)) + decide log pi_Omega(omega) + log pi_omega(a); the last is 0
    for omega = Done.
    """
    decision = record.option.masked_fill(~record.decide, STAY)
    acted = networks.log_prob_of(_of_option(action_log_probs, record.option), record.choice)
    return networks.log_prob_of(decisions, decision) + acted
