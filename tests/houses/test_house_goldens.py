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
    "paper": "5f4fa506c75536d8836e7cd036860514bd2e2afe0742dff59106789338bd9189",
    "paper, every type": "04d83db8a40299c6c336cbdda6b08808242e71b87917e1dc81eece055661aab8",
    "realistic": "4fe19d4202b9fb640c8c35aa395eb031743552825f7b635b05eb3d5a7f8c11c3",
    "realistic, every type": "e77f53ecaf0a9aeacab0c7a26881c826dba93b9dc849df2da076ebb9f712f010",
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
