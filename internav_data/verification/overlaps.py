"""Overlap tests of convex solids: slabs first, a linear programme for the remaining pairs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, QhullError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from shapely import Geometry

    from internav_data.core.typing import Floats
    from internav_data.verification.shapes import Slab

WALL_ID = -1
"""Owner of the slabs of walls."""
DEPTH_M = 0.001
"""Overlaps below this depth count as contact: poses are rounded to 0.1 mm."""
GRID_M = 1e-9
"""Grid of overlays. Without one, GEOS 3.14 finds two copies of a polygon disjoint where their
corners differ in the last digits."""
MAX_INTRUSIONS = 200
"""Pairs of bodies in each other that are told: more tell nothing new, and each takes milliseconds
(a damaged file may hold hundreds of copies of an obstacle in one place)."""


def plans_overlap(first: Geometry, second: Geometry, depth_m: float = DEPTH_M) -> bool:
    """Return whether two plans share a disc of diameter `depth_m` (or more)."""
    # A strip as long as a room and thinner than the rounding has a large area but holds no disc.
    shared = shapely.intersection(first, second, grid_size=GRID_M)
    if shapely.area(shared) < np.pi * (depth_m / 2.0) ** 2:
        return False
    return not shapely.is_empty(shapely.buffer(shared, -depth_m / 2.0))


def overlapping_plans(
    first: Sequence[Geometry], second: Sequence[Geometry], depth_m: float = DEPTH_M
) -> list[tuple[int, int]]:
    """Return pairs (index in first, index in second) of plans that overlap over `depth_m`."""
    if not first or not second:
        return []
    tree = shapely.STRtree(np.array(second, dtype=object))
    near = tree.query(np.array(first, dtype=object), predicate="intersects")
    return [(int(a), int(b)) for a, b in near.T if plans_overlap(first[a], second[b], depth_m)]


def _half_spaces(corners: Floats) -> Floats:
    return np.asarray(ConvexHull(corners).equations)


def hulls_overlap(first: Floats, second: Floats, depth_m: float = DEPTH_M) -> bool:
    """Return whether a ball of diameter `depth_m` fits into both hulls of corners (n, 3).

    The largest ball is the Chebyshev centre of all half-spaces, a linear programme (Boyd and
    Vandenberghe 2004, section 8.5.1).
    """
    try:
        planes = np.vstack([_half_spaces(first), _half_spaces(second)])
    except (QhullError, ValueError):  # a flat part has no inside
        return False
    # Unknowns are the centre and the radius r: n · x + r <= d for each half-space, largest r.
    # Normals have length one, so that r is in metres.
    limits = np.column_stack([planes[:, :3], np.ones(len(planes))])
    answer = linprog(
        [0.0, 0.0, 0.0, -1.0],
        A_ub=limits,
        b_ub=-planes[:, 3],
        bounds=[(None, None)] * 3 + [(0.0, None)],
    )
    return answer.x is not None and bool(answer.x[3] > depth_m / 2.0)


def overlapping_slabs(
    slabs: Sequence[Slab],
    owners: Sequence[int],
    may_interlock: Callable[[int, int], bool],
    depth_m: float = DEPTH_M,
) -> list[tuple[int, int]]:
    """Return pairs of owners (ascending) whose slabs overlap in space over `depth_m`."""
    if not slabs:
        return []
    plans = np.array([slab.plan for slab in slabs], dtype=object)
    left, right = shapely.STRtree(plans).query(plans, predicate="intersects")
    found: set[tuple[int, int]] = set()
    for a, b in zip(left.tolist(), right.tolist(), strict=True):
        pair = (owners[a], owners[b])
        if pair[0] >= pair[1] or pair in found or may_interlock(*pair):
            continue
        one, two = slabs[a], slabs[b]
        # Heights first: an interval costs nothing, a hull a millisecond.
        if min(one.high, two.high) - max(one.low, two.low) <= depth_m:
            continue
        if plans_overlap(one.plan, two.plan, depth_m) and hulls_overlap(
            one.corners, two.corners, depth_m
        ):
            found.add(pair)
    return sorted(found)


@dataclass(frozen=True, slots=True, eq=False)
class Solids:
    """Slabs of several bodies, with the boxes around them for a fast test."""

    slabs: tuple[Slab, ...]
    owners: tuple[int, ...]
    """Number of each slab's body."""
    boxes: Floats
    """Lowest, then highest corner of each slab, (n, 6) float64, metres."""

    @staticmethod
    def of(bodies: Iterable[tuple[int, Sequence[Slab]]]) -> Solids:
        """Gather bodies, each with its number."""
        owned = [(owner, slab) for owner, slabs in bodies for slab in slabs]
        boxes = np.empty((len(owned), 6))
        if owned:
            corners = [slab.corners for _, slab in owned]
            stacked, first = np.vstack(corners), np.cumsum([0, *map(len, corners[:-1])])
            boxes[:, :3] = np.minimum.reduceat(stacked, first)
            boxes[:, 3:] = np.maximum.reduceat(stacked, first)
        return Solids(tuple(s for _, s in owned), tuple(owner for owner, _ in owned), boxes)

    def near(self, others: Solids, grow: Sequence[float]) -> list[tuple[int, int]]:
        """Return index pairs of slabs whose boxes share a point, in order.

        `grow` widens these boxes along x, y and z, downwards, then upwards, metres (6 numbers).
        """
        meet = np.ones((len(self.slabs), len(others.slabs)), dtype=bool)
        for axis in range(3):
            low = self.boxes[:, axis] - grow[axis]
            high = self.boxes[:, axis + 3] + grow[axis + 3]
            meet &= low[:, None] <= others.boxes[:, axis + 3]
            meet &= high[:, None] >= others.boxes[:, axis]
        return [(int(a), int(b)) for a, b in np.argwhere(meet)]


def intrusions(first: Solids, second: Solids, depth_m: float = DEPTH_M) -> list[tuple[int, int]]:
    """Return pairs of bodies (of first, of second), ascending, over `depth_m` in each other.

    Slabs count in space, at all heights: also those that no footprint holds. Bodies of one and the
    same set are compared once, the higher number first, and never with themselves. After
    `MAX_INTRUSIONS` pairs no more are looked for.
    """
    found: set[tuple[int, int]] = set()
    for a, b in first.near(second, (-depth_m,) * 6):
        if len(found) == MAX_INTRUSIONS:
            break
        pair = first.owners[a], second.owners[b]
        if pair in found or (first is second and pair[0] <= pair[1]):
            continue
        one, two = first.slabs[a], second.slabs[b]
        # Plans first: boxes of turned parts often meet, and a linear programme takes a millisecond.
        if shapely.intersects(one.plan, two.plan) and hulls_overlap(
            one.corners, two.corners, depth_m
        ):
            found.add(pair)
    return sorted(found)
