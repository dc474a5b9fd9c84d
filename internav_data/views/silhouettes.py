"""Objects from above: the polyhedron of every part, its faces shaded by Lambert's law."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import cv2
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from internav_data.geometry import part_corners, rotation_matrix, transform

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from internav_data.core.typing import Floats
    from internav_data.records import RGB, Asset, Part, Pose
    from internav_data.views.canvas import Canvas

_LIGHT = np.array([-0.42, 0.38, 0.82]) / math.sqrt(0.42**2 + 0.38**2 + 0.82**2)
_AMBIENT = 0.5
"""Share of ambient light."""
_UPWARD = 0.02
"""Minimum z of the normal of a face that is visible from above."""


@dataclass(frozen=True, slots=True, eq=False)
class Silhouette:
    """Silhouette of one part, seen from above.

    Shapes: plan (n, 2), faces (m, 3, 2), shades (m,); metres, brightness 1 for a level face.
    """

    plan: Floats
    faces: Floats
    shades: Floats
    low_m: float
    top_m: float
    colour: RGB


@lru_cache(maxsize=16384)
def _facets(part: Part) -> tuple[Floats, NDArray[np.int64], Floats]:
    """Return corners (n, 3), triangles (m, 3) and outward normals (m, 3), the asset's frame."""
    corners = part_corners(part)
    try:
        hull = ConvexHull(corners)
    except QhullError:  # a part without volume has an outline, but no faces to shade
        return corners, np.empty((0, 3), dtype=np.int64), np.empty((0, 3))
    return corners, hull.simplices.astype(np.int64), hull.equations[:, :3]


def _plan(points: Floats) -> Floats:
    hull = cv2.convexHull(points.astype(np.float32)).reshape(-1, 2)
    return np.asarray(hull, dtype=np.float64)


def silhouettes(asset: Asset, pose: Pose) -> list[Silhouette]:
    """Return the silhouettes of an asset's parts at a pose."""
    matrix = rotation_matrix(pose.quaternion)
    found = []
    for part in asset.parts:
        corners, triangles, normals = _facets(part)
        moved = transform(corners, pose)
        turned = normals @ matrix.T
        seen = turned[:, 2] > _UPWARD
        lambert = np.maximum(turned[seen] @ _LIGHT, 0.0) / _LIGHT[2]
        found.append(
            Silhouette(
                plan=_plan(moved[:, :2]),
                faces=moved[triangles[seen]][:, :, :2],
                shades=_AMBIENT + (1.0 - _AMBIENT) * lambert,
                low_m=float(moved[:, 2].min()),
                top_m=float(moved[:, 2].max()),
                colour=part.colour,
            )
        )
    return found


def shaded(colour: RGB, light: float) -> RGB:
    """Return a colour multiplied by a light factor."""
    r, g, b = (min(255, max(0, round(c * light))) for c in colour)
    return (r, g, b)


def paint(canvas: Canvas, parts: Iterable[Silhouette], line_px: float, colour: RGB | None) -> None:
    """Paint parts from the lowest top to the highest, each with a soft outline.

    Parameters
    ----------
    canvas
        Canvas to paint on.
    parts
        Silhouettes in any order; those with equal tops keep theirs.
    line_px
        Width of the outline, pixels.
    colour
        Colour for all parts instead of their own.
    """
    for part in sorted(parts, key=lambda p: p.top_m):
        base = part.colour if colour is None else colour
        level = float(np.ptp(part.shades)) < 1e-3 if len(part.shades) else True
        canvas.fill(part.plan, shaded(base, float(part.shades[0]) if len(part.shades) else 1.0))
        if not level:
            for face, light in zip(part.faces, part.shades, strict=True):
                canvas.fill(face, shaded(base, float(light)))
        canvas.line(part.plan, shaded(base, 0.58), line_px, closed=True)
