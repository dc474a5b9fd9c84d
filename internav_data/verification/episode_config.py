"""Predicates of an episode against the manifest's config: what its settings refuse.

They judge by the stored values alone, which other predicates prove.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.records import Episode
    from internav_data.verification.findings import FindingCollector


BOOLEANS = (False, True)


@dataclass(frozen=True, slots=True)
class EpisodeRequest:
    """Settings of the config that every episode must agree with."""

    drops_idle: bool = False
    """Whether every obstacle is relevant."""
    min_detour_steps: int = 1
    """Minimum further steps of a lengthened path."""
    min_interactions: int = 0
    """Minimum number of pushes and pick-ups of an expert."""
    refuses_walls: bool = False
    """Whether no start faces a wall."""
    min_start_nodes: int = 1
    """Minimum number of nodes within reach of the start."""
    never: frozenset[str] = frozenset()
    """Types of obstacles that are never drawn."""


def episode_request(config: Mapping[str, Any]) -> EpisodeRequest:
    """Read the settings of episodes from a manifest's config; missing ones refuse nothing.

    Raises
    ------
    CorruptDataError
        A value that no generator writes.

    """
    section = config.get("episodes")
    values: Mapping[str, Any] = section if isinstance(section, dict) else {}

    def second_of(key: str, *known: object) -> bool:
        value = values.get(key, known[0])
        if value not in known:
            raise _unknown(key, " or ".join(map(str, known)), value)
        return bool(value == known[1])

    def number(key: str, low: int) -> int:
        value = values.get(key, low)
        if type(value) is not int or value < low:
            raise _unknown(key, f"{low} or more", value)
        return value

    return EpisodeRequest(
        second_of("idle_obstacles", "keep", "drop"),
        number("min_detour_steps", 1),
        number("min_interactions", 0),
        second_of("refuse_facing_wall", *BOOLEANS),
        number("min_start_nodes", 1),
        _never_drawn(values.get("asset_weights") or {}),
    )


def _never_drawn(weights: object) -> frozenset[str]:
    if not isinstance(weights, dict) or not all(
        isinstance(weight, int | float) and weight >= 0 for weight in weights.values()
    ):
        raise _unknown("asset_weights", "weights by type", weights)
    return frozenset(kind for kind, weight in weights.items() if weight == 0)


def _unknown(key: str, expected: str, value: object) -> CorruptDataError:
    return CorruptDataError(
        f"manifest.json: config.episodes.{key}: expected {expected}, got {value!r}; "
        "generate the dataset again"
    )


def check_episode_config(
    episode: Episode, request: EpisodeRequest, report: FindingCollector
) -> None:
    """Check an episode against the settings of its dataset."""

    def expect(holds: object, name: str, expected: object, got: object) -> None:
        predicate = f"schema.episodes.config-{name}"
        report.expect(holds, predicate, expected, got, episode.episode_id)

    if request.drops_idle:
        relevant = [obstacle.relevant for obstacle in episode.obstacles]
        expect(all(relevant), "idle-obstacles", "relevant obstacles alone", relevant)
    steps = episode.obstructed_path_steps
    if steps is not None:
        low = episode.shortest_path_steps + request.min_detour_steps
        expect(steps >= low, "min-detour-steps", f"at least {low} steps", steps)
    if episode.expert is not None:
        interactions = episode.expert.pushes + episode.expert.picks
        low = request.min_interactions
        expect(interactions >= low, "min-interactions", f"at least {low}", interactions)
    if request.never:
        found = request.never & {obstacle.type for obstacle in episode.obstacles}
        expect(not found, "asset-weights", "no type of weight 0", sorted(found))
    start = episode.start
    if request.refuses_walls:
        expect(start.faces_wall is False, "facing-wall", "a free step ahead", start.faces_wall)
    low = request.min_start_nodes
    if low > 1:
        nodes = start.reachable_nodes or 0
        expect(nodes >= low, "min-start-nodes", f"at least {low} nodes", start.reachable_nodes)
