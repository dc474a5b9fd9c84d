"""A second engine is an addition: `settle`, `push` and `World` take it by its name."""

import math
from contextlib import contextmanager

import numpy as np
import pytest
from builders import UPRIGHT, crate
from engines import default_engine

from internav_data.catalog import catalogue
from internav_data.episodes import EpisodeConfig, build_episodes
from internav_data.episodes.outcomes import outcomes_of
from internav_data.geometry import centre_of_mass
from internav_data.houses import HouseConfig, build_house
from internav_data.physics import (
    ENGINES,
    Body,
    get_solver,
    push,
    settle,
)
from internav_data.physics.config import PhysicsConfig
from internav_data.physics.engines.installed import available_engines
from internav_data.physics.engines.protocol import Simulation
from internav_data.physics.result_cache import ResultCache
from internav_data.physics.solving import RULES
from internav_data.records import Pose, PushSpec
from internav_data.records.errors import UsageError
from internav_data.world import Action, HouseModel, World

BOX = crate("Box_0", (0.4, 0.4, 0.4), mass_kg=5.0, friction=0.5)
GRAVITY = 9.81


class Glide:
    """An engine of points that slide by Coulomb's law, and stick to the floor where others are."""

    name, build, libraries = "glide", "glide 1", ("numpy",)
    contact_margin_m, step_s = 0.0, 0.01

    def __init__(self):
        self.loaded = []

    @contextmanager
    def load(self, scene):
        self.loaded.append(scene)
        yield GlideSimulation(scene)


class GlideSimulation(Simulation):
    """Motion of the first body of a scene; the others stay."""

    def __init__(self, scene):
        body = scene.bodies[0]
        self.stuck, self.dynamics, self.turn = len(scene.bodies) > 1, body.dynamics, UPRIGHT
        middle = centre_of_mass(body.asset)
        self.middles = [
            np.array([b.pose.x, b.pose.y, b.pose.z]) + centre_of_mass(b.asset) for b in scene.bodies
        ]
        self.floor_m, self.speed, self.force = middle[2], np.zeros(3), np.zeros(3)

    def step(self, count=1):
        for _ in range(count):
            self.speed += Glide.step_s * (self.force / self.dynamics.mass_kg - [0.0, 0.0, GRAVITY])
            slower = Glide.step_s * self.dynamics.friction * GRAVITY
            speed = np.hypot(*self.speed[:2])
            self.speed[:2] *= 0.0 if self.stuck else max(0.0, speed - slower) / max(speed, 1e-9)
            self.middles[0] = self.middles[0] + Glide.step_s * self.speed
            if self.middles[0][2] <= self.floor_m:
                self.middles[0][2], self.speed[2] = self.floor_m, 0.0
            self.force = np.zeros(3)

    def placement(self, body):
        return tuple(self.middles[body].tolist()), UPRIGHT

    def velocity(self, body):
        return (tuple(self.speed.tolist()) if body == 0 else (0.0, 0.0, 0.0)), (0.0, 0.0, 0.0)

    def set_velocity(self, body, linear, angular):  # noqa: ARG002 - the protocol's
        self.speed = np.array(linear)

    def apply_force(self, body, force):  # noqa: ARG002 - the protocol's
        self.force = np.array(force)

    def penetration_m(self, body):  # noqa: ARG002 - the protocol's
        return 0.0


@pytest.fixture
def glide(monkeypatch):
    engine = Glide()
    monkeypatch.setitem(ENGINES, "glide", lambda: engine)
    return engine


def alone(dop8):
    return ()


def test_settle_asks_the_engine_that_is_named(glide):
    body = Body.of(BOX, Pose(2.0, 3.0, 0.0, UPRIGHT))
    there = settle(body, 0.01, tuple, "glide")
    assert (there.pose, there.refusal) == (Pose(2.0, 3.0, 0.0, UPRIGHT), "")
    assert len(glide.loaded) == 1
    assert settle(body, 0.01, tuple).seconds != there.seconds


