"""The validator holds every house to the manifest's config."""

import json
from dataclasses import replace

import pytest
from scenery import small_scenes, write_dataset

from internav_data.generation.config import load_config
from internav_data.houses import build_house, quota
from internav_data.records import Window
from internav_data.records.errors import CorruptDataError
from internav_data.verification import house_config, validate
from internav_data.verification.findings import FindingCollector
from internav_data.verification.house_config import check_house_config, house_request, room_counts

TWO_ROOMS = {"preset": "paper", "rooms": "2", "floor_plan": None, "windows": True}


@pytest.fixture(scope="module")
def scenes():
    return small_scenes()


def found(tmp_path, scenes, **house):
    write_dataset(tmp_path / "d", scenes, config={"house": {**TWO_ROOMS, **house}})
    return set(validate(tmp_path / "d", "schema").by_predicate)


@pytest.mark.parametrize(
    ("house", "predicate"),
    [
        ({}, None),
        ({"rooms": "living_room:2"}, None),
        ({"floor_plan": "0" * 64}, None),
        ({"rooms": "1"}, "rooms"),
        ({"rooms": "3-10"}, "rooms"),
        ({"rooms": "living_room, kitchen"}, "rooms"),
        ({"preset": "realistic"}, "preset"),
        ({"hall_from": 2}, "hall"),
    ],
)
def test_houses_of_another_config_are_found(tmp_path, scenes, house, predicate):
    assert found(tmp_path, scenes, **house) == (
        {f"schema.scenes.config-{predicate}"} if predicate else set()
    )


def test_a_house_of_another_floor_plan_and_one_with_windows_are_found(tmp_path, scenes):
    house, episodes = scenes[2]
    other = replace(house.rooms[0], type="bedroom")
    planted = replace(house, rooms=(other, *house.rooms[1:]))
    mixed = [*scenes[:2], (planted, episodes)]
    assert "schema.scenes.config-floor-plan" in found(tmp_path, mixed, floor_plan="0" * 64)
    glazed = replace(house, windows=(Window(0, 0, 2.0, 4.0, 0.0, 1.0, 1.2, 0.9),))
    mixed[2] = (glazed, episodes)
    assert "schema.scenes.config-windows" in found(tmp_path / "b", mixed, windows=False)


def test_a_config_that_no_generator_writes_is_refused(tmp_path, scenes):
    write_dataset(tmp_path / "d", scenes)
    for house in ({"preset": "palace", "rooms": ""}, {"preset": "paper", "rooms": "kitchen:x"}):
        with pytest.raises(CorruptDataError, match=r"config\.house"):
            house_request(0, json.loads(json.dumps({"house": house})))


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["house.preset=realistic"],
        ["house.rooms=3-5"],
        ["house.rooms=kitchen,living,bedroom:2"],
        ["house.hall_from=3", "house.rooms=2-4"],
        ["house.windows=false", "house.rooms=1"],
    ],
)
def test_every_house_of_the_generator_agrees_with_its_config(options):
    from internav_data.catalog import catalogue

    config = load_config(overrides=[*options, "seed=5"])
    request = house_request(5, config.identity("0"))
    report = FindingCollector()
    for scene in range(3):
        check_house_config(build_house(5, scene, config.house, catalogue()), request, None, report)
    assert not report.found


def test_the_validators_numbers_of_rooms_are_those_of_the_generator():
    assert dict(house_config.SHARES) == pytest.approx(dict(quota.SHARES))
    for seed, rooms in ((0, ""), (7, "2-5"), (2**62, "")):
        request = house_request(seed, {"house": {**TWO_ROOMS, "rooms": rooms}})
        for scene in (*range(300), 999_999):
            expected = quota.room_count(seed, scene, {k: quota.SHARES[k] for k in request.shares})
            assert expected in room_counts(request, scene)
            assert len(room_counts(request, scene)) == 1
