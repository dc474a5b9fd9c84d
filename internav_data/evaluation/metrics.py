"""Metrics: one record an episode, and the paper's figures as ratios of sums over records.

Section 5.1 of the paper defines SR, FDT, SPL and STS, section 5.4 IR, ISR, PuSR and PiSR.
`docs/evaluation.md` has the formulas, and the decisions where the paper is silent.
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
"""Number of rooms from which a scene is hard, "with more rooms" (section 5.4: N >= 4)."""


@dataclass(frozen=True, slots=True)
class EpisodeResult:
    """Metrics and actions of one evaluated episode: a row of `episodes.parquet`."""

    episode_id: str
    """Episode, as `scene-000017/0003`."""
    scene_id: str
    """House of the episode, as `scene-000017`."""
    room_count: int
    """Number of rooms of the house."""
    obstacle_count: int
    """Number of spawned obstacles."""
    mode: Mode
    """Mode of the episode, blocked or lengthened."""
    success: bool
    """Whether the episode ended with Done within 0.2 m of the goal."""
    steps: int
    """Number of actions: Done, waits and failed actions included."""
    distance_m: float
    """FDT: Euclidean distance from the end to the goal, obstacles absent, metres."""
    shortest_path_m: float
    """L: Euclidean distance from the start to the goal, obstacles absent, metres."""
    path_m: float
    """P: length walked, 0.25 m for each successful move."""
    spl: float
    """Success weighted by path length."""
    sts: float
    """Success weighted by time steps."""
    pushes_tried: int
    """Number of pushes."""
    pushes_done: int
    """Number of successful pushes."""
    picks_tried: int
    """Number of pickups."""
    picks_done: int
    """Number of successful pickups."""
    drops_tried: int
    """Number of drops."""
    drops_done: int
    """Number of successful drops."""
    interaction_m: float
    """Sum of the drops of the lattice distance by interactions, metres, where both are finite."""
    openings: int
    """Number of interactions that open a path where there was none; not in `interaction_m`."""
    closings: int
    """Number of interactions that close the last path."""
    reward_sum: float
    """Sum of the rewards."""
    actions: tuple[int, ...]
    """Actions in order, -1 for a wait; with the episode, they replay it."""


RESULTS: Final[TableSpec[EpisodeResult]] = TableSpec(
    "results", EpisodeResult, ("episode_id", "scene_id", "room_count", "mode", "success")
)
"""Schema of `episodes.parquet`."""


def result_of(
    episode: Episode, metrics: Mapping[str, float], actions: Sequence[int]
) -> EpisodeResult:
    """Return the result of an episode from the environment's metrics at its end.

    An end from which the goal cannot be reached counts as a failure at the start's distance: it
    stays in every mean (the released code drops such episodes).
    """
    distance, reached = float(metrics["distance_to_goal_m"]), bool(metrics["success"])
    if not math.isfinite(distance):
        distance, reached = episode.shortest_path_m, False
    return EpisodeResult(
        episode_id=episode.episode_id,
        scene_id=episode.scene_id,
        room_count=episode.room_count,
        obstacle_count=episode.obstacle_count,
        mode=episode.mode,
        success=reached,
        steps=int(metrics["steps"]),
        distance_m=distance,
        shortest_path_m=episode.shortest_path_m,
        path_m=float(metrics["path_m"]),
        spl=float(metrics["spl"]) if reached else 0.0,
        sts=float(metrics["sts"]) if reached else 0.0,
        pushes_tried=int(metrics["pushes_tried"]),
        pushes_done=int(metrics["pushes_done"]),
        picks_tried=int(metrics["picks_tried"]),
        picks_done=int(metrics["picks_done"]),
        drops_tried=int(metrics["drops_tried"]),
        drops_done=int(metrics["drops_done"]),
        interaction_m=float(metrics["interaction_reward_m"]),
        openings=int(metrics["openings"]),
        closings=int(metrics["closings"]),
        reward_sum=float(metrics["return"]),
        actions=tuple(int(action) for action in actions),
    )


@dataclass(frozen=True, slots=True)
class Measure:
    """Figure of the paper: a ratio of two sums over episodes."""

    title: str
    """Name in tables."""
    unit: Literal["%", "m", ""]
    """Unit in tables: per cent of a share, metres, or none."""
    better: Literal["more", "less", ""]
    """Direction of improvement; empty for figures without one."""
    part: Callable[[EpisodeResult], tuple[float, float]]
    """Function that returns an episode's part of the numerator and of the denominator."""

    def of(self, results: Iterable[EpisodeResult]) -> float | None:
        """Return the figure of some episodes; None where the denominator is 0."""
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
"""Figures by name. Those of single episodes are means; rates of interactions are pooled."""

GROUPS: Final[Mapping[str, Callable[[EpisodeResult], bool]]] = {
    "all": lambda _: True,
    "hard": lambda r: r.room_count >= HARD_ROOMS,
    "non-interactive": lambda r: r.mode != "blocked",
    "blocked": lambda r: r.mode == "blocked",
}
"""Groups of episodes: the paper's three, and blocked ones, which need an interaction."""


@dataclass(frozen=True, slots=True)
class Summary:
    """Figures of one group of episodes."""

    episodes: int
    """Number of episodes."""
    scenes: int
    """Number of scenes."""
    values: Mapping[str, float | None]
    """Figures by their names in `MEASURES`; None where the denominator is 0."""


def summary(results: Sequence[EpisodeResult], group: str = "all") -> Summary:
    """Return the figures of one of the `GROUPS`; the order of the results does not matter."""
    chosen = [result for result in results if GROUPS[group](result)]
    values = {name: measure.of(chosen) for name, measure in MEASURES.items()}
    return Summary(len(chosen), len({result.scene_id for result in chosen}), values)
