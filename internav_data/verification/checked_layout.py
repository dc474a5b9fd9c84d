"""What all episodes of a scene share when they are judged, worked out once."""

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
from internav_data.verification.portals import Portals
from internav_data.verification.shapes import AGENT_HEIGHT_M, STEP_OVER_M
from internav_data.verification.ways import COARSE, FINE, Sight, grown

if TYPE_CHECKING:
    from collections.abc import Mapping

    from shapely import Geometry

    from internav_data.records import House
    from internav_data.verification.shapes import Shapes

MOST_PATHS = 64
"""Room paths and node paths listed at most."""

RoomPaths = tuple[tuple[int, ...], ...]


class CheckedLayout:
    """A house, its footprints, its lattice and its visibility graph without obstacles."""

    def __init__(
        self, house: House, shapes: Shapes, prints: Mapping[int, list[Geometry]] | None = None
    ) -> None:
        """Measure a house; `prints` are footprints of its things where they are known."""
        self.house = house
        self.shapes = shapes
        self.outline = Polygon(house.outline)
        self.walls: list[Geometry] = [
            box(w.x_min, w.y_min, w.x_max, w.y_max)
            for w in house.walls
            if w.z_max > STEP_OVER_M and w.z_min < AGENT_HEIGHT_M
        ]
        known = prints or {}
        self.prints: dict[int, list[Geometry]] = {
            t.object_id: known.get(t.object_id) or shapes.footprint(t.asset_id, t.pose)
            for t in house.objects
        }
        self.blockers = self.walls + [plan for plans in self.prints.values() for plan in plans]
        self.ground = CheckedLattice(self.blockers, self.outline)
        self._room_paths: dict[tuple[int, int], tuple[RoomPaths, bool]] = {}

    def without(self, gone: frozenset[int]) -> CheckedLayout:
        """Return the house without some of its things (ids)."""
        things = tuple(t for t in self.house.objects if t.object_id not in gone)
        return CheckedLayout(replace(self.house, objects=things), self.shapes, self.prints)

    @cached_property
    def components(self) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
        """Component of every lattice node, -1 where not free."""
        return self.ground.components()

    @cached_property
    def main_component(self) -> int:
        """The largest component, -1 where nothing is free."""
        labels = self.components[self.components >= 0]
        return int(np.bincount(labels).argmax()) if len(labels) else -1

    @cached_property
    def _ground(self) -> tuple[Polygon, Point] | None:
        """The outline and a node of the largest component."""
        nodes = np.flatnonzero(self.components == self.main_component)
        if self.main_component < 0:
            return None
        return self.outline, Point(self.ground.points()[nodes[0]])

    @cached_property
    def portals(self) -> Portals:
        """Lower bounds of ways from room to room."""
        return Portals(self.house)

    @cached_property
    def sight(self) -> Sight:
        """The visibility graph without obstacles, arcs cut coarsely."""
        return Sight(grown(self.blockers, COARSE, ground=self._ground), portals=self.portals)

    @cached_property
    def free(self) -> Geometry:
        """Where the disc's centre can be, arcs cut finely."""
        array = np.array(self.blockers, dtype=object)
        taken = shapely.union_all(shapely.buffer(array, KEEP_M, quad_segs=FINE))
        return shapely.difference(self.outline, taken)

    @cached_property
    def open_doors(self) -> dict[tuple[int, int], list[int]]:
        """Open doors between each pair of rooms, ascending."""
        doors: dict[tuple[int, int], list[int]] = {}
        for door in sorted(self.house.doors, key=lambda d: d.door_id):
            if door.open and OUTSIDE not in door.rooms:
                a, b = door.rooms
                doors.setdefault((min(a, b), max(a, b)), []).append(door.door_id)
        return doors

    def room_paths(self, first: int, second: int) -> tuple[RoomPaths, bool]:
        """All simple room paths, by number of rooms, then ids; whether more than are listed."""
        key = (first, second)
        if key not in self._room_paths:
            graph = nx.Graph(list(self.open_doors))
            graph.add_nodes_from(room.room_id for room in self.house.rooms)
            paths: list[tuple[int, ...]] = [(first,)]
            if first != second:
                paths = [tuple(p) for p in nx.all_simple_paths(graph, first, second)]
            paths.sort(key=lambda path: (len(path), path))
            self._room_paths[key] = (tuple(paths[:MOST_PATHS]), len(paths) > MOST_PATHS)
        return self._room_paths[key]

    def door_paths(self, first: int, second: int) -> tuple[tuple[tuple[int, ...], ...], bool]:
        """Every choice of doors along the listed room paths; whether more than are listed."""
        paths, _ = self.room_paths(first, second)
        out: list[tuple[int, ...]] = []
        for path in paths:
            steps = [self.open_doors[min(a, b), max(a, b)] for a, b in pairwise(path)]
            out += product(*steps)
        return tuple(out[:MOST_PATHS]), len(out) > MOST_PATHS
