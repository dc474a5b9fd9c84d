"""Corner points of parts: the one polyhedron that physics, footprints and pictures share."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from internav_data.geometry.poses import round_m, transform
from internav_data.records import Part, Pose

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.records import Asset, Vec3

CIRCLE_SIDES = 16


def _unit_circle() -> NDArray[np.float64]:
    """Corners of a 16-gon that touches its bounding square, radius 1, shape (16, 2)."""
    turns = [2.0 * math.pi * k / CIRCLE_SIDES for k in range(CIRCLE_SIDES)]
    return np.array([[round(math.cos(t), 12), round(math.sin(t), 12)] for t in turns]) + 0.0


def _unit_box() -> NDArray[np.float64]:
    return np.array(
        [[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)], dtype=np.float64
    )


def _ring(radius: float, z: float) -> NDArray[np.float64]:
    circle = _unit_circle() * radius
    return np.column_stack([circle, np.full(CIRCLE_SIDES, z)])


def _unit_cylinder() -> NDArray[np.float64]:
    return np.vstack([_ring(1.0, -1.0), _ring(1.0, 1.0)])


def _unit_sphere() -> NDArray[np.float64]:
    """Poles and three rings of 16: 50 corners on the unit sphere."""
    lift = round(math.sqrt(0.5), 12)
    poles = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    return np.vstack([poles, _ring(lift, -lift), _ring(1.0, 0.0), _ring(lift, lift)])


_UNIT = {"box": _unit_box(), "cylinder": _unit_cylinder(), "sphere": _unit_sphere()}


def part_corners(part: Part) -> NDArray[np.float64]:
    """Corners of a part in the asset's frame, shape (n, 3), metres. The part is their hull."""
    if part.shape == "hull":
        local = np.array(part.corners, dtype=np.float64)
    else:
        local = _UNIT[part.shape] * (np.array(part.size) / 2.0)
    x, y, z = part.centre
    return transform(local, Pose(x, y, z, part.rotation))


@lru_cache(maxsize=4096)
def asset_corners(asset: Asset) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Corners of all parts (n, 3) and where each part's begin (parts + 1,); cached, read-only."""
    corners = [part_corners(part) for part in asset.parts]
    offsets = np.cumsum([0, *(len(c) for c in corners)]).astype(np.int64)
    stacked = np.vstack(corners)
    stacked.flags.writeable = False
    offsets.flags.writeable = False
    return stacked, offsets


def asset_bounds(asset: Asset) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest corner of the asset's own bounding box, two (3,) arrays, metres."""
    corners, _ = asset_corners(asset)
    return corners.min(axis=0), corners.max(axis=0)


def _hull_mass(points: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """Volume and centroid of the hull of some points (n, 3)."""
    from scipy.spatial import ConvexHull  # noqa: PLC0415 - imported when used

    hull = ConvexHull(points)
    middle = points.mean(axis=0)
    triangles = points[hull.simplices] - middle
    volumes = np.abs(np.linalg.det(triangles)) / 6.0
    centroid = (volumes[:, None] * triangles.sum(axis=1) / 4.0).sum(axis=0) / volumes.sum()
    return float(volumes.sum()), middle + centroid


_FILLED = {"box": 1.0, "cylinder": math.pi / 4.0, "sphere": math.pi / 6.0}


@lru_cache(maxsize=4096)
def centre_of_mass(asset: Asset) -> Vec3:
    """Centre of mass in the asset's frame, as if all its parts were equally dense, metres."""
    total, moment = 0.0, np.zeros(3)
    for part in asset.parts:
        if part.shape == "hull":
            volume, centroid = _hull_mass(part_corners(part))
        else:
            volume = _FILLED[part.shape] * part.size[0] * part.size[1] * part.size[2]
            centroid = np.array(part.centre)
        total += volume
        moment += volume * centroid
    x, y, z = (round_m(c / total) for c in moment)
    return (x, y, z)
