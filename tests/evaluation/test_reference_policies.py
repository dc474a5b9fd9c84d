from __future__ import annotations

import copy
from dataclasses import replace
from types import SimpleNamespace

import networkx as nx
import numpy as np
import pytest
from scipy import stats

from internav_data.catalog import catalogue
from internav_data.evaluation.evaluator import EvaluationConfig, evaluate
from internav_data.evaluation.metrics import summary
from internav_data.evaluation.reference_policies import (
    nearest,
    reference_policy,
    shortest,
    shortest_path_planner,
)
from internav_data.generation import load_config
from internav_data.generation.scenes import beliefs_for
from internav_data.navigation import Lattice
from internav_data.records.errors import UsageError
from internav_data.world import Action, HouseModel, World
from internav_data.world.actions import ACTION_COUNT

STEPS = ((1, 0), (0, 1), (-1, 0), (0, -1))
INTERACTIONS = set(range(Action.PUSH_AHEAD, Action.DROP + 1))


@pytest.fixture(scope="module")
def rows(played_data):
    names = ("expert", "blind", "shortest_path", "random")
    return {name: evaluate(reference_policy(name, played_data), played_data) for name in names}


def world_of(dataset, episode):
    return World.of_episode(HouseModel.of(dataset.scene(episode.scene_id)), episode, dataset.assets)


def test_the_expert_does_what_is_stored_and_solves_all(played_data, rows):
    assert [r.actions for r in rows["expert"]] == [e.expert.actions for e in played_data]
    values = summary(rows["expert"]).values
    assert (values["success"], values["distance_m"], values["isr"]) == (1.0, 0.0, 1.0)
    for result, episode in zip(rows["expert"], played_data, strict=True):
        assert result.path_m == pytest.approx(episode.expert.path_m)


def test_the_blind_policy_lies_between_the_shortest_path_and_the_expert(rows):
    success = {name: summary(rows[name]).values["success"] for name in rows}
    assert success["shortest_path"] < success["blind"] <= success["expert"]


def test_a_stored_run_of_the_blind_expert_is_played_again(played_data):
    from internav_data.evaluation.reference_policies import blind_planner

    episode = played_data[0]
    stored = replace(episode, blind_expert=replace(episode.expert, actions=(1, 11)))
    assert tuple(blind_planner(played_data)(stored)) == (1, 11)


def test_the_blind_policy_believes_what_the_blind_expert_of_the_generator_does(
    played_data, monkeypatch
):
    """With hidden attributes the averages are those of their draws, not of the assets."""
    from internav_data.evaluation.reference_policies import blind_planner
    from internav_data.planner import blind

    config = {**played_data.manifest.config, "catalog": {"attributes": "hidden"}}
    data, believed = copy.copy(played_data), []
    monkeypatch.setattr(data, "manifest", replace(data.manifest, config=config))
    nowhere = SimpleNamespace(reached=True, actions=())
    monkeypatch.setattr(blind, "run_blind", lambda *args: believed.append(args[1]) or nowhere)
    blind_planner(data)(data[0])
    made = load_config(overrides=["catalog.attributes=hidden", "episodes.blind_expert=true"])
    assert believed == [beliefs_for(catalogue(), made)]
    assert believed[0]["Chair"].movable_share == 0.5


def test_the_shortest_path_policy_touches_nothing_and_walks_the_shortest_way(played_data, rows):
    assert {e.mode for e in played_data} == {"blocked", "lengthened"}
    for result, episode in zip(rows["shortest_path"], played_data, strict=True):
        assert not INTERACTIONS & set(result.actions)
        assert result.success == (episode.obstructed_path_steps is not None)
        if episode.obstructed_path_steps is not None:
            assert result.path_m == pytest.approx(0.25 * episode.obstructed_path_steps)


def test_where_cut_off_the_shortest_path_policy_walks_as_near_as_it_can(played_data, rows):
    blocked = 0
    for result, episode in zip(rows["shortest_path"], played_data, strict=True):
        if episode.obstructed_path_steps is not None:
            continue
        blocked += 1
        world = world_of(played_data, episode)
        clear = world.model.lattice.distances(*world.goal)
        labels = world.lattice.components()
        mine = labels[world.i, world.j]
        reach = [clear[i, j] for i, j in np.argwhere(labels == mine) if clear[i, j] >= 0]
        for action in result.actions:
            world.step(action)
        assert clear[world.i, world.j] == min(reach)
        assert result.actions[-1] == Action.DONE
    assert blocked


