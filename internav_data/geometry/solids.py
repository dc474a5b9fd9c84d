"""Corners, bounds and masses of parts: one polyhedron for physics, footprints and pictures."""

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
"""Corners of the prism that stands for a cylinder, and of each ring of a sphere."""


def _unit_circle() -> NDArray[np.float64]:
    """Return the corners of a 16-gon of radius 1 that touches its bounding square, (16, 2)."""
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
    """Return two poles and three rings of 16: 50 corners on the unit sphere, (50, 3)."""
    lift = round(math.sqrt(0.5), 12)
    poles = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    return np.vstack([poles, _ring(lift, -lift), _ring(1.0, 0.0), _ring(lift, lift)])


_UNIT = {"box": _unit_box(), "cylinder": _unit_cylinder(), "sphere": _unit_sphere()}


def part_corners(part: Part) -> NDArray[np.float64]:
    """Return the corners of a part in the asset's frame, (n, 3), metres; the part is their hull."""
    if part.shape == "hull":
        local = np.array(part.corners, dtype=np.float64)
    else:
        local = _UNIT[part.shape] * (np.array(part.size) / 2.0)
    x, y, z = part.centre
    return transform(local, Pose(x, y, z, part.rotation))


@lru_cache(maxsize=4096)
def asset_corners(asset: Asset) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the corners of all parts and the first row of each part; cached, read-only.

    Corners (n, 3) float64, metres, in the asset's frame; rows (parts + 1,) int64, the last one n.
    """
    corners = [part_corners(part) for part in asset.parts]
    offsets = np.cumsum([0, *(len(c) for c in corners)]).astype(np.int64)
    stacked = np.vstack(corners)
    stacked.flags.writeable = False
    offsets.flags.writeable = False
    return stacked, offsets


def _hull_mass(points: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """Return the volume (m³) and centroid (3,) of the hull of points (n, 3), metres.

    The hull is cut into tetrahedra from its mean point to each triangle of its surface.
    """
    from scipy.spatial import ConvexHull  # noqa: PLC0415 - imported when used

    hull = ConvexHull(points)
    middle = points.mean(axis=0)
    triangles = points[hull.simplices] - middle
    volumes = np.abs(np.linalg.det(triangles)) / 6.0
    centroid = (volumes[:, None] * triangles.sum(axis=1) / 4.0).sum(axis=0) / volumes.sum()
    return float(volumes.sum()), middle + centroid


_FILLED = {"box": 1.0, "cylinder": math.pi / 4.0, "sphere": math.pi / 6.0}
"""Share of its bounding box that a shape fills."""


@lru_cache(maxsize=4096)
def centre_of_mass(asset: Asset) -> Vec3:
    """Return the centre of mass in the asset's frame, metres, of parts of equal density."""
    total, moment = 0.0, np.zeros(3)
    corners, rows = asset_corners(asset)
    for part, first, end in zip(asset.parts, rows, rows[1:], strict=False):
        if part.shape == "hull":
            volume, centroid = _hull_mass(corners[first:end])
        else:
            volume = _FILLED[part.shape] * part.size[0] * part.size[1] * part.size[2]
            centroid = np.array(part.centre)
        total += volume
        moment += volume * centroid
    x, y, z = (round_m(c / total) for c in moment)
    return (x, y, z)
