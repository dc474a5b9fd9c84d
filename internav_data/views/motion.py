"""Poses between two known ones, for pictures of a motion."""

from __future__ import annotations

import math

from internav_data.records import Pose


def interpolated(begin: Pose, end: Pose, share: float) -> Pose:
    """Return a pose between two, by the shorter rotation; positions go straight."""
    a, b = begin.quaternion, end.quaternion
    sign = 1.0 if sum(p * q for p, q in zip(a, b, strict=True)) >= 0.0 else -1.0
    x, y, z, w = (p + share * (sign * q - p) for p, q in zip(a, b, strict=True))
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return Pose(
        begin.x + share * (end.x - begin.x),
        begin.y + share * (end.y - begin.y),
        begin.z + share * (end.z - begin.z),
        (x / length, y / length, z / length, w / length),
    )


def eased(share: float) -> float:
    """Return how far a slide has come after a share of its time: slower towards the end."""
    return 1.0 - (1.0 - share) ** 2
