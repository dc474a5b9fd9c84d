"""Areas, proportions and the stated minima of real homes."""

from __future__ import annotations

from collections import defaultdict
from statistics import mean, median

import pytest

from internav_data.houses import HouseConfig, build_house
from internav_data.houses.choice import choose_floor_plan
from internav_data.houses.programme import programme
from internav_data.houses.room_types import ROOM_TYPES
from internav_data.houses.standards import MIN_DOOR_CM


def test_realistic_minima_hold_in_every_house(sample, oracle):
    for house in sample["realistic"]:
        oracle.check_realistic(house)


def test_realistic_minima_hold_for_two_hundred_floor_plans(oracle, assets):
    config = HouseConfig(preset="realistic", furnishing=0.0, windows=False)
    for scene in range(200):
        oracle.check_realistic(build_house(8, scene, config, assets))


@pytest.mark.parametrize("preset", ["paper", "realistic"])
def test_areas_and_proportions_by_type(sample, oracle, preset):
    areas = defaultdict(list)
    for house in sample[preset]:
        for room in house.rooms:
            standard = ROOM_TYPES[room.type].standard(preset)
            clear = oracle.clear_polygon(room)
            assert clear.area >= standard.low_m2 - 1e-6, room
            assert clear.area <= standard.high_m2 * 1.31, room
            areas[room.type].append(clear.area)
            if room.type != "hall":
                x0, y0, x1, y1 = clear.bounds
                assert max(x1 - x0, y1 - y0) / min(x1 - x0, y1 - y0) < 3.2, room
    for name, values in areas.items():
        if len(values) >= 10 and name != "hall":
            typical = ROOM_TYPES[name].standard(preset).area_m2
            assert 0.7 * typical < median(values) < 1.4 * typical, (name, median(values))


def test_paper_houses_have_the_areas_of_procthor(assets):
    config = {n: HouseConfig(rooms=str(n), furnishing=0.0) for n in range(1, 11)}
    for n, c in config.items():
        area = mean(build_house(4, k, c, assets).area_m2 for k in range(25))
        assert 17.0 * n < area < 29.0 * n, n


@pytest.mark.parametrize("preset", ["paper", "realistic"])
@pytest.mark.parametrize(
    "rooms",
    ["bathroom:10", "storage:10", "hall:10", "hall,bedroom:9", "storage,living", "studio:5"],
)
def test_odd_programmes_have_a_plan(preset, rooms):
    config = HouseConfig(preset=preset, rooms=rooms)
    for scene in range(3):
        specs = programme(0, scene, config, 0)
        assert len(choose_floor_plan(0, scene, config, specs, 0).types) == len(specs)


def test_candidates_make_plans_better():
    def score(candidates):
        config = HouseConfig(rooms="7", candidates=candidates)
        return mean(
            choose_floor_plan(0, k, config, programme(0, k, config, 0), 0).score for k in range(15)
        )

    assert score(24) < score(1)


def test_the_plain_row_serves_every_programme(oracle):
    from internav_data.houses.choice import score_floor_plan
    from internav_data.houses.layouts import row_layout
    from internav_data.houses.plan import FloorGrid
    from internav_data.records import Purpose, generator

    for preset in ("paper", "realistic"):
        for scene in range(60):
            config = HouseConfig(preset=preset)
            specs = programme(2, scene, config, 0)
            layout = row_layout(specs)
            grid = FloorGrid.of([layout[k] for k in range(len(specs))])
            rng = generator(0, Purpose.FLOOR_PLAN)
            width = MIN_DOOR_CM[preset]
            assert score_floor_plan(grid, specs, width, rng, lenient=True) is not None, (
                preset,
                scene,
            )


def test_bathrooms_are_not_the_way_through_where_avoidable(sample):
    for house in sample["paper"]:
        if len(house.rooms) < 5:
            continue
        for room in house.rooms:
            if room.type != "bathroom":
                continue
            rest = {r.room_id for r in house.rooms} - {room.room_id}
            seen, stack = set(), [min(rest)]
            while stack:
                at = stack.pop()
                if at in seen or at not in rest:
                    continue
                seen.add(at)
                stack += [b for a, b in house.room_graph if a == at]
                stack += [a for a, b in house.room_graph if b == at]
            assert seen == rest, (house.scene_id, room)
