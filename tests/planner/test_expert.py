"""Every expert replays; hand-made houses get the plans that a person would make."""

import hashlib
import itertools
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import UPRIGHT, crate, one_room

from internav_data.catalog import catalogue
from internav_data.episodes import build_episodes
from internav_data.houses import HouseConfig, build_house
from internav_data.navigation import Lattice
from internav_data.physics import Body
from internav_data.planner.cost_to_go import FAR
from internav_data.planner.problem import EVERYTHING, PlanningProblem
from internav_data.planner.push_heuristic import path_marks, pushes_to_clear
from internav_data.planner.search import expert_of_episode, replay, solve
from internav_data.records import Pose
from internav_data.world import ACTION_COUNT, Action, HouseModel, World, WorldConfig

CRATE = crate("Crate_0", (0.8, 0.8, 0.5), mass_kg=12.0)
PARCEL = crate("Parcel_0", (0.8, 0.8, 0.5), mass_kg=3.0, pushable=False, pickable=True)
SAFE = crate("Safe_0", (0.8, 0.8, 0.7), mass_kg=900.0)
PILLAR = crate("Pillar_0", (0.8, 0.8, 1.5), mass_kg=100.0, pushable=False)


def at(asset, x, y):
    return Body.of(asset, Pose(x, y, 0.0, UPRIGHT))


def expert_of(model, obstacles, start, goal, **limit):
    return solve(World(model, obstacles, start, goal), **limit)


CORRIDOR = HouseModel.of(one_room(6.0, 1.5))
"""Three nodes wide: a block of 0.8 m in its middle leaves no way by."""
HALL = HouseModel.of(one_room(6.0, 4.0))
GAPS = HouseModel.of(one_room(5.0, 9.0, (2.44, 1.4, 2.56, 7.6)))
"""Two halls and a wall between them: one way past its lower end, one past its upper end."""


def fewest(world, bound, cap=60_000):
    """Length of the shortest plan that is shorter than `bound`, else `bound`: plain breadth first.

    Only states from which the goal may still be reached in time are kept: no plan can walk faster
    than on a lattice without any movable thing.
    """
    bare = Lattice.of_polygons(world.model.footprints, world.model.house.outline)
    ahead = bare.distances(*world.goal)
    layer, known = [world], {world.digest()}
    for spent in range(bound - 1):
        following = []
        for here, action in itertools.product(layer, range(ACTION_COUNT)):
            there = here.copy()
            if not there.step(action).success:
                continue
            if action == Action.DONE:
                return spent + 1
            if spent + 1 + ahead[there.i, there.j] + 1 >= bound:
                continue
            digest = there.digest()
            if digest not in known:
                known.add(digest)
                following.append(there)
        assert len(known) < cap
        layer = following
    return bound


@pytest.fixture(scope="module")
def episodes():
    out = []
    for scene in (0, 1, 2, 5):
        house = build_house(0, scene, HouseConfig(), catalogue())
        model = HouseModel.of(house)
        made = build_episodes(house, 8, catalogue().spawnable)
        out += [(model, episode) for episode in made]
    return out


def check(model, episode):
    """Solve, and hold every claim of the expert against a fresh world; all are solvable."""
    assets = catalogue().assets
    expert = expert_of_episode(model, episode, assets)
    assert expert == episode.expert
    assert expert is not None
    world = World.of_episode(model, episode, assets)
    results = [world.step(action) for action in expert.actions]
    assert all(result.success for result in results)
    assert (world.i, world.j) == (episode.goal.i, episode.goal.j)
    assert expert.actions[-1] == Action.DONE
    assert expert.steps == len(expert.actions) <= 500
    assert set(expert.actions) <= set(range(ACTION_COUNT))
    assert expert.path_m == 0.25 * expert.actions.count(Action.MOVE_AHEAD)
    assert expert.picks == expert.actions.count(Action.PICKUP)
    assert expert.pushes == sum(5 <= action <= 8 for action in expert.actions)
    interactions = expert.pushes + expert.picks
    assert interactions > 0 or episode.mode == "lengthened"
    return interactions


def test_every_expert_replays(episodes):
    assert {episode.mode for _, episode in episodes} == {"blocked", "lengthened"}
    assert sum(check(model, episode) for model, episode in episodes) >= len(episodes) // 2


@pytest.mark.slow
def test_a_thousand_experts_replay():
    for scene in range(100):
        house = build_house(1, scene, HouseConfig(), catalogue())
        model = HouseModel.of(house)
        for episode in build_episodes(house, 10, catalogue().spawnable):
            check(model, episode)


