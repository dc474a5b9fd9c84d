"""What a moving body sweeps in the plane, step by step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from internav_data.geometry import asset_corners, centre_of_mass, transform

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.records import Asset, Pose, Quaternion, Vec3
    from internav_data.world.setting import Box

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]


@njit(cache=True)
def _widen(
    box: Floats, corners: Floats, px: float, py: float, qx: float, qy: float, qz: float, qw: float
) -> None:
    """Widen a box (low x, low y, high x, high y) to hold the turned and moved corners (n, 3)."""
    s = 2.0 / (qx * qx + qy * qy + qz * qz + qw * qw)
    a, b, c = 1.0 - s * (qy * qy + qz * qz), s * (qx * qy - qz * qw), s * (qx * qz + qy * qw)
    d, e, f = s * (qx * qy + qz * qw), 1.0 - s * (qx * qx + qz * qz), s * (qy * qz - qx * qw)
    for k in range(len(corners)):
        u, v, w = corners[k, 0], corners[k, 1], corners[k, 2]
        x, y = a * u + b * v + c * w + px, d * u + e * v + f * w + py
        box[0], box[1] = min(box[0], x), min(box[1], y)
        box[2], box[3] = max(box[2], x), max(box[3], y)


@lru_cache(maxsize=4096)
def _about_middle(asset: Asset) -> Floats:
    """Corners (n, 3) from the centre of mass, about which Bullet turns a body."""
    corners, _ = asset_corners(asset)
    return corners - np.array(centre_of_mass(asset))


@dataclass(slots=True)
class Trail:
    """The box that a body has swept so far."""

    _corners: Floats
    _box: Floats
    _middle: Vec3 = (0.0, 0.0, 0.0)
    _turn: Quaternion = (0.0, 0.0, 0.0, 1.0)
    _before: tuple[Vec3, Quaternion] | None = None

    def follow(self, middle: Vec3, turn: Quaternion) -> None:
        """Widen the box to where the body is now: its centre of mass and orientation."""
        _widen(self._box, self._corners, middle[0], middle[1], *turn)
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
    def box(self) -> Box:
        """Lowest x and y, highest x and y, metres."""
        low_x, low_y, high_x, high_y = self._box.tolist()
        return low_x, low_y, high_x, high_y


def trail_of(asset: Asset) -> Trail:
    """Begin an empty trail."""
    return Trail(_about_middle(asset), np.array([math.inf, math.inf, -math.inf, -math.inf]))


@njit(cache=True)
def _touching(boxes: Floats, low_x: float, low_y: float, high_x: float, high_y: float) -> Ints:
    found = np.empty(len(boxes), dtype=np.int64)
    count = 0
    for k in range(len(boxes)):
        if (
            boxes[k, 0] < high_x
            and boxes[k, 2] > low_x
            and boxes[k, 1] < high_y
            and boxes[k, 3] > low_y
        ):
            found[count] = k
            count += 1
    return found[:count]


def touching(boxes: Floats, box: Box) -> list[int]:
    """Which boxes (n, 4) overlap a box, ascending."""
    rows: list[int] = _touching(boxes, *box).tolist()
    return rows


@dataclass(frozen=True, slots=True)
class Extent:
    """Bounding box of a thing where it lies, metres."""

    plan: Box
    low_m: float
    high_m: float


def extent_of(asset: Asset, pose: Pose) -> Extent:
    """Bounding box of all of a thing, its parts below 2 cm included."""
    corners, _ = asset_corners(asset)
    placed = transform(corners, pose)
    low_x, low_y, low_z = placed.min(axis=0).tolist()
    high_x, high_y, high_z = placed.max(axis=0).tolist()
    return Extent((low_x, low_y, high_x, high_y), low_z, high_z)
