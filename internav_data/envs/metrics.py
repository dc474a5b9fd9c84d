"""What is said about an episode at its end."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from internav_data.navigation import SPACING_M
from internav_data.world import Action

KINDS: Final = {
    **dict.fromkeys(
        (Action.PUSH_AHEAD, Action.PUSH_BACK, Action.PUSH_RIGHT, Action.PUSH_LEFT), "push"
    ),
    Action.PICKUP: "pick",
    Action.DROP: "drop",
}
"""Interactions by kind."""


@dataclass(slots=True)
class Tally:
    """What is counted on the way."""

    moves: int = 0
    """Successful ones only, each counted once."""
    tried: dict[str, int] = field(default_factory=lambda: {"push": 0, "pick": 0, "drop": 0})
    done: dict[str, int] = field(default_factory=lambda: {"push": 0, "pick": 0, "drop": 0})
    interaction_m: float = 0.0
    openings: int = 0
    closings: int = 0
    reward: float = 0.0


def metrics(
    tally: Tally, *, success: bool, clear_m: float, steps: int, distance_m: float
) -> dict[str, float | int | bool]:
    """Return the metrics of one finished episode: their means over episodes are the paper's.

    Parameters
    ----------
    tally
        What was counted.
    success
        Done at the goal.
    clear_m
        L: any-angle distance from start to goal without obstacles.
    steps
        Steps taken, Done and waits included.
    distance_m
        Any-angle distance without obstacles from where the agent ended.
    """
    path_m = SPACING_M * tally.moves
    return {
        "success": success,
        "distance_to_goal_m": distance_m,
        "spl": clear_m / max(path_m, clear_m) if success else 0.0,
        "sts": clear_m / SPACING_M / steps if success else 0.0,
        "steps": steps,
        "path_m": path_m,
        "pushes_tried": tally.tried["push"],
        "pushes_done": tally.done["push"],
        "picks_tried": tally.tried["pick"],
        "picks_done": tally.done["pick"],
        "drops_tried": tally.tried["drop"],
        "drops_done": tally.done["drop"],
        "interaction_reward_m": tally.interaction_m,
        "openings": tally.openings,
        "closings": tally.closings,
        "return": tally.reward,
    }
