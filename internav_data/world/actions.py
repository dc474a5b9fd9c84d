"""What an agent can do, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Final, Literal

if TYPE_CHECKING:
    from internav_data.records import Pose


class Action(IntEnum):
    """The twelve actions in the released code's order, and one for options outside of them.

    Stored experts and policies depend on these values: never renumber.
    """

    MOVE_AHEAD = 0
    ROTATE_LEFT = 1
    ROTATE_RIGHT = 2
    LOOK_DOWN = 3
    LOOK_UP = 4
    PUSH_AHEAD = 5
    PUSH_BACK = 6
    PUSH_RIGHT = 7
    PUSH_LEFT = 8
    PICKUP = 9
    DROP = 10
    DONE = 11
    WAIT = 12
    """Nothing happens: not one of the twelve, for options that pass a step."""


ACTION_COUNT: Final = 12
PUSH_TURNS: Final = {
    Action.PUSH_AHEAD: 0,
    Action.PUSH_BACK: 2,
    Action.PUSH_RIGHT: 3,
    Action.PUSH_LEFT: 1,
}
"""Quarter turns, counter-clockwise, from the agent's heading to the push."""
HORIZONS_DEG: Final = (-30, 0, 30, 60)
"""How far the camera can look down, degrees; negative is up."""
START_HORIZON_DEG: Final = 30

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
]
"""Why an action failed; empty where it did not."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """What one action did. A failed action changes nothing."""

    action: Action
    success: bool
    reason: Reason = ""
    target: int = -1
    """Index of the thing that was pushed, picked up or dropped, also where that failed; or -1."""
    displacement_m: float = 0.0
    """How far the target's centre of mass moved in the plane (pushes)."""
    seconds: float = 0.0
    """Simulated time of what physics decided."""
    toppled: bool = False
    moved: tuple[tuple[int, Pose], ...] = ()
    """Every thing that lies elsewhere now: indices, ascending, and poses. The held one has none."""
