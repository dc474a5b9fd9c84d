"""Clearance of an object that is about to fall: distances in the plane, part by part in space.

A footprint leaves out what lies below 2 cm and above 1.8 m, as the agent passes there. Another
object does not: it may stand on the base of a laptop or in the foot of a television. Here every
part counts, and only against the parts that the fall could bring to its height. The kernels are
compiled by numba.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from numba import njit

from internav_data.geometry.planar import polygon_distance

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints
    from internav_data.physics.narrow_phase import ConvexPrisms

DROP_M: Final = 0.01
"""Height above the floor from which an object is released, metres."""
_NEAR_M: Final = 1e-6
"""Distance beyond which plans are not compared where only a touch matters, metres."""


def fall_clearance(falling: ConvexPrisms, others: ConvexPrisms, stop_at: float) -> float:
    """Return the distance in the plane from an object about to fall to some others, metres.

    Parts count whose heights the fall could bring together while no corner moves by `stop_at` or
    more: an object that moves less in the plane than the distance returned touches none of them.

    Parameters
    ----------
    falling
        Prisms of the object where it is to stand, upright; it is released `DROP_M` above.
    others
        Prisms of the others.
    stop_at
        Largest distance of interest, metres; returned if nothing is nearer.

    """
    return float(_clearance(*falling, *others, stop_at, DROP_M + stop_at, stop_at))


def touches(resting: ConvexPrisms, others: ConvexPrisms) -> bool:
    """Return whether a part of an object at rest meets a part of some others.

    Conservative where a part leans: it counts as the upright prism around it.
    """
    return bool(_clearance(*resting, *others, 0.0, 0.0, _NEAR_M) <= 0.0)


@njit(cache=True)
def _clearance(
    vertices: Floats,
    starts: Ints,
    boxes: Floats,
    other_vertices: Floats,
    other_starts: Ints,
    other_boxes: Floats,
    below: float,
    above: float,
    stop_at: float,
) -> float:
    """Return the least distance of plans of parts that share a height, or `stop_at`.

    Heights of the first object's parts are widened by `below` and `above`.
    """
    best = stop_at
    around = boxes[0].copy()
    for part in range(1, len(boxes)):
        for d in range(6):
            around[d] = max(around[d], boxes[part, d])
    for other in range(len(other_boxes)):
        there = other_boxes[other]
        if _gap(around, there, below, above) >= best:
            continue
        for part in range(len(boxes)):
            # A gap between boxes is a lower bound, and nearly always large enough.
            if _gap(boxes[part], there, below, above) < best:
                distance = polygon_distance(
                    vertices,
                    starts[part],
                    starts[part + 1],
                    other_vertices,
                    other_starts[other],
                    other_starts[other + 1],
                )
                best = min(best, distance)
    return best


@njit(cache=True)
def _gap(box: Floats, other: Floats, below: float, above: float) -> float:
    """Return the gap of two boxes (6,) in the plane, inf where they share no height."""
    if box[4] + above + other[5] < 0.0 or box[5] + below + other[4] < 0.0:
        return math.inf
    # Supports along opposite directions: their sum is the overlap along the axis.
    gap = -math.inf
    for d in range(4):
        gap = max(gap, -(box[d] + other[(d + 2) % 4]))
    return gap
