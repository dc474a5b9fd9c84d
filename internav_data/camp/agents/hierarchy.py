"""`camp` and `hrl`: a global policy chooses the options Navigate, Push and Pick (section 4).

`Hierarchy` is the model itself; `AuxiliaryAgent` trains its action policies one by one in the
auxiliary tasks (section 5.2). Shapes: T steps, n environments, A actions (`ACTION_COUNT`).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import torch
from torch import Tensor, nn
from torch.nn import functional

from internav_data.camp import networks
from internav_data.camp.agents.protocol import (
    Agent,
    Batch,
    ForwardOutput,
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
    tuple(int(action) for action in actions_of_option(option)) for option in OPTION_NAMES
)
"""Actions of the options (table 1), in the order of their policies' logits; Done is the last."""
N = TypeVar("N", int, Tensor)


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
        begun = self.used.masked_fill(decide, 0)
        _, _, handed_back, forced = option_step(self.option, self.choice, begun)
        found["interactions"] = opened = int((interacting & decide).sum())
        if opened:
            found["interaction_length"] = float(interacting.sum()) / opened
        if ended := int((forced | handed_back | (decide & (self.open != 0))).sum()):
            found["forced_share"] = int(forced.sum()) / ended
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


def option_step(option: N, choice: N, used: N, *, extended: bool = True) -> tuple[N, N, N, N]:
    """Return the option state after an action; tensors of one shape, or numbers.

    After its 11th action an interaction closes; Done of Push or Pick, which is an action only where
    a hand-back is a step, closes it too, even as the first one.

    Parameters
    ----------
    option, choice
        Option that acted, and its action.
    used
        Actions that it had used before: 0 if it has just been opened.
    extended
        Whether interactions stay open over several actions.

    Returns
    -------
    open, used
        Open interaction (0 for none) and the actions that it has used.
    handed_back, forced
        Whether the interaction was closed by its Done, or by its 11th action.
    """
    spent, interacting = used + 1, extended & ((option == PUSH) | (option == PICK))
    acting = interacting & (choice != DONE)
    still = acting & (spent < INTERACTION_ACTIONS)
    forced = acting & (spent >= INTERACTION_ACTIONS)
    return option * still, spent * still, interacting & (choice == DONE), forced


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
            begun = 0 if decide else used
            opened, used, _, _ = option_step(acting, action, begun, extended=extended)
    choice, option, opens, uses, decides = torch.tensor(rows).reshape(-1, 5).unbind(1)
    waits = (choice == DONE) & (option != NAVIGATE)
    record = HierarchyRecord(choice, option, opens, uses, decide=decides.bool())
    return choice.masked_fill(waits, WAIT).tolist(), record


GLOBAL, INTENT, GRUS = 3, 4, 5
"""Hidden states: those of the three action policies, numbered as options are, then these two."""


def open_option(batch: Batch[Any]) -> tuple[Tensor, Tensor]:
    """Return the open interaction and the actions that it has used, (T, n), before each step."""
    if batch.record is None:
        return batch.state["open"][None], batch.state["used"][None]
    return batch.record.open, batch.record.used


@dataclass(frozen=True, slots=True, kw_only=True)
class HierarchyOutput(ForwardOutput):
    """Outputs of all networks over T steps; `log_probs` (T, n, 4, A) are those of each option."""

    option_log_probs: Tensor
    """(T, n, 4): log P(omega), equation 5."""
    ends: Tensor
    """(T, n, 2): log beta and log(1 - beta) of the open interaction; 0 and -inf if none is."""
    intended_option_probs: Tensor | None
    """(T, n, 4): P(omega'), equation 6; None where the intent was given."""
    intent: Tensor
    """(T, n, A or 4): P(i), equation 7."""

    @property
    def decisions(self) -> Tensor:
        """Log-probabilities of what is decided on arrival, (T, n, 5).

        The global policy takes each option, or the open one stays: log beta + log pi_Omega(omega),
        and log(1 - beta).
        """
        return torch.cat([self.option_log_probs + self.ends[..., :1], self.ends[..., 1:]], -1)

    def of_option(self, option: Tensor) -> Tensor:
        """Return the log-probabilities (T, n, A) of the actions of the options that act."""
        return self.log_probs.take_along_dim(option[..., None, None], -2).squeeze(-2)

    def log_prob(self, record: HierarchyRecord) -> Tensor:
        """See `ForwardOutput`.

        [open] (log beta or log(1 - beta)) + decide log pi_Omega(omega) + log pi_omega(a); the last
        is 0 for omega = Done.
        """
        decision = record.option.masked_fill(~record.decide, STAY)
        acted = networks.log_prob_of(self.of_option(record.option), record.choice)
        return networks.log_prob_of(self.decisions, decision) + acted

    def entropy(self, record: HierarchyRecord) -> Tensor:
        """See `ForwardOutput`."""
        decided = record.decide * networks.entropy_of(self.option_log_probs)
        acted = networks.entropy_of(self.of_option(record.option))
        return networks.entropy_of(self.ends) + decided + acted


