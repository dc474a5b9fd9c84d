"""Assets as the camera draws them: flat faces of convex parts, kept for the whole process."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from internav_data.catalog import part_triangles
from internav_data.geometry import rotation_matrix
from internav_data.records import Part
from internav_data.world.surfaces import Mesh, look_row, part_look

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.records import Asset

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

_FLAT = 1e-6
"""Faces whose normals differ by less are one face."""
_STEEP = 0.8
"""Cosine: of three axes at right angles two at least are this far from any normal."""


def _normal(corners: Floats) -> Floats:
    """Newell's normal of a polygon (n, 3), unit length."""
    after = np.roll(corners, -1, axis=0)
    sums = np.cross(corners, after).sum(axis=0)
    length = math.sqrt(float(sums[0] ** 2 + sums[1] ** 2 + sums[2] ** 2))
    return np.asarray(sums / max(length, 1e-300))


def _outline(triangles: list[tuple[int, int, int]]) -> list[int] | None:
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
    return ring if len(ring) == len(edges) else None


def flat_faces(vertices: Floats, triangles: Ints) -> list[list[int]]:
    """Join the triangles (m, 3) of a convex surface that lie in one plane to polygons."""
    groups: list[tuple[Floats, float, list[tuple[int, int, int]]]] = []
    for row in triangles.tolist():
        t = (row[0], row[1], row[2])
        points = vertices[list(t)]
        normal = _normal(points)
        offset = float(np.dot(normal, points[0]))
        for other, distance, members in groups:
            if abs(offset - distance) < _FLAT and float(np.abs(normal - other).max()) < _FLAT:
                members.append(t)
                break
        else:
            groups.append((normal, offset, [t]))
    faces: list[list[int]] = []
    for _, _, members in groups:
        ring = _outline(members)
        faces += [ring] if ring is not None else [list(t) for t in members]
    return faces


@lru_cache(maxsize=8)
def _fixed_faces(shape: str) -> list[list[int]]:
    """Faces of boxes, cylinders and spheres: those of the unit solid."""
    whole = (2.0, 2.0, 2.0)
    unit = Part(shape, (0.0, 0.0, 0.0), whole, (0.0, 0.0, 0.0, 1.0), (), (0, 0, 0), "wood")  # type: ignore[arg-type]
    return flat_faces(*part_triangles(unit))


def _grain(part: Part) -> Floats:
    """Return the part's own axes (3, 3) as rows, longest first."""
    axes = rotation_matrix(part.rotation).T
    order = sorted(range(3), key=lambda k: (-part.size[k], k))
    return np.asarray(axes[order])


class Model(NamedTuple):
    """One asset's part of a mesh: lists that are joined later."""

    vertices: list[Floats]
    faces: list[list[list[int]]]
    planes: list[list[float]]
    axes: list[list[float]]
    looks: list[list[float]]


def _texture(normal: Floats, grain: Floats, part: Part, salt: float) -> list[float]:
    """Axes of u, along the longest side that lies in the face, and of v across it."""
    along = next((axis for axis in grain if abs(float(np.dot(axis, normal))) < _STEEP), grain[0])
    along = along - normal * float(np.dot(along, normal))
    along = along / math.sqrt(float(np.dot(along, along)))
    across = np.cross(normal, along)
    centre = np.array(part.centre)
    u, v = -float(np.dot(along, centre)) + salt, -float(np.dot(across, centre)) + salt
    return [*along.tolist(), u, *across.tolist(), v]


def model_of(asset: Asset) -> Model:
    """Build the polygons of all parts of an asset."""
    model = Model([], [], [], [], [])
    for number, part in enumerate(asset.parts):
        vertices, triangles = part_triangles(part)
        faces = (
            flat_faces(vertices, triangles) if part.shape == "hull" else _fixed_faces(part.shape)
        )
        grain, row = _grain(part), look_row(part_look(part.material, part.colour))
        for face in faces:
            normal = _normal(vertices[face])
            model.planes.append([*normal.tolist(), float(np.dot(normal, vertices[face[0]]))])
            # No two parts show the same piece of grain.
            model.axes.append(_texture(normal, grain, part, 0.37 * number))
            model.looks.append(row)
        model.vertices.append(vertices)
        model.faces.append(faces)
    return model


def mesh_of(models: list[Model]) -> Mesh:
    """Join models to one mesh."""
    parts = [len(m.vertices) for m in models]
    vertices = [v for m in models for v in m.vertices]
    faces = [f for m in models for f in m.faces]
    rings = [ring for part in faces for ring in part]
    spheres = [_sphere(np.vstack(m.vertices)) for m in models]
    return Mesh(
        _starts(parts),
        np.array(spheres, np.float64).reshape(-1, 4),
        _starts([len(v) for v in vertices]),
        _starts([len(f) for f in faces]),
        np.vstack(vertices).astype(np.float64) if vertices else np.zeros((0, 3)),
        _starts([len(r) for r in rings]),
        np.array([k for ring in rings for k in ring], np.int64),
        np.array([p for m in models for p in m.planes], np.float64).reshape(-1, 4),
        np.array([a for m in models for a in m.axes], np.float64).reshape(-1, 8),
        np.array([row for m in models for row in m.looks], np.float32).reshape(-1, 7),
    )


def _starts(counts: list[int]) -> Ints:
    return np.cumsum([0, *counts]).astype(np.int64)


def _sphere(points: Floats) -> list[float]:
    """Ball around the middle of the bounding box, (x, y, z, radius)."""
    centre = (points.min(axis=0) + points.max(axis=0)) / 2.0
    radius = math.sqrt(float(((points - centre) ** 2).sum(axis=1).max()))
    return [*centre.tolist(), radius]


class Library:
    """All assets drawn so far in this process, in one mesh that grows."""

    def __init__(self) -> None:
        self._numbers: dict[Asset, int] = {}
        self._models: list[Model] = []
        self._mesh: Mesh | None = None

    def number(self, asset: Asset) -> int:
        """Return which model an asset is; made when first asked for."""
        found = self._numbers.get(asset)
        if found is None:
            found = len(self._models)
            self._models.append(model_of(asset))
            self._numbers[asset] = found
            self._mesh = None
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
"""Pictures do not depend on the order in which assets came: only their numbers do."""
