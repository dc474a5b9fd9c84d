"""Relevance of obstacles, derived again from its definition on the validator's own lattice.

docs/dataset.md defines it. Up to six obstacles every subset is judged; of more, the sets that its
text describes. Sets are bit masks here: bit k stands for obstacle k.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.verification.checked_lattice import FreeSpace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Geometry

    from internav_data.records import Episode
    from internav_data.verification.checked_lattice import CheckedLattice
    from internav_data.verification.findings import FindingCollector

ALL_SUBSETS = 6
"""Number of obstacles up to which every subset is judged."""


class Removals:
    """Lattice distance from start to goal without some of an episode's obstacles.

    Parameters
    ----------
    lattice
        Lattice of the house.
    footprints
        Footprint of each obstacle.
    start, goal
        Numbers of two nodes.

    Attributes
    ----------
    count
        Number of obstacles.
    steps
        Lattice distance with all of them in place, inf when cut off.

    """

    def __init__(
        self,
        lattice: CheckedLattice,
        footprints: Sequence[Sequence[Geometry]],
        start: int,
        goal: int,
    ) -> None:
        self.count = len(footprints)
        self._lattice, self._start, self._goal = lattice, start, goal
        self._spaces = [lattice.with_obstacles(own) for own in footprints]
        self._shorter: list[int] = []
        self._same: list[int] = []
        self.steps = self._steps(0)

    def free(self, removed: int = 0) -> FreeSpace:
        """Return what is free without the obstacles of a mask."""
        nodes, edges = self._lattice.free.nodes.copy(), self._lattice.free.edges.copy()
        for k, space in enumerate(self._spaces):
            if not removed >> k & 1:
                nodes &= space.nodes
                edges &= space.edges
        return FreeSpace(nodes, edges)

    def changes(self, removed: int) -> bool:
        """Return whether the goal is nearer without the obstacles of a mask."""
        # Whoever removes more has no longer path, and no shorter one who removes less.
        if any(known & removed == known for known in self._shorter):
            return True
        if any(known & removed == removed for known in self._same):
            return False
        nearer = self._steps(removed) < self.steps
        (self._shorter if nearer else self._same).append(removed)
        return nearer

    def _steps(self, removed: int) -> float:
        return float(self._lattice.distances(self._goal, self.free(removed))[self._start])


def relevant(removals: Removals) -> tuple[bool, ...]:
    """Return for each obstacle whether it is relevant."""
    every = (1 << removals.count) - 1
    alone = [1 << k for k in range(removals.count) if removals.changes(1 << k)]
    rest = every - sum(alone)
    # Asked first, as its answer is often that of all its subsets.
    found = [] if not removals.changes(rest) else _others(removals, rest)
    members = 0
    for minimal in (*alone, *found):
        members |= minimal
    return tuple(bool(members >> k & 1) for k in range(removals.count))


def _others(removals: Removals, rest: int) -> list[int]:
    """Return minimal sets among the obstacles of a mask."""
    if removals.count > ALL_SUBSETS:
        return _put_back(removals, rest)
    changing = [m for m in range(1, rest + 1) if m & rest == m and removals.changes(m)]
    return [m for m in changing if not any(n != m and n & m == n for n in changing)]


def _put_back(removals: Removals, rest: int) -> list[int]:
    """Return what stays removed after obstacles were put back, as docs/dataset.md says."""
    found: list[int] = []

    def missing() -> int:
        known = 0
        for minimal in found:
            known |= minimal
        return rest & ~known

    def shrink(removed: int, last: int) -> None:
        order = [k for k in reversed(range(removals.count)) if k != last]
        for k in (*order, last):
            if removed >> k & 1 and removals.changes(removed & ~(1 << k)):
                removed &= ~(1 << k)
        found.append(removed)

    for k in range(removals.count):
        if missing() >> k & 1:
            shrink(rest, k)
    while removals.changes(missing()):
        shrink(missing(), 0)
    return found


def check_relevance(episode: Episode, removals: Removals, report: FindingCollector) -> None:
    """Check which obstacles are stated to be relevant; those of earlier releases state nothing."""
    stated = tuple(obstacle.relevant for obstacle in episode.obstacles)
    if all(value is None for value in stated):
        return
    found = relevant(removals)
    report.expect(
        stated == found, "obstacle.relevant", f"relevant: {found}", stated, episode.episode_id
    )
