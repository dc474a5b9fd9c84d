"""Meshes of assets: flat faces of convex parts, cached for the process."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from internav_data.catalog import part_triangles
from internav_data.core.locks import ThreadLock
from internav_data.geometry import rotation_matrix
from internav_data.records import Part
from internav_data.render.materials import Mesh, look_row, part_look

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from internav_data.core.typing import Floats, Ints
    from internav_data.records import Asset, Shape

    Ring = tuple[int, ...]

_FLAT = 1e-6
"""Difference of normals and offsets (m) below which faces are one face."""
_STEEP = 0.8
"""Cosine between an axis and a normal below which the axis can be laid into the face: of three
axes at right angles at least two can."""


class Model(NamedTuple):
    """One asset's rows of a `Mesh`, with counts for the mesh's first numbers."""

    vertex_counts: Ints
    """Number of vertices of each part, (parts,) int64."""
    face_counts: Ints
    """Number of faces of each part, (parts,) int64."""
    corner_counts: Ints
    """Number of corners of each face, (faces,) int64."""
    vertices: Floats
    """Rows of `Mesh.vertices`, (vertices, 3)."""
    corners: Ints
    """Rows of `Mesh.corners`, (corners,)."""
    planes: Floats
    """Rows of `Mesh.planes`, (faces, 4)."""
    axes: Floats
    """Rows of `Mesh.axes`, (faces, 8)."""
    looks: NDArray[np.float32]
    """Rows of `Mesh.looks`, (faces, 7)."""
    sphere: tuple[float, float, float, float]
    """Row of `Mesh.spheres`."""
    bounds: tuple[float, float, float, float, float]
    """Row of `Mesh.bounds`."""


def _normals(vertices: Floats, rings: Sequence[Ring]) -> Floats:
    """Return the unit normals of polygons, (faces, 3), by Newell's method (Sutherland et al. 1974).

    `vertices` (n, 3); `rings` are the corners of each polygon.
    """
    longest = max(len(r) for r in rings)
    # Padded to one length: a corner repeated adds nothing to Newell's sum.
    padded = np.array([r + (r[-1],) * (longest - len(r)) for r in rings])
    points = vertices[padded]
    points = points - points[:, :1]
    sums = np.cross(points, np.roll(points, -1, axis=1)).sum(axis=1)
    lengths = np.sqrt((sums**2).sum(axis=1))
    # A face without area has no normal, and is never drawn.
    return np.asarray(sums / np.maximum(lengths, 1e-300)[:, None])


def _outline(triangles: list[Ring]) -> Ring | None:
    """Return the corners around triangles that make one convex face, None where they do not."""
    # A side that two triangles share runs both ways: the others are the outline.
    sides = [(t[k], t[(k + 1) % 3]) for t in triangles for k in range(3)]
    inner = {(b, a) for a, b in sides}
    edges = {a: b for a, b in sides if (a, b) not in inner}
    if not edges:
        return None
    start = next(iter(edges))
    ring, at = [start], edges[start]
    while at != start:
        if at not in edges or len(ring) > len(edges):
            return None
        ring.append(at)
        at = edges[at]
    return tuple(ring) if len(ring) == len(edges) else None


def flat_faces(vertices: Floats, triangles: Ints) -> list[Ring]:
    """Join the triangles of a convex surface that lie in one plane to polygons.

    `vertices` (n, 3) float64, metres; `triangles` (m, 3) int64. Triangles whose outline is not one
    ring stay triangles.
    """
    rows = [(a, b, c) for a, b, c in triangles.tolist()]
    normals = _normals(vertices, rows)
    offsets = (normals * vertices[triangles[:, 0]]).sum(axis=1)
    planes = np.column_stack([normals, offsets])
    left = np.ones(len(rows), dtype=np.bool_)
    faces: list[Ring] = []
    for k in range(len(rows)):
        if not left[k]:
            continue
        same = left & (np.abs(planes - planes[k]).max(axis=1) < _FLAT)
        left &= ~same
        members: list[Ring] = [rows[int(i)] for i in np.flatnonzero(same)]
        ring = _outline(members)
        faces += [ring] if ring is not None else members
    return faces


@lru_cache(maxsize=8)
def _fixed_faces(shape: Shape) -> list[Ring]:
    """Return the faces of a box, cylinder or sphere: those of the unit solid, for any size."""
    origin, whole = (0.0, 0.0, 0.0), (2.0, 2.0, 2.0)
    unit = Part(shape, origin, whole, (0.0, 0.0, 0.0, 1.0), (), (0, 0, 0), "wood")
    return flat_faces(*part_triangles(unit))


def _texture(normals: Floats, part: Part, shift: float) -> Floats:
    """Return rows of `Mesh.axes`, (faces, 8): u along the part's longest side, v across."""
    order = sorted(range(3), key=lambda k: (-part.size[k], k))
    grain = rotation_matrix(part.rotation).T[order]
    cosines = (normals[:, None, :] * grain[None]).sum(axis=2)
    choice = np.argmax(np.abs(cosines) < _STEEP, axis=1)
    rows = np.arange(len(normals))
    along = grain[choice] - normals * cosines[rows, choice][:, None]
    along = along / np.sqrt((along**2).sum(axis=1))[:, None]
    across = np.cross(normals, along)
    centre = np.array(part.centre)
    u, v = (shift - (axis * centre).sum(axis=1) for axis in (along, across))
    return np.column_stack([along, u, across, v])


