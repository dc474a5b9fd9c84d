"""Shells: parts as planes for rays to meet, and the fixed points by which a thing is seen."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from internav_data.geometry import asset_corners, part_corners, rotation_matrix

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints
    from internav_data.records import Asset, Part, Pose

MAX_POINTS: Final = 32
"""Visibility points of an asset: all parts' centres first, then corners, evenly chosen."""


class OcclusionShape(NamedTuple):
    """A thing's convex parts and visibility points.

    Shapes: planes (m, 4) float64, a point p is inside a part where n . p <= d for all its rows
    (n, d); starts (parts + 1,) int64 into planes; points (p, 3) float64, metres; owners (p,)
    int64: the part each point belongs to, which does not hide it.
    """

    planes: Floats
    starts: Ints
    points: Floats
    owners: Ints


def _planes_of(corners: Floats) -> Floats:
    """Planes (m, 4) of the hull of corners (n, 3), faces of several triangles once."""
    from scipy.spatial import ConvexHull  # noqa: PLC0415 - imported when used

    # qhull repeats a plane for each triangle of a face, equal but for the last bits.
    rows = np.unique(np.round(ConvexHull(corners).equations, 9), axis=0)
    return np.column_stack([rows[:, :3], -rows[:, 3]])


def _box_planes(size: tuple[float, float, float]) -> Floats:
    rows = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            row = [0.0, 0.0, 0.0, size[axis] / 2.0]
            row[axis] = sign
            rows.append(row)
    return np.array(rows)


def _part_planes(part: Part) -> Floats:
    """Planes of a part in the asset's frame."""
    if part.shape == "box":
        return moved_planes(_box_planes(part.size), rotation_matrix(part.rotation), part.centre)
    return _planes_of(part_corners(part))


def moved_planes(planes: Floats, matrix: Floats, shift: tuple[float, float, float]) -> Floats:
    """Turn planes (m, 4) by a matrix (3, 3) and shift them, metres."""
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
    """Shell in the asset's frame; cached, read-only."""
    planes = [_part_planes(part) for part in asset.parts]
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
    owner = np.repeat(np.arange(parts), np.diff(starts))
    points = np.vstack([centres, corners[rows]])
    owners = np.concatenate([np.arange(len(centres)), owner[rows]]).astype(np.int64)
    return points, owners


@lru_cache(maxsize=4096)
def placed_occlusion_shape(asset: Asset, pose: Pose) -> OcclusionShape:
    """Shell of a thing where it lies in the house; cached, read-only."""
    own = occlusion_shape(asset)
    matrix = rotation_matrix(pose.quaternion)
    planes = moved_planes(own.planes, matrix, (pose.x, pose.y, pose.z))
    x, y, z = own.points[:, 0], own.points[:, 1], own.points[:, 2]
    points = np.empty_like(own.points)
    for axis, offset in enumerate((pose.x, pose.y, pose.z)):
        row = matrix[axis]
        points[:, axis] = row[0] * x + row[1] * y + row[2] * z + offset
    return OcclusionShape(planes, own.starts, points, own.owners)
