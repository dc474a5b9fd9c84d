"""Real hands: what is held is carried before the agent, blocks, and must be put down."""

import math

import numpy as np
import pytest
from builders import UPRIGHT, apple, crate, one_room

from internav_data.envs.episode import EpisodeRun
from internav_data.envs.source import LoadedHouse
from internav_data.envs.tasks import TaskConfig
from internav_data.physics import Body
from internav_data.planner.search import replay, solve
from internav_data.records import Pose
from internav_data.world import Action, HouseModel, World, WorldConfig
from internav_data.world.carrying import CARRY_LOW_M, has_room
from internav_data.world.masks import action_mask

REAL = WorldConfig(hands="real")
BOX = crate("Box_0", (0.4, 0.4, 0.3), mass_kg=2.0, pushable=False, pickable=True)
LOW = crate("Low_0", (0.5, 0.5, 0.6), mass_kg=20.0)
TALL = crate("Tall_0", (0.5, 0.5, 1.2), mass_kg=60.0)
HALL = HouseModel.of(one_room(6.0, 4.0))
CORRIDOR = HouseModel.of(one_room(6.0, 1.5))


def at(asset, x, y):
    return Body.of(asset, Pose(x, y, 0.0, UPRIGHT))


def holding(*obstacles, start=(8, 8, 0), goal=(20, 8), config=REAL, model=HALL):
    """A world whose agent has just picked up a box from right before it."""
    x, y = 0.25 * start[0], 0.25 * start[1]
    world = World(model, [at(BOX, x + 0.55, y), *obstacles], start, goal, config)
    world.step(Action.LOOK_DOWN)
    assert world.step(Action.PICKUP).success
    return world


def tried(world, action):
    """Result of an action on a copy; its mask must agree, and a failure changes nothing."""
    copy = world.copy()
    result = copy.step(action)
    assert bool(action_mask(world)[action]) == result.success
    assert result.success or copy == world
    return result.reason


def test_a_held_thing_is_stopped_by_what_is_as_high_as_it():
    for asset, reason in ((TALL, "no room for what is held"), (LOW, "")):
        world = holding(at(asset, 3.1, 2.0))
        assert tried(world, Action.MOVE_AHEAD) == reason, "the agent itself has room"
    assert tried(holding(at(TALL, 3.1, 2.0), config=WorldConfig()), Action.MOVE_AHEAD) == ""


def test_a_turn_that_would_swing_it_into_something_fails():
    beside = at(TALL, 2.0, 2.75)
    assert tried(holding(beside), Action.ROTATE_LEFT) == "no room for what is held"
    assert tried(holding(beside), Action.ROTATE_RIGHT) == ""
    assert tried(holding(beside, config=WorldConfig()), Action.ROTATE_LEFT) == ""


def test_a_post_between_two_headings_is_met_on_the_way():
    post = at(crate("Post_0", (0.1, 0.1, 1.5)), 2.0 + 0.35, 2.0 + 0.35)
    world = holding(post)
    assert has_room(world, 0, world.position, 1.0)
    assert tried(world, Action.ROTATE_LEFT) == "no room for what is held"


@pytest.mark.parametrize("angle_deg", [22.5, 45.0, 67.5])
def test_no_apple_swings_through_a_post(angle_deg):
    angle = math.radians(angle_deg)
    x, y = 2.0 + 0.3 * math.cos(angle), 2.0 + 0.3 * math.sin(angle)
    post = at(crate("Post_0", (0.06, 0.06, 1.5)), x, y)
    world = World(HALL, [at(apple(), 5.0, 3.5), post], (8, 8, 0), (20, 8), REAL)
    world.put([(0, None)])
    world.held = 0
    assert has_room(world, 0, world.position, 0)
    assert has_room(world, 0, world.position, 1)
    assert tried(world, Action.ROTATE_LEFT) == "no room for what is held"


def test_it_is_not_picked_up_where_it_cannot_be_held():
    behind = at(TALL, 2.0 + 0.9, 2.0)
    world = World(HALL, [at(BOX, 2.42, 2.0), behind], (8, 8, 0), (20, 8), REAL)
    world.i, world.horizon_deg = 8, 60
    near = world.copy()
    near.put([(1, Pose(2.75, 2.0, 0.0, UPRIGHT)), (0, Pose(2.42, 2.3, 0.0, UPRIGHT))])
    assert near.target(pick=True) == 0
    assert tried(near, Action.PICKUP) == "no room for what is held"


def test_done_with_full_hands_fails_and_ends_nothing(hand_house, hand_episode):
    world = holding(goal=(8, 8))
    assert tried(world, Action.DONE) == "hands are full"
    assert tried(holding(goal=(8, 8), config=WorldConfig()), Action.DONE) == ""
    world.held = -1
    assert world.step(Action.DONE).success
    run = EpisodeRun(
        hand_episode, LoadedHouse.of(hand_house), hand_house.assets, TaskConfig(world=REAL)
    )
    run.world.i, run.world.j = run.world.goal
    run.world.held = 0
    step = run.step(int(Action.DONE))
    assert (step.reward, step.terminated, run.task.success) == (pytest.approx(-0.01), False, False)
    run.world.held = -1
    assert run.step(int(Action.DONE)).terminated


def test_room_is_judged_as_shapely_would():
    """Random poses among random posts: overlap of plans and of heights, by another library."""
    import shapely

    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(60):
        x, y = rng.uniform(1.5, 3.5, 2)
        post = crate("Post_0", (0.2, 0.3, float(rng.uniform(0.5, 1.5))))
        world = World(HALL, [at(BOX, 5.0, 3.5), at(post, x, y)], (10, 8, 0), (20, 8), REAL)
        quarter = int(rng.integers(4))
        ux, uy = ((1, 0), (0, 1), (-1, 0), (0, -1))[quarter]
        here = (2.5 + 0.45 * ux, 2.0 + 0.45 * uy)
        box = shapely.box(here[0] - 0.2, here[1] - 0.2, here[0] + 0.2, here[1] + 0.2)
        plan = shapely.box(x - 0.1, y - 0.15, x + 0.1, y + 0.15)
        meets = bool(box.intersects(plan)) and post.size[2] > CARRY_LOW_M
        assert has_room(world, 0, (2.5, 2.0), quarter) != meets
        seen.add(meets)
    assert seen == {True, False}


def test_walls_count():
    world = World(HALL, [at(BOX, 5.0, 3.5)], (3, 8, 2), (20, 8), REAL)
    assert not has_room(world, 0, (0.5, 2.0), 2)
    assert has_room(world, 0, (0.75, 2.0), 2)


def test_the_expert_puts_down_what_it_picked_up():
    obstacles = [at(BOX, 2.5, y) for y in (0.3, 0.75, 1.2)]
    ends = ((4, 3, 0), (20, 3))
    free = solve(World(CORRIDOR, obstacles, *ends))
    world = World(CORRIDOR, obstacles, *ends, REAL)
    real = solve(world)
    assert real is not None
    assert free is not None
    assert real.actions.count(Action.DROP) == real.picks >= 1
    assert real.steps > free.steps
    assert replay(world.copy(), real.actions) == real
    assert free.actions.count(Action.DROP) < free.picks
    assert replay(world.copy(), free.actions) is None, "full hands at the goal"