def test_a_box_in_a_corridor_is_pushed():
    expert = expert_of(CORRIDOR, [at(CRATE, 2.5, 0.75)], (4, 3, 0), (14, 3))
    assert expert is not None
    assert expert.pushes >= 1
    assert expert.picks == 0


def test_a_parcel_in_a_corridor_is_picked_up():
    expert = expert_of(CORRIDOR, [at(PARCEL, 2.5, 0.75)], (4, 3, 0), (14, 3))
    assert expert is not None
    assert (expert.pushes, expert.picks) == (0, 1)
    # Ten moves, the pick, Done: nothing is wasted.
    assert expert.steps == 12


def test_two_parcels_need_an_empty_hand():
    parcels = [at(PARCEL, 2.0, 0.75), at(PARCEL, 4.5, 0.75)]
    expert = expert_of(CORRIDOR, parcels, (2, 3, 0), (22, 3))
    assert expert is not None
    # The first is dropped behind the agent: in front of it, it would bar the corridor again.
    assert expert.picks == 2
    assert expert.actions.count(Action.DROP) == 1
    wide = [at(PARCEL, 2.5, 0.75), at(PARCEL, 2.5, 8.25)]
    house = one_room(5.0, 9.0, (2.44, 1.4, 2.56, 7.6))
    assert expert_of(HouseModel.of(house), wide, (4, 3, 0), (16, 3)).picks == 1, "one gap is enough"


def test_a_short_way_round_is_gone():
    expert = expert_of(HALL, [at(CRATE, 3.0, 2.0)], (6, 5, 0), (18, 11))
    assert expert is not None
    assert (expert.pushes, expert.picks) == (0, 0)


def test_a_long_way_round_is_not():
    # The lower gap is barred; the upper one is open, 12 m longer.
    expert = expert_of(GAPS, [at(PARCEL, 2.5, 0.75)], (4, 3, 0), (16, 3))
    assert expert is not None
    assert expert.picks == 1
    assert expert.steps < 20


def test_the_long_way_is_gone_where_nothing_can_be_moved():
    for asset in (SAFE, PILLAR):
        expert = expert_of(GAPS, [at(asset, 2.5, 0.75)], (4, 3, 0), (16, 3))
        assert expert is not None
        assert (expert.pushes, expert.picks) == (0, 0)
        assert expert.path_m > 12.0


@pytest.mark.parametrize("asset", [SAFE, PILLAR], ids=["too heavy", "fixed"])
def test_what_cannot_be_moved_has_no_expert(asset):
    assert expert_of(CORRIDOR, [at(asset, 2.5, 0.75)], (4, 3, 0), (14, 3)) is None


def test_a_crate_that_is_heavier_than_its_asset_has_no_expert():
    light = at(CRATE, 2.5, 0.75)
    heavy = Body(CRATE, light.pose, replace(CRATE.dynamics, mass_kg=900.0))
    assert expert_of(CORRIDOR, [light], (4, 3, 0), (14, 3)) is not None
    assert expert_of(CORRIDOR, [heavy], (4, 3, 0), (14, 3)) is None
    assert expert_of(GAPS, [heavy], (4, 3, 0), (16, 3)).pushes == 0


def test_a_limit_is_kept():
    obstacles = [at(PARCEL, 2.5, 0.75)]
    assert expert_of(CORRIDOR, obstacles, (4, 3, 0), (14, 3), limit=12) is not None
    assert expert_of(CORRIDOR, obstacles, (4, 3, 0), (14, 3), limit=11) is None


@pytest.mark.parametrize(
    ("model", "obstacles", "start", "goal"),
    [
        (CORRIDOR, [at(PARCEL, 2.0, 0.75)], (4, 3, 0), (11, 3)),
        (CORRIDOR, [at(PARCEL, 2.0, 0.75)], (4, 2, 1), (11, 4)),
    ],
)
def test_plans_are_nearly_the_shortest(model, obstacles, start, goal):
    expert = expert_of(model, obstacles, start, goal)
    assert expert is not None
    # No plan is shorter than ten elevenths of it.
    bound = math.ceil(expert.steps / 1.1)
    assert fewest(World(model, obstacles, start, goal), bound) == bound


