"""The world of actions: what each does, that failures change nothing, that all repeats."""

import hashlib
import itertools
import math
import subprocess
import sys

import numpy as np
import pytest
import shapely
from builders import UPRIGHT, one_room, screen

from internav_data.catalog import catalogue
from internav_data.episodes import build_episodes
from internav_data.geometry import Polygons, footprint, wall_footprints, yaw_quaternion
from internav_data.houses import HouseConfig, build_house
from internav_data.navigation import CLEARANCE_M, Lattice
from internav_data.physics import Body
from internav_data.physics.fall_clearance import touches
from internav_data.physics.narrow_phase import joined_prisms, prisms_of
from internav_data.records import Pose
from internav_data.records.errors import UsageError
from internav_data.world import (
    ACTION_COUNT,
    ACTIONS,
    Action,
    HouseModel,
    Interaction,
    StepResult,
    World,
)
from internav_data.world.actions import actions_of_option
from internav_data.world.world import BEHAVIOURS

SCENES = (0, 1, 7)


def played(scene, index, seed, count, state=None):
    """Digests and results of a random walk that meets things often; a pure function."""
    house = build_house(0, scene, HouseConfig(), catalogue())
    (episode,) = build_episodes(house, 1, catalogue().spawnable, first=index)
    world = World.of_episode(HouseModel.of(house), episode, catalogue().assets)
    return walk(world, seed, count)


def actions(seed, count):
    weights = np.array([8, 1, 1, 0.3, 0.3, 1, 1, 1, 1, 1, 1, 0.2])
    return np.random.default_rng(seed).choice(12, size=count, p=weights / weights.sum()).tolist()


def walk(world, seed, count):
    lines = [repr(world.step(action)) for action in actions(seed, count)]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest(), world.digest()


def beside_thing(world, rng):
    """Teleport the agent to a random free node near a random movable thing."""
    free = np.argwhere(world.lattice.free)
    item = world.items[int(rng.integers(len(world.items)))]
    if item.pose is not None:
        near = np.hypot(free[:, 0] * 0.25 - item.pose.x, free[:, 1] * 0.25 - item.pose.y) < 1.3
        free = free[near] if near.any() else free
    world.i, world.j = (int(v) for v in free[int(rng.integers(len(free)))])
    world.quarter = int(rng.integers(4))


@pytest.fixture(scope="module")
def worlds():
    houses = [build_house(0, scene, HouseConfig(), catalogue()) for scene in SCENES]
    return [
        (episode, World.of_episode(model, episode, catalogue().assets))
        for model in map(HouseModel.of, houses)
        for episode in build_episodes(model.house, 2, catalogue().spawnable)
    ]


@pytest.fixture
def small(hand_house):
    """The agent at (3, 1) looking along +x, a chair 0.75 m ahead, nothing else near."""
    chair = hand_house.assets["Chair_0"]
    model = HouseModel.of(hand_house)
    return World(model, [Body.of(chair, Pose(3.75, 1.0, 0.0, UPRIGHT))], (12, 4, 0), (28, 4))


def test_actions_have_the_released_order():
    names = (
        "MOVE_AHEAD ROTATE_LEFT ROTATE_RIGHT LOOK_DOWN LOOK_UP PUSH_AHEAD PUSH_BACK PUSH_RIGHT "
        "PUSH_LEFT PICKUP DROP DONE WAIT"
    )
    assert [action.name for action in Action] == names.split()
    assert [int(action) for action in Action] == [*range(ACTION_COUNT), -1]
    assert tuple(Action)[:-1] == ACTIONS


def test_every_action_has_every_column_and_a_behaviour(small):
    """A row of the table without words, options or behaviour is found by its name."""
    for action in Action:
        assert action.words, action.name
        assert action.description, action.name
        assert bool(action.options) == (action in ACTIONS), action.name
        assert small.copy().step(action).action == action, action.name
    assert [*ACTIONS] == [*range(len(ACTIONS))], "numbered from 0 without a gap"


