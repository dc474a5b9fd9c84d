"""A second engine is an addition: `settle`, `push` and `World` take it by its name."""

import math

import pytest
from builders import UPRIGHT, crate

from internav_data.catalog import catalogue
from internav_data.episodes import EpisodeConfig, build_episodes
from internav_data.episodes.outcomes import outcomes_of
from internav_data.geometry import centre_of_mass
from internav_data.houses import HouseConfig, build_house
from internav_data.physics import (
    ENGINES,
    Body,
    PushSolution,
    SettleSolution,
    cache_disabled,
    get_engine,
    push,
    settle,
)
from internav_data.physics.engines.bullet import bullet
from internav_data.physics.result_cache import ResultCache
from internav_data.physics.sweep import sweep_recorder
from internav_data.records import Pose
from internav_data.records.errors import UsageError
from internav_data.world import Action, HouseModel, World

BOX = crate("Box_0", (0.4, 0.4, 0.4), mass_kg=5.0, friction=0.5)


class Shift:
    """An engine without physics: a push shifts the first body 0.3 m, unless others are near."""

    name, build, rules = "shift", "shift 1, rules 1", 1
    libraries = ("numpy",)
    contact_margin_m = 0.0

    def __init__(self):
        self.solved = []

    def settle(self, scene):
        self.solved.append(scene)
        return SettleSolution(Pose(0.0, 0.0, 0.0, UPRIGHT), 0.25, True, 0.0, 0.0)

    def push(self, scene, spec):
        self.solved.append(scene)
        body = scene.bodies[0]
        far = 0.3 if spec.force_n and len(scene.bodies) == 1 else 0.0
        end = Pose(body.pose.x + far, body.pose.y, body.pose.z, body.pose.quaternion)
        recorder = sweep_recorder(body.asset, 2)
        x, y, z = centre_of_mass(body.asset)
        for pose in (body.pose, end):
            recorder.follow((pose.x + x, pose.y + y, pose.z + z), pose.quaternion)
        return PushSolution((end,), (recorder.dop8,), (recorder.path,), 0.5, True)


@pytest.fixture
def shift(monkeypatch):
    engine = Shift()
    monkeypatch.setitem(ENGINES, "shift", lambda: engine)
    return engine


def alone(dop8):
    return ()


def test_settle_asks_the_engine_that_is_named(shift):
    there = settle(Body.of(BOX, Pose(2.0, 3.0, 0.0, UPRIGHT)), 0.01, tuple, "shift")
    assert (there.pose, there.seconds) == (Pose(2.0, 3.0, 0.0, UPRIGHT), 0.25)
    assert len(shift.solved) == 1
    assert settle(Body.of(BOX, Pose(2.0, 3.0, 0.0, UPRIGHT)), 0.01, tuple).seconds != 0.25


def test_push_asks_the_engine_that_is_named(shift):
    body = Body.of(BOX, Pose(2.0, 3.0, 0.0, UPRIGHT))
    pushed = push(body, 1, alone, engine="shift")
    assert pushed.pose == Pose(2.0, 3.3, 0.0, UPRIGHT)
    assert (pushed.displacement_m, pushed.seconds) == (0.3, 0.5)
    assert push(body, 1, alone).displacement_m != 0.3


def test_a_world_asks_the_engine_that_is_named(shift, hand_house):
    model = HouseModel.of(hand_house)
    chair = Body.of(hand_house.assets["Chair_0"], Pose(3.75, 1.0, 0.0, UPRIGHT))
    world = World(model, [chair], (12, 4, 0), (28, 4), engine="shift")
    other = World(model, [chair], (12, 4, 0), (28, 4))
    assert world != other, "the engine is part of the state"
    result = world.step(Action.PUSH_AHEAD)
    assert result.success
    assert (result.displacement_m, result.seconds) == (0.3, 0.5)
    assert world.items[result.target].pose.x == 4.05
    assert world.copy().engine == "shift"


def test_a_world_drops_by_the_engine_that_is_named(shift, hand_house):
    apple = Body.of(hand_house.assets["Apple_0"], Pose(3.5, 1.0, 0.0, UPRIGHT))
    model = HouseModel.of(hand_house)
    world = World(model, [apple], (12, 4, 0), (28, 4), engine="shift")
    assert world.step(Action.PICKUP).success
    assert world.step(Action.DROP).seconds == 0.25


def test_episodes_ask_the_engine_of_their_config(shift):
    """Spawning, outcomes and expert; a world of the episode takes the same engine by itself."""
    house = build_house(0, 0, HouseConfig(), catalogue())
    config = EpisodeConfig(engine="shift", keep_unsolvable=True)
    (episode,) = build_episodes(house, 1, catalogue().spawnable, config)
    assert (episode.physics.engine, episode.physics.build) == ("shift", "shift 1, rules 1")
    assert {o.settle_s for o in episode.obstacles} == {0.25}
    pushes = [o for one in episode.obstacles for o in one.outcomes[:4] if one.pushable]
    assert {o.seconds for o in pushes} == {0.5}
    world = World.of_episode(HouseModel.of(house), episode, catalogue().assets)
    assert world.engine == "shift"
    assert outcomes_of(world) == tuple(o.outcomes for o in episode.obstacles)


def test_engines_do_not_share_cached_results(shift, tmp_path, monkeypatch):
    held = ResultCache(tmp_path)
    monkeypatch.setattr("internav_data.physics.registry.result_cache", lambda: held)
    body = Body.of(BOX, Pose(0.0, 0.0, 0.001, UPRIGHT))
    results = [push(body, 0, alone, engine=name).pose for name in ("shift", "bullet")]
    assert held.count() == 2
    assert results[0] != results[1]
    assert push(body, 0, alone, engine="shift").pose == results[0]
    assert held.count() == 2


def test_every_engine_states_what_results_depend_on(shift):
    for name in ENGINES:
        cached = get_engine(name)
        with cache_disabled():
            engine = get_engine(name)
        assert engine.name == name
        assert f"rules {engine.rules}" in engine.build
        assert engine.libraries
        assert 0.0 <= engine.contact_margin_m < math.inf
        stated = ("name", "build", "rules", "libraries", "contact_margin_m")
        assert all(getattr(cached, key) == getattr(engine, key) for key in stated)
    assert bullet().contact_margin_m == 0.001


def test_an_unknown_engine_is_refused_by_name(hand_house):
    body = Body.of(BOX, Pose(0.0, 0.0, 0.001, UPRIGHT))
    with pytest.raises(UsageError, match="'no engine'; known are bullet"):
        push(body, 0, alone, engine="no engine")
    with pytest.raises(UsageError, match="'no engine'"):
        settle(body, 0.01, tuple, "no engine")
    with pytest.raises(UsageError, match=r"episodes.engine: expected one of bullet, got 'no eng"):
        EpisodeConfig(engine="no engine").check()
