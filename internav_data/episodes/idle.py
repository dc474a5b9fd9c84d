"""Idle obstacles: those that are not relevant, dropped until all that is left is relevant."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.episodes.relevance import relevant_obstacles
from internav_data.episodes.spawn import settled_at
from internav_data.physics import Body

if TYPE_CHECKING:
    from internav_data.episodes.spawn import EpisodeDraft


def relevance_of(draft: EpisodeDraft) -> tuple[bool, ...]:
    """Return for each obstacle of a draft whether it is relevant."""
    footprints = [obstacle.footprint for obstacle in draft.obstacles]
    return relevant_obstacles(draft.site.lattice, footprints, draft.start, draft.goal, draft.steps)


def drop_idle(draft: EpisodeDraft) -> bool:
    """Remove the idle obstacles of a draft whose mode's condition holds.

    The lattice distance stays as it is, and with it the condition.

    Returns
    -------
    bool
        Whether each obstacle that is left would have come to rest as it did without those that
        are gone; if not, the draft is spoilt.

    """
    relevant = relevance_of(draft)
    # Without idle obstacles a relevant one may have become idle in its turn.
    while not all(relevant):
        kept = [o for o, matters in zip(draft.obstacles, relevant, strict=True) if matters]
        draft.lattice, draft.obstacles = draft.site.lattice.copy(), []
        for obstacle in kept:
            body = Body(obstacle.asset, obstacle.spot, obstacle.dynamics)
            if settled_at(draft, body) != obstacle.settled:
                return False
            draft.lattice.add(obstacle.footprint)
            draft.obstacles.append(obstacle)
        draft.steps = draft.lattice.distance(draft.start, draft.goal)
        relevant = relevance_of(draft)
    return draft.done
