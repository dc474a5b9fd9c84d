"""Digests of houses as they are released: a change of any of them changes users' data.

A change on purpose needs the new digests here, a line under *Data* in the changelog, and a look at
`make demo`'s pictures. A failing comparison shows the new digest.
"""

from __future__ import annotations

import pytest

from internav_data.houses import HouseConfig, build_house
from internav_data.houses.room_types import ROOM_TYPES

SCENES = 33
"""Scenes of the default programme: every number of rooms from 1 to 10 occurs."""
ALL_TYPES = "hall,living,dining,kitchen,laundry,office,storage,studio,bathroom,bedroom"

GOLDEN = {
    "paper": "66e26d5d3d70f169bab18f7ddcd8a8cb2c5ed409339e5b6172753e90b8d871b1",
    "paper, every type": "7b781de379683a2b58f68a09102ae1fa2a518ec812191f1f9d9c62b3fdb613cc",
    "realistic": "1836a3e4b1e963fc46fbc0789a897e9dcdb0a617744cb46c48eadba56097a006",
    "realistic, every type": "470c51bf08a94e6239ac52ab91525811908558ed0cbbb2dcdc8648f39d04eabc",
}


def houses(case, assets):
    """Houses of one case of `GOLDEN`."""
    preset, _, every = case.partition(", ")
    config = HouseConfig(preset=preset, rooms=ALL_TYPES if every else "")
    return [build_house(0, scene, config, assets) for scene in range(3 if every else SCENES)]


def digest(case, assets):
    """Logical digest of the scene rows of one case, on values as a file holds them."""
    from internav_data.dataset.digest import logical_digest
    from internav_data.dataset.encode import to_table
    from internav_data.dataset.tables import SCENES as SPEC

    return logical_digest(to_table(houses(case, assets), SPEC))


@pytest.mark.parametrize("case", GOLDEN)
def test_houses_are_the_released_ones(case, assets):
    assert digest(case, assets) == GOLDEN[case]


def test_the_goldens_hold_every_type_of_room():
    assert sorted(ALL_TYPES.split(",")) == sorted(ROOM_TYPES)


def test_the_goldens_hold_every_number_of_rooms(assets):
    assert {len(house.rooms) for house in houses("paper", assets)} == set(range(1, 11))
