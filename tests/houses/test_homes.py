"""Homes that work, and that differ: the benchmark's rules, counted over some drawn houses."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from internav_data.houses import HouseConfig, build_house
from internav_data.houses.choice import choose_floor_plan
from internav_data.houses.pieces import FACING_ROOM, Group, PlacedAsset
from internav_data.houses.programme import programme
from internav_data.houses.sitting import watched_poses
from internav_data.records import SceneKey

sys.path[:0] = [str(Path(__file__).parents[2] / "benchmarks")]
from home_rules import RULES, area_spread, kept_rules, repeated_plans  # noqa: E402

PRESETS = ("paper", "realistic")
WANTED = {"paper": 0.95, "realistic": 0.99}


@pytest.mark.parametrize("preset", PRESETS)
def test_homes_work(sample, preset):
    for name, (kept, of) in kept_rules(sample[preset]).items():
        # One exception more than the share allows: these are few houses.
        assert kept >= WANTED[preset] * of - 1, (name, kept, of)


@pytest.mark.slow
@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("seed", [0, 1])
def test_homes_of_240_scenes_work_and_differ(assets, preset, seed):
    houses = [build_house(seed, k, HouseConfig(preset=preset), assets) for k in range(240)]
    for name, (kept, of) in kept_rules(houses).items():
        assert kept >= WANTED[preset] * of, (name, kept, of)
    assert repeated_plans(houses) == 0


def without(house, *types, room=None):
    """A house without its things of some types (in one room)."""
    objects = [t for t in house.objects if t.type not in types or room not in {None, t.room}]
    return replace(house, objects=tuple(objects))


def _turned(quaternion):
    """The quaternion after half a turn about z."""
    x, y, z, w = quaternion
    return (-y, x, w, -z)


def test_each_rule_is_broken_by_a_house_that_breaks_it(sample):
    wanted = {"Rug", "Television", "Painting", "DiningTable"}
    house = next(
        h for h in sample["paper"] if len(h.rooms) > 4 and wanted <= {t.type for t in h.objects}
    )
    studio = next(h for h in sample["paper"] if len(h.rooms) == 1)
    number = {room.type: room.room_id for room in reversed(house.rooms)}
    bath, kitchen, bedroom = (number[name] for name in ("bathroom", "kitchen", "bedroom"))

    def joined_to(room):
        """The house with all bathrooms behind one room."""
        baths = {r.room_id for r in house.rooms if r.type == "bathroom"}
        graph = [edge for edge in house.room_graph if not baths & {*edge}]
        return replace(house, room_graph=(*graph, *((min(room, b), max(room, b)) for b in baths)))

    def again(kind, **changes):
        """The house with a thing of a type once more, or a new one of it."""
        one = next(t for t in house.objects if t.type == kind)
        return replace(house, objects=(*house.objects, replace(one, **changes)))

    def laid(name, room):
        """The house with two more things of a type."""
        two = (replace(house.objects[0], type=name, room=room),) * 2
        return replace(house, objects=(*house.objects, *two))

    others = [edge for edge in house.room_graph if kitchen not in edge]
    behind = replace(house, room_graph=(*others, (min(kitchen, bedroom), max(kitchen, bedroom))))
    screens = [t for t in house.objects if t.type == "Television"]
    turned = tuple(replace(t, quaternion=_turned(t.quaternion)) for t in screens)
    unseen = without(house, "Television")
    unseen = replace(unseen, objects=(*unseen.objects, *turned))
    long = replace(house.rooms[bedroom], polygon=((0, 0), (7, 0), (7, 3), (0, 3)))
    carried = next(t for t in house.objects if t.support >= 0)
    picture = next(t for t in house.objects if t.type == "Painting")
    rugs = {
        k: replace(a, size=(*a.size[:2], 0.01)) for k, a in house.assets.items() if not a.blocks
    }
    broken = {
        "toilet": without(house, "Toilet"),
        "stove": without(house, "Stove"),
        "counter": without(house, "CounterTop"),
        "fridge": without(house, "Fridge"),
        "kitchenette in a studio": without(studio, "Sink"),
        "wardrobe or dresser in a studio": without(studio, "Wardrobe", "Dresser"),
        "kitchen and living room not behind a private room": behind,
        "two chairs at a dining table": without(house, "Chair"),
        "television that somebody faces": unseen,
        "bedroom no longer than 2.2 to 1": replace(
            house, rooms=tuple(long if r.room_id == bedroom else r for r in house.rooms)
        ),
        "bathroom not only through the kitchen": joined_to(kitchen),
        "a bathroom not behind a private room": joined_to(bedroom),
        "window in a living room with an outer wall": replace(house, windows=()),
        "window in a bedroom": replace(house, windows=()),
        "window in a kitchen": replace(house, windows=()),
        "one dining table": laid("DiningTable", kitchen),
        "one shower in a bathroom": laid("Shower", bath),
        "toilet in a bathroom": without(house, "Toilet"),
        "basin in a bathroom": without(house, "Sink"),
        "wardrobe in a bedroom": without(house, "Wardrobe", room=bedroom),
        "bed in a bedroom": without(house, "Bed", room=bedroom),
        "stove in a kitchen": without(house, "Stove"),
        "things within the top they stand on": again(
            carried.type, x=carried.x + 3.0, support=carried.support
        ),
        "no television before a picture": again(
            "Television", x=picture.x, y=picture.y, z=picture.z, room=picture.room
        ),
        "rugs of 4 mm at most": replace(house, assets={**house.assets, **rugs}),
    }
    assert broken.keys() == RULES.keys()
    for name, bad in broken.items():
        kept, of = RULES[name](bad)
        assert kept < of, name


@pytest.mark.parametrize("preset", PRESETS)
def test_no_two_of_240_plans_are_equal_and_areas_spread(preset):
    config = HouseConfig(preset=preset)
    plans, areas = set(), []
    for scene in range(240):
        key = SceneKey(0, scene)
        specs = programme(key, config)
        if len(specs) == 1:
            areas.append(specs[0].area_m2)
        if len(specs) <= 2:  # larger plans are too many to repeat
            plan = choose_floor_plan(key, config, specs)
            assert (plan.types, plan.grid) not in plans, (scene, plan.types)
            plans.add((plan.types, plan.grid))
    # ProcTHOR's spread is 2.9 to 5.2 times; real homes of one room vary less.
    assert area_spread(areas) > (2.8 if preset == "paper" else 1.5)


def test_real_homes_of_five_rooms_differ_in_their_rooms():
    config = HouseConfig(preset="realistic", rooms="5")
    drawn = [tuple(spec.type for spec in programme(SceneKey(0, k), config)) for k in range(60)]
    assert len(set(drawn)) == 4
    assert max(map(drawn.count, drawn)) < 40
    assert all("hall" in types and "bathroom" in types for types in drawn)


def test_a_television_stands_where_a_bed_or_seat_faces_it(assets):
    sofa, stand = (assets.of_type(kind)[0] for kind in ("Sofa", "TVStand"))
    seat = Group((PlacedAsset(sofa, 0.0, 0.5, FACING_ROOM),))
    screen = Group((PlacedAsset(stand, 0.0, 0.2, FACING_ROOM),))
    # The sofa stands at (2, 0.5) with its back to y = 0; quarter turns of the group with the wall
    # that is behind the stand: y = 4 (2), x = 0 (3), y = 0 (0).
    poses = np.array([(2.0, 4.0, 2.0), (2.5, 4.0, 2.0), (0.0, 3.0, 3.0), (4.5, 0.0, 0.0)])
    kept = watched_poses(poses, screen, [(seat, 2.0, 0.0, 0)])
    assert kept.tolist() == poses[:2].tolist()
    assert len(watched_poses(poses, screen, [])) == 0


def test_a_programme_that_is_named_is_not_second_guessed(assets):
    house = build_house(0, 0, HouseConfig(rooms="kitchen,bedroom"), assets)
    assert sorted(room.type for room in house.rooms) == ["bedroom", "kitchen"]
    hall = build_house(0, 0, HouseConfig(rooms="3", hall_from=3), assets)
    assert {room.type for room in hall.rooms} == {"hall", "studio", "bathroom"}
