"""Areas, proportions and the stated minima of real homes."""

from __future__ import annotations

from collections import defaultdict
from itertools import product
from statistics import mean, median

import networkx as nx
import pytest

from internav_data.houses import HouseConfig, build_house
from internav_data.houses.choice import choose_floor_plan, plan_candidate, scored_plan
from internav_data.houses.layouts import row_layout
from internav_data.houses.plan_score import PLAN_SCORE, TREE_SCORE, PlanCandidate, score_terms
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
    # Few rooms of a type have no median worth the name: the ten dining rooms of this sample have
    # 1.5 times their area, 25 of another seed 1.0 times. Halls are as long as their house.
    judged = {name: v for name, v in areas.items() if len(v) >= 12 and name != "hall"}
    assert {"bathroom", "bedroom", "kitchen", "living"} <= set(judged)
    for name, values in judged.items():
        typical = ROOM_TYPES[name].standard(preset).area_m2
        # Houses of one size differ by a factor of three in area, and these are few.
        assert 0.65 * typical < median(values) < 1.5 * typical, (name, median(values))


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


def test_no_other_door_makes_a_plan_better():
    """Every spanning tree that differs by one door, found with networkx, scores no lower."""
    swaps = 0
    for scene, rooms in product(range(5), (5, 9)):
        plan = chosen(scene, rooms=str(rooms), candidates=4)
        aim = HouseConfig().rooms_on_path(rooms)
        candidate = PlanCandidate(plan.grid, (), plan.types, plan.spans, aim)

        def score(tree, candidate=candidate):
            return sum(score_terms(candidate, tree, TREE_SCORE).values())

        assert nx.is_tree(nx.Graph(plan.tree))
        assert nx.Graph(plan.tree).number_of_nodes() == rooms
        for new, old in product(set(plan.spans) - set(plan.tree), plan.tree):
            other = [*(edge for edge in plan.tree if edge != old), new]
            if nx.is_connected(nx.Graph(other)) and nx.Graph(other).number_of_nodes() == rooms:
                swaps += 1
                assert score(other) > score(plan.tree) - 1e-9, (scene, new, old)
    assert swaps > 100


def test_a_score_can_be_printed_term_by_term():
    names = [term.name for term in PLAN_SCORE]
    assert len(set(names)) == len(names)
    seen = {"nooks"}
    programmes = (
        "8",
        "10",
        "3",
        "bathroom:4",
        "hall,bedroom",
        "living,kitchen:2,bathroom:2",
        "living,bedroom:2,bathroom",
    )
    for preset, rooms in (*product(["paper"], programmes), ("realistic", "8")):
        for scene in range(20):
            plan = chosen(scene, rooms=rooms, preset=preset, candidates=1)
            terms = plan.score_terms
            assert list(terms) == names
            assert min(terms.values()) >= 0.0
            seen |= {name for name, value in terms.items() if value > 0.0}
    assert chosen(0).score == sum(chosen(0).score_terms.values())
    assert seen == set(names), "a penalty that never occurs"


def test_a_room_of_nooks_is_penalised():
    """A cross of 4 m wide arms: its largest rectangle is 60 % of it."""
    config = HouseConfig(rooms="studio")
    specs = programme(SceneKey(0, 0), config)
    square = [(0, 0, 900, 900)]
    cross = [(0, 400, 1200, 800), (400, 0, 800, 400), (400, 800, 800, 1200)]
    nooks = [
        score_terms(plan_candidate({0: rects}, specs, config, lenient=True), [])["nooks"]
        for rects in (square, cross)
    ]
    assert nooks == [0.0, pytest.approx(1.5 * (0.62 - 0.6))]


def test_the_plain_row_serves_every_programme():
    for preset in ("paper", "realistic"):
        for scene in range(60):
            config = HouseConfig(preset=preset)
            specs = programme(SceneKey(2, scene), config)
            candidate = plan_candidate(row_layout(specs), specs, config, lenient=True)
            plan = scored_plan(candidate, generator(0, Purpose.FLOOR_PLAN))
            assert plan is not None, (preset, scene)


def test_bathrooms_are_not_the_way_through_where_avoidable(sample):
    bathrooms = 0
    for house in sample["paper"]:
        if len(house.rooms) < 5:
            continue
        for room in house.rooms:
            if room.type != "bathroom":
                continue
            bathrooms += 1
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
    assert bathrooms >= 18
