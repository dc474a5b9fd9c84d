"""Lattice of nodes 0.25 m apart, free where the agent's disc keeps clear of all polygons."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from internav_data.geometry import Polygons, house_footprints
from internav_data.navigation import grid
from internav_data.records.agent import CLEARANCE_M, SPACING_M
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from internav_data.records import House, Vec2

_DIRECTIONS = {(1, 0): 0, (0, 1): 1, (-1, 0): 2, (0, -1): 3}


class Lattice:
    """Nodes and edges on which the agent can stand and step: (i, j) lies at (0.25 i, 0.25 j) m.

    A node is free when the disc keeps its distance from every polygon, an edge when the swept disc
    does; exact distances, no bitmap. Blockers are *counted*, so that adding or removing a group of
    polygons costs only the nodes around it.

    Parameters
    ----------
    blockers : (3, nx, ny) int32
        Number of polygons that block each node, its edge to +x and its edge to +y.
    """

    __slots__ = ("_blockers", "_groups", "_next")

    def __init__(self, blockers: NDArray[np.int32]) -> None:
        self._blockers = blockers
        self._groups: dict[int, Polygons] = {}
        self._next = 0

    @staticmethod
    def of(house: House) -> Lattice:
        """Return the lattice of a house: its walls and furniture, no obstacles."""
        return Lattice.of_polygons(house_footprints(house), house.outline)

    @staticmethod
    def of_polygons(polygons: Polygons, outline: Sequence[Vec2] | NDArray[np.float64]) -> Lattice:
        """Return a lattice over a simple polygon; nodes outside it are blocked for good.

        The lattice reaches from (0, 0) to the outline's largest x and y; `outline` (n, 2), metres.
        """
        corners = np.ascontiguousarray(outline, dtype=np.float64).reshape(-1, 2)
        # A millionth of a step: an outline that ends on a node row keeps that row.
        nx, ny = (max(0, math.floor(float(m) / SPACING_M + 1e-6)) + 1 for m in corners.max(axis=0))
        blockers = np.zeros((3, nx, ny), dtype=np.int32)
        grid.close_outside(blockers, corners, SPACING_M)
        grid.mark(blockers, polygons.vertices, polygons.offsets, SPACING_M, CLEARANCE_M, 1)
        return Lattice(blockers)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of nodes along x and along y."""
        _, nx, ny = self._blockers.shape
        return nx, ny

    @property
    def free(self) -> NDArray[np.bool_]:
        """Nodes on which the disc can stand, (nx, ny) bool."""
        return self._blockers[grid.NODE] == 0

    def add(self, polygons: Polygons) -> int:
        """Block nodes and edges by a group of polygons; return the handle that removes it."""
        grid.mark(self._blockers, polygons.vertices, polygons.offsets, SPACING_M, CLEARANCE_M, 1)
        handle = self._next
        self._groups[handle] = polygons
        self._next += 1
        return handle

    def remove(self, handle: int) -> None:
        """Remove a group of polygons.

        Raises
        ------
        UsageError
            The handle is unknown or was removed before.
        """
        polygons = self._groups.pop(handle, None)
        if polygons is None:
            raise UsageError(
                f"Lattice.remove: no group has handle {handle}; "
                f"there are {sorted(self._groups)}: pass what `add` returned, once."
            )
        grid.mark(self._blockers, polygons.vertices, polygons.offsets, SPACING_M, CLEARANCE_M, -1)

    def copy(self) -> Lattice:
        """Return an independent lattice; handles stay valid in both."""
        other = Lattice(self._blockers.copy())
        other._groups = dict(self._groups)
        other._next = self._next
        return other

    def distances(self, i: int, j: int) -> NDArray[np.int32]:
        """Return the steps from every node to node (i, j), (nx, ny) int32; -1 where cut off.

        A blocked (i, j) is cut off from all nodes, itself included.

        Raises
        ------
        UsageError
            The node does not exist.
        """
        self._check(i, j)
        steps: NDArray[np.int32] = grid.steps_to(self._blockers, i, j)
        return steps

    def distance(self, start: tuple[int, int], goal: tuple[int, int]) -> int | None:
        """Return the steps between two nodes; None without a path.

        Raises
        ------
        UsageError
            One of the nodes does not exist.
        """
        self._check(*start)
        self._check(*goal)
        steps = int(grid.steps_between(self._blockers, *start, *goal))
        return None if steps < 0 else steps

    def components(self) -> NDArray[np.int32]:
        """Return the component of every node, (nx, ny) int32; -1 where blocked.

        Components are numbered in order of their first node.
        """
        labels: NDArray[np.int32] = grid.components(self._blockers)
        return labels

    def path(self, start: tuple[int, int], goal: tuple[int, int]) -> NDArray[np.int64] | None:
        """Return nodes (n, 2) int64 of a shortest path, both ends included; None without one.

        Among shortest paths, one that goes straight on as long as that is shortest.

        Raises
        ------
        UsageError
            One of the nodes does not exist.
        """
        self._check(*start)
        self._check(*goal)
        steps = self.distances(*goal)
        if steps[start] < 0:
            return None
        nodes: NDArray[np.int64] = grid.descend(self._blockers, steps, *start)
        return nodes

    def edge_free(self, i: int, j: int, di: int, dj: int) -> bool:
        """Return whether the disc can step from node (i, j) by (di, dj), to one of four neighbours.

        Raises
        ------
        UsageError
            The node does not exist, or (di, dj) is no step.
        """
        self._check(i, j)
        direction = _DIRECTIONS.get((di, dj))
        if direction is None:
            raise UsageError(
                f"Lattice.edge_free: ({di}, {dj}) is no step; "
                f"expected one of {sorted(_DIRECTIONS)}."
            )
        return bool(grid.open_edge(self._blockers, i, j, direction))

    def _check(self, i: int, j: int) -> None:
        nx, ny = self.shape
        if not (0 <= i < nx and 0 <= j < ny):
            raise UsageError(
                f"Lattice: node ({i}, {j}) does not exist; expected 0 <= i < {nx} and "
                f"0 <= j < {ny} (node = position / {SPACING_M} m)."
            )
