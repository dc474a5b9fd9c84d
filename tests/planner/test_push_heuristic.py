"""The expert's screen of pushes: against Coulomb, and against what really happens."""

import numpy as np
import pytest

from internav_data.catalog import catalogue
from internav_data.houses import HouseConfig, build_house
from internav_data.physics import engines
from internav_data.planner.cost_to_go import FAR, bucket_dijkstra
from internav_data.planner.problem import EVERYTHING, PlanningProblem
from internav_data.planner.push_heuristic import path_marks, pushes_to_clear, slide_m
from internav_data.planner.search import MAX_MOVERS
from internav_data.world import HouseModel, World

SIXES = range(0, 12, 3)


@pytest.fixture(scope="module")
def worlds():
    models = [HouseModel.of(build_house(0, scene, HouseConfig(), catalogue())) for scene in SIXES]
    return [World(model, [], (0, 0, 0), (4, 4)) for model in models]


def pushables(world):
    return [k for k, item in enumerate(world.items) if item.dynamics.pushable]


def test_free_slides_are_guessed(worlds):
    """The heuristic ignores collisions and rotation: an upright object never slides farther."""
    checked = 0
    for world in worlds:
        for thing in pushables(world):
            before = world.items[thing].pose
            for heading in range(4):
                pushed = world.simulate_push(thing, heading, agent=False)
                upright = abs(pushed.pose.z - before.z) < 0.01 and not pushed.toppled
                if pushed.success and upright:
                    assert pushed.displacement_m < 1.1 * slide_m(world, thing) + 0.1
                    checked += pushed.displacement_m > 0.8 * slide_m(world, thing)
    assert checked > 10


def test_most_guesses_are_right(worlds):
    """Ways straight over each thing: what the screen says of them, and what a push does."""
    right = wrong = 0
    for world in worlds:
        nx, ny = world.model.lattice.shape
        problem = PlanningProblem.of(world)
        for thing in pushables(world):
            i, j = np.rint(world.items[thing].footprint.vertices.mean(axis=0) / 0.25).astype(int)
            path = path_marks([4 * ((i + k) * ny + j) for k in range(-1, 2)], nx * ny)
            bit = 1 << problem.objects.index(thing)
            for heading, clears in enumerate(pushes_to_clear(world, thing, path, (nx, ny))):
                there, pushed = world.copy(), world.simulate_push(thing, heading, agent=False)
                if pushed.success:
                    there.put([(thing, pushed.pose), *pushed.moved])
                blocks = (problem.masks(there).reshape(-1)[path] & bit).any()
                right += clears != blocks
                wrong += clears == blocks
    assert right + wrong > 100
    assert right > 4 * wrong


def test_crowds_are_foreseen(worlds):
    """The estimate is no bound, but the search seldom pushes a crowd, or forgoes what is none."""
    tried, right, crowds, foreseen = 0, 0, 0, 0
    for world in worlds:
        for thing in pushables(world):
            for heading in range(4):
                moved = len(world.simulate_push(thing, heading, agent=False).moved) > MAX_MOVERS
                expected = world.count_movers(thing, heading) > MAX_MOVERS
                tried, right = tried + 1, right + (moved == expected)
                crowds, foreseen = crowds + moved, foreseen + (moved and expected)
    assert tried > 100
    share = {"bullet": 0.9, "mujoco": 0.85}[engines.DEFAULT_ENGINE]
    assert right > share * tried  # MuJoCo: 122 of 136
    assert crowds > 10
    assert foreseen > share * crowds


def test_a_field_that_stops_early_knows_the_way_down(worlds):
    for world in worlds:  # the first whose goal has much room around it
        problem = PlanningProblem.of(world)
        masks, prices = problem.masks(world), problem.prices(world)
        goals = problem.goals
        whole = bucket_dijkstra(problem.fixed, masks, 0, prices, problem.ny, goals, -1)
        poses = np.flatnonzero(whole < FAR)
        if len(poses) > 100:
            break
    assert len(poses) > 100
    for pose in poses[:: len(poses) // 40].tolist():
        part = bucket_dijkstra(problem.fixed, masks, 0, prices, problem.ny, goals, pose)
        assert part[pose] == whole[pose]
        below = whole <= whole[pose]
        assert (part[below] == whole[below]).all()
        first, second = (
            problem.path(masks, 0, prices, costs, pose)[0].tolist() for costs in (part, whole)
        )
        assert first == second
    cut_off = np.flatnonzero(whole == FAR)
    closed = bucket_dijkstra(
        problem.fixed, masks, EVERYTHING, prices, problem.ny, goals, int(cut_off[0])
    )
    assert closed[cut_off[0]] == FAR
