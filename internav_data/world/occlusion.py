"""Occlusion shapes: convex parts as half-spaces that rays can meet, and visibility points."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from internav_data.geometry import asset_corners, rotation_matrix

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints
    from internav_data.records import Asset, Part, Pose

MAX_POINTS: Final = 32
"""Maximum number of visibility points of an asset: the centres of its parts, then corners, evenly
chosen."""


class OcclusionShape(NamedTuple):
    """An object's convex parts as half-spaces, and its visibility points."""

    planes: Floats
    """Planes of all parts, (m, 4) float64: a point p is inside a part if n · p <= d holds for every
    row (n, d) of it."""
    starts: Ints
    """Index of each part's first plane, and m, (parts + 1,) int64."""
    points: Floats
    """Visibility points, (p, 3) float64, metres."""
    owners: Ints
    """Part of each point, which does not hide it, (p,) int64."""


def _planes_of(corners: Floats) -> Floats:
    """Return the planes (m, 4) of the convex hull of corners (n, 3), each plane once."""
    from scipy.spatial import ConvexHull  # noqa: PLC0415 - imported when used

    # qhull repeats a plane for each triangle of a face, equal but for the last bits.
    rows = np.round(ConvexHull(corners).equations, 9)
    # As np.unique(rows, axis=0), in a third of its time.
    rows = rows[np.lexsort(rows.T[::-1])]
    new = np.append(True, (rows[1:] != rows[:-1]).any(axis=1))
    return rows[new] * (1.0, 1.0, 1.0, -1.0)


def _box_planes(size: tuple[float, float, float]) -> Floats:
    rows = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            row = [0.0, 0.0, 0.0, size[axis] / 2.0]
            row[axis] = sign
            rows.append(row)
    return np.array(rows)


def _part_planes(part: Part, corners: Floats) -> Floats:
    """Return the planes (m, 4) of a part with these corners (n, 3), in the asset's frame."""
    if part.shape == "box":
        return moved_planes(_box_planes(part.size), rotation_matrix(part.rotation), part.centre)
    return _planes_of(corners)


def moved_planes(planes: Floats, matrix: Floats, shift: tuple[float, float, float]) -> Floats:
    """Return planes (m, 4) turned by a matrix (3, 3) and then shifted, metres."""
    x, y, z = planes[:, 0], planes[:, 1], planes[:, 2]
    out = np.empty_like(planes)
    # Written out: a BLAS product may differ in the last bit between processors.
    for axis in range(3):
        row = matrix[axis]
        out[:, axis] = row[0] * x + row[1] * y + row[2] * z
    out[:, 3] = planes[:, 3] + out[:, 0] * shift[0] + out[:, 1] * shift[1] + out[:, 2] * shift[2]
    return out


@lru_cache(maxsize=2048)
def occlusion_shape(asset: Asset) -> OcclusionShape:
    """Return an asset's occlusion shape in its own frame; cached, read-only."""
    corners, rows = asset_corners(asset)
    parts = zip(asset.parts, np.split(corners, rows[1:-1]), strict=True)
    planes = [_part_planes(part, own) for part, own in parts]
    starts = np.cumsum([0, *(len(p) for p in planes)]).astype(np.int64)
    points, owners = _visibility_points(asset)
    return OcclusionShape(np.vstack(planes), starts, points, owners)


def _visibility_points(asset: Asset) -> tuple[Floats, Ints]:
    corners, starts = asset_corners(asset)
    parts = len(starts) - 1
    centres = np.array([part.centre for part in asset.parts])[:MAX_POINTS]
    room = min(MAX_POINTS - len(centres), len(corners))
    # Evenly spaced rows touch every part where there are at least as many as parts.
    rows = [k * len(corners) // room for k in range(room)]
    # Centres lie inside their parts, so a part must not hide its own points.
    owner = np.repeat(np.arange(parts), np.diff(starts))
    points = np.vstack([centres, corners[rows]])
    owners = np.concatenate([np.arange(len(centres)), owner[rows]]).astype(np.int64)
    return points, owners


@lru_cache(maxsize=4096)
def placed_occlusion_shape(asset: Asset, pose: Pose) -> OcclusionShape:
    """Return the occlusion shape of an object at a pose in the house; cached, read-only."""
    own = occlusion_shape(asset)
    matrix = rotation_matrix(pose.quaternion)
    planes = moved_planes(own.planes, matrix, (pose.x, pose.y, pose.z))
    x, y, z = own.points[:, 0], own.points[:, 1], own.points[:, 2]
    points = np.empty_like(own.points)
    for axis, offset in enumerate((pose.x, pose.y, pose.z)):
        row = matrix[axis]
        points[:, axis] = row[0] * x + row[1] * y + row[2] * z + offset
    return OcclusionShape(planes, own.starts, points, own.owners)
