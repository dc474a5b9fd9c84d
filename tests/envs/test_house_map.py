"""Maps against shapely, cell by cell, after pushes and picks; occlusion against segments."""

import math

import numpy as np
import pytest
import shapely
from scipy.spatial.transform import Rotation

from internav_data.catalog.asset_types import ASSET_TYPES
from internav_data.envs import InterNavEnv, InterNavProcesses, InterNavVectorEnv
from internav_data.envs.sensors import map_sensor
from internav_data.geometry import asset_corners, footprint
from internav_data.records import type_affordances
from internav_data.records.errors import UsageError
from internav_data.world import Action

CELL, SIZE = 0.125, 52
ORACLE = {"observation": "map", "privileged": ["mass", "movable"]}
SURE_M2 = 1e-9
"""Area above which a footprint overlaps a cell whatever the last bits."""
WEIGHTS = {"move": 6, "turn": 3, "look": 1, "push": 2, "pick": 3, "drop": 2, "done": 0, "wait": 0}


class Watch:
    """What failed in a run, noted by the test itself, and what stands in a cell, by shapely."""

    def __init__(self, run, affordances):
        self.run, self.world, self.affordances = run, run.world, affordances
        self.tried, self.here = {}, set()
        self.poses = [item.pose for item in self.world.items]

    def step(self, action):
        known = Action(action)
        self.run.step(action)
        result, now = self.run.last, [item.pose for item in self.world.items]
        for k, (old, new) in enumerate(zip(self.poses, now, strict=True)):
            if old != new:
                self.tried.pop(k, None)
                self.here.clear()
        self.poses = now
        if result.success or known.kind not in {"push", "pick", "drop"}:
            return
        if known.kind == "drop" or result.target < 0:
            self.here.add((self.world.i, self.world.j))
        elif known.kind == "pick":
            self.tried.setdefault(result.target, set()).add("pick")
        else:
            east_first = (self.world.quarter + known.quarter_turns) % 4
            self.tried.setdefault(result.target, set()).add(east_first)

    def things(self):
        """Yield plan, top (m), kind, type's number, what failed, mass and movability."""
        world, house = self.world, self.world.model.house
        for wall in house.walls:
            if wall.z_min < 1.0:  # lintels hang above
                plan = shapely.box(wall.x_min, wall.y_min, wall.x_max, wall.y_max)
                yield plan, wall.z_max, 1, 255, set(), 255, 0
        home = set(world.model.object_ids)
        rest = [o for o in house.objects if o.object_id not in home]
        for placed in rest:
            asset = house.assets[placed.asset_id]
            if asset.blocks:
                yield self.thing(asset, placed.pose, asset.dynamics, set())
        for k, item in enumerate(world.items):
            if item.pose is not None:
                yield self.thing(item.asset, item.pose, item.dynamics, self.tried.get(k, set()))

    def thing(self, asset, pose, dynamics, tried):
        plan = shapely.union_all([shapely.Polygon(p) for p in footprint(asset, pose)])
        corners = Rotation.from_quat(pose.quaternion).apply(np.array(asset_corners(asset)[0]))
        kind = {"push": 3, "pick": 4}.get(self.affordances.get(asset.type), 2)
        number = ASSET_TYPES[asset.type].number + 1 if asset.type in ASSET_TYPES else 254
        movable = dynamics.pushable + 2 * dynamics.pickable
        top = pose.z + corners[:, 2].max()
        return plan, top, kind, number, tried, max(1, round(dynamics.mass_kg)), movable

    def cells(self, lower):
        """Return channels of cells by their lower corners (n, 2), m; and where they are sure."""
        shown = np.zeros((len(lower), 6), int)
        sure, best = np.ones(len(lower), bool), np.full(len(lower), -1)
        squares = shapely.box(*lower.T, *(lower + CELL).T)
        for plan, top, kind, number, tried, mass, movable in self.things():
            area = shapely.area(shapely.intersection(squares, plan))
            sure &= (area == 0) | (area > SURE_M2)
            height = min(255, max(1, round(round(top, 4) / 0.02)))
            score = height + 1000 * (kind >= 3)
            wins = (area > SURE_M2) & (score >= best)
            best[wins] = score
            bits = sum(1 << (h - self.world.quarter) % 4 for h in tried - {"pick"})
            bits += 16 * ("pick" in tried)
            shown[wins] = height, kind, number, bits, mass, movable
        for node in self.here:
            around = np.abs(lower + CELL / 2 - 0.25 * np.array(node)).max(1) < CELL
            shown[around, 3] |= 32
        return shown, sure


