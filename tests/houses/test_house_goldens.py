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
    "paper": "b3f22dd35a33f634c5f536acdca9a684f6f0fb271f1c5975d439d0adadb6d23a",
    "paper, every type": "5951052b92a500b594a9af75044cb54134c76896e5386a61a72245c27cc2b435",
    "realistic": "d1b3780eea61427536b4660c7d33fb28c84cb0a4c19d5cdcf0330ddd3063cc33",
    "realistic, every type": "4f587de007bcc6c43edb3c404a0bd1502d401a2f9232afd1949cc647729d637b",
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
