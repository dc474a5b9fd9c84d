"""Assets as the camera draws them: flat faces of convex parts, kept for the whole process."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from internav_data.catalog import part_triangles
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
"""Faces whose normals and offsets differ by less are one face."""
_STEEP = 0.8
"""Cosine: of three axes at right angles two at least are this far from any normal."""


class Model(NamedTuple):
    """One asset's share of a mesh: counts where the mesh has first numbers."""

    vertex_counts: Ints
    """(parts,)"""
    face_counts: Ints
    """(parts,)"""
    corner_counts: Ints
    """(faces,)"""
    vertices: Floats
    corners: Ints
    planes: Floats
    axes: Floats
    looks: NDArray[np.float32]
    sphere: tuple[float, float, float, float]
    bounds: tuple[float, float, float, float, float]


def _normals(vertices: Floats, rings: Sequence[Ring]) -> Floats:
    """Newell's unit normals (faces, 3)."""
    longest = max(len(r) for r in rings)
    # A corner repeated adds nothing.
    padded = np.array([r + (r[-1],) * (longest - len(r)) for r in rings])
    points = vertices[padded]
    points = points - points[:, :1]
    sums = np.cross(points, np.roll(points, -1, axis=1)).sum(axis=1)
    lengths = np.sqrt((sums**2).sum(axis=1))
    # A face without area has no normal, and is never drawn.
    return np.asarray(sums / np.maximum(lengths, 1e-300)[:, None])


def _outline(triangles: list[Ring]) -> Ring | None:
    """Corners around some triangles that make one convex face, None where they do not."""
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
    """Join the triangles (m, 3) of a convex surface that lie in one plane to polygons."""
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
    """Faces of boxes, cylinders and spheres: those of the unit solid."""
    origin, whole = (0.0, 0.0, 0.0), (2.0, 2.0, 2.0)
    unit = Part(shape, origin, whole, (0.0, 0.0, 0.0, 1.0), (), (0, 0, 0), "wood")
    return flat_faces(*part_triangles(unit))


def _texture(normals: Floats, part: Part, shift: float) -> Floats:
    """Axes (faces, 8): u along the longest side of the part that lies in the face, v across."""
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
    """Build the polygons of all parts of an asset."""
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
        # No two parts show the same piece of grain.
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
    return np.cumsum(np.concatenate([np.zeros(1, np.int64), *counts]))


def bounds_of(
    points: Floats,
) -> tuple[tuple[float, float, float, float], tuple[float, float, float, float, float]]:
    """Return a ball around points (x, y, z, radius) and a box (see `Mesh`)."""
    low, high = points.min(axis=0), points.max(axis=0)
    centre = (low + high) / 2.0
    radius = math.sqrt(float(((points - centre) ** 2).sum(axis=1).max()))
    (x0, y0, _), (x1, y1, z1) = low.tolist(), high.tolist()
    x, y, z = centre.tolist()
    return (x, y, z, radius), (x0, y0, x1, y1, z1)


def mesh_of(models: Sequence[Model]) -> Mesh:
    """Join models to one mesh."""
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
    """All assets drawn so far in this process, in one mesh that grows.

    Pictures do not depend on the order in which assets came: only the models' numbers do.
    """

    def __init__(self) -> None:
        self._numbers: dict[Asset, int] = {}
        self._models: list[Model] = []
        self._mesh: Mesh | None = None
        self.most_vertices = 4
        """Of any part."""
        self.most_corners = 8
        """Of any face."""

    def number(self, asset: Asset) -> int:
        """Return which model an asset is; made when first asked for."""
        found = self._numbers.get(asset)
        if found is None:
            found = len(self._models)
            model = model_of(asset)
            self._models.append(model)
            self._numbers[asset] = found
            self._mesh = None
            self.most_vertices = max(self.most_vertices, int(model.vertex_counts.max()))
            self.most_corners = max(self.most_corners, int(model.corner_counts.max()))
        return found

    def faces(self, number: int) -> int:
        """Return how many faces a model has."""
        return len(self._models[number].planes)

    @property
    def mesh(self) -> Mesh:
        """The mesh of all models so far."""
        if self._mesh is None:
            self._mesh = mesh_of(self._models)
        return self._mesh


LIBRARY = Library()
