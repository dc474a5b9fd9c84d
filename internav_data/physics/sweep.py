"""What a moving body sweeps, step by step."""

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
"""A pose is kept on a body's path once some corner may have come this far since the last one."""
_POSE: Final = 7
"""Numbers of a pose: the centre of mass and a quaternion."""
PATH_POSE_BYTES: Final = 4 * _POSE
"""Of each pose of a `SweepRecorder.path`."""
_KEPT, _LATEST, _COUNT, _LENGTH = 8, 15, 22, 23
"""Where a trail's state holds the last pose kept, the latest pose and the count of those kept;
the first eight numbers are the octagon's."""


@lru_cache(maxsize=4096)
def centred_corners(asset: Asset) -> Floats:
    """Corners (n, 3) from the centre of mass, about which Bullet turns a body; read-only."""
    corners, _ = asset_corners(asset)
    return corners - np.array(centre_of_mass(asset))


@lru_cache(maxsize=4096)
def bounding_radius_m(asset: Asset) -> float:
    """Farthest corner from the centre of mass: how far a turn can carry it, metres."""
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
    """Widen a trail to a pose, keep it where the body came far enough; returns the last shift."""
    widen(state[:8], corners, x, y, qx, qy, qz, qw)
    pose = (x, y, z, qx, qy, qz, qw)
    count = int(state[_COUNT])
    first = count == 0
    far = math.hypot(math.hypot(x - state[_KEPT], y - state[_KEPT + 1]), z - state[_KEPT + 2])
    dot = qx * state[_KEPT + 3] + qy * state[_KEPT + 4]
    dot += qz * state[_KEPT + 5] + qw * state[_KEPT + 6]
    # An angle is at most pi times the sine of its half.
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
    """What a body has swept so far."""

    _corners: Floats
    _radius: float
    _state: Floats
    _kept: Poses
    _before: tuple[float, ...] | None = None

    def follow(self, middle: Vec3, turn: Quaternion) -> float:
        """Widen it to where the body is now: its centre of mass and orientation.

        Returns how far the centre of mass came since the last call, metres.
        """
        return _follow(self._state, self._kept, self._corners, self._radius, *middle, *turn)

    def crept(self, far_m: float, far_rad: float) -> bool:
        """Whether it has come farther, or turned more, since this was last asked."""
        now = tuple(self._state[_LATEST : _LATEST + _POSE].tolist())
        before, self._before = self._before, now
        if before is None or math.dist(before[:3], now[:3]) > far_m:
            return True
        turn = abs(sum(p * q for p, q in zip(before[3:], now[3:], strict=True)))
        return 2.0 * math.acos(min(1.0, turn)) > far_rad

    @property
    def dop8(self) -> Dop8:
        """Octagon round all of it."""
        a, b, c, d, e, f, g, h = self._state[:8].tolist()
        return a, b, c, d, e, f, g, h

    @property
    def path(self) -> bytes:
        """Poses on its way as float32 numbers, seven each, the first and the last included."""
        poses = self._kept[: int(self._state[_COUNT])]
        last = self._state[_LATEST : _LATEST + _POSE].astype(np.float32)
        return poses.tobytes() + last.tobytes()


def sweep_recorder(asset: Asset, steps: int) -> SweepRecorder:
    """Begin an empty trail of at most so many steps."""
    state = np.zeros(_LENGTH)
    state[:8] = -math.inf
    kept = np.empty((steps + 1, _POSE), dtype=np.float32)
    return SweepRecorder(centred_corners(asset), bounding_radius_m(asset), state, kept)


@dataclass(frozen=True, slots=True)
class Extent:
    """How far a thing reaches where it lies, metres."""

    dop8: Dop8
    low_m: float
    high_m: float


def extent_of(asset: Asset, pose: Pose) -> Extent:
    """Extent of all of a thing, its parts below 2 cm included."""
    corners, _ = asset_corners(asset)
    reach = np.full(8, -math.inf)
    widen(reach, corners, pose.x, pose.y, *pose.quaternion)
    heights = transform(corners, pose)[:, 2]
    a, b, c, d, e, f, g, h = reach.tolist()
    return Extent((a, b, c, d, e, f, g, h), float(heights.min()), float(heights.max()))
