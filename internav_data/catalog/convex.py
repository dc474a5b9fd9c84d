"""Convex decomposition of a mesh into pieces of few corners.

Method: coacd (Wei et al. 2022), collision-aware approximate convex decomposition.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data.core.arithmetic import plain_sum
from internav_data.core.extras import install_command, require
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from pathlib import Path

    from internav_data.core.typing import Floats, Ints

MAX_CORNERS = 32
"""Largest number of corners of a piece: footprints and Bullet slow down beyond."""
_CONVEX_SHARE = 0.97
"""Share of its hull's volume from which a mesh counts as convex and is not cut."""
_THRESHOLD = 0.08
"""coacd's concavity at which it stops cutting."""
_MIN_SHARE = 1e-3
"""Smallest share of the total volume: smaller pieces are dropped."""
_MIN_THICKNESS_M = 1e-3
_SEED = 0


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A convex piece: corners (n, 3) with n <= 32, metres, and its volume, m³."""

    corners: Floats
    volume: float


def convex_pieces(path: Path, vertices: Floats, faces: Ints, max_parts: int) -> list[Piece]:
    """Cut a mesh into at most `max_parts` convex pieces, largest first.

    `vertices` is (n, 3) float64 in metres, `faces` (m, 3) int64.

    The same mesh gives the same pieces: coacd's seed is fixed and pieces are ordered by volume.

    Raises
    ------
    UsageError
        When the mesh encloses no volume, or coacd cannot cut it.
    """
    hull_piece = _piece(vertices)
    extent = np.ptp(vertices, axis=0)
    if hull_piece is None or extent.min() < _MIN_THICKNESS_M:
        raise UsageError(
            f"{path}: encloses no volume (it is flat: {' x '.join(f'{e:.4g}' for e in extent)} m); "
            "give it at least 1 mm of thickness"
        )
    require("trimesh")
    import trimesh  # noqa: PLC0415 - only for users with meshes

    mesh = trimesh.Trimesh(vertices, faces, process=True)
    if _is_convex(mesh, hull_piece) or max_parts == 1:
        return [hull_piece]
    pieces = _pieces(path, mesh, max_parts)
    total = plain_sum(piece.volume for piece in pieces)
    if total <= 0.0:
        raise UsageError(f"{path}: encloses no volume; close its surface or give it thickness")
    large = [piece for piece in pieces if piece.volume >= _MIN_SHARE * total]
    large.sort(key=lambda piece: (-piece.volume, piece.corners.min(axis=0).tolist()))
    return large[:max_parts]


def enclosed_volume(vertices: Floats, faces: Ints) -> float | None:
    """Return the volume that a mesh's bodies enclose, each by itself, m³; None if one is open.

    `vertices` is (n, 3) float64 in metres, `faces` (m, 3) int64.
    """
    import trimesh  # noqa: PLC0415 - only for users with meshes

    bodies = _bodies(trimesh.Trimesh(vertices, faces, process=True))
    if not bodies or not all(body.is_watertight for body in bodies):
        return None
    return plain_sum(abs(float(body.volume)) for body in bodies)


def _bodies(mesh: Any) -> list[Any]:  # noqa: ANN401 - trimesh
    """Return the connected surfaces of a mesh as meshes, in the order of their faces."""
    import trimesh  # noqa: PLC0415 - only for users with meshes

    groups = trimesh.graph.connected_components(
        mesh.face_adjacency, nodes=np.arange(len(mesh.faces)), min_len=1
    )
    ordered = sorted((np.sort(group) for group in groups), key=lambda group: int(group[0]))
    return list(mesh.submesh(ordered, append=False, repair=False))


def _is_convex(mesh: Any, hull: Piece) -> bool:  # noqa: ANN401 - trimesh
    closed = bool(mesh.is_watertight)
    return closed and abs(float(mesh.volume)) >= _CONVEX_SHARE * hull.volume


def _pieces(path: Path, mesh: Any, max_parts: int) -> list[Piece]:  # noqa: ANN401 - trimesh
    """Cut a mesh body by body: coacd fills the space between solids that touch.

    What is open, or has more bodies than pieces are allowed, is cut at once.
    """
    bodies = _bodies(mesh)
    hulls = [_piece(np.asarray(body.vertices)) for body in bodies]
    solid = all(body.is_watertight for body in bodies) and None not in hulls
    if not solid or len(bodies) > max_parts:
        return _hulls(_cut(path, mesh, max_parts))
    pieces: list[Piece] = []
    left = max_parts
    for k, (body, hull) in enumerate(zip(bodies, hulls, strict=True)):
        most = left - (len(bodies) - 1 - k)  # each later body needs a piece at least
        if hull is not None and (_is_convex(body, hull) or most == 1):
            found = [hull]
        else:
            found = _hulls(_cut(path, body, most))
        pieces += found
        left -= len(found)
    return pieces


def _hulls(cut: list[Floats]) -> list[Piece]:
    return [piece for points in cut if (piece := _piece(points)) is not None]


def _cut(path: Path, mesh: Any, max_parts: int) -> list[Floats]:  # noqa: ANN401 - trimesh
    try:
        import coacd  # noqa: PLC0415 - only for users with meshes
    except ImportError as error:
        raise UsageError(
            f"{path}: is not convex and cutting it needs coacd; "
            f"{install_command('coacd')}, or set max_parts = 1"
        ) from error
    coacd.set_log_level("error")
    try:
        parts = coacd.run_coacd(
            coacd.Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces)),
            threshold=_THRESHOLD,
            max_convex_hull=max_parts,
            preprocess_resolution=20,
            resolution=300,
            mcts_nodes=6,
            mcts_iterations=6,
            mcts_max_depth=1,
            seed=_SEED,
        )
    except Exception as error:
        raise UsageError(
            f"{path}: cannot be cut into convex parts ({error}); close its surface, or set "
            "max_parts = 1 to take its convex hull"
        ) from error
    return [np.asarray(points, dtype=np.float64) for points, _ in parts]


def _piece(points: Floats) -> Piece | None:
    """Return the hull of points (n, 3) with few corners; None where they enclose no volume."""
    from scipy.spatial import ConvexHull, QhullError  # noqa: PLC0415 - only for users with meshes

    try:
        hull = ConvexHull(points)
        corners = _fewer(points[np.sort(hull.vertices)])
        volume = float(ConvexHull(corners).volume)
    except (QhullError, ValueError):
        return None
    return Piece(corners, volume) if volume > 0.0 else None


def _fewer(corners: Floats) -> Floats:
    """Choose at most 32 of a hull's corners (n, 3): farthest-point sampling.

    The extremes of the axes come first, so that the bounding box stays, then always the corner
    that lies farthest from those chosen.
    """
    if len(corners) <= MAX_CORNERS:
        return corners
    chosen = list(dict.fromkeys(int(k) for k in (*corners.argmin(axis=0), *corners.argmax(axis=0))))
    distance = np.full(len(corners), np.inf)
    for k in chosen:
        distance = np.minimum(distance, ((corners - corners[k]) ** 2).sum(axis=1))
    while len(chosen) < MAX_CORNERS:
        k = int(distance.argmax())
        chosen.append(k)
        distance = np.minimum(distance, ((corners - corners[k]) ** 2).sum(axis=1))
    return corners[sorted(chosen)]
