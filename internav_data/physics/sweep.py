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
"""Length of one pose in `SweepRecorder.path`, bytes."""
_KEPT, _LATEST, _COUNT, _LENGTH = 8, 15, 22, 23
"""Offsets into a recorder's state, one array that its kernel can write: the 8-DOP comes first, then
the last recorded pose, the latest pose and the number of recorded poses; `_LENGTH` is its size."""


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
def _follow(
    state: Floats,
    kept: Poses,
    corners: Floats,
    radius: float,
    x: float,
    y: float,
    z: float,
    qx: float,
    qy: float,
    qz: float,
    qw: float,
) -> float:
    """Widen the 8-DOP to a pose and record the pose if the body moved far enough since the last.

    Returns the distance of the centre of mass from the latest pose, metres; inf at first.
    """
    widen(state[:8], corners, x, y, qx, qy, qz, qw)
    pose = (x, y, z, qx, qy, qz, qw)
    count = int(state[_COUNT])
    first = count == 0
    far = math.hypot(math.hypot(x - state[_KEPT], y - state[_KEPT + 1]), z - state[_KEPT + 2])
    dot = qx * state[_KEPT + 3] + qy * state[_KEPT + 4]
    dot += qz * state[_KEPT + 5] + qw * state[_KEPT + 6]
    # A bound of the angle since the last recorded pose without its arc cosine: dot is the cosine
    # of half the angle, and an angle is at most pi times the sine of its half.
    turn = math.pi * math.sqrt(max(0.0, 1.0 - dot * dot))
    dx, dy, dz = x - state[_LATEST], y - state[_LATEST + 1], z - state[_LATEST + 2]
    if (first or far + radius * turn >= KEPT_M) and count < len(kept):
        for k in range(_POSE):
            kept[count, k] = pose[k]
            state[_KEPT + k] = pose[k]
        state[_COUNT] = count + 1
    for k in range(_POSE):
        state[_LATEST + k] = pose[k]
    return math.inf if first else math.sqrt(dx * dx + dy * dy + dz * dz)


@dataclass(slots=True)
class SweepRecorder:
    """Record of one body's motion: a planar 8-DOP of its sweep, and sampled poses."""

    _corners: Floats
    _radius: float
    _state: Floats
    _kept: Poses

    def follow(self, middle: Vec3, turn: Quaternion) -> float:
        """Add the body's present centre of mass and orientation to the record.

        Returns
        -------
        float
            Distance that the centre of mass moved since the last call, metres; inf at first.

        """
        return _follow(self._state, self._kept, self._corners, self._radius, *middle, *turn)

    @property
    def dop8(self) -> Dop8:
        """Planar 8-DOP of the sweep so far."""
        a, b, c, d, e, f, g, h = self._state[:8].tolist()
        return a, b, c, d, e, f, g, h

    @property
    def path(self) -> bytes:
        """Recorded poses, (n, 7) float32 as bytes, the first and the latest included."""
        poses = self._kept[: int(self._state[_COUNT])]
        last = self._state[_LATEST : _LATEST + _POSE].astype(np.float32)
        return poses.tobytes() + last.tobytes()


def sweep_recorder(asset: Asset, steps: int) -> SweepRecorder:
    """Return an empty recorder for at most `steps` calls of `follow`."""
    state = np.zeros(_LENGTH)
    state[:8] = -math.inf
    kept = np.empty((steps + 1, _POSE), dtype=np.float32)
    return SweepRecorder(centred_corners(asset), bounding_radius_m(asset), state, kept)


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
