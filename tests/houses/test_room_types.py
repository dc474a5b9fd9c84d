"""The table of room types is complete: a forgotten entry fails with its name."""

from __future__ import annotations

import dataclasses

import pytest

from internav_data.houses import HouseConfig, build_house
from internav_data.houses.group_makers import GROUP_MAKERS
from internav_data.houses.room_types import (
    ROOM_PAIRS,
    ROOM_TYPES,
    FurnitureRule,
    RoomPair,
    RoomType,
    room_pairs,
)


def test_the_oracles_own_tables_name_every_type(oracle):
    assert set(oracle.ASSETS_OF) == set(ROOM_TYPES)
    assert {name for name, r in ROOM_TYPES.items() if r.habitable} == oracle.HABITABLE


@pytest.mark.parametrize("preset", ["paper", "realistic"])
@pytest.mark.parametrize("name", ROOM_TYPES)
def test_a_house_with_a_room_of_each_type(assets, oracle, name, preset):
    found = 0
    config = HouseConfig(preset=preset, rooms=f"{name},living")
    for scene in range(3):
        house = build_house(3, scene, config, assets)
        oracle.check_house(house, reachable=False)
        room = next(r for r in house.rooms if r.type == name)
        found += bool(
            oracle.ASSETS_OF[name] & {t.type for t in house.objects if t.room == room.room_id}
        )
    assert found >= 2, f"rooms of the type '{name}' lack {sorted(oracle.ASSETS_OF[name])}"


@pytest.mark.parametrize("name", ROOM_TYPES)
@pytest.mark.parametrize("preset", ["paper", "realistic"])
def test_standards_are_consistent(name, preset):
    standard = ROOM_TYPES[name].standard(preset)
    assert standard.low_m2 < standard.area_m2 < standard.high_m2
    assert standard.width_m**2 <= standard.area_m2
    if ROOM_TYPES[name].habitable:
        assert standard.low_m2 >= 6.5
        assert standard.width_m >= 2.13


def test_positions_and_places_at_the_halls_end_are_taken_once():
    positions = [record.position for record in ROOM_TYPES.values()]
    assert sorted(positions) == list(range(len(ROOM_TYPES)))
    ends = [r.hall_end for r in ROOM_TYPES.values() if r.hall_end is not None]
    assert sorted(ends) == list(range(len(ends)))


def test_a_forgotten_fact_is_named():
    facts = {
        field.name: getattr(ROOM_TYPES["office"], field.name)
        for field in dataclasses.fields(RoomType)
    }
    for name in facts:
        with pytest.raises(TypeError, match=name):
            RoomType(**{key: value for key, value in facts.items() if key != name})


@pytest.mark.parametrize("name", ROOM_TYPES)
def test_the_doors_of_every_type_have_a_cost_of_their_own(name):
    assert any(name in pair for pair in ROOM_PAIRS), f"no record's `pairs` name '{name}'"


def test_every_furniture_group_is_made_and_used():
    used = {rule.group for record in ROOM_TYPES.values() for rule in record.furniture}
    assert used == set(GROUP_MAKERS)


def test_furniture_rules_name_types_that_exist(assets):
    for name, record in ROOM_TYPES.items():
        assert record.furniture, name
        for rule in record.furniture:
            assert rule.without in {"", *ROOM_TYPES}, (name, rule)
            assert rule.lacking in {"", *assets.types}, (name, rule)
            assert rule.without != name, (name, rule)


def test_a_pair_stands_in_one_of_its_records():
    assert sum(len(record.pairs) for record in ROOM_TYPES.values()) == len(ROOM_PAIRS)
    hall = ROOM_TYPES["hall"]
    twice = {**ROOM_TYPES, "hall": dataclasses.replace(hall, pairs={"office": RoomPair(2.0)})}
    twice["office"] = dataclasses.replace(ROOM_TYPES["office"], pairs={"hall": RoomPair(2.0)})
    with pytest.raises(ValueError, match=r"'hall' and 'office'|'office' and 'hall'"):
        room_pairs(twice)
    unknown = dataclasses.replace(hall, pairs={"attic": RoomPair(2.0)})
    with pytest.raises(ValueError, match="'attic'"):
        room_pairs({**ROOM_TYPES, "hall": unknown})


def test_a_new_type_of_one_record_becomes_rooms(monkeypatch, assets, oracle):
    """One record is enough for a type: no other module must list it.

    Programme, layouts, doors, windows and scores name hall, living room, kitchen, bedroom and
    bathroom, which play parts of their own; a further type is known by its record alone.
    """
    nursery = dataclasses.replace(
        ROOM_TYPES["office"],
        extra=None,
        position=len(ROOM_TYPES),
        pairs={"bedroom": RoomPair(1.0), "hall": RoomPair(2.0)},
        furniture=(FurnitureRule("bed", "corner"), FurnitureRule("box", "corner")),
    )
    monkeypatch.setitem(ROOM_TYPES, "nursery", nursery)
    for key, pair in room_pairs(ROOM_TYPES).items():
        monkeypatch.setitem(ROOM_PAIRS, key, pair)
    for preset in ("paper", "realistic"):
        config = HouseConfig(preset=preset, rooms="hall,living,bedroom,nursery:2,bathroom")
        house = build_house(0, 0, config, assets)
        oracle.check_house(house)
        rooms = {room.room_id for room in house.rooms if room.type == "nursery"}
        assert len(rooms) == 2
        assert rooms <= {thing.room for thing in house.objects if thing.type in {"Bed", "Box"}}
