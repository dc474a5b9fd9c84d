"""The options Navigate, Push, Pick and Done: what each may do, and when it hands control back."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

import torch
from torch import Tensor

from internav_data.camp.config import INTERACTION_ACTIONS
from internav_data.world.actions import ACTION_COUNT, Action, OptionName, actions_of_option

if TYPE_CHECKING:
    from collections.abc import Sequence

NAVIGATE, PUSH, PICK, STOP = range(4)
"""Options, as global's logits have them. STOP executes Done. (0 in a state: none is open.)"""
OPTION_NAMES: Final[tuple[OptionName, ...]] = ("navigate", "push", "pick", "done")
"""Options by number."""
OPTIONS: Final = len(OPTION_NAMES)
OPTION_INPUTS: Final = 3
"""Push is open, Pick is open, actions used / 11."""
DONE: Final = int(Action.DONE)
WAIT: Final = int(Action.WAIT)
"""Action of the step at which an interaction hands control back."""
ACTIONS_OF: Final[tuple[tuple[int, ...], ...]] = tuple(
    tuple(int(action) for action in actions_of_option(option)) for option in OPTION_NAMES[:STOP]
)
"""Actions of the three policies (table 1), in the order of their logits; Done is the last."""
# A run of pushes; what is picked, put down and turned between without a move; all else.
_RUNS: Final = re.compile("(?P<push>P+)|(?P<pick>I(?:T*I)*)|(?P<else>.)")
_LETTERS: Final = {"turn": "T", "push": "P", "pick": "I", "drop": "I"}
"""Letters of the kinds of action that `_RUNS` tells apart."""


def start_chances(end: float, interact: float) -> tuple[list[float], list[float]]:
    """Return the chances at the start of Navigate's actions and of global's options.

    Done by global and Done by Navigate end an episode with chance `end` together, half each;
    global's other options are as 1 - 2 interact - end : interact : interact (.9 : .045 :
    .045).
    """
    weights = [1.0 - 2.0 * interact - end, interact, interact]
    options = [(1.0 - end / 2.0) * weight / sum(weights) for weight in weights]
    done = end / 2.0 / options[NAVIGATE]
    moves = len(ACTIONS_OF[NAVIGATE]) - 1
    return [(1.0 - done) / moves] * moves + [done], [*options, end / 2.0]


def action_table() -> Tensor:
    """Return where each option's twelve log-probabilities lie among all logits, (4 * 12,).

    Logits are those of the three policies, then minus infinity, then 0.
    """
    ends = [0]
    for actions in ACTIONS_OF:
        ends.append(ends[-1] + len(actions))
    table = torch.full((OPTIONS, ACTION_COUNT), ends[-1], dtype=torch.int64)
    for option, actions in enumerate(ACTIONS_OF):
        for place, action in enumerate(actions):
            table[option, action] = ends[option] + place
    table[STOP, DONE] = ends[-1] + 1
    return table.flatten()


def option_inputs(opened: Tensor, used: Tensor) -> Tensor:
    """Return what global, intent, Push and Pick are told of the open option, (…, 3)."""
    parts = (opened == PUSH, opened == PICK, used / INTERACTION_ACTIONS)
    return torch.stack([part.to(torch.float32) for part in parts], -1)


def option_step(
    option: Tensor, choice: Tensor, used: Tensor
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Return what is open after an action, how many it has used, who handed back, who was cut.

    A Done of Push or Pick hands control back, be it the first action; after its 11th action an
    interaction closes. All (n,).
    """
    interacting = (option == PUSH) | (option == PICK)
    handed = interacting & (choice == DONE)
    spent = used + 1
    forced = interacting & ~handed & (spent >= INTERACTION_ACTIONS)
    still = (interacting & ~handed & ~forced).to(option.dtype)
    return option * still, spent * still, handed, forced


def follow(actions: Sequence[int], *, keeps: bool) -> dict[str, list[int]]:
    """Return an expert's actions as options take them: the labels of cloning.

    A maximal run of pushes is Push; pickups, drops and the rotations between them are Pick; Done is
    global's; all else is Navigate. Where options are kept, each interaction is followed by a
    hand-back, save one that its 11th action closed.
    """
    label: dict[str, list[int]] = {
        name: [] for name in ("action", "choice", "option", "decide", "open", "used")
    }

    def add(option: int, choice: int, used: int) -> None:
        opened = option if used else NAVIGATE
        act = WAIT if choice == DONE and option != STOP else choice
        values = (act, choice, option, int(used == 0), opened, used)
        for column, value in zip(label.values(), values, strict=True):
            column.append(value)

    letters = "".join(_LETTERS.get(Action(action).kind, ".") for action in actions)
    for run in _RUNS.finditer(letters):
        option = {"push": PUSH, "pick": PICK}.get(run.lastgroup or "", NAVIGATE)
        taken = actions[run.start() : run.end()]
        if option == NAVIGATE:
            add(STOP if taken[0] == DONE else NAVIGATE, taken[0], 0)
            continue
        for place, choice in enumerate(taken):
            add(option, choice, place % INTERACTION_ACTIONS if keeps else 0)
        if keeps and len(taken) % INTERACTION_ACTIONS:
            add(option, DONE, len(taken) % INTERACTION_ACTIONS)
    return label
