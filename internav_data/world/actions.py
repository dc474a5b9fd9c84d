"""The table of actions, and the result of one.

Action spaces, the policies' options, captions, names in files and the documentation are read off
`Action`. Three places hold what is not in the table: behaviour by kind (`BEHAVIOURS` in
`internav_data.world.world`), the expert's moves (`internav_data.planner`), and the validator's own
table of actions (`internav_data.verification`), which is written again on purpose.
To add an action, see CONTRIBUTING.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Final, Literal, Self

from internav_data.records.agent import AGENT

if TYPE_CHECKING:
    from internav_data.records import Pose

ActionKind = Literal["move", "turn", "look", "push", "pick", "drop", "done", "wait"]
"""Kinds of behaviour: actions of one kind share code, rewards and counters."""
OptionName = Literal["navigate", "push", "pick", "done"]
"""Options of a hierarchical agent (the paper's section 4.2)."""


class Action(IntEnum):
    """Discrete actions, numbered as in the released code, with their kind, words and options.

    Stored experts and policies depend on the numbers: never renumber; a new action takes the next.

    Attributes
    ----------
    kind : str
        Kind of behaviour in the world, one of `ActionKind`.
    words : str
        Imperative for captions.
    description : str
        Effect, for the documentation.
    options : tuple of str
        Options that may take it; the first is its own, further ones borrow it.
    quarter_turns : int
        Quarter turns, counter-clockwise: of the agent (turn), or from its heading to the push.
    changes_picture : bool
        Whether the camera sees something else after a success.
    """

    kind: ActionKind
    words: str
    description: str
    options: tuple[OptionName, ...]
    quarter_turns: int
    changes_picture: bool

    MOVE_AHEAD = (
        0, "move", "move ahead",
        "0.25 m ahead; fails where the disc (radius 0.2 m) would not get through",
        ("navigate",),
    )  # fmt: skip
    ROTATE_LEFT = (1, "turn", "turn left", "a quarter turn to the left", ("navigate", "pick"), 1)
    ROTATE_RIGHT = (2, "turn", "turn right", "a quarter turn to the right", ("navigate", "pick"), 3)
    LOOK_DOWN = (3, "look", "look down", "camera 30° down, to 60° at most", ("navigate",))
    LOOK_UP = (4, "look", "look up", "camera 30° up, to 30° above level at most", ("navigate",))
    PUSH_AHEAD = (
        5, "push", "push ahead",
        "push the closest visible pushable object within 1.25 m away from the agent",
        ("push",), 0,
    )  # fmt: skip
    PUSH_BACK = (6, "push", "push back", "the same, towards the agent", ("push",), 2)
    PUSH_RIGHT = (7, "push", "push right", "the same, to the agent's right", ("push",), 3)
    PUSH_LEFT = (8, "push", "push left", "the same, to the agent's left", ("push",), 1)
    PICKUP = (
        9, "pick", "pick up",
        "take the closest visible pickable object within 1.25 m; one at a time",
        ("pick",),
    )  # fmt: skip
    DROP = (
        10, "drop", "drop",
        "put the held object down at the first spot around the agent where it comes to rest",
        ("pick",),
    )  # fmt: skip
    DONE = (
        11, "done", "done", "ends the episode", ("done", "navigate", "push", "pick"), 0, False,
    )  # fmt: skip
    WAIT = (
        -1, "wait", "wait",
        "passes a step; outside the action space, for options that hand control back", (), 0, False,
    )  # fmt: skip

    def __new__(
        cls,
        number: int,
        # Defaults only so that type checkers accept the look-up `Action(3)`.
        kind: ActionKind = "wait",
        words: str = "",
        description: str = "",
        options: tuple[OptionName, ...] = (),
        quarter_turns: int = 0,
        changes_picture: bool = True,
    ) -> Self:
        """Make a row of the table."""
        action = int.__new__(cls, number)
        action._value_ = number
        action.kind, action.words, action.description = kind, words, description
        action.options, action.quarter_turns = options, quarter_turns
        action.changes_picture = changes_picture
        return action

    @property
    def label(self) -> str:
        """Name in the paper's spelling: "MoveAhead"."""
        return self.name.title().replace("_", "")


ACTIONS: Final = tuple(action for action in Action if action >= 0)
"""The action space, ascending from 0; `Action.WAIT` is outside."""
ACTION_COUNT: Final = len(ACTIONS)
INTERACTION_KINDS: Final[tuple[ActionKind, ...]] = ("push", "pick", "drop")
"""Kinds that act on an object."""
PUSHES: Final = tuple(action for action in ACTIONS if action.kind == "push")


def actions_of_option(option: OptionName) -> tuple[Action, ...]:
    """Return the actions that an option may take: its own, borrowed ones, Done; each ascending.

    The order is that of the logits of the option's policy, whose last one is Done.
    """
    taken = [action for action in ACTIONS if option in action.options]
    return tuple(
        sorted(taken, key=lambda action: (action == Action.DONE, action.options[0] != option))
    )


HORIZONS_DEG: Final = AGENT.horizons_deg
"""Horizons of the camera, degrees; negative is up."""
START_HORIZON_DEG: Final = AGENT.start_horizon_deg

Reason = Literal[
    "",
    "something is in the way",
    "the agent is in the way",
    "cannot look further",
    "nothing to push in sight and reach",
    "nothing to pick up in sight and reach",
    "hands are full",
    "hands are empty",
    "too heavy",
    "would come to lie on the agent",
    "something rests on it",
    "no room to drop it",
    "not at the goal",
    "did not move",
    "no room for what is held",
]
"""Reason of an action's failure; empty after a success. "did not move" stands for every reason that
would tell something about hidden attributes."""
Cause = Literal[Reason, "not pushable", "not pickable"]
"""True reason of a failure."""


@dataclass(frozen=True, slots=True)
class Interaction:
    """An interaction that has begun and takes further steps."""

    action: Action
    target: int
    """Index of the object acted on."""
    steps: int
    """Number of steps taken so far."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """Result of one action. A failed action changes nothing."""

    action: Action
    success: bool
    reason: Reason = ""
    target: int = -1
    """Index of the object to be pushed, picked up or dropped, also after a failure; or -1."""
    displacement_m: float = 0.0
    """Distance that the target's centre of mass moved in the plane (pushes)."""
    seconds: float = 0.0
    """Simulated time of the physics involved."""
    toppled: bool = False
    moved: tuple[tuple[int, Pose], ...] = ()
    """Objects that lie elsewhere now, ascending by index, and their poses. A held one has none."""
    ongoing: bool = False
    """The interaction takes further steps; it is `World.interaction` until its last one."""
    cause: Cause = ""
    """True reason for which a target could not be moved. Not for agents: where attributes are
    hidden, `reason` does not tell it."""
