"""A house as episodes see it: what all its episodes share, worked out once."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from internav_data.geometry import Polygons, house_footprints
from internav_data.navigation import SPACING_M, room_paths, rooms_of
from internav_data.world import HouseModel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.navigation import Lattice, TangentGraph
    from internav_data.records import House, Vec2


@dataclass(slots=True)
class SpawnSite:
    """A furnished house with its lattice, its ways and the nodes where agents can be put."""

    house: House
    model: HouseModel
    """What the worlds of its episodes share."""
    footprints: Polygons
    """All that stands in the house, walls first."""
    lattice: Lattice
    """The stage's: of the house without obstacles. Never changed: copy it."""
    tangent_graph: TangentGraph
    """The stage's, all furniture in its place."""
    nodes: NDArray[np.int64]
    """Free nodes of the largest component, shape (n, 2), in order of i, then j."""
    rooms: NDArray[np.int64]
    """Room of each node, shape (n,)."""
    _paths_between: dict[tuple[Vec2, Vec2], tuple[Vec2, ...]] = field(default_factory=dict)
    _room_paths: dict[tuple[int, int], tuple[tuple[tuple[int, ...], ...], bool]] = field(
        default_factory=dict
    )

    @staticmethod
    def of(house: House) -> SpawnSite:
        """Work out what the episodes of a house share."""
        model = HouseModel.of(house)
        lattice = model.lattice
        components = lattice.components()
        sizes = np.bincount(components[components >= 0].ravel(), minlength=1)
        nodes = np.argwhere(components == int(np.argmax(sizes)))
        return SpawnSite(
            house=house,
            model=model,
            footprints=house_footprints(house),
            lattice=lattice,
            tangent_graph=model.tangent_graph(),
            nodes=nodes.astype(np.int64),
            rooms=rooms_of(house, SPACING_M * nodes.astype(np.float64)),
        )

    def path_between(self, first: Vec2, second: Vec2) -> tuple[Vec2, ...]:
        """Points of the any-angle way in the house without obstacles; () when there is none."""
        key = (first, second)
        if key not in self._paths_between:
            path = self.tangent_graph.path(first, second)
            self._paths_between[key] = (
                () if path is None else tuple((x, y) for x, y in path.tolist())
            )
        return self._paths_between[key]

    def room_paths(self, first: int, second: int) -> tuple[tuple[tuple[int, ...], ...], bool]:
        """All room paths between two rooms, and whether there were more than are listed."""
        key = (first, second)
        if key not in self._room_paths:
            self._room_paths[key] = room_paths(self.house, first, second)
        return self._room_paths[key]