def test_an_interaction_of_several_steps_is_part_of_the_state(small, monkeypatch):
    """The door for interactions that go on: a push that is carried out in its third step."""
    push = BEHAVIOURS["push"]

    def slow_push(world, action):
        steps = 1 if world.interaction is None else world.interaction.steps + 1
        target = world.target(pick=False)
        if steps < 3:
            world.interaction = Interaction(action, target, steps)
            return StepResult(action, success=True, target=target, ongoing=True)
        world.interaction = None
        return push(world, action)

    monkeypatch.setitem(BEHAVIOURS, "push", slow_push)
    worlds = [small.copy()]
    results = []
    for _ in range(3):
        worlds.append(worlds[-1].copy())
        results.append(worlds[-1].step(Action.PUSH_AHEAD))
    assert [result.ongoing for result in results] == [True, True, False]
    assert [bool(result.moved) for result in results] == [False, False, True]
    assert len({world.digest() for world in worlds}) == 4, "equal poses, another interaction"
    assert worlds[1].interaction == Interaction(Action.PUSH_AHEAD, results[0].target, 1)
    assert worlds[1].copy() == worlds[1] != worlds[0]
    assert worlds[3].interaction is None
    monkeypatch.undo()
    small.step(Action.PUSH_AHEAD)
    assert worlds[3] == small


def test_an_action_whose_kind_does_nothing_is_named(small, monkeypatch):
    monkeypatch.setattr(Action.DROP, "kind", "throw")
    with pytest.raises(NotImplementedError, match="DROP has no behaviour: add 'throw'"):
        small.step(Action.DROP)


def test_options_take_their_own_actions_then_borrowed_ones_and_done():
    taken = {name: actions_of_option(name) for name in ("navigate", "push", "pick", "done")}
    assert taken == {
        "navigate": (0, 1, 2, 3, 4, 11),
        "push": (5, 6, 7, 8, 11),
        "pick": (9, 10, 1, 2, 11),
        "done": (11,),
    }


def test_an_episode_begins_with_its_own_distances(worlds):
    for episode, world in worlds:
        assert world.path_steps() == episode.obstructed_path_steps
        assert world.obstructed_path_m() == episode.obstructed_path_m
        assert world.shortest_path_m() == episode.shortest_path_m
        assert world.horizon_deg == 30
        assert len(world.obstacles) == len(episode.obstacles)


def test_another_house_is_refused(worlds):
    with pytest.raises(UsageError, match="own house"):
        World.of_episode(worlds[0][1].model, worlds[-1][0], catalogue().assets)


def test_an_unknown_action_is_refused(small):
    for action in (-2, ACTION_COUNT):
        with pytest.raises(UsageError, match="expected 0 MOVE_AHEAD"):
            small.step(action)


def test_waiting_passes(small):
    before = small.digest()
    assert small.step(Action.WAIT).success
    assert small.digest() == before


def test_moving_and_turning(small):
    assert small.step(Action.MOVE_AHEAD).success
    assert (small.i, small.j) == (13, 4)
    # The chair's legs begin at 3.53: the disc at 3.25 may not come nearer than 0.2.
    blocked = small.step(Action.MOVE_AHEAD)
    assert not blocked.success
    assert blocked.reason == "something is in the way"
    for quarter in (1, 2, 3, 0):
        small.step(Action.ROTATE_LEFT)
        assert small.quarter == quarter
    small.step(Action.ROTATE_RIGHT)
    assert small.quarter == 3


def test_looking_has_ends(small):
    seen = [small.step(Action.LOOK_DOWN).success, small.step(Action.LOOK_DOWN).success]
    assert seen == [True, False]
    assert small.horizon_deg == 60
    assert [small.step(Action.LOOK_UP).success for _ in range(4)] == [True, True, True, False]
    assert small.horizon_deg == -30


def test_done_knows_the_goal(small):
    assert small.step(Action.DONE).reason == "not at the goal"
    small.i, small.j = 28, 4
    assert small.step(Action.DONE).success


def test_pushing_is_relative_to_the_heading(small):
    index = small.obstacles[0]
    ways = {
        Action.PUSH_AHEAD: (1, 0),
        Action.PUSH_LEFT: (0, 1),
        Action.PUSH_RIGHT: (0, -1),
        Action.PUSH_BACK: (-1, 0),
    }
    for action, (dx, dy) in ways.items():
        world = small.copy()
        before, result = world.items[index].pose, world.step(action)
        assert result.success, (action, result)
        assert result.target == index
        after = world.items[index].pose
        along = (after.x - before.x) * dx + (after.y - before.y) * dy
        # A chair that topples may roll on aside; success speaks of its centre of mass.
        assert along > 0.03
        assert dict(result.moved)[index] == after
    # What it was copied from has not moved.
    assert small.items[index].pose.x == 3.75


def test_only_what_is_seen_is_pushed(small):
    small.step(Action.ROTATE_RIGHT)
    assert small.step(Action.PUSH_AHEAD).reason == "nothing to push in sight and reach"


