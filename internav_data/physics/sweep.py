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
    from internav_data.records import Asset, Pose, Quaternion, Vec3

    Poses = NDArray[np.float32]

KEPT_M: Final = 0.004
"""Distance that a corner may move between two recorded poses, metres."""
_POSE: Final = 7
"""Length of a recorded pose: the centre of mass (3) and a quaternion (4)."""
PATH_POSE_BYTES: Final = 4 * _POSE
"""Length of one pose in `SweepRecorder.recorded`, bytes."""


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


class SweepRecorder:
    """Record of one body's motion: a planar 8-DOP of its sweep, and sampled poses."""

    __slots__ = ("_asset", "_placements")

    def __init__(self, asset: Asset) -> None:
        self._asset = asset
        self._placements: list[tuple[Vec3, Quaternion]] = []

    def follow(self, middle: Vec3, turn: Quaternion) -> float:
        """Add the body's present centre of mass and orientation to the record.

        Returns
        -------
        float
            Distance that the centre of mass moved since the last call, metres; inf at first.

        """
        placements = self._placements
        shift = math.dist(middle, placements[-1][0]) if placements else math.inf
        placements.append((middle, turn))
        return shift

    def recorded(self) -> tuple[Dop8, bytes]:
        """Return what is known of the motion so far.

        Returns
        -------
        dop8
            Planar 8-DOP of the sweep.
        path
            Recorded poses, (n, 7) float32 as bytes, the first and the latest included.

        """
        # All at once: a call of a compiled kernel takes a tenth of a step of the engine.
        poses = np.array([(*middle, *turn) for middle, turn in self._placements])
        reach = np.full(8, -math.inf)
        asset = self._asset
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
