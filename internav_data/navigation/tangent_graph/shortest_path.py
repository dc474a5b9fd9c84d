"""Any-angle distances: the shortest way of the agent's disc, off the grid and exact.

A found way as points: straight tangents, turns as chords.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from internav_data.geometry import Polygons, house_footprints
from internav_data.navigation.tangent_graph import arcs as arc_kernels
from internav_data.navigation.tangent_graph import disconnection as links
from internav_data.navigation.tangent_graph.arcs import MID_X, MID_Y, X, Y
from internav_data.navigation.tangent_graph.polygon_grid import (
    boxes_of,
    point_clear,
    scene_of,
    way_clear_of,
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
def drawn(rows: Floats, slots: Ints, arcs: Floats, radius: float) -> Floats:
    """Points (n, 2) of a way, given its tangents (n, 7) and the slots they arrive in (n,)."""
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
        arc, side = arcs[slots[k] // 2], 1.0 - 2.0 * (slots[k] % 2)
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


REMEMBERED = 256
"""So many clear ways are kept: episodes ask again and again about the same start and goal."""
_ASIDE = np.array([7.548776662466927e-8, 5.698402909980532e-8])
"""Clear ways are shifted by this before crossings are counted, so that no corner lies on them:
stored positions are multiples of 0.1 mm, these are not, and 0.1 um crosses nothing by itself."""
_NOTHING = Polygons.of([])
_NO_BOXES = np.empty((0, 4))
_UNTOUCHED_M = CLEARANCE_M + 0.001
"""What keeps this distance from a drawn way is out of its way: chords leave arcs by 0.8 mm."""


class TangentGraph:
    """Shortest ways of the disc among convex polygons, with obstacles that come and go.

    What belongs to the house alone (free arcs, tangents, clusters) is worked out once.

    Parameters
    ----------
    polygons : Polygons
        What always stands in the way.
    """

    def __init__(self, polygons: Polygons) -> None:
        self._scene = scene_of(polygons, CLEARANCE_M)
        self._arcs: Floats = arc_kernels.free_arcs(
            *self._scene[:3], _NOTHING.vertices, _NOTHING.offsets, _NO_BOXES, CLEARANCE_M
        )
        self._tangents = tangents_of(self._scene, self._arcs, CLEARANCE_M)
        self._labels = links.clusters(*self._scene[:3], 2.0 * CLEARANCE_M)
        self._clear_ways: dict[tuple[float, float, float, float], tuple[float, Floats]] = {}

    @staticmethod
    def of(house: House) -> TangentGraph:
        """Prepare a house: its walls and furniture, no obstacles.

        Walls must close its outline (entrances are closed): a way could lead outside otherwise.
        """
        return TangentGraph(house_footprints(house))

    @staticmethod
    def of_polygons(polygons: Polygons) -> TangentGraph:
        """Prepare any convex polygons."""
        return TangentGraph(polygons)

    def distance(self, p: Vec2, q: Vec2, obstacles: Polygons | None = None) -> float | None:
        """Length of the shortest way between two points, metres; None where they are sealed off.

        Parameters
        ----------
        p, q : (2,) float
            Positions of the disc's middle, anywhere.
        obstacles : Polygons, optional
            Convex polygons that stand in the way besides the house.
        """
        length, _ = self._way(p, q, obstacles)
        return None if math.isinf(length) else length

    def path(self, p: Vec2, q: Vec2, obstacles: Polygons | None = None) -> Floats | None:
        """Points (n, 2) along the shortest way, turns as chords of at most 10 degrees.

        None where the two points are sealed off from each other.
        """
        length, points = self._way(p, q, obstacles)
        return None if math.isinf(length) else points.copy()

    def way(
        self, p: Vec2, q: Vec2, obstacles: Polygons | None = None
    ) -> tuple[float, Floats] | None:
        """Both: the length and the points of the shortest way; None where they are sealed off."""
        length, points = self._way(p, q, obstacles)
        return None if math.isinf(length) else (length, points.copy())

    def sealed(self, p: Vec2, q: Vec2, obstacles: Polygons | None = None) -> bool:
        """Whether no way of the disc leads from p to q, on the lattice or off it: exact.

        A point where the disc cannot stand is sealed off from everything.
        """
        obstacles = _NOTHING if obstacles is None else obstacles
        boxes = boxes_of(obstacles.vertices, obstacles.offsets)
        return self._sealed(p, q, obstacles, boxes)

    def can_stand(self, p: Vec2, obstacles: Polygons | None = None) -> bool:
        """Whether the disc can stand at a point."""
        obstacles = _NOTHING if obstacles is None else obstacles
        boxes = boxes_of(obstacles.vertices, obstacles.offsets)
        return self._stands(p, obstacles, boxes)

    def _stands(self, p: Vec2, obstacles: Polygons, boxes: Floats) -> bool:
        x, y = float(p[0]), float(p[1])
        return bool(
            point_clear(*self._scene[:3], x, y, CLEARANCE_M)
            and point_clear(obstacles.vertices, obstacles.offsets, boxes, x, y, CLEARANCE_M)
        )

    def _sealed(self, p: Vec2, q: Vec2, obstacles: Polygons, boxes: Floats) -> bool:
        if not (self._stands(p, obstacles, boxes) and self._stands(q, obstacles, boxes)):
            return True
        length, points = self._clear_way(p, q)
        if math.isinf(length) or not len(boxes):
            return math.isinf(length)
        return bool(
            links.closes(
                points + _ASIDE,
                *self._scene[:3],
                self._labels,
                obstacles.vertices,
                obstacles.offsets,
                boxes,
                2.0 * CLEARANCE_M,
            )
        )

    def _way(self, p: Vec2, q: Vec2, obstacles: Polygons | None) -> tuple[float, Floats]:
        obstacles = _NOTHING if obstacles is None else obstacles
        boxes = boxes_of(obstacles.vertices, obstacles.offsets)
        if self._stands(p, _NOTHING, _NO_BOXES) and self._stands(q, _NOTHING, _NO_BOXES):
            length, points = self._clear_way(p, q)
            # Nothing is shorter than the clear way: where it is left free, no other is looked for.
            if math.isinf(length) or keeps_clear(points, obstacles):
                return length, points
        if self._sealed(p, q, obstacles, boxes):
            return math.inf, np.empty((0, 2))
        return self._search(p, q, obstacles, boxes)

    def _clear_way(self, p: Vec2, q: Vec2) -> tuple[float, Floats]:
        key = (float(p[0]), float(p[1]), float(q[0]), float(q[1]))
        found = self._clear_ways.get(key)
        if found is None:
            found = self._search(p, q, _NOTHING, _NO_BOXES)
            if len(self._clear_ways) >= REMEMBERED:
                self._clear_ways.clear()
            self._clear_ways[key] = found
        return found

    def _search(self, p: Vec2, q: Vec2, obstacles: Polygons, boxes: Floats) -> tuple[float, Floats]:
        own = self._arcs
        vertices, offsets = obstacles.vertices, obstacles.offsets
        shadow_starts, shadows = arc_kernels.shadows_on(own, vertices, offsets, boxes, CLEARANCE_M)
        arcs = own
        if len(boxes):
            new = arc_kernels.free_arcs(vertices, offsets, boxes, *self._scene[:3], CLEARANCE_M)
            arcs = np.concatenate((own, new))
        query = Query(
            len(own),
            arcs,
            vertices,
            offsets,
            boxes,
            shadow_starts,
            shadows,
            np.array(p, dtype=np.float64),
            np.array(q, dtype=np.float64),
            CLEARANCE_M,
        )
        length, rows, slots = search(self._scene, self._tangents, query)
        if math.isinf(length):
            return math.inf, np.empty((0, 2))
        return float(length), drawn(rows, slots, arcs, CLEARANCE_M)


def keeps_clear(points: Floats, polygons: Polygons) -> bool:
    """Return whether a disc going along (n, 2) `points` surely keeps clear of polygons."""
    boxes = boxes_of(polygons.vertices, polygons.offsets)
    return bool(way_clear_of(points, polygons.vertices, polygons.offsets, boxes, _UNTOUCHED_M))