def model_of(asset: Asset) -> Model:
    """Build the model of an asset."""
    rings: list[Ring] = []
    parts: list[tuple[Floats, int]] = []
    planes, axes, looks = [], [], []
    for number, part in enumerate(asset.parts):
        vertices, triangles = part_triangles(part)
        hull = part.shape == "hull"
        faces = flat_faces(vertices, triangles) if hull else _fixed_faces(part.shape)
        normals = _normals(vertices, faces)
        starts = vertices[[ring[0] for ring in faces]]
        planes.append(np.column_stack([normals, (normals * starts).sum(axis=1)]))
        # Shifted, so that no two parts show the same piece of grain.
        axes.append(_texture(normals, part, 0.37 * number))
        looks += [look_row(part_look(part.material, part.colour))] * len(faces)
        rings += faces
        parts.append((vertices, len(faces)))
    return Model(
        np.array([len(v) for v, _ in parts]),
        np.array([n for _, n in parts]),
        np.array([len(r) for r in rings]),
        np.vstack([v for v, _ in parts]),
        np.array([k for ring in rings for k in ring]),
        np.vstack(planes),
        np.vstack(axes),
        np.array(looks, np.float32),
        *bounds_of(np.vstack([v for v, _ in parts])),
    )


def _starts(counts: Iterable[Ints]) -> Ints:
    """Return the first numbers that follow from counts, and the total."""
    return np.cumsum(np.concatenate([np.zeros(1, np.int64), *counts]))


def bounds_of(
    points: Floats,
) -> tuple[tuple[float, float, float, float], tuple[float, float, float, float, float]]:
    """Return a ball and a box around points (n, 3), metres: rows of `Mesh.spheres` and `bounds`."""
    low, high = points.min(axis=0), points.max(axis=0)
    centre = (low + high) / 2.0
    radius = math.sqrt(float(((points - centre) ** 2).sum(axis=1).max()))
    (x0, y0, _), (x1, y1, z1) = low.tolist(), high.tolist()
    x, y, z = centre.tolist()
    return (x, y, z, radius), (x0, y0, x1, y1, z1)


def mesh_of(models: Sequence[Model]) -> Mesh:
    """Concatenate models to one mesh."""
    return Mesh(
        _starts([np.array([len(m.face_counts) for m in models], np.int64)]),
        np.array([m.sphere for m in models]).reshape(-1, 4),
        np.array([m.bounds for m in models]).reshape(-1, 5),
        _starts(m.vertex_counts for m in models),
        _starts(m.face_counts for m in models),
        np.concatenate([np.zeros((0, 3)), *(m.vertices for m in models)]),
        _starts(m.corner_counts for m in models),
        np.concatenate([np.zeros(0, np.int64), *(m.corners for m in models)]),
        np.concatenate([np.zeros((0, 4)), *(m.planes for m in models)]),
        np.concatenate([np.zeros((0, 8)), *(m.axes for m in models)]),
        np.concatenate([np.zeros((0, 7), np.float32), *(m.looks for m in models)]),
    )


class Library:
    """All assets that this process has drawn, in one mesh that grows.

    Pictures do not depend on the order in which assets came: only the models' numbers do.

    Attributes
    ----------
    max_vertices : int
        Largest number of vertices of a part.
    max_corners : int
        Largest number of corners of a face.
    """

    def __init__(self) -> None:
        self._numbers: dict[Asset, int] = {}
        self._models: list[Model] = []
        self._mesh: Mesh | None = None
        self._lock = ThreadLock()
        self.max_vertices = 4
        self.max_corners = 8

    def number(self, asset: Asset) -> int:
        """Return the number of an asset's model; the model is built at the first call."""
        with self._lock:
            found = self._numbers.get(asset)
            if found is None:
                found = len(self._models)
                model = model_of(asset)
                self._models.append(model)
                self._numbers[asset] = found
                self._mesh = None
                self.max_vertices = max(self.max_vertices, int(model.vertex_counts.max()))
                self.max_corners = max(self.max_corners, int(model.corner_counts.max()))
            return found

    def faces(self, number: int) -> int:
        """Return the number of faces of a model."""
        return len(self._models[number].planes)

    @property
    def mesh(self) -> Mesh:
        """Mesh of all models so far."""
        with self._lock:
            if self._mesh is None:
                self._mesh = mesh_of(self._models)
            return self._mesh


LIBRARY = Library()
"""Models of this process."""