def test_solving_changes_nothing_and_begins_anywhere(episodes):
    model, episode = next(pair for pair in episodes if pair[1].mode == "lengthened")
    world = World.of_episode(model, episode, catalogue().assets)
    expert = solve(world)
    before = world.digest()
    assert solve(world) == expert
    assert world.digest() == before
    for action in expert.actions[: expert.steps // 2]:
        world.step(action)
    rest = solve(world)
    assert rest is not None
    assert rest.steps <= expert.steps - expert.steps // 2


def test_replay_refuses_what_fails():
    obstacles = [at(PARCEL, 2.5, 0.75)]

    def world():
        return World(CORRIDOR, obstacles, (4, 3, 0), (14, 3))

    good = expert_of(CORRIDOR, obstacles, (4, 3, 0), (14, 3)).actions
    assert replay(world(), good) is not None
    assert replay(world(), good[:-1]) is None
    assert replay(world(), ()) is None
    assert replay(world(), tuple(a for a in good if a != Action.PICKUP)) is None


def test_fields_count_what_the_lattice_counts(episodes):
    reachable = set()
    for model, episode in episodes[::5]:
        world = World.of_episode(model, episode, catalogue().assets)
        problem = PlanningProblem.of(world)
        masks = problem.masks(world)
        reach, _ = problem.reach(masks, problem.pose(world))
        nearest = reach.reshape(-1, 4).min(axis=1).reshape(problem.shape)
        steps = world.lattice.distances(world.i, world.j)
        assert np.array_equal(nearest < FAR, steps >= 0)
        there = steps >= 0
        assert (nearest[there] >= steps[there]).all()
        costs = problem.costs(masks, EVERYTHING, problem.prices(world))
        ahead = int(costs[problem.pose(world)])
        assert (ahead < FAR) == (world.path_steps() is not None)
        # There and back are equally far, and equally cut off.
        goal = 4 * (world.goal[0] * problem.ny + world.goal[1])
        assert ahead == reach[goal : goal + 4].min()
        reachable.add(ahead < FAR)
    assert reachable == {True, False}


def experts():
    """Digest of some experts; a pure function."""
    house = build_house(0, 2, HouseConfig(), catalogue())
    model = HouseModel.of(house)
    made = build_episodes(house, 4, catalogue().spawnable)
    found = [expert_of_episode(model, episode, catalogue().assets) for episode in made]
    return hashlib.sha256(repr(found).encode()).hexdigest()


def test_processes_agree(episodes):
    folders = [str(folder) for folder in Path(__file__).parents[:2]]
    code = (
        f"import sys; sys.path[:0] = {folders}; from test_expert import experts; print(experts())"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == experts()


def test_things_that_stand_apart_do_not_matter():
    near = [at(PARCEL, 2.5, 0.75)]
    far = [*near, at(crate("Crate_1", (0.2, 0.2, 0.5), mass_kg=2.0), 5.6, 0.3)]
    alone = expert_of(CORRIDOR, near, (4, 3, 0), (14, 3))
    assert expert_of(CORRIDOR, far, (4, 3, 0), (14, 3)).steps == alone.steps


STEP = WorldConfig(push_model="step")


def test_short_pushes_of_one_object_come_in_runs():
    """A crate in a corridor is shoved along until there is a way: one candidate, many pushes."""
    for x, pushes in ((2.5, 1), (2.25, 2)):
        world = World(CORRIDOR, [at(CRATE, x, 0.75)], (4, 3, 0), (8, 3), STEP)
        expert = solve(world)
        assert expert is not None
        assert expert.pushes == pushes
        assert replay(world.copy(), expert.actions) == expert
    far = solve(World(CORRIDOR, [at(CRATE, 2.25, 0.75)], (4, 3, 0), (12, 3), STEP))
    assert far is not None
    assert far.pushes >= 4
    strong = solve(World(CORRIDOR, [at(CRATE, 2.25, 0.75)], (4, 3, 0), (12, 3)))
    assert strong.pushes < far.pushes


def test_the_number_of_short_pushes_that_clear_a_path_is_estimated():
    world = World(HALL, [at(CRATE, 3.0, 2.0)], (4, 8, 0), (20, 8), STEP)
    problem = PlanningProblem.of(world)
    poses = [4 * (i * problem.ny + 8) for i in range(4, 21)]
    marks = path_marks(poses, problem.fixed.shape[1])
    east, north, west, south = pushes_to_clear(world, 0, marks, problem.shape)
    assert north == south == 3, "0.4 m of crate and 0.21 m of agent, 0.24 m a push"
    assert east == west == 0, "along the path no number of pushes helps"
    once = World(HALL, [at(CRATE, 3.0, 2.0)], (4, 8, 0), (20, 8))
    assert set(pushes_to_clear(once, 0, marks, problem.shape)) <= {0, 1}
