"""Relevance: which obstacles of an episode have a part in its lattice distance.

A set of obstacles *changes* the path if the lattice distance from start to goal is shorter without
them. Removing more of them makes it no longer, so the family of changing sets is known by its
inclusion-minimal members; an obstacle is relevant if it belongs to one of these. Up to six
obstacles all subsets are looked at. Of more, each obstacle has one minimal set shrunk around it
(deletion-based, as minimal unsatisfiable subsets are found); docs/dataset.md gives the order, so
that a reader of the file finds the same.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from internav_data.geometry import Polygons
    from internav_data.navigation import Lattice

    Changes = Callable[[frozenset[int]], bool]

EXACT_OBSTACLES: Final = 6
"""Number of obstacles up to which relevance is exact."""


def relevant_obstacles(
    lattice: Lattice,
    footprints: Sequence[Polygons],
    start: tuple[int, int],
    goal: tuple[int, int],
    steps: int | None,
) -> tuple[bool, ...]:
    """Return for each obstacle whether it is relevant.

    Parameters
    ----------
    lattice
        Lattice of the house without the obstacles; it is not changed.
    footprints
        Footprint of each obstacle, metres, in the order of spawning.
    start, goal
        Nodes, both free with all obstacles in place.
    steps
        Lattice distance between them with all obstacles in place; None when cut off.

    """
    trial = lattice.copy()
    handles = [trial.add(footprint) for footprint in footprints]

    def changes(removed: frozenset[int]) -> bool:
        for k in removed:
            trial.remove(handles[k])
        found = trial.distance(start, goal)
        for k in removed:
            handles[k] = trial.add(footprints[k])
        return found is not None and (steps is None or found < steps)

    relevant = members_of_minimal_sets(len(footprints), changes)
    return tuple(k in relevant for k in range(len(footprints)))


def members_of_minimal_sets(count: int, changes: Changes) -> frozenset[int]:
    """Return the obstacles 0 … count - 1 that belong to a minimal changing set.

    Parameters
    ----------
    count
        Number of obstacles.
    changes
        Whether the removal of a set changes the path; true of every set that holds such a one.

    """
    alone = frozenset(k for k in range(count) if changes(frozenset({k})))
    # No other minimal set holds an obstacle that changes the path alone.
    rest = frozenset(range(count)) - alone
    if len(rest) <= 1 or not changes(rest):
        return alone
    return alone | (_exact if count <= EXACT_OBSTACLES else _greedy)(rest, changes)


def _exact(rest: frozenset[int], changes: Changes) -> frozenset[int]:
    """Return the members of all minimal sets among obstacles of which none changes alone."""
    minimal: list[frozenset[int]] = []
    for size in range(2, len(rest) + 1):
        minimal += [
            chosen
            for chosen in map(frozenset, combinations(sorted(rest), size))
            if not any(known <= chosen for known in minimal) and changes(chosen)
        ]
    return frozenset().union(*minimal)


def _greedy(rest: frozenset[int], changes: Changes) -> frozenset[int]:
    """Return members of minimal sets among obstacles of which none changes alone.

    All that are returned are relevant; some may be missed. Without those that are not returned
    the path is the same.
    """
    found: frozenset[int] = frozenset()
    for k in sorted(rest):
        if k not in found:
            found |= _shrunk(rest, k, changes)
    while changes(rest - found):
        found |= _shrunk(rest - found, None, changes)
    return found


def _shrunk(removed: frozenset[int], last: int | None, changes: Changes) -> frozenset[int]:
    """Return a minimal changing subset of a changing set: obstacles are put back while it is one.

    The last spawned comes first, as it completed the obstruction and spares the others; `last`
    is put back at the end, so that a set that needs it is found.
    """
    order = sorted(removed, key=lambda k: (k == last, -k))
    for k in order:
        if changes(removed - {k}):
            removed -= {k}
    return removed
