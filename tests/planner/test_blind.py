"""The blind expert: what it knows, what it learns by failing, and what it cannot know."""

from dataclasses import replace

import numpy as np
import pytest
from builders import UPRIGHT, crate, one_room

from internav_data.catalog import catalogue
from internav_data.catalog.attributes import DRAWS, hidden_attributes
from internav_data.catalog.config import CatalogConfig
from internav_data.episodes import build_episodes
from internav_data.generation import generate_episodes, load_config
from internav_data.houses import HouseConfig, build_house
from internav_data.physics import Body
from internav_data.planner.beliefs import Experience, type_beliefs
from internav_data.planner.blind import run_blind
from internav_data.planner.search import solve
from internav_data.records import PUSH_SPECS, Pose
from internav_data.world import Action, HouseModel, World

FORCE = PUSH_SPECS["force"]
CRATE = crate("Crate_0", (0.8, 0.8, 0.5), mass_kg=12.0)
PARCEL = crate("Parcel_0", (0.8, 0.8, 0.5), mass_kg=3.0, pushable=False, pickable=True)
CORRIDOR = HouseModel.of(one_room(6.0, 1.5))
GAPS = HouseModel.of(one_room(5.0, 9.0, (2.44, 1.4, 2.56, 7.6)))
"""Two halls and a wall between them: one way past its lower end, one past its upper end."""
BELIEFS = type_beliefs([CRATE, PARCEL], FORCE)


def at(asset, x, y, **changes):
    return Body(asset, Pose(x, y, 0.0, UPRIGHT), replace(asset.dynamics, **changes))


def failures(world, actions):
    """Actions that fail in a world, which all of them change."""
    return [a for a in map(Action, actions) if not world.step(a).success]


def test_where_things_are_as_they_look_it_does_what_the_expert_does():
    world = World(CORRIDOR, [at(CRATE, 2.5, 0.75)], (4, 3, 0), (14, 3))
    run = run_blind(world, BELIEFS)
    assert run.expert == solve(world)
    assert run.plans == 1


def test_it_tries_the_near_one_and_goes_to_the_far_one_when_that_is_bolted():
    """A pick has no target there: the type can be picked up, this object cannot."""
    bolted = at(PARCEL, 2.5, 0.75, pickable=False)
    world = World(GAPS, [bolted, at(PARCEL, 2.5, 8.25)], (4, 3, 0), (16, 3))
    run, expert = run_blind(world, BELIEFS), solve(world)
    assert run.reached
    assert (run.expert.picks, expert.picks) == (2, 1)
    assert failures(world.copy(), run.actions) == [Action.PICKUP], "one try suffices"
    assert run.expert.steps == len(run.actions) > expert.steps


def test_it_gives_up_where_nothing_yields_and_the_world_is_untouched():
    world = World(CORRIDOR, [at(CRATE, 2.5, 0.75, mass_kg=900.0)], (4, 3, 0), (14, 3))
    before = world.digest()
    run = run_blind(world, BELIEFS)
    assert not run.reached
    assert run.expert is None
    assert len(failures(run.world.copy(), [])) == 0
    assert sum(Action(a).kind == "push" for a in run.actions) == 1
    assert world.digest() == before


def test_a_lighter_object_than_believed_is_seen_where_it_comes_to_rest():
    light = World(CORRIDOR, [at(CRATE, 2.5, 0.75, mass_kg=2.0)], (4, 3, 0), (14, 3))
    run = run_blind(light, BELIEFS)
    assert run.reached
    assert not failures(light.copy(), run.actions)
    assert run.plans > 1, "it lies elsewhere than believed: planned again"


def test_the_limit_is_kept():
    world = World(CORRIDOR, [at(PARCEL, 2.5, 0.75)], (4, 3, 0), (14, 3))
    assert run_blind(world, BELIEFS, 12).reached
    assert not run_blind(world, BELIEFS, 11).reached


