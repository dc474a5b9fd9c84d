"""Any prefix of the scenes has the shares of room counts right."""

from __future__ import annotations

from collections import Counter

import pytest

from internav_data.houses import room_count, split_of_scene
from internav_data.houses.config import RoomsRequest, parse_rooms
from internav_data.houses.quota import SHARES


def test_shares_sum_to_one():
    assert sum(SHARES.values()) == pytest.approx(1.0)


@pytest.mark.parametrize("seed", [0, 1, 12345])
@pytest.mark.parametrize("prefix", [25, 100, 300, 1200])
def test_every_prefix_is_close_to_the_shares(seed, prefix):
    counts = Counter(room_count(seed, scene) for scene in range(prefix))
    for rooms, share in SHARES.items():
        # Random draws would miss by sqrt(prefix): 17 of 1,200.
        assert abs(counts[rooms] - share * prefix) < 3.0, rooms


def test_large_houses_have_their_share_together():
    counts = Counter(room_count(7, scene) for scene in range(1000))
    assert abs(sum(counts[k] for k in range(6, 11)) - 187) <= 3


def test_a_count_and_a_range_are_kept():
    assert parse_rooms(" 4 ") == RoomsRequest(counts=(4,))
    assert parse_rooms("2-5") == RoomsRequest(counts=(2, 3, 4, 5))
    assert parse_rooms("") == RoomsRequest()
    assert parse_rooms("kitchen, bedroom:2").programme == ("kitchen", "bedroom", "bedroom")
    restricted = {k: SHARES[k] for k in (2, 3)}
    assert {room_count(0, scene, restricted) for scene in range(30)} == {2, 3}


def test_splits_are_a_function_of_the_scene():
    splits = Counter(split_of_scene(scene) for scene in range(12_000))
    assert splits == {"train": 11_800, "val": 100, "test": 100}
    assert [split_of_scene(s) for s in (0, 1, 2, 120, 121)] == [
        "val",
        "test",
        "train",
        "val",
        "test",
    ]
