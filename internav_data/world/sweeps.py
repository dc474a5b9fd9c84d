"""What a moving body sweeps in the plane, step by step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from internav_data.geometry import asset_corners, centre_of_mass, transform
from internav_data.world.octagons import widen

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.records import Asset, Pose, Quaternion, Vec3
    from internav_data.world.octagons import Octagon

    Floats = NDArray[np.float64]


@lru_cache(maxsize=4096)
def _about_middle(asset: Asset) -> Floats:
    """Corners (n, 3) from the centre of mass, about which Bullet turns a body."""
    corners, _ = asset_corners(asset)
    return corners - np.array(centre_of_mass(asset))


@dataclass(slots=True)
class Trail:
    """What a body has swept so far."""

    _corners: Floats
    _reach: Floats
    _middle: Vec3 = (0.0, 0.0, 0.0)
    _turn: Quaternion = (0.0, 0.0, 0.0, 1.0)
    _before: tuple[Vec3, Quaternion] | None = None

    def follow(self, middle: Vec3, turn: Quaternion) -> None:
        """Widen it to where the body is now: its centre of mass and orientation."""
        widen(self._reach, self._corners, middle[0], middle[1], *turn)
        self._middle, self._turn = middle, turn

    def crept(self, far_m: float, far_rad: float) -> bool:
        """Whether it has come farther, or turned more, since this was last asked."""
        before, self._before = self._before, (self._middle, self._turn)
        if before is None or math.dist(before[0], self._middle) > far_m:
            return True
        ax, ay, az, aw = before[1]
        bx, by, bz, bw = self._turn
        return 2.0 * math.acos(min(1.0, abs(ax * bx + ay * by + az * bz + aw * bw))) > far_rad

    @property
    def octagon(self) -> Octagon:
        """Octagon round all of it."""
        a, b, c, d, e, f, g, h = self._reach.tolist()
        return a, b, c, d, e, f, g, h


def trail_of(asset: Asset) -> Trail:
    """Begin an empty trail."""
    return Trail(_about_middle(asset), np.full(8, -math.inf))


@dataclass(frozen=True, slots=True)
class Extent:
    """How far a thing reaches where it lies, metres."""

    octagon: Octagon
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
