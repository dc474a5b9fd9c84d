"""Shortest Euclidean paths of the agent's disc among polygons: exact, off the lattice.

Tangent graph: Liu and Arimoto 1992 (see the package); disconnection is proved before a search that
would find nothing.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from internav_data.geometry import Polygons, house_footprints
from internav_data.navigation.tangent_graph.boundary_arcs import (
    MID_X,
    MID_Y,
    X,
    Y,
    find_boundary_arcs,
    forbidden_parts,
)
from internav_data.navigation.tangent_graph.disconnection import clusters, disconnects
from internav_data.navigation.tangent_graph.polygon_grid import (
    boxes_of,
    index_polygons,
    path_clear_of,
    point_clear,
)
from internav_data.navigation.tangent_graph.search import Query, search
from internav_data.navigation.tangent_graph.tangents import (
    ARRIVE,
    FROM_X,
    FROM_Y,
    LEAVE,
    TO_X,
    TO_Y,
    tangents_of,
)
from internav_data.records.agent import CLEARANCE_M

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints
    from internav_data.records import House, Vec2


CHORD_RAD = math.radians(10.0)
"""Chords of at most this angle lie within 0.8 mm of the arc."""


@njit(cache=True)
def to_polyline(rows: Floats, directed_arcs: Ints, boundary_arcs: Floats, radius: float) -> Floats:
    """Return a path as points (n, 2) float64, metres: straight tangents, turns as chords.

    Parameters
    ----------
    rows
        Tangents of the path, (m, 7) float64.
    directed_arcs
        Directed arcs in which they arrive, (m,) int64; the last one is not read.
    boundary_arcs
        All arcs, (a, 6) float64.
    radius
        Radius of the disc, metres.
    """
    count = 2
    for k in range(len(rows) - 1):
        count += 2 + int(max(0.0, rows[k + 1, LEAVE] - rows[k, ARRIVE]) / CHORD_RAD)
    points = np.empty((count, 2))
    points[0] = rows[0, FROM_X : FROM_Y + 1]
    size = 1
    for k in range(len(rows)):
        points[size] = rows[k, TO_X : TO_Y + 1]
        size += 1
        if k + 1 == len(rows):
            break
        arc, side = boundary_arcs[directed_arcs[k] // 2], 1.0 - 2.0 * (directed_arcs[k] % 2)
        middle = math.atan2(arc[MID_Y], arc[MID_X])
        begin, turn = rows[k, ARRIVE], max(0.0, rows[k + 1, LEAVE] - rows[k, ARRIVE])
        chords = 1 + int(turn / CHORD_RAD)
        for c in range(1, chords):
            angle = middle + side * (begin + turn * c / chords)
            points[size, 0] = arc[X] + radius * math.cos(angle)
            points[size, 1] = arc[Y] + radius * math.sin(angle)
            size += 1
        if turn > 0.0:
            points[size] = rows[k + 1, FROM_X : FROM_Y + 1]
            size += 1
    return points[:size].copy()


CACHED_PATHS = 256
"""Maximum number of paths without obstacles that are cached: episodes ask again and again about
the same start and goal."""
_OFF_CORNERS_M = np.array([7.548776662466927e-8, 5.698402909980532e-8])
"""Paths are shifted by this (x, y) before crossings are counted, so that no corner lies on them:
stored positions are multiples of 0.1 mm, these are not, and 0.1 um crosses nothing by itself."""
_NOTHING = Polygons.of([])
_NO_BOXES = np.empty((0, 4))
_CLEAR_OF_POLYLINE_M = CLEARANCE_M + 0.001
"""Polygons this far from a polyline do not touch the disc: chords leave arcs by 0.8 mm."""


class TangentGraph:
    """Shortest paths of the agent's disc among convex polygons, with obstacles that come and go.

    Boundary arcs, tangents and clusters of the polygons alone are computed once; each question adds
    its start, goal and obstacles.

    Parameters
    ----------
    polygons : Polygons
        Polygons that are always there.
    """

    def __init__(self, polygons: Polygons) -> None:
        self._grid = index_polygons(polygons, CLEARANCE_M)
        self._boundary_arcs: Floats = find_boundary_arcs(
            *self._grid[:3], _NOTHING.vertices, _NOTHING.offsets, _NO_BOXES, CLEARANCE_M
        )
        self._tangents = tangents_of(self._grid, self._boundary_arcs, CLEARANCE_M)
        self._labels = clusters(*self._grid[:3], 2.0 * CLEARANCE_M)
        self._free_paths: dict[tuple[float, float, float, float], tuple[float, Floats]] = {}

    @staticmethod
    def of(house: House) -> TangentGraph:
        """Return the tangent graph of a house's walls and furniture, without obstacles.

        Walls must close its outline (entrances are closed): a path could lead outside otherwise.
        """
        return TangentGraph(house_footprints(house))

    @staticmethod
    def of_polygons(polygons: Polygons) -> TangentGraph:
        """Return the tangent graph of any convex polygons."""
        return TangentGraph(polygons)

    def distance(self, p: Vec2, q: Vec2, obstacles: Polygons | None = None) -> float | None:
        """Return the length of the shortest path between two points, metres; None without a path.

        Parameters
        ----------
        p, q : (2,) float
            Positions of the disc's centre, metres, anywhere.
        obstacles : Polygons, optional
            Convex polygons besides the graph's own.
        """
        length, _ = self._shortest_path(p, q, obstacles)
        return None if math.isinf(length) else length

    def path(self, p: Vec2, q: Vec2, obstacles: Polygons | None = None) -> Floats | None:
        """Return points (n, 2) float64 of the shortest path, metres; None without a path.

        Turns are chords of at most 10 degrees. Arguments as for `distance`.
        """
        length, points = self._shortest_path(p, q, obstacles)
        return None if math.isinf(length) else points.copy()

    def length_and_path(
        self, p: Vec2, q: Vec2, obstacles: Polygons | None = None
    ) -> tuple[float, Floats] | None:
        """Return the shortest path's length (metres) and points (n, 2) float64; None without one.

        Arguments as for `distance`.
        """
        length, points = self._shortest_path(p, q, obstacles)
        return None if math.isinf(length) else (length, points.copy())

    def sealed(self, p: Vec2, q: Vec2, obstacles: Polygons | None = None) -> bool:
        """Return whether no path of the disc leads from p to q, on the lattice or off it: exact.

        A point where the disc cannot stand is sealed off from everything.
        """
        obstacles = _NOTHING if obstacles is None else obstacles
        boxes = boxes_of(obstacles.vertices, obstacles.offsets)
        return self._sealed(p, q, obstacles, boxes)

    def can_stand(self, p: Vec2, obstacles: Polygons | None = None) -> bool:
        """Return whether the disc can stand at a point (x, y), metres."""
        obstacles = _NOTHING if obstacles is None else obstacles
        boxes = boxes_of(obstacles.vertices, obstacles.offsets)
        return self._stands(p, obstacles, boxes)

    def _stands(self, p: Vec2, obstacles: Polygons, boxes: Floats) -> bool:
        x, y = float(p[0]), float(p[1])
        return bool(
            point_clear(*self._grid[:3], x, y, CLEARANCE_M)
            and point_clear(obstacles.vertices, obstacles.offsets, boxes, x, y, CLEARANCE_M)
        )

    def _sealed(self, p: Vec2, q: Vec2, obstacles: Polygons, boxes: Floats) -> bool:
        if not (self._stands(p, obstacles, boxes) and self._stands(q, obstacles, boxes)):
            return True
        length, points = self._free_path(p, q)
        if math.isinf(length) or not len(boxes):
            return math.isinf(length)
        return bool(
            disconnects(
                points + _OFF_CORNERS_M,
                *self._grid[:3],
                self._labels,
                obstacles.vertices,
                obstacles.offsets,
                boxes,
                2.0 * CLEARANCE_M,
            )
        )

    def _shortest_path(self, p: Vec2, q: Vec2, obstacles: Polygons | None) -> tuple[float, Floats]:
        obstacles = _NOTHING if obstacles is None else obstacles
        boxes = boxes_of(obstacles.vertices, obstacles.offsets)
        if self._stands(p, _NOTHING, _NO_BOXES) and self._stands(q, _NOTHING, _NO_BOXES):
            length, points = self._free_path(p, q)
            # No path is shorter than the one without obstacles: where they leave it free, no other
            # is looked for.
            if math.isinf(length) or keeps_clear(points, obstacles):
                return length, points
        if self._sealed(p, q, obstacles, boxes):
            return math.inf, np.empty((0, 2))
        return self._search(p, q, obstacles, boxes)

    def _free_path(self, p: Vec2, q: Vec2) -> tuple[float, Floats]:
        key = (float(p[0]), float(p[1]), float(q[0]), float(q[1]))
        found = self._free_paths.get(key)
        if found is None:
            found = self._search(p, q, _NOTHING, _NO_BOXES)
            if len(self._free_paths) >= CACHED_PATHS:
                self._free_paths.clear()
            self._free_paths[key] = found
        return found

    def _search(self, p: Vec2, q: Vec2, obstacles: Polygons, boxes: Floats) -> tuple[float, Floats]:
        own = self._boundary_arcs
        vertices, offsets = obstacles.vertices, obstacles.offsets
        forbidden_starts, forbidden = forbidden_parts(own, vertices, offsets, boxes, CLEARANCE_M)
        boundary_arcs = own
        if len(boxes):
            new = find_boundary_arcs(vertices, offsets, boxes, *self._grid[:3], CLEARANCE_M)
            boundary_arcs = np.concatenate((own, new))
        query = Query(
            len(own),
            boundary_arcs,
            vertices,
            offsets,
            boxes,
            forbidden_starts,
            forbidden,
            np.array(p, dtype=np.float64),
            np.array(q, dtype=np.float64),
            CLEARANCE_M,
        )
        length, rows, directed_arcs = search(self._grid, self._tangents, query)
        if math.isinf(length):
            return math.inf, np.empty((0, 2))
        return float(length), to_polyline(rows, directed_arcs, boundary_arcs, CLEARANCE_M)


def keeps_clear(points: Floats, polygons: Polygons) -> bool:
    """Return whether a disc that follows a path surely keeps clear of polygons.

    `points` (n, 2) float64, metres, turns as chords of at most 10 degrees. False may be wrong by
    1 mm of clearance, True never is.
    """
    boxes = boxes_of(polygons.vertices, polygons.offsets)
    return bool(
        path_clear_of(points, polygons.vertices, polygons.offsets, boxes, _CLEAR_OF_POLYLINE_M)
    )
