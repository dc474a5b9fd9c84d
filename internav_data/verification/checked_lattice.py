"""The lattice derived again: distances by shapely, breadth-first search by scipy.

Every node and every edge of the 0.25 m lattice is compared with every polygon near it. The house
alone is evaluated once; obstacles only remove nodes and edges.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, dijkstra

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from shapely import Geometry, Polygon

    from internav_data.core.typing import Bools, Ints

SPACING_M = 0.25
RADIUS_M = 0.2
"""Radius of the agent's disc."""
TOLERANCE_M = 1e-6
"""Exact ties (a node row 0.2 m from a wall) are free."""
KEEP_M = RADIUS_M - TOLERANCE_M
"""A disc is free at this distance from every polygon or more."""


@dataclass(frozen=True, slots=True, eq=False)
class FreeSpace:
    """Masks of the free nodes (n,) and edges (m,) of a lattice."""

    nodes: Bools
    edges: Bools


class CheckedLattice:
    """Lattice of one house; `free` are its free nodes and edges without obstacles.

    Nodes are numbered i * columns + j; node (i, j) lies at (i, j) * 0.25 m.
    """

    def __init__(self, blockers: Sequence[Geometry], outline: Polygon) -> None:
        _, _, x_max, y_max = outline.bounds
        self.shape = (math.floor(x_max / SPACING_M) + 1, math.floor(y_max / SPACING_M) + 1)
        i, j = np.indices(self.shape)
        self._xy = np.column_stack([i.ravel(), j.ravel()]) * SPACING_M
        shapely.prepare(outline)
        inside = shapely.intersects_xy(outline, self._xy[:, 0], self._xy[:, 1])
        self._point_tree = shapely.STRtree(list(shapely.get_parts(shapely.multipoints(self._xy))))
        nodes = inside & ~self._near(self._point_tree, blockers, len(self._xy))
        number = np.arange(len(self._xy)).reshape(self.shape)
        pairs = np.vstack(
            [
                np.column_stack([number[:-1].ravel(), number[1:].ravel()]),
                np.column_stack([number[:, :-1].ravel(), number[:, 1:].ravel()]),
            ]
        )
        # A swept edge contains its ends: only edges between free nodes can be free.
        pairs = pairs[nodes[pairs].all(axis=1)]
        # By first node, as the rows of a sparse matrix: each graph of a subset takes two sums.
        self._pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].astype(np.int32)
        self._edge_tree = shapely.STRtree(
            list(shapely.get_parts(shapely.multilinestrings(self._xy[self._pairs])))
        )
        edges = ~self._near(self._edge_tree, blockers, len(self._pairs))
        self.free = FreeSpace(nodes, edges)
        self._distances: dict[int, NDArray[np.float64]] = {}

    @staticmethod
    def _near(tree: shapely.STRtree, blockers: Sequence[Geometry], count: int) -> Bools:
        """Mask (count,) of a tree's geometries that are too close to a blocker for the disc."""
        near = np.zeros(count, dtype=np.bool_)
        if blockers and count:
            hit = tree.query(np.array(blockers, dtype=object), "dwithin", KEEP_M)
            near[hit[1]] = True
        return near

    def with_obstacles(self, obstacles: Sequence[Geometry]) -> FreeSpace:
        """Return the nodes and edges that stay free with footprints of obstacles."""
        nodes = self.free.nodes & ~self._near(self._point_tree, obstacles, len(self._xy))
        edges = self.free.edges & ~self._near(self._edge_tree, obstacles, len(self._pairs))
        return FreeSpace(nodes, edges)

    def node(self, i: int, j: int) -> int:
        """Return the number of a node, -1 off the lattice."""
        inside = 0 <= i < self.shape[0] and 0 <= j < self.shape[1]
        return i * self.shape[1] + j if inside else -1

    def _graph(self, free: FreeSpace) -> csr_array:
        pairs, count = self._pairs[free.edges], len(self._xy)
        ends = np.cumsum(np.bincount(pairs[:, 0], minlength=count), dtype=np.int32)
        rows = np.concatenate([np.zeros(1, np.int32), ends])
        columns = np.ascontiguousarray(pairs[:, 1])
        return csr_array((np.ones(len(pairs)), columns, rows), shape=(count, count))

    def distances(self, goal: int, free: FreeSpace) -> NDArray[np.float64]:
        """Return the number of steps from every node to a goal, inf if none, shape (n,)."""
        if free is self.free and goal in self._distances:
            return self._distances[goal]
        # Without weights scipy's Dijkstra counts edges, as a breadth-first search does.
        steps = dijkstra(self._graph(free), directed=False, indices=[goal], unweighted=True)[0]
        out = np.asarray(steps, dtype=np.float64)
        if free is self.free:
            self._distances[goal] = out
        return out

    def edge_free(self, node: int, neighbour: int, free: FreeSpace) -> bool:
        """Return whether the edge between two nodes is free; not if one of them does not exist."""
        ends = sorted((node, neighbour))
        return bool((self._pairs[free.edges] == ends).all(axis=1).any())

    def reachable(self, node: int, free: FreeSpace) -> int:
        """Return the number of nodes within reach of a free node, itself included."""
        order = breadth_first_order(
            self._graph(free), node, directed=False, return_predecessors=False
        )
        return len(order)

    def components(self) -> Ints:
        """Return the component of every node without obstacles, -1 if not free, shape (n,)."""
        _, labels = connected_components(self._graph(self.free), directed=False)
        return np.where(self.free.nodes, labels, -1)

    def points(self) -> NDArray[np.float64]:
        """Return the positions of all nodes, shape (n, 2), metres."""
        return np.asarray(self._xy, dtype=np.float64)
