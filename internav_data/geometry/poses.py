"""Rounding and rotations: scalar `math` only, so that processors agree to the last bit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from internav_data.core.arithmetic import plain_sum

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.records import Pose, Quaternion

METRE_DIGITS = 4
"""Decimals of stored positions and distances: 0.1 mm."""
QUATERNION_DIGITS = 6
"""Decimals of stored quaternions."""


def round_m(value: float) -> float:
    """Round a length to 0.1 mm, never to -0.0."""
    return round(float(value), METRE_DIGITS) + 0.0


def round_quaternion(quaternion: Quaternion) -> Quaternion:
    """Normalise, round to 1e-6 and choose the sign with w >= 0 (z, y, x decide where w is 0)."""
    length = math.sqrt(plain_sum(q * q for q in quaternion))
    rounded = [round(q / length, QUATERNION_DIGITS) for q in quaternion]
    leading = next((q for q in (rounded[3], rounded[2], rounded[1], rounded[0]) if q != 0.0), 1.0)
    sign = 1.0 if leading > 0.0 else -1.0
    x, y, z, w = (sign * q + 0.0 for q in rounded)
    return (x, y, z, w)


def yaw_quaternion(yaw_deg: float) -> Quaternion:
    """Return the rounded quaternion of a rotation about z, degrees counter-clockwise."""
    half = math.radians(yaw_deg) / 2.0
    return round_quaternion((0.0, 0.0, math.sin(half), math.cos(half)))


def multiply(first: Quaternion, second: Quaternion) -> Quaternion:
    """Return the Hamilton product: the rotation by `second`, then by `first`."""
    ax, ay, az, aw = first
    bx, by, bz, bw = second
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotation_matrix(quaternion: Quaternion) -> NDArray[np.float64]:
    """Return the rotation matrix of a quaternion of any length, (3, 3) float64."""
    x, y, z, w = quaternion
    s = 2.0 / (x * x + y * y + z * z + w * w)
    return np.array(
        [
            [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
        ]
    )


def transform(points: NDArray[np.float64], pose: Pose) -> NDArray[np.float64]:
    """Return points (n, 3), metres, moved from an asset's frame into the house's."""
    matrix = rotation_matrix(pose.quaternion)
    x, y, z = points[:, 0], points[:, 1], points[:, 2]
    out = np.empty_like(points, dtype=np.float64)
    # Written out: a BLAS product may differ in the last bit between processors.
    for axis, offset in enumerate((pose.x, pose.y, pose.z)):
        row = matrix[axis]
        out[:, axis] = row[0] * x + row[1] * y + row[2] * z + offset
    return out
