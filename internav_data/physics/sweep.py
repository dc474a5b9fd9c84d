"""Sweeps: the area that a moving body covers and poses of its path, recorded step by step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numba import njit

from internav_data.geometry import asset_corners, centre_of_mass, transform
from internav_data.physics.kdop import widen

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.core.typing import Floats
    from internav_data.physics.kdop import Dop8
    from internav_data.records import Asset, Pose

    Poses = NDArray[np.float32]

KEPT_M: Final = 0.004
"""Distance that a corner may move between two recorded poses, metres."""
_POSE: Final = 7
"""Length of a recorded pose: the centre of mass (3) and a quaternion (4)."""
PATH_POSE_BYTES: Final = 4 * _POSE
"""Length of one pose of a path in `sweep_of`, bytes."""


@lru_cache(maxsize=4096)
def centred_corners(asset: Asset) -> Floats:
    """Return an asset's corners relative to its centre of mass, (n, 3), metres; read-only."""
    corners, _ = asset_corners(asset)
    return corners - np.array(centre_of_mass(asset))


@lru_cache(maxsize=4096)
def bounding_radius_m(asset: Asset) -> float:
    """Return the distance of the farthest corner from the centre of mass, metres.

    No corner moves farther than this times the angle, in radians, when the body turns.
    """
    corners = centred_corners(asset)
    return max(math.hypot(*corner) for corner in corners.tolist())


@njit(cache=True)
def _record(corners: Floats, radius: float, poses: Floats, reach: Floats) -> Poses:
    """Widen an 8-DOP (8,) to poses (n, 7); return those that lie apart, and the latest one."""
    kept = np.empty((len(poses) + 1, _POSE), dtype=np.float32)
    count, last = 0, 0
    for k in range(len(poses)):
        x, y, z, qx, qy, qz, qw = poses[k]
        widen(reach, corners, x, y, qx, qy, qz, qw)
        far = math.hypot(math.hypot(x - poses[last, 0], y - poses[last, 1]), z - poses[last, 2])
        dot = qx * poses[last, 3] + qy * poses[last, 4]
        dot += qz * poses[last, 5] + qw * poses[last, 6]
        # A bound of the angle since the last recorded pose without its arc cosine: dot is the
        # cosine of half the angle, and an angle is at most pi times the sine of its half.
        turn = math.pi * math.sqrt(max(0.0, 1.0 - dot * dot))
        if k == 0 or far + radius * turn >= KEPT_M:
            kept[count] = poses[k]
            count, last = count + 1, k
    kept[count] = poses[-1]
    return kept[: count + 1]


def sweep_of(asset: Asset, placements: Floats) -> tuple[Dop8, bytes]:
    """Return the planar 8-DOP of a motion's sweep, and sampled poses.

    Parameters
    ----------
    asset
        Body that moves.
    placements
        Its centre of mass and orientation after each step, (n, 7), the start first.

    Returns
    -------
    dop8
        Planar 8-DOP of the sweep.
    path
        Recorded poses, (k, 7) float32 as bytes, the first and the latest included.

    """
    reach = np.full(8, -math.inf)
    poses = np.ascontiguousarray(placements)
    path = _record(centred_corners(asset), bounding_radius_m(asset), poses, reach)
    a, b, c, d, e, f, g, h = reach.tolist()
    return (a, b, c, d, e, f, g, h), path.tobytes()


@dataclass(frozen=True, slots=True)
class Extent:
    """Bounds of an object at its pose, metres: planar 8-DOP, lowest and highest point."""

    dop8: Dop8
    low_m: float
    high_m: float


def extent_of(asset: Asset, pose: Pose) -> Extent:
    """Return an object's extent; unlike its footprint, it includes the parts below 2 cm."""
    corners, _ = asset_corners(asset)
    reach = np.full(8, -math.inf)
    widen(reach, corners, pose.x, pose.y, *pose.quaternion)
    heights = transform(corners, pose)[:, 2]
    a, b, c, d, e, f, g, h = reach.tolist()
    return Extent((a, b, c, d, e, f, g, h), float(heights.min()), float(heights.max()))
