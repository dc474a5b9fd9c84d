"""Clutter: small things on the surfaces and the floor of a furnished room (`HouseConfig.clutter`).

Nothing overhangs, overlaps or stands before a door, and the floor stays passable: the tests are
those of furniture. What can be pushed or picked up counts as movable, as everywhere.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from internav_data.houses.fitting import hits, turn_box
from internav_data.houses.furnishing import CAPACITY
from internav_data.houses.pieces import Group, PlacedAsset, against

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.core.typing import Floats
    from internav_data.houses.furnishing import RoomState
    from internav_data.houses.pieces import Picker

APART_M = 0.01
"""Smallest distance of two things on one surface."""
HIGHEST_TOP_M = 2.1
"""Height over which nothing on a surface reaches: that of doors, below any ceiling."""
TRIES = 8
"""Places that are tried for one thing on a surface."""
FLOOR_THINGS = ("Box", "Pillow", "HousePlant", "Stool", "GarbageCan", "Box", "LaundryHamper")
"""Types that lie about on floors; `Box` twice as often as the others."""
FLOOR_EXPECTED, FLOOR_PER_M2 = 2.6, 0.17
"""Expected number of things on a room's floor at `clutter` = 1, and for each square metre."""


class Surface(NamedTuple):
    """Things that one type of furniture may carry."""

    expected: float
    """Expected number of things tried for at `clutter` = 1, for each square metre of its plan."""
    min_expected: float
    """The same, however small it is."""
    kinds: tuple[str, ...]
    """Types of asset to choose from."""


_FOOD = ("Apple", "Bread", "Lettuce", "Tomato", "Pot")
_PAPERS = ("Laptop", "AlarmClock", "Box", "Apple")
_SHELF = ("Box", "AlarmClock", "HousePlant")
SURFACES: Mapping[str, Surface] = {
    "ArmChair": Surface(0.0, 0.8, ("Pillow",)),
    "Bed": Surface(0.6, 1.0, ("Pillow", "Pillow", "Laptop")),
    "Bench": Surface(1.5, 0.5, ("Pillow", "Box")),
    "Bookcase": Surface(3.0, 0.5, _SHELF),
    "ClothesDryer": Surface(2.0, 0.5, ("Box", "Pot")),
    "CoffeeTable": Surface(3.0, 1.0, (*_FOOD, "Laptop")),
    "CounterTop": Surface(5.0, 1.0, (*_FOOD, "Microwave")),
    "Desk": Surface(3.5, 1.0, _PAPERS),
    "DiningTable": Surface(3.5, 2.0, (*_FOOD, "Laptop")),
    "Dresser": Surface(4.0, 1.0, (*_SHELF, "Laptop")),
    "FilingCabinet": Surface(3.0, 0.5, _SHELF),
    "KitchenIsland": Surface(4.0, 1.0, _FOOD),
    "Nightstand": Surface(0.0, 1.2, ("AlarmClock", "Apple")),
    "Piano": Surface(1.5, 0.5, ("AlarmClock", "Box")),
    "Safe": Surface(0.0, 0.7, _SHELF),
    "ShelvingUnit": Surface(3.0, 0.5, _SHELF),
    "ShoeCabinet": Surface(4.0, 1.0, _SHELF),
    "SideTable": Surface(4.0, 1.0, (*_PAPERS, "HousePlant")),
    "Sofa": Surface(0.5, 1.2, ("Pillow",)),
    "StorageRack": Surface(3.0, 0.5, ("Box",)),
    "TVStand": Surface(1.5, 0.5, ("AlarmClock", "Box")),
    "Wardrobe": Surface(2.0, 0.5, ("Box",)),
    "WashingMachine": Surface(2.0, 0.5, ("Box", "Pot")),
}
"""Furniture that carries clutter, by type."""


def clutter_room(state: RoomState, picker: Picker, amount: float) -> None:
    """Lay small things on the surfaces and the floor of a furnished room.

    Parameters
    ----------
    state
        The room; its items and free nodes are updated.
    picker
        Assets and random numbers of the room's clutter.
    amount
        `HouseConfig.clutter`, above 0.
    """
    for number in range(len(state.placed)):
        for index in range(len(state.placed[number][0].items)):
            _lay_on(state, number, index, picker, amount)
    for _ in range(_drawn(picker, amount * (FLOOR_EXPECTED + FLOOR_PER_M2 * state.area_m2))):
        asset = picker.one(_chosen(picker, FLOOR_THINGS))
        if asset is None:
            continue
        if picker.chance(0.6):
            wall = Group((against(asset),))
            state.place(wall, state.along_walls(wall, picker.rng, "any"))
        else:
            loose = Group((PlacedAsset(asset, 0.0, 0.0, 0),))
            state.place(loose, state.in_the_open(loose, picker.rng))


def _drawn(picker: Picker, expected: float) -> int:
    """Round an expected number at random."""
    certain = int(expected)
    return certain + picker.chance(expected - certain)


def _chosen(picker: Picker, kinds: tuple[str, ...]) -> str:
    return kinds[int(float(picker.rng.random()) * len(kinds))]


def _lay_on(state: RoomState, number: int, index: int, picker: Picker, amount: float) -> None:
    """Lay things on one item of a group of the room."""
    below = state.placed[number][0].items[index]
    surface = SURFACES.get(below.asset.type)
    if surface is None or below.support >= 0:
        return
    width, depth = below.asset.size[:2]
    for _ in range(
        _drawn(picker, amount * (surface.min_expected + surface.expected * width * depth))
    ):
        asset = picker.one(_chosen(picker, surface.kinds))
        for _ in range(TRIES):
            across, along, turn = (float(v) for v in picker.rng.random(3))
            if asset is None or state.solid_count == CAPACITY:
                break
            dx, dy = (2.0 * across - 1.0) * below.half[0], (2.0 * along - 1.0) * below.half[1]
            item = picker.resting(below, index, asset, dx, dy, int(4 * turn))
            if item is not None and _stands(state, number, index, item):
                break


def _stands(state: RoomState, number: int, index: int, item: PlacedAsset) -> bool:
    """Put a thing onto an item of a group unless something is in its way; return whether it was."""
    group, x, y, turn = state.placed[number]
    mine, carrier = np.empty(6), np.empty(6)
    turn_box(Group((item,)).boxes[0], x, y, turn, mine)
    turn_box(group.boxes[index], x, y, turn, carrier)
    solids = state.solids[: state.solid_count]
    # The bounding box of what carries the thing may reach over its top, as a sofa's does: whether
    # the top is free there was tested part by part.
    others: Floats = solids[(solids != carrier).any(axis=1)]
    keep_out = state.keep_out[: state.keep_out_count]
    if mine[5] > HIGHEST_TOP_M or hits(mine, others, APART_M) or hits(mine, keep_out, 0.0):
        return False
    state.placed[number] = (group.with_items(item), x, y, turn)
    state.add_solid(mine)
    return True
