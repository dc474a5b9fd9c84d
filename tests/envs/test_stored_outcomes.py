"""Stored outcomes stand for solving first pushes, to the last bit, and only where they may."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from internav_data.dataset import load_dataset
from internav_data.envs.source import Source
from internav_data.generation import generate, load_config
from internav_data.records.agent import AGENT
from internav_data.world import Action, HouseModel, World
from internav_data.world.config import WorldConfig

PUSHES = (Action.PUSH_AHEAD, Action.PUSH_BACK, Action.PUSH_LEFT, Action.PUSH_RIGHT)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """Five houses with three episodes each (one in val and test) of obstacles to push."""
    out = tmp_path_factory.mktemp("stored") / "d"
    weights = "{Chair = 9, Stool = 9, GarbageCan = 9, DogBed = 9}"
    overrides = ["episodes_per_scene=3", "house.rooms=2-3", f"episodes.asset_weights={weights}"]
    generate(out, load_config(overrides=overrides), 5, workers=1)
    return load_dataset(out)


@pytest.fixture(scope="module")
def models(dataset):
    return {scene_id: HouseModel.of(dataset.scene(scene_id)) for scene_id in dataset.scene_ids}


@pytest.fixture(scope="module")
def world_of(dataset, models):
    def make(episode, *, stored):
        model = models[episode.scene_id]
        return World.of_episode(model, episode, dataset.assets, stored_outcomes=stored)

    return make


def places(world, near, rng, count):
    """Free nodes, drawn among those within 1.5 m of an object."""
    nodes = np.argwhere(world.lattice.distances(world.i, world.j) >= 0)
    far = [world.distance_to(near, 0.25 * i, 0.25 * j) for i, j in nodes]
    return rng.permutation(nodes[np.array(far) < 1.5])[:count].tolist()


def test_stored_pushes_are_those_of_solving(dataset, world_of):
    rng, asked, served = np.random.default_rng(0), 0, 0
    for episode in dataset:
        world = world_of(episode, stored=True)
        for index in world.obstacles:
            if not world.items[index].dynamics.pushable:
                continue
            for i, j in places(world, index, rng, 12):
                world.i, world.j = i, j
                for heading in range(4):
                    stored = world.stored_pushes.result(world, index, heading)
                    asked += 1
                    if stored is None:
                        continue
                    served += 1
                    solved = world.simulate_push(index, heading)
                    if solved.success:
                        assert stored == replace(solved, swept=None)
                    else:
                        told = (stored.success, stored.reason, stored.seconds, stored.at_rest)
                        assert told == (False, solved.reason, solved.seconds, solved.at_rest)
    assert served >= 200
    assert 0.5 * asked < served < asked


@settings(max_examples=25)
@given(data=st.data())
def test_worlds_with_and_without_stored_outcomes_are_the_same(dataset, world_of, data):
    episode = data.draw(st.sampled_from(list(dataset)))
    worlds = [world_of(episode, stored=stored) for stored in (True, False)]
    near = data.draw(st.sampled_from(worlds[0].obstacles))
    rng = np.random.default_rng(data.draw(st.integers(0, 99)))
    for place in places(worlds[0], near, rng, 1):
        for world in worlds:
            world.i, world.j = place
    actions = st.sampled_from([*PUSHES, Action.ROTATE_LEFT, Action.MOVE_AHEAD, Action.PICKUP])
    for action in data.draw(st.lists(actions, min_size=6, max_size=12)):
        first, second = (world.step(action) for world in worlds)
        assert first == second
        assert worlds[0] == worlds[1]


def one_stored(dataset, world_of):
    """A world, and a successful push of it that is stored."""
    for episode in dataset:
        world = world_of(episode, stored=True)
        for index in world.obstacles:
            for heading in range(4):
                result = world.stored_pushes.result(world, index, heading)
                if result is not None and result.success:
                    return episode, world, index, heading
    raise AssertionError


def test_what_has_moved_or_is_near_is_solved(dataset, world_of):
    _, world, index, heading = one_stored(dataset, world_of)
    pushed = world.stored_pushes.result(world, index, heading)
    other = world.copy()
    other.put([(index, pushed.pose)])
    assert other.stored_pushes.result(other, index, heading) is None
    assert world.stored_pushes.result(world, index, heading) == pushed
    world.i, world.j = (round(c / AGENT.step_m) for c in (pushed.pose.x, pushed.pose.y))
    assert world.stored_pushes.result(world, index, heading) is None


def test_outcomes_of_other_physics_are_not_believed(dataset, world_of):
    episode, _, index, heading = one_stored(dataset, world_of)
    older = replace(episode, physics=replace(episode.physics, build="another, rules 4"))
    assert world_of(older, stored=True).stored_pushes is None
    assert world_of(episode, stored=False).stored_pushes is None
    assert world_of(episode, stored=True).asking("mujoco").stored_pushes is None
    obstacles = tuple(
        replace(one, outcomes=tuple(replace(o, swept=None) for o in one.outcomes))
        for one in episode.obstacles
    )
    without = world_of(replace(episode, obstacles=obstacles), stored=True)
    assert without.stored_pushes.result(without, index, heading) is None


def test_outcomes_of_other_settings_and_arithmetic_are_not_believed(dataset, monkeypatch):
    source = Source(dataset)
    assert source.outcomes_hold(WorldConfig())
    assert not source.outcomes_hold(WorldConfig(push_model="kick"))
    assert not source.outcomes_hold(WorldConfig(force_n=300.0))
    monkeypatch.setattr("internav_data.envs.source.hardware", lambda: "another")
    assert not Source(dataset).outcomes_hold(WorldConfig())
