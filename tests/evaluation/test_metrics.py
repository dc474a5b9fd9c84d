"""The paper's figures, against arithmetic on paper and episodes played again."""

from __future__ import annotations

import math
from dataclasses import replace

import networkx as nx
import numpy as np
import pytest

from internav_data.dataset import from_table, to_table
from internav_data.evaluation.evaluator import EvaluationConfig, evaluate
from internav_data.evaluation.metrics import GROUPS, MEASURES, RESULTS, result_of, summary
from internav_data.evaluation.reference_policies import reference_policy
from internav_data.verification.checked_layout import CheckedLayout
from internav_data.verification.checked_path import CheckedPath
from internav_data.verification.shapes import Shapes
from internav_data.world import Action, HouseModel, World

KINDS = {
    **dict.fromkeys(range(Action.PUSH_AHEAD, Action.PUSH_LEFT + 1), "pushes"),
    Action.PICKUP: "picks",
    Action.DROP: "drops",
}


@pytest.fixture(scope="module")
def four(row):
    return [
        row(0, scene=0, pushes_tried=4, pushes_done=1, picks_tried=1, picks_done=1, drops_tried=3,
            drops_done=1, interaction_m=0.5, openings=1),
        row(1, scene=0, success=False, distance_m=4.0, spl=0.0, sts=0.0, mode="lengthened",
            interaction_m=-0.25, closings=1, reward_sum=-2.0),
        row(0, scene=1, room_count=4, spl=0.4, sts=0.1, mode="lengthened"),
        row(1, scene=1, room_count=4, success=False, distance_m=2.0, spl=0.0, sts=0.0,
            pushes_tried=1, steps=500),
    ]  # fmt: skip


def test_figures_by_hand(four):
    values = summary(four).values
    assert values["success"] == 0.5
    assert values["distance_m"] == 1.5, "failures and successes alike"
    assert values["spl"] == pytest.approx((0.8 + 0.4) / 4)
    assert values["sts"] == pytest.approx((0.5 + 0.1) / 4)
    assert values["ir_m"] == pytest.approx(0.25 / 4), "losses count too"
    assert values["pusr"] == 1 / 5, "pooled, not a mean of episodes' ratios"
    assert values["pisr"] == 2 / 4, "Pickup and Drop"
    assert values["pickup_success"] == 1.0
    assert values["isr"] == 3 / 9, "all of them"
    assert (values["openings"], values["closings"]) == (0.25, 0.25)
    assert values["interactions"] == 9 / 4
    assert values["steps"] == (40 + 40 + 40 + 500) / 4
    assert values["return"] == (10 - 2 + 10 + 10) / 4


def test_groups_are_those_of_the_paper(four):
    assert [summary(four, name).episodes for name in GROUPS] == [4, 2, 2, 2]
    assert summary(four, "hard").scenes == 1
    assert summary(four, "hard").values["success"] == 0.5
    assert {r.room_count for r in four if GROUPS["hard"](r)} == {4}, "rooms, not obstacles"
    assert summary(four, "non-interactive").values["distance_m"] == 2.0
    assert summary(four, "blocked").values["spl"] == pytest.approx(0.4)


def test_nothing_to_divide_by_is_none_and_no_nan(row):
    none = summary([row(room_count=1)], "hard")
    assert (none.episodes, none.scenes) == (0, 0)
    assert set(none.values.values()) == {None}
    idle = summary([row()]).values
    assert idle["isr"] is idle["pusr"] is idle["pisr"] is None
    assert idle["ir_m"] == 0.0


def test_order_does_not_matter(four, row):
    many = [replace(each, spl=0.1 * k) for k in range(9) for each in four]
    shuffled = [many[k] for k in np.random.default_rng(0).permutation(len(many))]
    assert summary(shuffled) == summary(many)


