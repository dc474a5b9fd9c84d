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
    "paper": "dedb73257b2681f0a2cbb14b9bd84331ada3f117c8abd6ac04a779d20eb2c239",
    "paper, every type": "d7edad40c665911eaf2b1b76a7b6ea044ad1c85376f9f590a33ccc38ab8e7e0a",
    "realistic": "b669efd270c42ab33fe756fdeab53651d2218284ddaae5535683987b3a07b89f",
    "realistic, every type": "0b6e8876a9d2acc7e39bd756a203497e98f9af286f5721140d44d3737c2a9b54",
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