class Hierarchy(Agent[HierarchyRecord]):
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

    def __init__(self, config: CampConfig, *, temporally_extended: bool = True) -> None:
        super().__init__()
        network, agent = config.network, config.agent
        self.hidden, self.temporally_extended = network.hidden, temporally_extended
        self.hand_back_step = temporally_extended and agent.hand_back_step
        variant = agent.intent if temporally_extended else "none"
        self.uses_intent = variant != "none"
        self.sensors = networks.observation_sensors(network, self.sensors)
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
        mask[[OPTION_NAMES.index(name) for name in agent.forbidden]] = -torch.inf
        self.register_buffer("mask", mask, persistent=False)

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

    def draw(
        self, ran: HierarchyOutput, state: State, uniforms: Uniforms
    ) -> tuple[Tensor, HierarchyRecord, State]:
        """See `Agent`."""
        opened, used = state["open"][None], state["used"][None]
        decision = networks.drawn(ran.decisions, uniforms[0])
        decide = decision != STAY
        option = torch.where(decide, decision, opened)
        choice = networks.drawn(ran.of_option(option), uniforms[1])
        # An episode ends by the global policy's Done, or by Navigate and its Done.
        probs, done = ran.option_log_probs.exp(), ran.log_probs[..., NAVIGATE, DONE].exp()
        ending = (probs[..., STOP] + probs[..., NAVIGATE] * done) * ran.ends[..., 0].exp()
        record = HierarchyRecord(
            choice, option, opened, used, decide, ran.intent,
            probs, ran.intended_option_probs, ending,
        )  # fmt: skip
        opened, used, handed_back, _ = option_step(
            option, choice, used.masked_fill(decide, 0), extended=self.temporally_extended
        )
        after = {"open": opened[0], "used": used[0]}
        return choice.masked_fill(handed_back, WAIT), record, after

    def run(self, batch: Batch[Any]) -> HierarchyOutput:
        """See `Agent`."""
        segments, (opened, used) = batch.segments, open_option(batch)
        option_features = option_inputs(opened, used)
        policies: list[networks.RecurrentActorCritic] = list(self.policies)
        views = [encoder(batch.observations) for encoder in self.encoders]  # (T, n, size) each
        inputs = [
            views[0],
            *(torch.cat([views[k % len(views)], option_features], -1) for k in (PUSH, PICK)),
        ]
        features, intended = torch.cat([views[0], option_features], -1), None
        intent = None if batch.record is None else batch.record.intent
        if not self.uses_intent:
            intent = networks.uniform_intent(features, self.global_policy.embed.in_features)
        if intent is not None:  # else the action policies must run first
            policies.append(self.global_policy)
            inputs.append(self.global_policy.condition(features, intent))
        hidden = list(batch.state["hidden"].unbind(1))
        grus = [policy.gru for policy in policies]
        outs, hidden[: len(grus)] = segments.run_together(grus, inputs, hidden[: len(grus)])
        acts, termination = self.heads(outs)
        if intent is None:
            intended, intent, hidden[INTENT] = self.intent(
                features, hidden[INTENT], segments, lambda p: self.mixed(p, acts), self.mask
            )
            conditioned = self.global_policy.condition(features, intent)
            out, hidden[GLOBAL] = segments.run(self.global_policy.gru, conditioned, hidden[GLOBAL])
            outs.append(out)
        out = outs[GLOBAL]
        logit = termination.take_along_dim(opened.unsqueeze(-1), -1)
        return HierarchyOutput(
            log_probs=acts, ends=functional.logsigmoid(torch.cat([logit, -logit], -1)),
            option_log_probs=torch.log_softmax(self.global_policy.actor(out) + self.mask, -1),
            intended_option_probs=intended, intent=intent, value=self.global_policy.critic(out),
            state={**batch.state, "hidden": torch.stack(hidden, 1)}, critic_inputs=out,
        )  # fmt: skip

    def heads(self, outs: Sequence[Tensor]) -> tuple[Tensor, Tensor]:
        """Return what the outputs of the action policies' GRUs (T, n, hidden) lead to.

        Returns
        -------
        log_probs : (T, n, 4, A)
            Log-probabilities of the actions of each option; STOP's is Done.
        termination : (T, n, 3)
            Logits of beta, the probability that the open option ends on arrival.
        """
        # Navigate lasts a step; interactions that end by a step of their own never do on arrival.
        fixed = (torch.inf, *[-torch.inf if self.hand_back_step else 0.0] * 2)
        acts, termination = [], []
        for k, policy in enumerate(self.policies):
            logits = policy.actor(outs[k])
            acts.append(action_log_probs_of(k, logits, may_end=fixed[k] != 0.0))
            termination.append(fixed[k] + logits[..., -1] - logits[..., :-1].logsumexp(-1))
        acts.append(action_log_probs_of(STOP, logits[..., -1:]))
        return torch.stack(acts, -2), torch.stack(termination, -1)

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
        options, device = [OPTION_NAMES.index(task) for task in tasks], hierarchy.device
        self._option = torch.tensor(options, device=device)
        self._trained = sorted({OPTION_NAMES.index(task) for task in (trained or tasks)})

    def initial_state(self, count: int) -> State:
        """See `Agent`: one hidden state an environment."""
        state = self.hierarchy.initial_state(count)
        return {**state, "hidden": state["hidden"][:, 0]}

    def draw(
        self, ran: ForwardOutput, state: State, uniforms: Uniforms
    ) -> tuple[Tensor, OptionRecord, State]:
        """See `Agent`."""
        choice = networks.drawn(ran.log_probs, uniforms[1])
        record = OptionRecord(choice, self._option[None], state["open"][None], state["used"][None])
        opened, used, _, _ = option_step(  # `hrl` has no such inputs later either
            record.option, choice, record.used, extended=self.hierarchy.temporally_extended
        )
        return choice, record, {"open": opened[0], "used": used[0]}

    def run(self, batch: Batch[Any]) -> ForwardOutput:
        """See `Agent`: each policy runs over its own environments, with its own critic."""
        option = self._option if batch.record is None else batch.record.option[0]
        option_features = option_inputs(*open_option(batch))
        parts: list[tuple[Tensor, Tensor, Tensor]] = []
        columns = [(option == task).nonzero().flatten() for task in (NAVIGATE, PUSH, PICK)]
        for task in (task for task, numbers in enumerate(columns) if len(numbers)):
            policy = self.hierarchy.policies[task]
            own = batch.chunked(columns[task], [batch.state])
            inputs = self.hierarchy.encoders[task % len(self.hierarchy.encoders)](own.observations)
            if task != NAVIGATE:
                inputs = torch.cat([inputs, option_features[:, columns[task]]], -1)
            out, after = own.segments.run(policy.gru, inputs, own.state["hidden"])
            parts.append((action_log_probs_of(task, policy.actor(out)), policy.critic(out), after))
        order = torch.cat(columns).argsort()
        log_probs, value, hidden = zip(*parts, strict=True)
        return ForwardOutput(
            log_probs=torch.cat(log_probs, 1)[:, order], value=torch.cat(value, 1)[:, order],
            state={**batch.state, "hidden": torch.cat(hidden)[order]},
        )  # fmt: skip

    def optimised(self) -> list[nn.Parameter]:
        """See `Agent`: encoders and policies that have environments, critics too."""
        encoders = self.hierarchy.encoders
        used = [encoders[k] for k in sorted({task % len(encoders) for task in self._trained})]
        parts = [*used, *(self.hierarchy.policies[task] for task in self._trained)]
        return [parameter for part in parts for parameter in part.parameters()]

    def critics(self) -> list[nn.Module]:
        """See `Agent`."""
        return [self.hierarchy.policies[task].critic for task in self._trained]
