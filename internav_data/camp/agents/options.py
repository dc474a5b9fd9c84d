"""Options Navigate, Push, Pick and Done: their actions, their ends, and records of them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import torch
from torch import Tensor

from internav_data.camp.agents.protocol import StepRecord
from internav_data.camp.config import INTERACTION_ACTIONS
from internav_data.world.actions import ACTION_COUNT, Action, OptionName, actions_of_option

if TYPE_CHECKING:
    from collections.abc import Sequence

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
# A run of pushes; pickups, drops and the turns between them; anything else.
_RUNS: Final = re.compile("(?P<push>P+)|(?P<pick>I(?:T*I)*)|(?P<else>.)")
_LETTERS: Final = {"turn": "T", "push": "P", "pick": "I", "drop": "I"}
"""Letters in `_RUNS` of the kinds of action."""
_TINY: Final = 1e-12


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
    """P(i), (…, 12 or 4): equation 7."""
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
            found["intent_kl"] = divergence(chosen[decide], intended[decide])
        return found


def divergence(first: Tensor, second: Tensor) -> float:
    """Return the mean KL divergence of distributions (…, k) from one another, in nats."""
    ratio = first.clamp_min(_TINY).log() - second.clamp_min(_TINY).log()
    return float((first * ratio).sum(-1).mean())


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


def action_table() -> Tensor:
    """Return the column of each option's twelve log-probabilities among all logits, (4 * 12,).

    The columns are the logits of the three policies, then minus infinity, then 0.
    """
    ends = [0]
    for actions in ACTIONS_OF:
        ends.append(ends[-1] + len(actions))
    table = torch.full((OPTIONS, ACTION_COUNT), ends[-1], dtype=torch.int64)
    for option, actions in enumerate(ACTIONS_OF):
        for column, action in enumerate(actions):
            table[option, action] = ends[option] + column
    table[STOP, DONE] = ends[-1] + 1
    return table.flatten()


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
    """
    rows: list[tuple[int, int, int, int]] = []  # choice, option, open, used
    letters = "".join(_LETTERS.get(Action(action).kind, ".") for action in actions)
    for run in _RUNS.finditer(letters):
        acting = {"push": PUSH, "pick": PICK}.get(run.lastgroup or "", NAVIGATE)
        taken = list(actions[run.start() : run.end()])
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
