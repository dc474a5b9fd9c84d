"""Areas, proportions and the stated minima of real homes."""

from __future__ import annotations

from collections import defaultdict
from statistics import mean, median

import pytest

from internav_data.houses import HouseConfig, build_house
from internav_data.houses.choice import choose_floor_plan, plan_candidate, scored_plan
from internav_data.houses.layouts import row_layout
from internav_data.houses.plan_score import PLAN_SCORE
from internav_data.houses.programme import programme
from internav_data.houses.room_types import ROOM_TYPES
from internav_data.records import Purpose, SceneKey, generator


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
        key = SceneKey(0, scene)
        specs = programme(key, config)
        assert len(choose_floor_plan(key, config, specs).types) == len(specs)


def chosen(scene, **levers):
    """The floor plan of one scene."""
    key, config = SceneKey(0, scene), HouseConfig(**levers)
    return choose_floor_plan(key, config, programme(key, config))


def test_candidates_make_plans_better():
    def score(candidates):
        return mean(chosen(k, rooms="7", candidates=candidates).score for k in range(15))

    assert score(24) < score(1)


def test_a_score_can_be_printed_term_by_term():
    plans = [chosen(scene, rooms="7", candidates=2) for scene in range(8)]
    names = [term.name for term in PLAN_SCORE]
    assert len(set(names)) == len(names)
    for plan in plans:
        assert list(plan.score_terms) == names
        assert plan.score == sum(plan.score_terms.values())
        assert min(plan.score_terms.values()) >= 0.0
    for name in names:
        # Every penalty can be low and, but for the rarest, occurs.
        assert min(plan.score_terms[name] for plan in plans) < 8.0, name


def test_the_plain_row_serves_every_programme():
    for preset in ("paper", "realistic"):
        for scene in range(60):
            config = HouseConfig(preset=preset)
            specs = programme(SceneKey(2, scene), config)
            candidate = plan_candidate(row_layout(specs), specs, config, lenient=True)
            plan = scored_plan(candidate, generator(0, Purpose.FLOOR_PLAN))
            assert plan is not None, (preset, scene)


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
