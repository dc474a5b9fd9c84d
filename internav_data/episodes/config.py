"""Settings of the generation of episodes: the figures of the algorithm that users may change."""

from __future__ import annotations

from collections.abc import Iterable, Mapping  # noqa: TC003 - read at run time by the settings
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Annotated, Literal, get_args

from internav_data.core.config import Bounds, check_bounds
from internav_data.records.errors import UsageError

IdleObstacles = Literal["keep", "drop"]
Weight = Annotated[float, Bounds(0.0, 1000.0)]
ObstacleCount = Annotated[int, Bounds(1)]


@dataclass(frozen=True, slots=True)
class EpisodeConfig:
    """Settings of the episodes; the defaults are calibrated to Table 2 of the paper."""

    max_obstacles: tuple[ObstacleCount, ObstacleCount, ObstacleCount] = (4, 9, 18)
    """Maximum number of obstacles in houses of 1-2, 3-5 and 6-10 rooms; where they do not suffice,
    start and goal are drawn anew."""
    lateral_std_m: Annotated[float, Bounds(0.0)] = 0.40
    """Standard deviation of an obstacle's distance from the path, metres."""
    gap_m: Annotated[float, Bounds(0.0)] = 0.01
    """Minimum distance of an obstacle from all other objects when it is spawned, metres."""
    min_shortest_path_m: Annotated[float, Bounds(0.0, exclusive=True)] = 2.0
    """Minimum Euclidean path length from start to goal without obstacles, metres."""
    max_spawn_tries: Annotated[int, Bounds(1)] = 200
    """Maximum number of spots tried for the obstacles of one start and goal."""
    max_redraws: Annotated[int, Bounds(1)] = 50
    """Maximum number of starts and goals tried for one episode."""
    keep_unsolvable: bool = False
    """Keep episodes for which the expert finds no plan, their `expert` null; else draw again."""
    idle_obstacles: IdleObstacles = "keep"
    """`keep` obstacles that are not relevant (docs/dataset.md), as the paper's procedure does, or
    `drop` them before expert and outcomes."""
    min_detour_steps: Annotated[int, Bounds(1)] = 2
    """Minimum further steps of a lengthened path; 2 is any, as lattice detours are even."""
    min_interactions: Annotated[int, Bounds(0)] = 0
    """Minimum number of pushes and pick-ups of the expert; with fewer, start and goal are drawn
    anew."""
    refuse_facing_wall: bool = False
    """Refuse starts whose first step ahead a wall or furniture blocks."""
    min_start_nodes: Annotated[int, Bounds(1)] = 1
    """Minimum number of nodes within reach of the start before any interaction."""
    asset_weights: Mapping[str, Weight] = field(default_factory=dict)
    """Weights of types of obstacles, with which each asset of a type is drawn; 1 where a type has
    none, 0 for never."""
    balance: bool = False
    """Draw by weights that let each type of the catalogue stand about as often as its share of the
    assets, where uniform draws leave few large objects."""
    blind_expert: bool = False
    """Store the run of an expert that knows the averages of types, not an object's own mass,
    friction and fixedness, and learns by failing."""
    unseen_assets: bool = False
    """Each split draws its obstacles from its own share of the assets (2/3, 1/6, 1/6)."""

    def check(self) -> None:
        """Check all values.

        Raises
        ------
        UsageError
            A value is out of its bounds, or none of those that the setting may have.

        """
        check_bounds(self, "{key}: expected {expected}, got {value}", "episodes.")
        known = get_args(IdleObstacles)
        if self.idle_obstacles not in known:
            raise UsageError(
                f"episodes.idle_obstacles: expected one of {', '.join(known)}, "
                f"got {self.idle_obstacles!r}"
            )

    def max_obstacles_for(self, room_count: int) -> int:
        """Return the maximum number of obstacles in a house with a number of rooms."""
        few, some, many = self.max_obstacles
        if room_count <= 2:  # noqa: PLR2004 - the classes of Table 2
            return few
        return some if room_count <= 5 else many  # noqa: PLR2004


def check_types(weights: Mapping[str, float], types: Iterable[str]) -> None:
    """Check that every type with a weight in `asset_weights` is one of obstacles.

    Raises
    ------
    UsageError
        A type is none of `types`.

    """
    known = sorted(set(types))
    for kind in sorted(set(weights) - set(known)):
        near = get_close_matches(kind, known, 2)
        listed = (
            "did you mean " + " or ".join(near) + "?" if near else f"expected {', '.join(known)}"
        )
        raise UsageError(f"episodes.asset_weights: no obstacle has the type {kind!r}; {listed}")
