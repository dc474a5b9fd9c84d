"""House model: the parts of a house that all its worlds share, as `MjModel` is to `MjData`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from internav_data.core.locks import ThreadLock
from internav_data.geometry import Polygons, footprint, wall_footprints
from internav_data.navigation import SPACING_M, Lattice, TangentGraph
from internav_data.physics.kdop import EMPTY, dop8_of_rectangle
from internav_data.physics.scene import Body, wall_body
from internav_data.physics.sweep import extent_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from internav_data.core.typing import Floats
    from internav_data.physics.kdop import Dop8
    from internav_data.records import (
        Affordance,
        Asset,
        Dynamics,
        House,
        Pose,
        SceneObject,
        Vec2,
    )

MAX_TANGENT_GRAPHS: Final = 16
"""Maximum number of tangent graphs kept per house: one for each set of moved furniture."""


@dataclass(frozen=True, slots=True, eq=False)
class MovableObject:
    """An object that can move, at its pose or held in the agent's hand."""

    asset: Asset
    pose: Pose | None
    """None while it is held."""
    dynamics: Dynamics
    """Mass, friction and abilities of this object; those of the asset do not count."""
    footprint: Polygons
    """Footprint in the house, metres; empty while it is held."""
    dop8: Dop8
    """8-DOP in the house, metres."""
    low_m: float
    """Height of its lowest point, metres; inf while it is held."""
    high_m: float
    """Height of its highest point, metres; -inf while it is held."""
    affordance: Affordance | None = None
    """Interaction of which it can be the target whatever comes of it, where its dynamics are
    hidden; None where `dynamics` decides."""

    @staticmethod
    def of(body: Body, affordance: Affordance | None = None) -> MovableObject:
        """Return an object at the pose of a body."""
        asset, pose, extent = body.asset, body.pose, extent_of(body.asset, body.pose)
        return MovableObject(
            *(asset, pose, body.dynamics, footprint(asset, pose)),
            *(extent.dop8, extent.low_m, extent.high_m, affordance),
        )

    def affords(self, interaction: Affordance) -> bool:
        """Return whether an interaction may choose the object as its target."""
        if self.affordance is not None:
            return self.affordance == interaction
        return self.dynamics.pickable if interaction == "pick" else self.dynamics.pushable

    def moved(self, pose: Pose | None) -> MovableObject:
        """Return the object at another pose, or (None) in a hand."""
        if pose is not None:
            return MovableObject.of(Body(self.asset, pose, self.dynamics), self.affordance)
        nowhere = (Polygons.of([]), EMPTY, np.inf, -np.inf)
        return MovableObject(self.asset, None, self.dynamics, *nowhere, self.affordance)


def is_movable(placed: SceneObject, asset: Asset) -> bool:
    """Return whether agents take a piece of furniture for movable.

    It is of an obstacle type, and of an asset that they can handle; where attributes are hidden, it
    is of a type that they can handle, and may be fixed nevertheless.
    """
    return placed.affordance is not None or (asset.spawnable and not asset.dynamics.fixed)


