"""The counterfactual table says what the world does, and what fresh graphs measure."""

import itertools

import pytest
from builders import UPRIGHT, crate, one_room

from internav_data.catalog import catalogue
from internav_data.episodes import build_episodes
from internav_data.episodes.outcomes import PICK, PUSH_DIRECTIONS, outcomes_of
from internav_data.geometry import Polygons
from internav_data.houses import HouseConfig, build_house
from internav_data.navigation import Lattice, TangentGraph
from internav_data.physics import Body
from internav_data.records import Pose
from internav_data.world import HouseModel, World, WorldConfig


@pytest.fixture(scope="module")
def tables():
    out = []
    for scene in (0, 6):
        house = build_house(0, scene, HouseConfig(), catalogue())
        model = HouseModel.of(house)
        for episode in build_episodes(house, 3, catalogue().spawnable):
            world = World.of_episode(model, episode, catalogue().assets)
            before = world.digest()
            out.append((episode, world, outcomes_of(world)))
            assert world.digest() == before
    return out


def test_every_obstacle_has_five(tables):
    for episode, _, table in tables:
        assert len(table) == len(episode.obstacles)
        for obstacle, outcomes in zip(episode.obstacles, table, strict=True):
            assert [o.action for o in outcomes] == [*PUSH_DIRECTIONS, PICK]
            assert all(o.reason == "not pushable" for o in outcomes[:4]) != obstacle.pushable
            assert (outcomes[4].reason == "not pickable") != obstacle.pickable
            for outcome in outcomes:
                assert outcome.success == (not outcome.reason)
                assert outcome.opened == (
                    outcome.success
                    and episode.obstructed_path_steps is None
                    and outcome.path_steps_after is not None
                )


def test_failed_ones_leave_the_distances(tables):
    listed = [(e, o) for e, _, table in tables for o in itertools.chain.from_iterable(table)]
    failed = [(episode, outcome) for episode, outcome in listed if not outcome.success]
    assert failed
    for episode, outcome in failed:
        assert (outcome.path_steps_after, outcome.path_m_after) == (
            episode.obstructed_path_steps,
            episode.obstructed_path_m,
        )
        assert outcome.displacement_m == 0.0
    pushed = [o for _, o in listed if o.success and o.action != PICK]
    assert pushed
    assert all(outcome.displacement_m >= 0.05 for outcome in pushed)


def test_poses_are_those_that_the_push_leaves(tables):
    for _, world, table in tables:
        ids = world.model.object_ids
        for index, outcomes in zip(world.obstacles, table, strict=True):
            for heading, outcome in enumerate(outcomes):
                if not outcome.success or outcome.action == PICK:
                    assert (outcome.pose, outcome.moved) == (None, ())
                    continue
                pushed = world.simulate_push(index, heading, agent=False)
                assert outcome.pose == pushed.pose
                assert outcome.at_rest == pushed.at_rest
                moved = {
                    ids.index(o.object_id) if o.obstacle is None else o.obstacle + len(ids): o.pose
                    for o in outcome.moved
                }
                assert tuple(moved.items()) == pushed.moved


def test_distances_are_those_of_fresh_graphs(tables):
    checked = 0
    for episode, world, table in tables:
        start, goal = (episode.start.i, episode.start.j), (episode.goal.i, episode.goal.j)
        for index, outcomes in zip(world.obstacles, table, strict=True):
            for heading, outcome in enumerate(outcomes):
                if not outcome.success:
                    continue
                poses = {k: item.pose for k, item in enumerate(world.items)}
                poses[index] = None
                if outcome.action != PICK:
                    pushed = world.simulate_push(index, heading, agent=False)
                    poses |= {index: pushed.pose, **dict(pushed.moved)}
                there = world.copy()
                there.put(poses.items())
                loose = [item.footprint for item in there.items]
                everything = Polygons.joined([world.model.footprints, *loose])
                fresh = Lattice.of_polygons(everything, world.model.house.outline)
                assert outcome.path_steps_after == fresh.distance(start, goal)
                way = TangentGraph.of_polygons(everything).distance(
                    (episode.start.x, episode.start.y), (episode.goal.x, episode.goal.y)
                )
                assert outcome.path_m_after == (
                    None if way is None else pytest.approx(way, abs=2e-4)
                )
                checked += 1
    assert checked >= 10


def test_short_pushes_in_a_row_say_how_far_and_when_they_open():
    """A crate before a door: pushed on four times by hand, all else as the pushes left it."""
    model = HouseModel.of(one_room(6.0, 1.5))
    body = Body.of(crate("Crate_0", (0.8, 0.8, 0.5), mass_kg=12.0), Pose(2.0, 0.75, 0.0, UPRIGHT))
    step = WorldConfig(push_model="step")
    world = World(model, [body], (4, 3, 0), (8, 3), step)
    before = world.digest()
    east, north, *_ = outcomes_of(world)[0]
    assert world.digest() == before
    by_hand, opened = [], None
    for count in range(1, 5):
        pushed = world.simulate_push(0, 0, agent=False)
        world.put([(0, pushed.pose)])
        by_hand.append(pushed.pose.x - 2.0)
        if opened is None and world.path_steps() is not None:
            opened = count
    assert east.reach_m == pytest.approx(by_hand, abs=2e-4)
    assert east.reach_opened == opened == 3
    assert not east.opened
    assert len(north.reach_m or ()) < 4, "a wall is near"
    for config in (WorldConfig(), WorldConfig("kick")):
        once = outcomes_of(World(model, [body], (4, 3, 0), (8, 3), config))[0]
        assert all(o.reach_m is None and o.reach_opened is None for o in once)
