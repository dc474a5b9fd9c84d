"""What is said about an episode at its end.

What the main task pays: plain arithmetic on distances, so that it can be checked by hand.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from internav_data.navigation import SPACING_M
from internav_data.world.actions import INTERACTION_KINDS, ActionKind


@dataclass(slots=True)
class EpisodeStatistics:
    """What is counted on the way."""

    moves: int = 0
    """Successful ones only, each counted once."""
    tried: dict[ActionKind, int] = field(
        default_factory=lambda: dict.fromkeys(INTERACTION_KINDS, 0)
    )
    done: dict[ActionKind, int] = field(default_factory=lambda: dict.fromkeys(INTERACTION_KINDS, 0))
    interaction_m: float = 0.0
    openings: int = 0
    closings: int = 0
    reward: float = 0.0


def metrics(
    statistics: EpisodeStatistics,
    *,
    success: bool,
    shortest_path_m: float,
    steps: int,
    distance_m: float,
) -> dict[str, float | int | bool]:
    """Return the metrics of one finished episode: their means over episodes are the paper's.

    Parameters
    ----------
    statistics
        What was counted.
    success
        Done at the goal.
    shortest_path_m
        L: any-angle distance from start to goal without obstacles.
    steps
        Steps taken, Done and waits included.
    distance_m
        Any-angle distance without obstacles from where the agent ended.
    """
    path_m = SPACING_M * statistics.moves
    return {
        "success": success,
        "distance_to_goal_m": distance_m,
        "spl": shortest_path_m / max(path_m, shortest_path_m) if success else 0.0,
        "sts": shortest_path_m / SPACING_M / steps if success else 0.0,
        "steps": steps,
        "path_m": path_m,
        "pushes_tried": statistics.tried["push"],
        "pushes_done": statistics.done["push"],
        "picks_tried": statistics.tried["pick"],
        "picks_done": statistics.done["pick"],
        "drops_tried": statistics.tried["drop"],
        "drops_done": statistics.done["drop"],
        "interaction_reward_m": statistics.interaction_m,
        "openings": statistics.openings,
        "closings": statistics.closings,
        "return": statistics.reward,
    }


STEP: Final = -0.01
"""Every step, the last one and a `wait` included."""
SUCCESS: Final = 10.0
"""Done at the goal."""
OPENED: Final = 1.0
"""An interaction makes a way where there was none on the lattice; one that closes it costs it."""


def move_reward(before_m: float, after_m: float) -> float:
    """Pay the drop of the any-angle distance without obstacles, metres."""
    return before_m - after_m


def interaction_reward(before: int | None, after: int | None) -> float:
    """Pay what an interaction did to the lattice distance (steps; None where cut off).

    The drop in metres while both are finite, +1 for opening the way, -1 for closing it.
    """
    if before is None:
        return 0.0 if after is None else OPENED
    return -OPENED if after is None else SPACING_M * (before - after)