@dataclass(frozen=True, slots=True, eq=False)
class HouseModel:
    """Parts of a house that all its worlds share; never changed."""

    house: House
    fixed: tuple[Body, ...]
    """Walls, then furniture that never moves, without rugs and the like."""
    dop8s: Floats
    """8-DOPs of `fixed`, (n, 8) float64, metres."""
    walls: Polygons
    """Footprints of the walls, metres."""
    footprints: Polygons
    """Footprints of `fixed`, walls first, metres."""
    items: tuple[MovableObject, ...]
    """Furniture that can move, in the house's order."""
    object_ids: tuple[int, ...]
    """Object id in the house of each item."""
    lattice: Lattice
    """Lattice with all furniture in its place and no obstacle."""
    handles: tuple[int, ...]
    """The lattice's handles of `items`."""
    _tangent_graphs: dict[tuple[int, ...], TangentGraph] = field(default_factory=dict)
    _lock: ThreadLock = field(default_factory=ThreadLock)

    @staticmethod
    def of(house: House) -> HouseModel:
        """Prepare a house for any number of worlds."""
        bodies = [wall_body(wall) for wall in house.walls]
        dop8s = [dop8_of_rectangle(w.x_min, w.y_min, w.x_max, w.y_max) for w in house.walls]
        walls = wall_footprints(house.walls)
        plans, items, object_ids = [walls], [], []
        # Movable furniture counts as an item with a handle of its own in the lattice, all else as
        # fixed; rugs block nothing and are left out.
        for placed in house.objects:
            asset = house.assets[placed.asset_id]
            if is_movable(placed, asset):
                body = Body.of_object(placed, house.assets)
                items.append(MovableObject.of(body, placed.affordance))
                object_ids.append(placed.object_id)
            elif asset.blocks:
                bodies.append(Body.of(asset, placed.pose, moves=False))
                dop8s.append(extent_of(asset, placed.pose).dop8)
                plans.append(footprint(asset, placed.pose))
        footprints = Polygons.joined(plans)
        lattice = Lattice.of_polygons(footprints, house.outline)
        handles = tuple(lattice.add(item.footprint) for item in items)
        return HouseModel(
            house=house,
            fixed=tuple(bodies),
            dop8s=np.array(dop8s, dtype=np.float64).reshape(-1, 8),
            walls=walls,
            footprints=footprints,
            items=tuple(items),
            object_ids=tuple(object_ids),
            lattice=lattice,
            handles=handles,
        )

    def tangent_graph(self, displaced: tuple[int, ...] = ()) -> TangentGraph:
        """Return the tangent graph among all furniture but some items (indices, ascending)."""
        with self._lock:
            graph = self._tangent_graphs.get(displaced)
            if graph is None:
                left = (item.footprint for k, item in enumerate(self.items) if k not in displaced)
                graph = TangentGraph.of_polygons(Polygons.joined([self.footprints, *left]))
                if len(self._tangent_graphs) >= MAX_TANGENT_GRAPHS:
                    # The oldest goes, but never the one with all furniture in its place.
                    del self._tangent_graphs[next(key for key in self._tangent_graphs if key)]
                self._tangent_graphs[displaced] = graph
            return graph

    def shortest_path_m(self, here: Vec2, goal: Vec2) -> float | None:
        """Return the Euclidean path length with all furniture in its place and no obstacle.

        An agent may stand where a piece of furniture was before it was moved away. The path then
        begins at the nearest clear node, and the straight distance to that node is added.

        Parameters
        ----------
        here, goal
            Points in the plane, metres.

        Returns
        -------
        float or None
            Length in metres; None without a path.

        """
        clear = self.tangent_graph()
        if clear.can_stand(here):
            return clear.distance(here, goal)
        # Nodes of the goal's component.
        steps = self.lattice.distances(*_node(goal))
        nodes = np.argwhere(steps >= 0)
        if not len(nodes):
            return None
        x, y = SPACING_M * nodes[:, 0] - here[0], SPACING_M * nodes[:, 1] - here[1]
        # Rounded, so that no tie hangs on the last bits: the first of equals by i, then j.
        best = int(np.argmin(np.round(x * x + y * y, 9)))
        there = (SPACING_M * int(nodes[best, 0]), SPACING_M * int(nodes[best, 1]))
        path = clear.distance(there, goal)
        straight = float(np.sqrt(x[best] * x[best] + y[best] * y[best]))
        return None if path is None else path + straight


def _node(point: Vec2) -> tuple[int, int]:
    return round(point[0] / SPACING_M), round(point[1] / SPACING_M)


def dop8_rows(items: Iterable[MovableObject]) -> Floats:
    """Return the 8-DOPs of items, (n, 8) float64, metres."""
    return np.array([item.dop8 for item in items], dtype=np.float64).reshape(-1, 8)
