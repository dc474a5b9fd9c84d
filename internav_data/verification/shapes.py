"""Footprints derived again: hull edges cut by planes, shapely hulls of the remaining points.

Shares no code with `internav_data.geometry`: corners, quaternions and clipping are written anew.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np
import shapely
from scipy.spatial import ConvexHull, Delaunay, QhullError

from internav_data.core.lru import LRUCache

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from shapely import Geometry

    from internav_data.core.typing import Floats, Ints
    from internav_data.records import Asset, Part, Pose, Quaternion, Wall

STEP_OVER_M = 0.02
"""Height below which the agent steps over an object."""
AGENT_HEIGHT_M = 1.8
"""Height above which the agent walks under an object."""
MAX_PLACED = 256
"""Number of objects at their poses that are kept: those of a large house."""
SIDES = 16
"""Number of sides of the prisms that stand for cylinders, and of the rings of spheres."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """One convex part in its asset's frame: corners (n, 3) metres, hull edges (m, 2) indices."""

    corners: Floats
    edges: Ints


@dataclass(frozen=True, slots=True, eq=False)
class Slab:
    """One part at its pose: corners (n, 3), plan and interval of heights, metres."""

    corners: Floats
    plan: Geometry
    low: float
    high: float


def rotate(points: Floats, quaternion: Quaternion) -> Floats:
    """Rotate points (n, 3) by a quaternion: v + 2 w (q x v) + 2 q x (q x v), q normalised."""
    x, y, z, w = np.asarray(quaternion, dtype=np.float64) / math.hypot(*quaternion)

    def crossed(v: Floats) -> Floats:
        """Vector part of the quaternion x v (np.cross, without its overhead on few points)."""
        a, b, c = v.T
        out = np.empty(v.shape)
        out[:, 0], out[:, 1], out[:, 2] = y * c - z * b, z * a - x * c, x * b - y * a
        return out

    once = crossed(points)
    return np.asarray(points + 2.0 * w * once + 2.0 * crossed(once), dtype=np.float64)


def _circle(radius_x: float, radius_y: float, z: float) -> list[tuple[float, float, float]]:
    turns = [k * 2.0 * math.pi / SIDES for k in range(SIDES)]
    return [(radius_x * math.cos(t), radius_y * math.sin(t), z) for t in turns]


def _local_corners(shape: str, size: tuple[float, float, float]) -> Floats:
    """Return the corners (n, 3) of a box, cylinder or sphere of a size, metres."""
    a, b, c = (extent / 2.0 for extent in size)
    if shape == "box":
        corners = list(product((-a, a), (-b, b), (-c, c)))
    elif shape == "cylinder":
        corners = _circle(a, b, -c) + _circle(a, b, c)
    elif shape == "sphere":
        slant = math.sqrt(0.5)
        corners = [(0.0, 0.0, -c), (0.0, 0.0, c), *_circle(a, b, 0.0)]
        for side in (-1.0, 1.0):
            corners += _circle(slant * a, slant * b, side * slant * c)
    else:
        raise ValueError(f"no part has the shape {shape!r}")
    return np.array(corners, dtype=np.float64)


def _hull_edges(corners: Floats) -> Ints:
    """Pairs of corners joined by an edge of the triangulated hull, shape (m, 2)."""
    try:
        faces = ConvexHull(corners).simplices
    except (QhullError, ValueError):  # flat: every pair of corners lies in the part
        pairs = np.array(list(combinations(range(len(corners)), 2)), dtype=np.int64)
        return pairs.reshape(-1, 2)
    # Each side of each face as one number: numpy sorts those ten times as fast as pairs.
    sides = np.sort(faces[:, ((0, 1), (1, 2), (2, 0))].reshape(-1, 2).astype(np.int64), axis=1)
    numbers = np.unique(sides[:, 0] * len(corners) + sides[:, 1])
    return np.column_stack(np.divmod(numbers, len(corners)))


@cache
def _unit_edges(shape: str) -> Ints:
    """Return the hull edges of a shape of any size: a stretched hull keeps its edges."""
    return _hull_edges(_local_corners(shape, (1.0, 1.0, 1.0)))


def solid_of(part: Part) -> Solid:
    """Return the polyhedron of a part, in its asset's frame."""
    if part.shape == "hull":
        own = np.array(part.corners, dtype=np.float64).reshape(-1, 3)
        edges = None
    else:
        own, edges = _local_corners(part.shape, part.size), _unit_edges(part.shape)
    corners = rotate(own, part.rotation) + np.array(part.centre)
    return Solid(corners, _hull_edges(corners) if edges is None else edges)


FILLED = {"box": 1.0, "cylinder": math.pi / 4.0, "sphere": math.pi / 6.0}
"""Share of its bounding box that a round part fills: for its mass it is round, not a polyhedron."""


def _volume(part: Part) -> tuple[float, Floats]:
    """Return the volume of a part, m³, and its centroid in its asset's frame, (3,) metres."""
    if part.shape != "hull":
        return FILLED[part.shape] * math.prod(part.size), np.array(part.centre)
    corners = solid_of(part).corners
    try:
        tetrahedra = corners[Delaunay(corners).simplices]
    except (QhullError, ValueError):  # flat: it weighs nothing
        return 0.0, np.array(part.centre)
    edges = tetrahedra[:, 1:] - tetrahedra[:, :1]
    volumes = np.abs(np.einsum("ki,ki->k", edges[:, 0], np.cross(edges[:, 1], edges[:, 2]))) / 6.0
    total = float(volumes.sum())
    return total, np.asarray(volumes @ tetrahedra.mean(axis=1) / total)


