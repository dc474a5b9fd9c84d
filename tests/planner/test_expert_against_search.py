"""The expert against every plan there is, in small rooms where things have to be pushed.

The search takes nothing from the expert: A* over true worlds, told apart by their digests; what
lies ahead is counted on a lattice without any movable thing, rotations included, so that no plan
can be cheaper. Looks are left out where the agent sees what it needs without them.
"""

import statistics
from collections import defaultdict, deque

import pytest
from builders import UPRIGHT, crate, one_room
from builders import WALL_HALF_M as HALF

from internav_data.navigation import Lattice
from internav_data.physics import Body
from internav_data.planner.search import solve
from internav_data.records import Pose
from internav_data.world import Action, HouseModel, World

AHEAD = ((1, 0), (0, 1), (-1, 0), (0, -1))
ACTIONS = tuple(a for a in range(12) if a not in (Action.LOOK_DOWN, Action.LOOK_UP))
MAX_WORLDS = 30_000


CRATE = crate("Crate_7", (0.8, 0.8, 0.5), mass_kg=12.0)
HEAVY = crate("Chest_7", (0.8, 0.8, 0.5), mass_kg=28.0)
LONG = crate("Bench_7", (0.4, 1.1, 0.4), mass_kg=15.0)
PARCEL = crate("Parcel_7", (0.8, 0.8, 0.5), mass_kg=3.0, pushable=False, pickable=True)


CORRIDOR = HouseModel.of(one_room(6.0, 1.5))
"""Three nodes wide."""
WIDE = HouseModel.of(one_room(5.0, 2.25))
DOOR = HouseModel.of(one_room(5.0, 3.0, (2.44, HALF, 2.56, 1.0), (2.44, 2.0, 2.56, 3.0 - HALF)))
"""Two rooms and a gap of 1 m between them."""
BEND = HouseModel.of(one_room(3.5, 3.5, (1.5, HALF, 3.5 - HALF, 2.0)))
"""A corridor round a corner."""

CASES = {
    "a crate, straight on": (CORRIDOR, [(CRATE, 2.5, 0.75)], (4, 3, 0), (14, 3)),
    "a crate, off the row": (CORRIDOR, [(CRATE, 2.4, 0.7)], (3, 2, 1), (13, 4)),
    "a crate, not far to go": (CORRIDOR, [(CRATE, 2.2, 0.75)], (4, 3, 0), (10, 3)),
    "turned away at first": (CORRIDOR, [(CRATE, 2.5, 0.75)], (5, 3, 2), (12, 3)),
    "two crates in a row": (CORRIDOR, [(CRATE, 2.2, 0.75), (CRATE, 3.6, 0.75)], (4, 3, 0), (12, 3)),
    "a parcel, a crate": (CORRIDOR, [(PARCEL, 2.2, 0.75), (CRATE, 3.6, 0.75)], (4, 3, 0), (12, 3)),
    "a bench across": (WIDE, [(LONG, 2.4, 0.62), (LONG, 2.4, 1.73)], (4, 4, 0), (14, 4)),
    "a crate in a door": (DOOR, [(CRATE, 2.5, 1.5)], (5, 6, 0), (15, 6)),
    "beside a door": (DOOR, [(CRATE, 2.0, 1.5)], (3, 6, 0), (14, 6)),
    "a chest behind a door": (DOOR, [(HEAVY, 3.05, 1.5)], (7, 6, 0), (15, 6)),
    "a door, from aside": (DOOR, [(CRATE, 2.5, 1.5)], (6, 3, 1), (14, 8)),
    "round the corner": (BEND, [(CRATE, 0.78, 2.2)], (3, 5, 1), (10, 11)),
    "in the corner": (BEND, [(CRATE, 0.8, 2.75)], (3, 6, 1), (10, 11)),
}  # fmt: skip
FEW = ("a crate, off the row", "a crate, not far to go", "turned away at first", "beside a door")


def distances(model, goal):
    """Actions to the goal from every pose of the lattice without any movable thing."""
    bare = Lattice.of_polygons(model.footprints, model.house.outline)
    far = {(*goal, quarter): 0 for quarter in range(4)}
    queue = deque(far)
    while queue:
        i, j, quarter = here = queue.popleft()
        di, dj = AHEAD[quarter]
        before = [(i, j, (quarter + 1) % 4), (i, j, (quarter - 1) % 4)]
        if bare.free[i - di, j - dj] and bare.edge_free(i - di, j - dj, di, dj):
            before.append((i - di, j - dj, quarter))
        for pose in before:
            if pose not in far:
                far[pose] = far[here] + 1
                queue.append(pose)
    return far


def fewest(world, bound):
    """Length of the shortest plan, `bound` where none is shorter; and how many worlds it took."""
    ahead = distances(world.model, world.goal)

    def f_cost(spent, there):
        return spent + ahead.get((there.i, there.j, there.quarter), bound) + 1

    layers = defaultdict(list)
    layers[f_cost(0, world)].append((0, world))
    known = {world.digest(): 0}
    for total in range(bound):
        while layers[total]:
            spent, here = layers[total].pop()
            if known[here.digest()] < spent:
                continue
            for action in ACTIONS:
                there = here.copy()
                if not there.step(action).success:
                    continue
                if action == Action.DONE:
                    return spent + 1, len(known)
                f_cost_there, digest = f_cost(spent + 1, there), there.digest()
                if f_cost_there < bound and known.get(digest, bound) > spent + 1:
                    known[digest] = spent + 1
                    layers[f_cost_there].append((spent + 1, there))
        assert len(known) < MAX_WORLDS
    return bound, len(known)


def compared(name):
    """Steps of the expert, and of the best plan."""
    model, objects, start, goal = CASES[name]
    obstacles = [Body.of(asset, Pose(x, y, 0.001, UPRIGHT)) for asset, x, y in objects]
    expert = solve(World(model, obstacles, start, goal))
    assert expert is not None, name
    best, worlds = fewest(World(model, obstacles, start, goal), expert.steps)
    return expert, best, worlds


@pytest.mark.parametrize("name", FEW)
def test_pushes_are_planned_nearly_as_well_as_can_be(name):
    expert, best, _ = compared(name)
    assert expert.pushes
    assert expert.steps <= 1.1 * best


@pytest.mark.slow
def test_experts_are_within_a_tenth_of_the_best_on_average():
    ratios = {}
    for name in CASES:
        expert, best, _ = compared(name)
        ratios[name] = expert.steps / best
    assert statistics.fmean(ratios.values()) <= 1.1, ratios
