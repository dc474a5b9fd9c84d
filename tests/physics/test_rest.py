"""At rest is what is let go and stays: nothing that is pressed, leans on a hand, or swings."""

import math
from contextlib import contextmanager
from dataclasses import dataclass

import pytest
from builders import UPRIGHT, crate
from engines import bullet_only

from internav_data.catalog import catalogue
from internav_data.episodes import build_episodes
from internav_data.houses import HouseConfig, build_house
from internav_data.physics import ENGINES, Body, push, wall_body
from internav_data.physics.config import PhysicsConfig
from internav_data.physics.displacement import tilt_deg
from internav_data.physics.engines.protocol import Simulation
from internav_data.physics.kdop import grown
from internav_data.physics.scene import PhysicsScene
from internav_data.physics.solving import PUSH_LIMIT_S, RULES, solve_push
from internav_data.physics.sweep import extent_of
from internav_data.records import PUSH_SPECS, Pose, Wall
from internav_data.world import HouseModel, World

BOX = crate("Box_0", (0.3, 0.3, 0.8), mass_kg=12.0, friction=0.5)
FORCE = PUSH_SPECS["force"]
STEP_S = 1.0 / 240.0


@dataclass
class Scripted(Simulation):
    """An engine whose first body is where a function of time says, x in metres."""

    x: object
    name = build = "scripted"
    libraries = ()
    contact_margin_m = 0.0
    step_s = STEP_S
    now = 0

    @contextmanager
    def load(self, scene):  # noqa: ARG002 - the protocol's
        self.now = 0
        yield self

    def step(self, count=1):
        self.now += count

    def placement(self, body):  # noqa: ARG002 - the protocol's
        return (self.x(self.now * STEP_S), 0.0, 0.4), UPRIGHT

    def velocity(self, body):  # noqa: ARG002 - the protocol's
        before, after = (self.x((self.now + k) * STEP_S) for k in (-0.5, 0.5))
        return ((after - before) / STEP_S, 0.0, 0.0), (0.0, 0.0, 0.0)

    def set_velocity(self, body, linear, angular): ...

    def apply_force(self, body, force): ...

    def penetration_m(self, body):  # noqa: ARG002 - the protocol's
        return 0.0


def solved(x):
    return solve_push(Scripted(x), PhysicsScene((Body.of(BOX, Pose(0, 0, 0, UPRIGHT)),)), FORCE)


@pytest.mark.parametrize("phase", range(0, 24, 3))
def test_the_apex_of_a_swing_is_no_rest(phase):
    """It is slow there for less than it takes, and where it was a window ago."""
    apex = 1.0 + phase * STEP_S

    def swing(t):
        return 0.03 * min(t - apex, 0.5) ** 2 * (1.0 if t > apex - 0.7 else 0.0) + (
            0.3 * t if t <= apex - 0.7 else 0.0
        )

    assert solved(swing).seconds > apex + 0.5


def test_what_trembles_in_place_is_at_rest_two_windows_after_it_is_let_go():
    solution = solved(lambda t: 1e-5 * math.sin(500.0 * t) + min(t, 0.6))
    assert solution.at_rest
    assert 0.6 + 0.2 <= solution.seconds < 0.6 + 0.35


def test_what_does_not_yield_to_the_hand_is_let_go_early():
    solution = solved(lambda t: 1e-5 * math.sin(500.0 * t))
    assert solution.at_rest
    assert solution.seconds < FORCE.seconds


def test_what_rolls_on_is_solved_to_its_end_and_cut_off_late():
    assert solved(lambda t: 0.05 * min(t, 8.0)).at_rest
    endless = solved(lambda t: 0.05 * t)
    assert not endless.at_rest
    assert endless.seconds == pytest.approx(PUSH_LIMIT_S + FORCE.seconds)


def test_what_creeps_for_ever_is_at_rest_after_two_seconds_and_what_it_tips_over_is_not():
    def creep(t, tips_at):
        late = max(0.0, t - tips_at)
        return 0.0004 * t + min(2.0 * late**2, 0.3)

    assert solved(lambda t: creep(t, math.inf)).seconds == pytest.approx(2.5, abs=0.2)
    assert solved(lambda t: creep(t, 1.8)).seconds > 1.8 + 0.4
    assert not solved(lambda t: 0.001 * t).at_rest


@bullet_only
def test_what_leans_while_it_is_pressed_falls_back():
    import holds

    """Pressed over a curb, its top against a wall: 200 N hold it there, and nothing else does."""
    curb = wall_body(Wall(0.152, -1.0, 0.25, 1.0, 0.0, 0.1))
    wall = wall_body(Wall(0.32, -1.0, 0.44, 1.0, 0.0, 2.6))
    around = [(0, curb), (1, wall)]
    pushed = push(Body.of(BOX, Pose(0.0, 0.0, 0.001, UPRIGHT)), 0, lambda _: around)
    assert pushed.at_rest
    assert tilt_deg(UPRIGHT, pushed.pose.quaternion) < 1.0
    bodies = [Body.of(BOX, pushed.pose), curb, wall]
    assert holds.holds(holds.drift(bodies)[0])


@bullet_only
def test_poses_after_pushes_hold_in_a_fresh_scene():
    """Fifty successful pushes of generated episodes; `benchmarks/holds.py` asks thousands."""
    import holds

    count = 0
    for world, _ in holds.made(seed=11):
        for index, _, pushed in holds.successful_pushes(world):
            moved = [(index, pushed.pose), *pushed.moved]
            for (k, _), drift in zip(moved, holds.push_drift(world, moved), strict=True):
                assert holds.holds(drift), (world.items[k].asset.asset_id, pushed, drift)
            count += 1
        if count >= 50:
            break


def test_the_rules_have_a_number_of_their_own():
    assert RULES == 5


def drift_on(engine, bodies):
    """How far the first body moves, metres, and turns, degrees, in a scene of its own in 2 s."""
    with ENGINES[engine]().load(PhysicsScene(tuple(bodies))) as simulation:
        here, turn = simulation.placement(0)
        simulation.step(480)
        there, turned = simulation.placement(0)
    dot = min(1.0, abs(sum(a * b for a, b in zip(turn, turned, strict=True))))
    return math.dist(here, there), math.degrees(2.0 * math.acos(dot))


def test_poses_after_pushes_hold_on_the_engine_that_found_them(engine):
    """What moved comes first in a scene: there it may not sleep."""
    house = build_house(12, 1, HouseConfig(), catalogue())
    model, count = HouseModel.of(house), 0
    episodes = build_episodes(house, 8, catalogue().spawnable, physics=PhysicsConfig(engine))
    for episode in episodes:
        world = World.of_episode(model, episode, catalogue().assets)
        for index in world.obstacles:
            if not world.items[index].dynamics.pushable:
                continue
            pushed = world.simulate_push(index, count % 4, agent=False)
            moved = [(index, pushed.pose), *pushed.moved]
            there = world.copy()
            there.put(moved)
            for k, _ in moved if pushed.success else ():
                body = there.body(k)
                near = there.near(grown(extent_of(body.asset, body.pose).dop8, 0.5))
                others = [other for key, other in near if key != k]
                far_m, turned_deg = drift_on(engine, [body, *others])
                assert far_m < 0.005, (body.asset.asset_id, pushed)
                assert turned_deg < 1.0, (body.asset.asset_id, pushed)
            count += pushed.success
    assert count >= 4