def own_cells(world):
    """Lower corners (52, 52, 2), m, of a map's cells: row 0 ahead, column 0 to the left."""
    offsets = CELL * (SIZE / 2 - 0.5 - np.arange(SIZE))
    ahead, left = np.meshgrid(offsets, offsets, indexing="ij")
    turn = math.radians(90 * world.quarter)
    x = 0.25 * world.i + ahead * math.cos(turn) - left * math.sin(turn)
    y = 0.25 * world.j + ahead * math.sin(turn) + left * math.cos(turn)
    return CELL * np.floor(np.stack([x, y], -1) / CELL)


def shown_to(run, **options):
    """Return an oracle's map of a run."""
    out = np.zeros((7, SIZE, SIZE), np.uint8)
    map_sensor(privileged=("mass", "movable"), **options).write(run, None, out)
    return out


def walk(watch, rng, steps):
    acts = [a for a in Action if WEIGHTS[a.kind]]
    shares = np.array([WEIGHTS[a.kind] for a in acts], float)
    for action in rng.choice(acts, size=steps, p=shares / shares.sum()).tolist():
        watch.step(action)


@pytest.fixture(scope="module")
def watched(small):
    """A watched run that begins beside an obstacle."""

    def make(seed, task):
        env = InterNavVectorEnv(1, small, 16, task=task, max_steps=10_000)
        env.reset(seed=seed)
        slot = env.slots[0]
        affordances = type_affordances(slot.source.dataset.assets.values())
        assert {*affordances.values()} == {"push", "pick"}
        return Watch(slot.run, affordances)

    return make


@pytest.mark.parametrize(("task", "seed"), [("push", 0), ("pick", 1), ("pick", 5)])
def test_every_channel_is_what_shapely_finds_after_pushes_and_picks(watched, task, seed):
    watch = watched(seed, task)
    rng, moved = np.random.default_rng(seed), 0
    for _ in range(6):
        walk(watch, rng, 12)
        seen = shown_to(watch.run)
        lower = own_cells(watch.world)
        shown, sure = watch.cells(lower.reshape(-1, 2))
        assert sure.mean() > 0.99
        order = (0, 1, 2, 4, 5, 6)  # height, kind, type, tried, mass, movable
        found = seen[list(order)].reshape(6, -1).T.astype(int)
        np.testing.assert_array_equal(found[sure], shown[sure])
        goal = np.abs(lower + CELL / 2 - 0.25 * np.array(watch.world.goal)).max(-1) < CELL
        np.testing.assert_array_equal(seen[3], goal)
        moved += watch.world.items[:] != watch.world.model.items[:]
    assert moved, "nothing was moved: the test is void"
    assert watch.tried or watch.here, "nothing failed: the test is void"


def test_a_failed_push_is_told_as_the_agent_looks_now_until_the_thing_is_moved(hand_run):
    """A crate of 5 t, 0.6 m wide, 1 m ahead in the middle of a room."""
    run = hand_run(divided=False, pickable=False, mass_kg=5000.0)
    run.step(Action.PUSH_AHEAD)
    assert (run.last.success, run.last.target) == (False, 0)
    # Cells of 0.125 m that [0.7, 1.3] m ahead and 0.3 m to either side overlap.
    ahead, across = slice(26 - 11, 26 - 5), slice(26 - 3, 26 + 3)
    places = ((ahead, across), (across, slice(26 + 5, 26 + 11)), (slice(26 + 5, 26 + 11), across))
    for bit, place in zip((1, 8, 4), places, strict=True):  # ahead, to the right, back
        tried = shown_to(run)[4]
        assert (tried[place] == bit).all()
        assert (tried != 0).sum() == 36
        run.step(Action.ROTATE_LEFT)
    run.step(Action.PICKUP)
    assert shown_to(run)[4, 25:27, 25:27].tolist() == [[32, 32], [32, 32]]