def test_the_closest_is_taken_and_ties_go_by_index(hand_house):
    chair = hand_house.assets["Chair_0"]
    poses = [Pose(3.8, 1.5, 0.0, UPRIGHT), Pose(3.8, 0.5, 0.0, yaw_quaternion(180))]
    # Footprints of both, mirrored at the agent's row, are equally far away.
    near = Pose(3.6, 1.0, 0.0, UPRIGHT)
    model = HouseModel.of(hand_house)
    first = len(model.items)
    tie = World(model, [Body.of(chair, p) for p in poses], (12, 4, 0), (28, 4))
    assert tie.target(pick=False) == first
    world = World(
        model, [*(Body.of(chair, p) for p in poses), Body.of(chair, near)], (12, 4, 0), (28, 4)
    )
    assert world.target(pick=False) == first + 2


def test_pick_and_drop(hand_house):
    apple = hand_house.assets["Apple_0"]
    model = HouseModel.of(hand_house)
    poses = [Pose(3.5, 1.0, 0.0, UPRIGHT), Pose(3.5, 1.3, 0.0, UPRIGHT)]
    world = World(model, [Body.of(apple, p) for p in poses], (12, 4, 0), (28, 4))
    assert world.step(Action.DROP).reason == "hands are empty"
    # Pickable things are never pushed.
    assert world.step(Action.PUSH_AHEAD).reason == "nothing to push in sight and reach"
    picked = world.step(Action.PICKUP)
    assert picked.success
    assert world.held == picked.target == world.obstacles[0]
    assert world.items[world.held].pose is None
    assert world.step(Action.PICKUP).reason == "hands are full"
    assert world.step(Action.MOVE_AHEAD).success
    dropped = world.step(Action.DROP)
    assert dropped.success
    assert world.held == -1
    pose = world.items[dropped.target].pose
    gap = math.dist((pose.x, pose.y), world.position) - 0.2 - 0.05
    assert gap == pytest.approx(0.05, abs=0.011)  # the first gap, straight ahead
    assert (pose.y, pose.z) == pytest.approx((1.0, 0.0), abs=0.01)


def dropped_in(room):
    """Where a screen comes to rest that an agent at (1, 1) drops ahead, and the room's walls."""
    thing = screen(pushable=False, pickable=True)
    model = HouseModel.of(room)
    world = World(model, [Body.of(thing, Pose(3.0, 1.0, 0.0, UPRIGHT))], (4, 4, 0), (12, 4))
    world.put([(0, None)])
    world.held = 0
    assert world.step(Action.DROP).success
    prisms = prisms_of(thing, world.items[0].pose)
    walls = joined_prisms([prisms_of(wall.asset, wall.pose) for wall in model.fixed])
    return world.items[0].pose, prisms, walls


def test_a_flat_foot_is_not_dropped_into_walls():
    """Between two posts a screen's footprint has room, its foot has none."""
    pose, *_ = dropped_in(one_room(4.0, 2.0))
    assert (pose.x, pose.y) == pytest.approx((1.55, 1.0), abs=0.005)
    posts = (1.5, 0.5, 1.6, 0.93), (1.5, 1.07, 1.6, 1.5)
    pose, prisms, walls = dropped_in(one_room(4.0, 2.0, *posts))
    assert math.dist((pose.x, pose.y), (1.55, 1.0)) > 0.1
    assert not touches(prisms, walls)


def test_what_carries_something_is_not_picked(hand_house):
    apple = hand_house.assets["Apple_0"]
    model = HouseModel.of(hand_house)
    stack = [Pose(3.5, 1.0, 0.0, UPRIGHT), Pose(3.5, 1.0, 0.1, UPRIGHT)]
    world = World(model, [Body.of(apple, p) for p in stack], (12, 4, 0), (28, 4))
    result = world.step(Action.PICKUP)
    assert (result.success, result.reason) == (False, "something rests on it")


def test_putting_a_thing_back_restores_every_distance(worlds):
    for episode, world in worlds:
        there = world.copy()
        before = there.lattice.distances(*there.goal)
        for index in there.obstacles:
            pose = there.items[index].pose
            there.put([(index, None)])
            there.put([(index, pose)])
        there.put([(0, None)])
        there.put([(0, world.items[0].pose)])
        assert (there.lattice.distances(*there.goal) == before).all()
        assert there.obstructed_path_m() == episode.obstructed_path_m
        assert there == world


def test_the_lattice_follows_what_lies_where(worlds):
    """After pushes, picks and drops the lattice is the one built from nothing."""
    rng = np.random.default_rng(3)
    done = 0
    for _, start in worlds:
        world = start.copy()
        for action in actions(7, 80):
            if action > 4:
                beside_thing(world, rng)
            done += world.step(action).success and action > 4
        house = world.model.house
        loose = Polygons.joined(item.footprint for item in world.items)
        fresh = Lattice.of_polygons(Polygons.joined([world.model.footprints, loose]), house.outline)
        assert (fresh.free == world.lattice.free).all()
        wide, deep = fresh.shape
        for i, j in itertools.product(range(wide - 1), range(deep - 1)):
            for step in ((1, 0), (0, 1)):
                assert fresh.edge_free(i, j, *step) == world.lattice.edge_free(i, j, *step)
    assert done