def test_an_unreachable_end_is_a_failure_that_counts(hand_episode):
    names = ("pushes", "picks", "drops")
    said = {f"{name}_{what}": 0 for name in names for what in ("tried", "done")}
    said |= {
        "success": True, "distance_to_goal_m": math.inf, "spl": 0.9, "sts": 0.9, "steps": 3,
        "path_m": 0.5, "interaction_reward_m": 0.0, "openings": 0, "closings": 0, "return": 1.0,
    }  # fmt: skip
    result = result_of(hand_episode, said, [0, 0, 11])
    assert (result.success, result.spl, result.sts) == (False, 0.0, 0.0)
    assert result.distance_m == hand_episode.shortest_path_m
    near = result_of(hand_episode, said | {"distance_to_goal_m": 0.0}, [0, 0, 11])
    assert (near.success, near.spl, near.distance_m) == (True, 0.9, 0.0)
    assert summary([result, near]).values["success"] == 0.5


def test_records_go_through_their_table(four):
    assert from_table(to_table(four, RESULTS), RESULTS) == four
    assert not any(field.nullable for field in RESULTS.schema)


def steps_by_networkx(lattice, here, goal):
    free = lattice.free
    graph = nx.Graph()
    graph.add_nodes_from((int(i), int(j)) for i, j in zip(*free.nonzero(), strict=True))
    for i, j in list(graph):
        for di, dj in ((1, 0), (0, 1)):
            if (i + di, j + dj) in graph and lattice.edge_free(i, j, di, dj):
                graph.add_edge((i, j), (i + di, j + dj))
    if here not in graph or goal not in graph or not nx.has_path(graph, here, goal):
        return None
    return nx.shortest_path_length(graph, here, goal)


def played_again(stage, episode, assets, actions):
    """Count everything anew, from what each action did to the world."""
    world = World.of_episode(stage, episode, assets)
    found = {f"{kind}_{what}": 0 for kind in KINDS.values() for what in ("tried", "done")}
    found |= {"moves": 0, "interaction_m": 0.0, "openings": 0, "closings": 0, "reached": False}
    for action in actions:
        here, before = (world.i, world.j), world.lattice
        result = world.step(action)
        found["moves"] += action == Action.MOVE_AHEAD and result.success
        found["reached"] = action == Action.DONE and result.success
        if action not in KINDS:
            continue
        found[f"{KINDS[action]}_tried"] += 1
        if not result.success:
            continue
        found[f"{KINDS[action]}_done"] += 1
        old = steps_by_networkx(before, here, world.goal)
        new = steps_by_networkx(world.lattice, here, world.goal)
        found["openings"] += old is None and new is not None
        found["closings"] += old is not None and new is None
        if old is not None and new is not None:
            found["interaction_m"] += 0.25 * (old - new)
    return found, world


@pytest.mark.parametrize("who", ["expert", "random", "shortest_path"])
def test_the_environment_says_what_the_definitions_say(played_data, who):
    """Every metric again: by networkx and the validator's visibility graph, from the actions."""
    config = EvaluationConfig(max_steps=60)
    results = evaluate(reference_policy(who, played_data), played_data, config)
    assert len(results) == len(played_data)
    worked = moved = 0
    for result, episode in zip(results, played_data, strict=True):
        house = played_data.scene(episode.scene_id)
        found, world = played_again(
            HouseModel.of(house), episode, played_data.assets, result.actions
        )
        length, steps = episode.shortest_path_m, len(result.actions)
        assert result.steps == steps <= config.max_steps
        assert result.success == found["reached"]
        assert result.path_m == pytest.approx(0.25 * found["moves"])
        for kind in set(KINDS.values()):
            for what in ("tried", "done"):
                assert getattr(result, f"{kind}_{what}") == found[f"{kind}_{what}"]
        assert result.interaction_m == pytest.approx(found["interaction_m"])
        assert (result.openings, result.closings) == (found["openings"], found["closings"])
        spl = length / max(0.25 * found["moves"], length) if found["reached"] else 0.0
        sts = length / 0.25 / steps if found["reached"] else 0.0
        assert result.spl == pytest.approx(spl)
        assert result.sts == pytest.approx(sts)
        between = CheckedPath(
            CheckedLayout(house, Shapes(played_data.assets)), world.position, world.goal_point
        )
        assert between.agrees(result.distance_m), "Euclidean, no obstacle about"
        assert MEASURES["distance_m"].of([result]) == result.distance_m
        worked += result.pushes_done + result.picks_done
        moved += found["moves"]
    assert moved > 0
    assert who == "shortest_path" or worked > 0, "something was pushed or picked"