def test_only_what_was_seen_is_shown_and_as_it_was_then(watched):
    watch, memory = watched(1, "pick"), {}
    size = [2 * n for n in watch.world.model.lattice.shape]
    grid = np.stack(np.meshgrid(*(np.arange(-2, n + 2) for n in size), indexing="ij"), -1)
    lower = CELL * grid.reshape(-1, 2)
    rng = np.random.default_rng(3)
    for step in range(9):
        if step:
            walk(watch, rng, 1)
        world = watch.world
        shown, _ = watch.cells(lower)
        here, quarter = 0.25 * np.array([world.i, world.j]), world.quarter
        high = lower[shown[:, 0] * 0.02 >= 1.575 - 1e-9]
        opaque = shapely.STRtree(shapely.box(*high.T, *(high + CELL).T))
        there = lower + CELL / 2 - here
        c, s = round(math.cos(math.pi / 2 * quarter)), round(math.sin(math.pi / 2 * quarter))
        level, side = there @ (c, s), np.abs(there @ (-s, c))
        near = np.abs(there).max(1) < 0.25
        for k in np.flatnonzero(near | (side <= level + 1e-9)).tolist():
            ray = shapely.LineString([here, lower[k] + CELL / 2])
            between = opaque.geometries[opaque.query(ray)]
            own = shapely.equals(between, shapely.box(*lower[k], *(lower[k] + CELL)))
            crossed = shapely.length(shapely.intersection(between[~own], ray)) > 1e-9
            if near[k] or not crossed.any():
                memory[tuple(np.rint(lower[k] / CELL).astype(int))] = shown[k]
    found = shown_to(watch.run, occlusion=True)
    mine = np.rint(own_cells(watch.world) / CELL).astype(int)
    unseen, checked = np.array([0, 5, 0, 0, 0, 0]), 0
    for row in range(SIZE):
        for column in range(SIZE):
            want = memory.get(tuple(mine[row, column]), unseen)
            checked += want is not unseen
            np.testing.assert_array_equal(
                found[[0, 1, 2, 5, 6], row, column], want[[0, 1, 2, 4, 5]]
            )
    assert checked > 200
    assert (found[1] == 5).sum() > 200


def test_maps_are_equal_in_one_environment_in_many_and_in_processes_and_restored(small):
    for given in ({}, {"map_occlusion": True, "privileged": ["movable"]}):
        options = {"observation": "map", "task": "pick", **given}
        alone = InterNavEnv(small, **options)
        many = InterNavVectorEnv(2, small, **options)
        processes = InterNavProcesses(2, small, 2, **options)
        try:
            seen = [env.reset(seed=3)[0] for env in (alone, many, processes)]
            for action in (9, 0, 1, 10, 5, 0, 0, 2, 9, 0):
                assert set(seen[0]) == {"map", "goal", "held", "horizon"}
                assert alone.observation_space.contains(seen[0])
                assert many.observation_space.contains(dict(seen[1]))
                np.testing.assert_array_equal(seen[0]["map"], seen[1]["map"][0])
                np.testing.assert_array_equal(seen[1]["map"], seen[2]["map"])
                acts = np.array([action] * 2)
                seen = [alone.step(action)[0], many.step(acts)[0], processes.step(acts)[0]]
            again = InterNavEnv(small, **options).restore(alone.state())[0]
            np.testing.assert_array_equal(again["map"], seen[0]["map"])
        finally:
            processes.close()


def test_a_map_tells_nothing_hidden_unless_it_is_privileged(small):
    plain = InterNavEnv(small, observation="map")
    assert plain.reset(seed=0)[0]["map"].shape == (5, SIZE, SIZE)
    oracle = InterNavEnv(small, **ORACLE)
    assert oracle.reset(seed=0)[0]["map"].shape == (7, SIZE, SIZE)
    assert "privileged" not in map_sensor().description
    assert "privileged input: mass" in map_sensor(privileged=["mass"]).description


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"observation": "smell"}, "expected 'camera' or 'map'"),
        ({"map_occlusion": True}, "pictures have no use"),
        ({"privileged": ["mass"]}, "pictures have no use"),
        ({"observation": "map", "privileged": ["price"]}, "expected some of"),
        ({"observation": "map", "privileged": ["mass", "mass"]}, "expected some of"),
        ({"observation": "map", "sensors": ["goal"]}, "sensors are given, too"),
    ],
)
def test_maps_that_cannot_be_are_refused(small, given, message):
    with pytest.raises(UsageError, match=message):
        InterNavVectorEnv(1, small, 16, **given)
