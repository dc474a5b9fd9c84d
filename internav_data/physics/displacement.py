"""Displacement, tilt and rest: comparisons of an object's poses before and after."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from internav_data.geometry import centre_of_mass

if TYPE_CHECKING:
    from internav_data.records import Asset, Pose, Quaternion, Vec3

STILL_M: Final = 0.0005
STILL_RAD: Final = 0.001
"""A neighbour that moved and turned less has not moved: an engine's bodies tremble at rest."""


def _rotated(quaternion: Quaternion, vector: Vec3) -> Vec3:
    """Rotate a vector. Plain floats: numpy arrays of three cost more than they save."""
    x, y, z, w = quaternion
    u, v, t = vector
    s = 2.0 / (x * x + y * y + z * z + w * w)
    # Twice the cross product with the axis, then once more (Rodrigues).
    a, b, c = y * t - z * v, z * u - x * t, x * v - y * u
    return (
        u + s * (w * a + y * c - z * b),
        v + s * (w * b + z * a - x * c),
        t + s * (w * c + x * b - y * a),
    )


def shift_m(asset: Asset, before: Pose, after: Pose) -> float:
    """Return the distance in the plane that an object's centre of mass moved, metres."""
    middle = centre_of_mass(asset)
    ax, ay, _ = _rotated(before.quaternion, middle)
    bx, by, _ = _rotated(after.quaternion, middle)
    return math.hypot(after.x + bx - before.x - ax, after.y + by - before.y - ay)


def tilt_deg(before: Quaternion, after: Quaternion) -> float:
    """Return the angle between an object's upward axis before and after, degrees."""
    a, b = _rotated(before, (0.0, 0.0, 1.0)), _rotated(after, (0.0, 0.0, 1.0))
    return math.degrees(math.acos(max(-1.0, min(1.0, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]))))


def is_still(here: Pose, there: Pose) -> bool:
    """Return whether two poses differ by less than an engine's bodies tremble at rest."""
    near = math.dist((here.x, here.y, here.z), (there.x, there.y, there.z)) < STILL_M
    return near and _turn_rad(here.quaternion, there.quaternion) < STILL_RAD


def _turn_rad(before: Quaternion, after: Quaternion) -> float:
    """Return the angle between two orientations, radians.

    From the chord of the unit quaternions. Their product would not do: a length that rounding to
    1e-6 leaves 1e-6 short looks like a turn of 3 mrad in its arc cosine.
    """
    p, q = _unit(before), _unit(after)
    # q and -q are one orientation.
    chord = min(math.dist(p, q), math.dist(p, tuple(-n for n in q)))
    return 4.0 * math.asin(min(1.0, chord / 2.0))


def _unit(quaternion: Quaternion) -> tuple[float, ...]:
    length = math.hypot(*quaternion)
    return tuple(n / length for n in quaternion)
