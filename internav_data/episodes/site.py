"""Spawn site: the parts of a furnished house that all its episodes share, computed once."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from internav_data.geometry import Polygons, house_footprints
from internav_data.navigation import SPACING_M, room_paths, rooms_of
from internav_data.physics.config import DEFAULT_PHYSICS, PhysicsConfig
from internav_data.physics.narrow_phase import joined_prisms, prisms_of
from internav_data.world import HouseModel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.catalog.attributes import HiddenAttributes
    from internav_data.navigation import Lattice, TangentGraph
    from internav_data.physics.narrow_phase import ConvexPrisms
    from internav_data.records import House, Vec2


@dataclass(frozen=True, slots=True)
class SpawnSite:
    """A furnished house with its lattice, its paths and the nodes where an agent can stand."""

    house: House
    model: HouseModel
    """Model that the worlds of all episodes share."""
    footprints: Polygons
    """Footprints of all walls and furniture, walls first, metres."""
    prisms: ConvexPrisms
    """Prisms of all walls and furniture but rugs: entire hulls, at all heights."""
    lattice: Lattice
    """Lattice of `model`, without obstacles. Never changed: copy it."""
    tangent_graph: TangentGraph
    """Tangent graph of `model`, all furniture in its place."""
    nodes: NDArray[np.int64]
    """Free nodes (i, j) of the largest component, (n, 2) int64, in order of i, then j."""
    rooms: NDArray[np.int64]
    """Room of each node, (n,) int64."""
    hidden: HiddenAttributes | None = None
    """Distribution of the obstacles' attributes; None where their look tells them."""
    physics: PhysicsConfig = DEFAULT_PHYSICS
    """Settings of physics."""
    _paths_between: dict[tuple[Vec2, Vec2], tuple[Vec2, ...]] = field(default_factory=dict)
    _room_paths: dict[tuple[int, int], tuple[tuple[tuple[int, ...], ...], bool]] = field(
        default_factory=dict
    )

    @staticmethod
    def of(
        house: House,
        hidden: HiddenAttributes | None = None,
        physics: PhysicsConfig = DEFAULT_PHYSICS,
    ) -> SpawnSite:
        """Prepare a house for episodes, whose obstacles may have hidden attributes."""
        model = HouseModel.of(house)
        lattice = model.lattice
        components = lattice.components()
        # One component, the largest: without obstacles its nodes reach each other.
        sizes = np.bincount(components[components >= 0].ravel(), minlength=1)
        nodes = np.argwhere(components == int(np.argmax(sizes)))
        return SpawnSite(
            house=house,
            model=model,
            footprints=house_footprints(house),
            prisms=_prisms(model),
            lattice=lattice,
            tangent_graph=model.tangent_graph(),
            nodes=nodes.astype(np.int64),
            rooms=rooms_of(house, SPACING_M * nodes.astype(np.float64)),
            hidden=hidden,
            physics=physics,
        )

    def path_between(self, first: Vec2, second: Vec2) -> tuple[Vec2, ...]:
        """Return the points of the shortest path between two points, metres, without obstacles.

        () without a path.
        """
        # Door to door these recur in every episode of the house.
        key = (first, second)
        if key not in self._paths_between:
            path = self.tangent_graph.path(first, second)
            self._paths_between[key] = (
                () if path is None else tuple((x, y) for x, y in path.tolist())
            )
        return self._paths_between[key]

    def room_paths(self, first: int, second: int) -> tuple[tuple[tuple[int, ...], ...], bool]:
        """Return the room paths between two rooms, and whether the list was cut at its bound."""
        key = (first, second)
        if key not in self._room_paths:
            self._room_paths[key] = room_paths(self.house, first, second)
        return self._room_paths[key]


def _prisms(model: HouseModel) -> ConvexPrisms:
    movable = [prisms_of(item.asset, item.pose) for item in model.items if item.pose is not None]
    return joined_prisms([*(prisms_of(b.asset, b.pose) for b in model.fixed), *movable])