def test_a_push_opens_the_way_exactly_when_the_lattice_says_so(worlds):
    opened = 0
    for episode, world in worlds:
        for index, heading in itertools.product(world.obstacles, range(4)):
            if not world.items[index].dynamics.pushable:
                continue
            pushed = world.simulate_push(index, heading, agent=False)
            there = world.copy()
            there.put([(index, pushed.pose), *pushed.moved])
            polygons = [
                footprint(item.asset, item.pose) for item in there.items if item.pose is not None
            ]
            fresh = Lattice.of_polygons(
                Polygons.joined([world.model.footprints, *polygons]), world.model.house.outline
            )
            start = (episode.start.i, episode.start.j)
            assert there.path_steps() == fresh.distance(start, world.goal)
            opened += episode.obstructed_path_steps is None and there.path_steps() is not None
    assert opened


def test_failures_change_nothing(worlds):
    rng = np.random.default_rng(11)
    reasons = set()
    for _, start in worlds:
        world = start.copy()
        for action in actions(13, 80):
            if action > 4:
                beside_thing(world, rng)
            before, items, lattice = world.digest(), world.items, world.lattice
            result = world.step(action)
            if not result.success:
                assert world.digest() == before
                assert world.items is items
                assert world.lattice is lattice
                assert result.reason
                reasons.add(result.reason)
            else:
                assert not result.reason
    assert {"too heavy", "something is in the way", "hands are empty"} <= reasons


def test_a_copy_in_mid_sequence_goes_on_in_the_same_way(worlds):
    for _, start in worlds:
        world = start.copy()
        walk(world, 1, 100)
        twin = world.copy()
        assert twin == world
        assert walk(twin, 2, 100) == walk(world, 2, 100)
        assert twin == world
        # And again, when every answer is cached and other things have happened in between.
        again = start.copy()
        walk(again, 1, 100)
        assert walk(again, 2, 100)[1] == world.digest()


def test_the_same_in_a_fresh_process_and_after_other_episodes():
    script = (
        "import sys; sys.path[:0] = ['tests', 'tests/world']; from test_world import *\n"
        "print(played(1, 0, 4, 150), played(0, 1, 5, 150))"
    )
    run = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    played(0, 2, 0, 60)
    assert run.stdout == f"{played(1, 0, 4, 150)} {played(0, 1, 5, 150)}\n"


def stands_in_nothing(world):
    """Shapely's word for it: the disc meets no wall and no thing."""
    axis = shapely.Point(world.position)
    for polygon in wall_footprints(world.model.house.walls):
        assert shapely.Polygon(polygon).distance(axis) >= CLEARANCE_M - 1e-9
    for thing in world.model.house.objects:
        asset = world.model.house.assets[thing.asset_id]
        if thing.object_id not in world.model.object_ids:
            for polygon in footprint(asset, thing.pose):
                assert shapely.Polygon(polygon).distance(axis) >= CLEARANCE_M - 1e-9
    for item in world.items:
        if item.pose is not None:
            for polygon in footprint(item.asset, item.pose):
                assert shapely.Polygon(polygon).distance(axis) >= CLEARANCE_M - 1e-9


def wander(worlds, count):
    rng = np.random.default_rng(17)
    acted = 0
    for n, (_, start) in enumerate(worlds):
        world = start.copy()
        for action in actions(n, count // len(worlds)):
            # Now and then it goes elsewhere, so that it meets more than one corner of the house.
            if rng.random() < 0.02:
                beside_thing(world, rng)
            moved = world.step(action).success
            if moved and (action in (0, 10) or 5 <= action <= 8):
                stands_in_nothing(world)
                acted += 1
    return acted


def test_random_agents_never_stand_inside_anything(worlds):
    assert wander(worlds, 900) > 60


@pytest.mark.slow
def test_random_agents_never_stand_inside_anything_for_long(worlds):
    assert wander(worlds, 10_000) > 1000


def test_copies_share_nothing_that_changes(worlds):
    _, start = worlds[0]
    one, before = start.copy(), start.digest()
    one.put([(k, None) for k in range(len(one.items))])
    assert start.digest() == before
    assert (start.lattice.free <= one.lattice.free).all()
    assert one != start
