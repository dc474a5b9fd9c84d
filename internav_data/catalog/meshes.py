"""Triangles of parts and assets: the polyhedra that physics and footprints use."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data.core.extras import require
from internav_data.geometry import part_corners

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints
    from internav_data.records import Asset, Part, Shape


def hull_faces(corners: Floats) -> Ints:
    """Return the hull's triangles (m, 3) of points (n, 3), counter-clockwise from outside."""
    from scipy.spatial import ConvexHull  # noqa: PLC0415 - imported when used

    hull = ConvexHull(corners)
    faces = hull.simplices.astype(np.int64)
    a, b, c = (corners[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    inward = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return faces


@lru_cache(maxsize=8)
def _fixed_faces(shape: Shape) -> Ints:
    """Return the triangles of a box, cylinder or sphere: those of the unit solid."""
    from internav_data.records import Part  # noqa: PLC0415 - as a value only here

    origin, size = (0.0, 0.0, 0.0), (2.0, 2.0, 2.0)
    unit = Part(shape, origin, size, (0.0, 0.0, 0.0, 1.0), (), (0, 0, 0), "wood")
    faces = hull_faces(part_corners(unit))
    faces.flags.writeable = False
    return faces


@lru_cache(maxsize=16384)
def part_triangles(part: Part) -> tuple[Floats, Ints]:
    """Return a part's surface: corners (n, 3), metres, in the asset's frame, and faces (m, 3).

    Faces are counter-clockwise from outside; both arrays are read-only. Hulls keep only the
    corners that lie on the hull.
    """
    corners = part_corners(part)
    if part.shape == "hull":
        faces = hull_faces(corners)
        used, flat = np.unique(faces, return_inverse=True)
        corners, faces = corners[used], flat.reshape(-1, 3)
    else:
        faces = _fixed_faces(part.shape)
    corners.flags.writeable = False
    faces.flags.writeable = False
    return corners, faces


def asset_mesh(asset: Asset) -> Any:  # noqa: ANN401 - trimesh is imported when used
    """Return an asset as `trimesh.Trimesh`: its parts side by side, each watertight, coloured."""
    require("trimesh")
    import trimesh  # noqa: PLC0415 - only for users with meshes

    vertices, faces, colours = [], [], []
    start = 0
    for part in asset.parts:
        corners, triangles = part_triangles(part)
        vertices.append(corners)
        faces.append(triangles + start)
        colours.append(np.tile(np.array([*part.colour, 255], np.uint8), (len(triangles), 1)))
        start += len(corners)
    return trimesh.Trimesh(
        np.vstack(vertices), np.vstack(faces), face_colors=np.vstack(colours), process=False
    )
