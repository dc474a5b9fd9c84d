"""What is measured: one record an episode, and the paper's figures as ratios of sums over them.

Section 5.1 of the paper defines SR, FDT, SPL and STS, section 5.4 IR, ISR, PuSR and PiSR.
`docs/evaluation.md` has the formulas, and what was settled where the paper is silent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from internav_data.dataset import TableSpec
from internav_data.records import Mode  # noqa: TC001 - the schema is read from the fields' types

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from internav_data.records import Episode

HARD_ROOMS: Final = 4
"""The paper's N >= 4: hard scenes are those "with more rooms" (section 5.4)."""


@dataclass(frozen=True, slots=True)
class EpisodeResult:
    """How one episode went: a row of `episodes.parquet`."""

    episode_id: str
    scene_id: str
    room_count: int
    obstacle_count: int
    mode: Mode
    success: bool
    """Done within 0.2 m of the goal."""
    steps: int
    """Taken: Done, waits and failed actions included."""
    distance_m: float
    """From the end to the goal, any-angle, no obstacle about (FDT)."""
    shortest_path_m: float
    """L: from the start to the goal, any-angle, no obstacle about."""
    path_m: float
    """P: 0.25 m for each move that succeeded."""
    spl: float
    sts: float
    pushes_tried: int
    pushes_done: int
    picks_tried: int
    picks_done: int
    drops_tried: int
    drops_done: int
    interaction_m: float
    """What interactions took off the lattice distance, while it was finite before and after."""
    openings: int
    """Interactions that made a way where there was none; not in `interaction_m`."""
    closings: int
    reward_sum: float
    actions: tuple[int, ...]
    """All that was done, -1 for a wait: with the episode, these play it again."""


RESULTS: Final[TableSpec[EpisodeResult]] = TableSpec(
    "results", EpisodeResult, ("episode_id", "scene_id", "room_count", "mode", "success")
)
"""The schema of `episodes.parquet`."""


def result_of(episode: Episode, said: Mapping[str, float], actions: Sequence[int]) -> EpisodeResult:
    """Make the record of an episode from the environment's metrics at its end.

    An end from which the goal cannot be reached at all is a failure at the start's distance: it
    stays in every mean (the released code drops such episodes).
    """
    distance, reached = float(said["distance_to_goal_m"]), bool(said["success"])
    if not math.isfinite(distance):
        distance, reached = episode.shortest_path_m, False
    return EpisodeResult(
        episode_id=episode.episode_id,
        scene_id=episode.scene_id,
        room_count=episode.room_count,
        obstacle_count=episode.obstacle_count,
        mode=episode.mode,
        success=reached,
        steps=int(said["steps"]),
        distance_m=distance,
        shortest_path_m=episode.shortest_path_m,
        path_m=float(said["path_m"]),
        spl=float(said["spl"]) if reached else 0.0,
        sts=float(said["sts"]) if reached else 0.0,
        pushes_tried=int(said["pushes_tried"]),
        pushes_done=int(said["pushes_done"]),
        picks_tried=int(said["picks_tried"]),
        picks_done=int(said["picks_done"]),
        drops_tried=int(said["drops_tried"]),
        drops_done=int(said["drops_done"]),
        interaction_m=float(said["interaction_reward_m"]),
        openings=int(said["openings"]),
        closings=int(said["closings"]),
        reward_sum=float(said["return"]),
        actions=tuple(int(action) for action in actions),
    )


@dataclass(frozen=True, slots=True)
class Measure:
    """A figure of the paper: the sum of one thing over the sum of another."""

    title: str
    unit: Literal["%", "m", ""]
    better: Literal["more", "less", ""]
    part: Callable[[EpisodeResult], tuple[float, float]]
    """An episode's share of the numerator and of the denominator."""

    def of(self, results: Iterable[EpisodeResult]) -> float | None:
        """Return the figure of some episodes; None where nothing is to be divided by."""
        parts = [self.part(result) for result in results]
        whole = math.fsum(below for _, below in parts)
        return math.fsum(above for above, _ in parts) / whole if whole else None


def _pushes(r: EpisodeResult) -> tuple[float, float]:
    return r.pushes_done, r.pushes_tried


def _picks(r: EpisodeResult) -> tuple[float, float]:
    # Table 1 gives Pick both PickUp and Drop; Table 5's ISR lies between PuSR and PiSR in every
    # row, so the two kinds make up all interactions.
    return r.picks_done + r.drops_done, r.picks_tried + r.drops_tried


def _interactions(r: EpisodeResult) -> tuple[float, float]:
    (a, b), (c, d) = _pushes(r), _picks(r)
    return a + c, b + d


MEASURES: Final[Mapping[str, Measure]] = {
    "success": Measure("SR", "%", "more", lambda r: (float(r.success), 1.0)),
    "distance_m": Measure("FDT", "m", "less", lambda r: (r.distance_m, 1.0)),
    "spl": Measure("SPL", "", "more", lambda r: (r.spl, 1.0)),
    "sts": Measure("STS", "", "more", lambda r: (r.sts, 1.0)),
    "ir_m": Measure("IR", "m", "more", lambda r: (r.interaction_m, 1.0)),
    "isr": Measure("ISR", "%", "more", _interactions),
    "pusr": Measure("PuSR", "%", "more", _pushes),
    "pisr": Measure("PiSR", "%", "more", _picks),
    "pickup_success": Measure("Pickup", "%", "more", lambda r: (r.picks_done, r.picks_tried)),
    "openings": Measure("openings", "", "more", lambda r: (float(r.openings), 1.0)),
    "closings": Measure("closings", "", "less", lambda r: (float(r.closings), 1.0)),
    "interactions": Measure("interactions", "", "", lambda r: (_interactions(r)[1], 1.0)),
    "steps": Measure("steps", "", "", lambda r: (float(r.steps), 1.0)),
    "return": Measure("return", "", "more", lambda r: (r.reward_sum, 1.0)),
}
"""All figures by name. Those of single episodes are means; rates of interactions are pooled."""

GROUPS: Final[Mapping[str, Callable[[EpisodeResult], bool]]] = {
    "all": lambda _: True,
    "hard": lambda r: r.room_count >= HARD_ROOMS,
    "non-interactive": lambda r: r.mode != "blocked",
    "blocked": lambda r: r.mode == "blocked",
}
"""Which episodes: the paper's three, and those that an interaction must open."""


@dataclass(frozen=True, slots=True)
class Summary:
    """The figures of one group of episodes."""

    episodes: int
    scenes: int
    values: Mapping[str, float | None]
    """By the names of `MEASURES`; None where there is nothing to divide by."""


def summary(results: Sequence[EpisodeResult], group: str = "all") -> Summary:
    """Return all figures of one of the `GROUPS`; the order of the results does not matter."""
    chosen = [result for result in results if GROUPS[group](result)]
    values = {name: measure.of(chosen) for name, measure in MEASURES.items()}
    return Summary(len(chosen), len({result.scene_id for result in chosen}), values)
