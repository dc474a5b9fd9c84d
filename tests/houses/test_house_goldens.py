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
    "paper": "ec7fad4be25c66c4f68c8839c3342018037a4c3dc48f216fda8490387ac1b730",
    "paper, every type": "d15d7c5a5654a0e5aae875a7e866c49c5d59f011ed1514d1d0e172b382b6fc6d",
    "realistic": "5642e9e7a94c67cfa386cc44b3de82b3959347c8898bf2301b543b77bc1a4a0a",
    "realistic, every type": "aed07ac302baf40c3f45e4dedbffeb125f2166888e8b6b431ebb35d50e8e02b4",
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