def _hulls(groups: Sequence[Floats]) -> list[Geometry]:
    """Return the convex hulls in the plane of groups of points (n, 2), in one call."""
    if not groups:
        return []
    owners = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    clouds = shapely.multipoints(np.vstack(groups), indices=owners)
    return list(np.atleast_1d(np.asarray(shapely.convex_hull(clouds))))


def slice_of(corners: Floats, edges: Ints, low: float, high: float) -> Floats:
    """Return points (n, 2) whose hull is the plan of a polyhedron between two heights.

    The polyhedron has corners (k, 3) and edges (m, 2). No points: nothing lies between them.
    """
    z = corners[:, 2]
    if z.min() >= low and z.max() <= high:
        return corners[:, :2]
    pieces = [corners[(z >= low) & (z <= high), :2]]
    first, second = corners[edges[:, 0]], corners[edges[:, 1]]
    # Between two planes a convex solid is the hull of its corners there and of the points at which
    # its edges cross the planes.
    for level in (low, high):
        cut = (first[:, 2] - level) * (second[:, 2] - level) < 0.0
        a, b = first[cut], second[cut]
        share = ((level - a[:, 2]) / (b[:, 2] - a[:, 2]))[:, None]
        pieces.append(a[:, :2] + share * (b[:, :2] - a[:, :2]))
    return np.vstack(pieces)


def _uncovered(plans: list[Geometry]) -> list[Geometry]:
    """Leave out the plans that the largest one covers: same union, less work."""
    if len(plans) <= 1:
        return plans
    largest = max(plans, key=shapely.area)
    shapely.prepare(largest)
    covered = shapely.covers(largest, np.array(plans, dtype=object))
    return [largest, *(plan for plan, inside in zip(plans, covered, strict=True) if not inside)]


def wall_slabs(walls: Sequence[Wall]) -> list[Slab]:
    """Return walls as slabs."""
    slabs = []
    for w in walls:
        plan = shapely.box(w.x_min, w.y_min, w.x_max, w.y_max)
        flat = shapely.get_coordinates(plan)[:-1]
        corners = np.vstack([np.column_stack([flat, np.full(4, z)]) for z in (w.z_min, w.z_max)])
        slabs.append(Slab(corners, plan, w.z_min, w.z_max))
    return slabs


class Shapes:
    """Footprints and slabs of assets at poses; hulls are computed once for each asset."""

    def __init__(self, assets: Mapping[str, Asset]) -> None:
        self.assets = assets
        self._solids: dict[str, tuple[Solid, ...]] = {}
        self._middles: dict[str, Floats] = {}
        # Footprint and slabs of one object are asked for in turn.
        self._known: LRUCache[tuple[str, Pose], list[tuple[Floats, Ints]]] = LRUCache(MAX_PLACED)

    def solids(self, asset_id: str) -> tuple[Solid, ...]:
        """Return the polyhedra of an asset's parts, in its own frame."""
        if asset_id not in self._solids:
            self._solids[asset_id] = tuple(solid_of(p) for p in self.assets[asset_id].parts)
        return self._solids[asset_id]

    def centre_of_mass(self, asset_id: str) -> Floats:
        """Return the centre of mass of an asset in its own frame, (3,), rounded to 0.1 mm."""
        if asset_id not in self._middles:
            parts = [_volume(part) for part in self.assets[asset_id].parts]
            moment = np.sum([volume * centroid for volume, centroid in parts], axis=0)
            total = sum(volume for volume, _ in parts)
            self._middles[asset_id] = np.round(moment / total, 4) if total else np.zeros(3)
        return self._middles[asset_id]

    def _placed(self, asset_id: str, pose: Pose) -> list[tuple[Floats, Ints]]:
        """Return corners (n, 3) and edges (m, 2) of every part at a pose; not to be changed."""
        return self._known.get((asset_id, pose), lambda: self._moved(asset_id, pose))

    def _moved(self, asset_id: str, pose: Pose) -> list[tuple[Floats, Ints]]:
        solids = self.solids(asset_id)
        ends = np.cumsum([0, *(len(s.corners) for s in solids)])
        moved = rotate(np.vstack([s.corners for s in solids]), pose.quaternion)
        moved += (pose.x, pose.y, pose.z)
        return [(moved[ends[k] : ends[k + 1]], s.edges) for k, s in enumerate(solids)]

    def corners(self, asset_id: str, pose: Pose) -> Floats:
        """Return the corners of all parts of an asset at a pose, (n, 3), metres."""
        return np.vstack([corners for corners, _ in self._placed(asset_id, pose)])

    def footprint(self, asset_id: str, pose: Pose) -> list[Geometry]:
        """Return the footprint of an asset at a pose: convex plans, one a part."""
        if not self.assets[asset_id].blocks:
            return []
        slices = [
            slice_of(corners, edges, STEP_OVER_M, AGENT_HEIGHT_M)
            for corners, edges in self._placed(asset_id, pose)
        ]
        return _uncovered(_hulls([points for points in slices if len(points)]))

    def slabs(self, asset_id: str, pose: Pose) -> list[Slab]:
        """Return every part's plan at its full height, and the heights it spans."""
        placed = [corners for corners, _ in self._placed(asset_id, pose)]
        plans = _hulls([corners[:, :2] for corners in placed])
        return [
            Slab(corners, plan, float(corners[:, 2].min()), float(corners[:, 2].max()))
            for corners, plan in zip(placed, plans, strict=True)
        ]