def test_nothing_of_an_object_but_type_and_shape_reaches_its_beliefs():
    """Worlds that look alike give the same beliefs, whatever their objects are like inside."""
    hidden = ({"mass_kg": 900.0}, {"friction": 0.1}, {"pushable": False}, {"pickable": True})
    worlds = [World(GAPS, [at(CRATE, 2.5, 0.75, **h)], (4, 3, 0), (16, 3)) for h in ({}, *hidden)]
    seen = {Experience(BELIEFS).believed(world).digest() for world in worlds}
    assert len(seen) == 1
    assert len({world.digest() for world in worlds}) == len(worlds)


def test_beliefs_of_a_type_are_averages_of_the_movable_ones():
    light, heavy = crate("Bin_0", (0.4, 0.4, 0.4), mass_kg=4.0), replace(CRATE, type="Bin")
    safe = crate("Bin_2", (0.4, 0.4, 0.4), mass_kg=400.0)
    belief = type_beliefs([light, heavy, safe], FORCE)["Bin"]
    assert belief.dynamics.mass_kg == 8.0
    assert belief.movable_share == 2 / 3
    assert (belief.dynamics.pushable, belief.dynamics.pickable) == (True, False)
    none = type_beliefs([safe], FORCE)["Bin"]
    assert (none.movable_share, none.dynamics.pushable) == (0.0, False)


def test_beliefs_where_attributes_are_hidden_are_averages_of_what_may_be_drawn():
    """Half of what is pushed is bolted, whatever its asset; averages of 4,000 objects agree."""
    spawnable = tuple(catalogue().spawnable)
    for strength in (0.0, 0.4, 1.0):
        hidden = hidden_attributes(CatalogConfig("hidden", strength), spawnable)
        beliefs = type_beliefs(spawnable, FORCE, hidden)
        for kind in ("Chair", "Apple", "SideTable"):
            assets = catalogue().of_type(kind)
            rows = np.random.default_rng(3).random((4_000, DRAWS)).tolist()
            drawn = [hidden.dynamics(assets[k % len(assets)], row) for k, row in enumerate(rows)]
            able = [
                d
                for d in drawn
                if d.pickable or (d.pushable and d.friction * d.mass_kg < 200 / 9.81)
            ]
            belief = beliefs[kind]
            assert belief.movable_share == pytest.approx(len(able) / len(drawn), abs=0.03)
            mean_kg = sum(d.mass_kg for d in able) / len(able)
            assert belief.dynamics.mass_kg == pytest.approx(mean_kg, rel=0.05)
            assert belief.dynamics.pickable == able[0].pickable
    assert type_beliefs(spawnable, FORCE)["Stool"].movable_share > 0.9
    assert beliefs["Stool"].movable_share <= 0.5


def test_a_failure_speaks_against_the_type_and_a_success_for_it():
    bodies = [at(CRATE, 1.5 + x, 0.75) for x in range(3)]
    world = World(CORRIDOR, bodies, (0, 3, 0), (20, 3))
    experience = Experience(type_beliefs([CRATE, replace(CRATE, mass_kg=900.0)], FORCE))
    first = experience.success(world, 2)
    experience.note(world, 0, moved=False)
    doubted = experience.success(world, 2)
    experience.note(world, 1, moved=True)
    assert doubted < experience.success(world, 2) < 1.0
    assert doubted < first == 0.5
    assert (experience.success(world, 0), experience.success(world, 1)) == (0.0, 1.0)
    assert experience.immovable == {0}


def test_runs_are_stored_beside_the_expert_and_change_nothing_else():
    house = build_house(0, 1, HouseConfig(), catalogue())
    config = load_config(overrides=["episodes.blind_expert=true"])
    stored = generate_episodes(house, 2, config=config)
    plain = build_episodes(house, 2, catalogue().spawnable)
    assert tuple(replace(e, blind_expert=None) for e in stored) == plain
    beliefs, model = type_beliefs(catalogue().assets.values(), FORCE), HouseModel.of(house)
    for episode in stored:
        run = run_blind(World.of_episode(model, episode, catalogue().assets), beliefs)
        assert run.expert == episode.blind_expert
    assert any(episode.blind_expert for episode in stored)


@pytest.mark.parametrize("asset", [CRATE, PARCEL])
def test_a_type_that_it_has_no_belief_about_is_not_touched(asset):
    world = World(CORRIDOR, [at(asset, 2.5, 0.75)], (4, 3, 0), (14, 3))
    assert run_blind(world, {}).actions == ()
