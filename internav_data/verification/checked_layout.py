"""Geometry of a house that the checks of all its episodes share, computed once."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from itertools import pairwise, product
from typing import TYPE_CHECKING

import networkx as nx
import numpy as np
import shapely
from shapely import Point, Polygon, box

from internav_data.records import OUTSIDE
from internav_data.verification.checked_lattice import KEEP_M, CheckedLattice
from internav_data.verification.overlaps import WALL_ID, Solids
from internav_data.verification.portals import Portals
from internav_data.verification.shapes import AGENT_HEIGHT_M, STEP_OVER_M, wall_slabs
from internav_data.verification.visibility_graph import COARSE, FINE, VisibilityGraph, inflate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from shapely import Geometry

    from internav_data.records import House
    from internav_data.verification.shapes import Shapes, Slab

MAX_LAYOUTS = 8
"""Maximum number of cached layouts without some furniture: visibility graphs are large."""
MAX_PATHS = 64
"""Maximum number of room paths, and of node paths, that are listed."""

RoomPaths = tuple[tuple[int, ...], ...]


class CheckedLayout:
    """A house with its footprints, lattice and visibility graph, without obstacles."""

    def __init__(
        self, house: House, shapes: Shapes, footprints: Mapping[int, list[Geometry]] | None = None
    ) -> None:
        """Derive the geometry of a house; `footprints` holds those already known, by object id."""
        self.house = house
        self.shapes = shapes
        self.outline = Polygon(house.outline)
        self.walls: list[Geometry] = [
            box(w.x_min, w.y_min, w.x_max, w.y_max)
            for w in house.walls
            if w.z_max > STEP_OVER_M and w.z_min < AGENT_HEIGHT_M
        ]
        known = footprints or {}
        self.footprints: dict[int, list[Geometry]] = {
            t.object_id: known.get(t.object_id) or shapes.footprint(t.asset_id, t.pose)
            for t in house.objects
        }
        self.blockers = self.walls + [plan for plans in self.footprints.values() for plan in plans]
        self.lattice = CheckedLattice(self.blockers, self.outline)
        self._room_paths: dict[tuple[int, int], tuple[RoomPaths, bool]] = {}
        self._without: dict[frozenset[int], CheckedLayout] = {}

    @cached_property
    def wall_slabs(self) -> list[Slab]:
        """Walls as slabs, lintels and window breasts among them."""
        return wall_slabs(self.house.walls)

    @cached_property
    def object_slabs(self) -> dict[int, list[Slab]]:
        """Slabs of each object, by object id."""
        return {t.object_id: self.shapes.slabs(t.asset_id, t.pose) for t in self.house.objects}

    @cached_property
    def solids(self) -> Solids:
        """Walls and all objects but rugs, entire, at all heights."""
        assets = self.shapes.assets
        objects = (
            (t.object_id, self.object_slabs[t.object_id])
            for t in self.house.objects
            if assets[t.asset_id].blocks
        )
        return Solids.of([(WALL_ID, self.wall_slabs), *objects])

    def without(self, gone: frozenset[int]) -> CheckedLayout:
        """Return the layout without some of the house's objects (ids); the last ones are kept."""
        if not gone:
            return self
        if gone not in self._without:
            if len(self._without) >= MAX_LAYOUTS:
                del self._without[next(iter(self._without))]
            remaining = tuple(t for t in self.house.objects if t.object_id not in gone)
            self._without[gone] = CheckedLayout(
                replace(self.house, objects=remaining), self.shapes, self.footprints
            )
        return self._without[gone]

    @cached_property
    def components(self) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
        """Component of every lattice node, (n,) int64; -1 where not free."""
        return self.lattice.components()

    @cached_property
    def main_component(self) -> int:
        """Number of the largest component, -1 if no node is free."""
        labels = self.components[self.components >= 0]
        return int(np.bincount(labels).argmax()) if len(labels) else -1

    @cached_property
    def _interior(self) -> tuple[Polygon, Point] | None:
        """Outline and a node of the largest component."""
        nodes = np.flatnonzero(self.components == self.main_component)
        if self.main_component < 0:
            return None
        return self.outline, Point(self.lattice.points()[nodes[0]])

    @cached_property
    def portals(self) -> Portals:
        """Lower bounds of path lengths from room to room."""
        return Portals(self.house)

    @cached_property
    def visibility_graph(self) -> VisibilityGraph:
        """Visibility graph without obstacles, arcs approximated by few chords."""
        return VisibilityGraph(
            inflate(self.blockers, COARSE, interior=self._interior), portals=self.portals
        )

    @cached_property
    def free_area(self) -> Geometry:
        """Area of the disc's centre, arcs approximated by many chords."""
        array = np.array(self.blockers, dtype=object)
        occupied = shapely.union_all(shapely.buffer(array, KEEP_M, quad_segs=FINE))
        return shapely.difference(self.outline, occupied)

    @cached_property
    def open_doors(self) -> dict[tuple[int, int], list[int]]:
        """Ids of the open doors between each pair of rooms, ascending."""
        doors: dict[tuple[int, int], list[int]] = {}
        for door in sorted(self.house.doors, key=lambda d: d.door_id):
            if door.open and OUTSIDE not in door.rooms:
                a, b = door.rooms
                doors.setdefault((min(a, b), max(a, b)), []).append(door.door_id)
        return doors

    def room_paths(self, first: int, second: int) -> tuple[RoomPaths, bool]:
        """Return all simple room paths by number of rooms, then ids, and whether some are omitted.

        At most `MAX_PATHS` are listed.
        """
        key = (first, second)
        if key not in self._room_paths:
            graph = nx.Graph(list(self.open_doors))
            graph.add_nodes_from(room.room_id for room in self.house.rooms)
            paths: list[tuple[int, ...]] = [(first,)]
            if first != second:
                paths = [tuple(p) for p in nx.all_simple_paths(graph, first, second)]
            paths.sort(key=lambda path: (len(path), path))
            self._room_paths[key] = (tuple(paths[:MAX_PATHS]), len(paths) > MAX_PATHS)
        return self._room_paths[key]

    def door_paths(self, first: int, second: int) -> tuple[tuple[tuple[int, ...], ...], bool]:
        """Return all choices of doors along the listed room paths, and whether some are omitted."""
        paths, _ = self.room_paths(first, second)
        out: list[tuple[int, ...]] = []
        for path in paths:
            steps = [self.open_doors[min(a, b), max(a, b)] for a, b in pairwise(path)]
            out += product(*steps)
        return tuple(out[:MAX_PATHS]), len(out) > MAX_PATHS