def test_the_pusher_and_the_rule_of_rest_are_every_engines(glide):
    """Closed form: pushed by 200 N until 2 m/s, then let go and slowed by friction."""
    body = Body.of(BOX, Pose(2.0, 3.0, 0.0, UPRIGHT))
    pushed = push(body, 1, alone, engine="glide")
    gained, lost = 200.0 / 5.0 - 0.5 * GRAVITY, 0.5 * GRAVITY
    expected = 2.0**2 / (2.0 * gained) + 2.0**2 / (2.0 * lost)
    assert pushed.pose.y - 3.0 == pytest.approx(expected, rel=0.05)
    assert pushed.seconds == pytest.approx(2.0 / gained + 2.0 / lost, abs=0.3)
    assert pushed.at_rest
    assert pushed.pose != push(body, 1, alone).pose
    assert push(body, 1, alone, PushSpec(20.0, 2.0, 0.5), engine="glide").displacement_m == 0.0


def test_a_world_asks_the_engine_that_is_named(glide, hand_house):
    model = HouseModel.of(hand_house)
    chair = Body.of(hand_house.assets["Chair_0"], Pose(3.75, 1.0, 0.0, UPRIGHT))
    world = World(model, [chair], (12, 4, 0), (28, 4), engine="glide")
    other = World(model, [chair], (12, 4, 0), (28, 4))
    assert world != other, "the engine is part of the state"
    assert not glide.loaded
    result = world.step(Action.PUSH_AHEAD)
    assert result.success
    assert glide.loaded
    assert result.displacement_m != other.step(Action.PUSH_AHEAD).displacement_m
    assert world.copy().engine == "glide"


def test_a_world_drops_by_the_engine_that_is_named(glide, hand_house):
    apple = Body.of(hand_house.assets["Apple_0"], Pose(3.5, 1.0, 0.0, UPRIGHT))
    model = HouseModel.of(hand_house)
    world = World(model, [apple], (12, 4, 0), (28, 4), engine="glide")
    assert world.step(Action.PICKUP).success
    assert not glide.loaded
    assert world.step(Action.DROP).success
    assert glide.loaded


def test_episodes_ask_the_engine_of_their_config(glide):
    """Spawning, outcomes and expert; a world of the episode takes the same engine by itself."""
    house = build_house(0, 0, HouseConfig(), catalogue())
    config, physics = EpisodeConfig(keep_unsolvable=True), PhysicsConfig("glide")
    (episode,) = build_episodes(house, 1, catalogue().spawnable, config, physics=physics)
    assert (episode.physics.engine, episode.physics.build) == ("glide", f"glide 1, rules {RULES}")
    assert {o.z for o in episode.obstacles} == {0.0}
    pushes = [o for one in episode.obstacles for o in one.outcomes[:4] if one.pushable]
    assert all(round(100.0 * o.seconds) == pytest.approx(100.0 * o.seconds) for o in pushes)
    world = World.of_episode(HouseModel.of(house), episode, catalogue().assets)
    assert world.engine == "glide"
    assert outcomes_of(world) == tuple(o.outcomes for o in episode.obstacles)


def test_engines_do_not_share_cached_results(glide, tmp_path, monkeypatch):
    held = ResultCache(tmp_path)
    monkeypatch.setattr("internav_data.physics.registry.result_cache", lambda: held)
    body = Body.of(BOX, Pose(0.0, 0.0, 0.001, UPRIGHT))
    results = [push(body, 0, alone, engine=name).pose for name in ("glide", default_engine().name)]
    assert held.count() == 2
    assert results[0] != results[1]
    assert push(body, 0, alone, engine="glide").pose == results[0]
    assert held.count() == 2


def test_every_engine_states_what_results_depend_on(glide):
    for name in available_engines():
        engine, solver = ENGINES[name](), get_solver(name)
        assert engine.name == solver.name == name
        assert solver.build == f"{engine.build}, rules {RULES}"
        assert engine.libraries
        assert 0.0 < engine.step_s < 0.1
        assert 0.0 <= engine.contact_margin_m == solver.contact_margin_m < math.inf


def test_an_unknown_engine_is_refused_by_name(hand_house):
    body = Body.of(BOX, Pose(0.0, 0.0, 0.001, UPRIGHT))
    with pytest.raises(UsageError, match="'no engine'; known are bullet, mujoco"):
        push(body, 0, alone, engine="no engine")
    with pytest.raises(UsageError, match="'no engine'"):
        settle(body, 0.01, tuple, "no engine")
    with pytest.raises(UsageError, match=r"physics.engine: expected one of bullet.*, got 'no eng"):
        PhysicsConfig("no engine").check()