def test_bounds_lie_as_they_should(rows):
    """The shortest path bounds those who do not interact; the expert all on the lattice."""
    for group in ("all", "blocked", "non-interactive"):
        names = ("expert", "shortest_path", "random")
        expert, shortest_path, chance = (summary(rows[name], group).values for name in names)
        for name in ("success", "spl", "sts"):
            assert expert[name] >= shortest_path[name] >= chance[name]
        assert expert["distance_m"] <= shortest_path["distance_m"] <= chance["distance_m"]


def fewest_by_networkx(lattice, start, goal):
    """Length and turns: Dijkstra over nodes and headings, a turn a millionth of a step."""
    graph = nx.DiGraph()
    for i, j in np.argwhere(lattice.free).tolist():
        for q, (di, dj) in enumerate(STEPS):
            for other in ((q + 1) % 4, (q + 3) % 4):
                graph.add_edge((i, j, q), (i, j, other), weight=1e-6)
            inside = 0 <= i + di < lattice.shape[0] and 0 <= j + dj < lattice.shape[1]
            if inside and lattice.edge_free(i, j, di, dj):
                graph.add_edge((i, j, q), (i + di, j + dj, q), weight=1.0)
    found = nx.single_source_dijkstra_path_length(graph, start)
    return min(cost for node, cost in found.items() if node[:2] == goal)


def test_shortest_ways_have_the_fewest_turns(played_data):
    turned = 0
    for episode in played_data:
        world = world_of(played_data, episode)
        if world.path_steps() is None:
            continue
        start = (world.i, world.j, world.quarter)
        actions = shortest(world.lattice, start, world.goal)
        moves = actions.count(0)
        turns = len(actions) - moves
        best = fewest_by_networkx(world.lattice, start, world.goal)
        assert moves + 1e-6 * turns == pytest.approx(best, abs=1e-9)
        turned += turns
    assert turned


def test_ties_of_the_nearest_go_by_the_walk():
    square = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)]
    from internav_data.geometry import Polygons

    clear = Lattice.of_polygons(Polygons.joined([]), square)
    lattice = clear.copy()
    wall = np.array([[0.95, -1.0], [1.05, -1.0], [1.05, 2.0], [0.95, 2.0]])
    lattice.add(Polygons.of([wall]))
    goal = (7, 2)
    assert lattice.distance((1, 0), goal) is None
    near = nearest(lattice, clear, (1, 0), goal)
    assert lattice.distance((1, 0), near) is not None
    assert near[1] == 2, "straight across from the goal"
    assert shortest(lattice, (*near, 3), near) == [], "already there"


def test_chance_is_even_and_of_the_episode(played_data, rows):
    counts = np.bincount([a for r in rows["random"] for a in r.actions], minlength=ACTION_COUNT)
    assert (counts > 0).all()
    assert (
        evaluate(reference_policy("random", played_data), played_data, EvaluationConfig(batch=2))
        == rows["random"]
    )
    policy = reference_policy("random", played_data)
    policy.begin(1, 0)
    drawn = []
    for episode in list(played_data) * 50:
        policy.start(0, episode)
        drawn += [int(policy.act({})[0]) for _ in range(3)]
    many = []
    policy.start(0, played_data[0])
    many = [int(policy.act({})[0]) for _ in range(1000 * ACTION_COUNT)]
    expected = 1000.0
    chi2 = ((np.bincount(many, minlength=ACTION_COUNT) - expected) ** 2 / expected).sum()
    assert chi2 < stats.chi2.ppf(0.999, ACTION_COUNT - 1), "99.9 % of even chances"
    assert drawn[:3] == drawn[len(played_data) * 3 : len(played_data) * 3 + 3], "keyed"


def test_unknown_reference_policies_and_missing_experts(played_data, monkeypatch):
    with pytest.raises(UsageError, match=r"expert, blind, shortest_path, random"):
        reference_policy("best", played_data)
    import pyarrow as pa

    gone = pa.table({"expert": pa.nulls(3, pa.struct([("steps", pa.int32())]))})
    monkeypatch.setattr(type(played_data), "to_table", lambda *_: gone)
    with pytest.raises(UsageError, match=r"no episode has an expert.*shortest_path and random"):
        reference_policy("expert", played_data)


def test_an_episode_without_expert_is_a_failure_not_a_gap(played_data):
    from internav_data.evaluation.reference_policies import expert_actions

    assert expert_actions(replace(played_data[0], expert=None)) == (Action.DONE,)


def test_a_plan_is_the_same_every_time(played_data):
    plan = shortest_path_planner(played_data)
    assert [plan(e) for e in played_data] == [
        shortest_path_planner(played_data)(e) for e in played_data
    ]
