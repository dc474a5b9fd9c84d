"""Encoders: one of the table for each sensor that an agent takes."""

from __future__ import annotations

import copy
import itertools
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import nn

from internav_data.camp import agents, networks
from internav_data.camp.agents import make_agent
from internav_data.camp.agents.flat import PPOAgent
from internav_data.camp.agents.hierarchy import Hierarchy
from internav_data.camp.config import config_of, preset
from internav_data.envs.house_map import MAP_SIZE
from internav_data.envs.sensors import DEFAULT_SENSORS, sensor_names
from internav_data.records.errors import UsageError


class GridEncoder(networks.SensorEncoder):
    """Three features of a grid, learnt."""

    sensors, size = ("grid",), 3

    def __init__(self, config):
        super().__init__(config)
        self.linear = nn.Linear(4, self.size)

    def forward(self, grid):
        return self.linear(grid.flatten(2))


@pytest.fixture
def config():
    return preset("small")


@pytest.fixture
def observations(config):
    size = config.network.image_size
    return {
        "rgb": torch.randint(0, 256, (2, 3, size, size, 3), dtype=torch.uint8),
        "depth": 5.0 * torch.rand(2, 3, size, size, 1),
        "goal": torch.rand(2, 3, 2),
        "held": torch.tensor([[0, 1, 0], [1, 0, 0]]),
        "horizon": torch.tensor([[0, 1, 2], [3, 1, 1]]),
        "grid": torch.rand(2, 3, 2, 2),
    }


def test_features_are_those_of_each_sensor_side_by_side(config, observations):
    encoder = networks.Encoder(config.network)
    found = encoder(observations)
    assert found.shape == (2, 3, encoder.size)
    held, horizon = found[..., -5], found[..., -4:]
    assert torch.equal(held, observations["held"].float())
    assert torch.equal(horizon.argmax(-1), observations["horizon"])
    assert torch.equal(horizon.sum(-1), torch.ones(2, 3))
    goal = encoder.parts["goal"](observations["goal"])
    assert torch.equal(found[..., -5 - config.network.goal_embedding : -5], goal)


def test_an_encoder_of_ones_own_is_an_argument(config, observations):
    encoders = {**networks.ENCODERS, "grid": GridEncoder}
    plain = networks.Encoder(config.network, encoders=encoders)
    assert "grid" not in plain.parts, "an agent without the sensor does not pay for it"
    encoder = networks.Encoder(config.network, (*DEFAULT_SENSORS, "grid"), encoders)
    assert encoder.size == plain.size + GridEncoder.size
    encoder(observations)[..., -GridEncoder.size :].sum().backward()
    assert encoder.parts["grid"].linear.weight.grad.abs().sum() > 0.0


def test_an_agent_without_pictures_has_no_convolutions(config, observations):
    encoder = networks.Encoder(config.network, ("goal", "held", "horizon"))
    assert sorted(encoder.parts) == ["goal", "held", "horizon"]
    del observations["rgb"], observations["depth"]
    assert encoder(observations).shape == (2, 3, config.network.goal_embedding + 1 + 4)


def test_an_agent_need_not_take_the_goal(config, observations):
    class Blind(PPOAgent):
        sensors = ("held", "horizon")

    agent = Blind(config)
    shown = {name: observations[name][0] for name in agent.sensors}
    state, begun = agent.initial_state(3), torch.ones(3, dtype=torch.bool)
    assert agent.act(shown, state, begun, None).action.shape == (3,)
    assert agent.value(shown, state).shape == (3,)


@pytest.mark.parametrize("kind", [PPOAgent, Hierarchy])
def test_the_sensors_of_an_agent_of_ones_own_are_taken(config, kind):
    class Mine(kind):
        sensors = (*DEFAULT_SENSORS, "ids")

    assert Mine(config).sensors == Mine.sensors


def test_the_goal_is_far_from_a_place_a_step_beside_it(config):
    """In the embedding of a new encoder: the distance alone would tell them apart by a tenth."""
    encoder = networks.GoalEncoder(config.network)
    bearings = torch.linspace(-3.0, 3.0, 9)
    at, beside, far, farther = (
        encoder(torch.stack([torch.full((9,), metres), bearings], -1).unsqueeze(0))
        for metres in (0.0, 0.25, 3.0, 3.25)
    )
    step = (farther - far).norm(dim=-1)
    assert ((beside - at).norm(dim=-1) > 4.0 * step).all()


def test_metres_ahead_and_to_the_left_are_inputs_of_the_goal(config):
    encoder = networks.GoalEncoder(config.network)
    with torch.no_grad():
        encoder.linear.weight.zero_()
        encoder.linear.weight[0, 4] = encoder.linear.weight[1, 5] = 1.0
    found = encoder(torch.tensor([[[2.0, torch.pi / 6]]]))[0, 0]
    expected = torch.tensor([3.0**0.5, 1.0]) / config.network.goal_scale_m
    torch.testing.assert_close(found[:2], expected)


def test_a_new_scale_leaves_values_and_nears_the_returns_deviation():
    head, out = networks.ValueHead(5), torch.randn(6, 4, 5)
    before = head(out)
    for _ in range(30):
        head.note_returns(torch.tensor(9.0))
    torch.testing.assert_close(head(out), before)
    assert head.scale.item() == pytest.approx(3.0, rel=1e-2)
    head.note_returns(torch.tensor(0.0))
    for _ in range(200):
        head.note_returns(torch.tensor(0.0))
    assert head.scale.item() == pytest.approx(0.1), "a rollout without reward divides by no zero"


@pytest.mark.parametrize("scale", [1.0, 4.0])
def test_a_fitted_critic_is_the_ridge_regression_of_numpy(scale):
    """On two ranks that have half of the steps each it is the same."""
    rng = np.random.default_rng(0)
    head, out = networks.ValueHead(3), torch.from_numpy(rng.normal(size=(8, 5, 3))).float()
    returns = out @ torch.tensor([1.0, -2.0, 0.5]) + 4.0
    returns += torch.from_numpy(rng.normal(size=(8, 5))).float() * 0.1
    head.scale.fill_(scale)
    start = torch.cat([head.weight[0], head.bias]).detach().double().numpy() * scale
    inputs = np.hstack([out.reshape(-1, 3).double().numpy(), np.ones((40, 1))])
    gram = inputs.T @ inputs
    penalty = 0.01 * np.trace(gram) / 4
    rest = returns.reshape(-1).double().numpy() - inputs @ start
    stacked = np.vstack([inputs, np.sqrt(penalty) * np.eye(4)])
    step = np.linalg.lstsq(stacked, np.hstack([rest, np.zeros(4)]), rcond=None)[0]
    halves = copy.deepcopy(head)
    head.fit(out, returns, lambda tensor: tensor)
    found = torch.cat([head.weight[0], head.bias]).detach().double().numpy() * scale
    np.testing.assert_allclose(found, start + step, rtol=1e-4)
    sums: list[torch.Tensor] = []
    for part in (slice(0, 4), slice(4, 8)):
        copy.deepcopy(halves).fit(out[part], returns[part], lambda t: sums.append(t.clone()) or t)
    totals = iter([sums[0] + sums[2], sums[1] + sums[3]])
    halves.fit(out[:4], returns[:4], lambda _: next(totals))
    torch.testing.assert_close(halves.weight, head.weight)
    torch.testing.assert_close(halves.bias, head.bias)


def test_the_maps_encoder_sees_every_channel():
    """A change of any value that an agent must tell apart changes the features."""
    torch.manual_seed(0)
    network = replace(
        preset("small").network, observation="map", map_occlusion=True, privileged=("movable",)
    )
    encoder = networks.MapEncoder(network)
    middle = MAP_SIZE // 2
    here = (0, 0, slice(None), middle, middle)
    empty = torch.zeros(1, 1, 6, MAP_SIZE, MAP_SIZE, dtype=torch.uint8)
    chair = (45, 3, 4, 0, 0, 1)
    seen = {"nothing": empty}
    others = [(45, 2, 4, 0, 0, 1), (45, 4, 4, 0, 0, 1), (60, 3, 4, 0, 0, 1), (45, 3, 8, 0, 0, 1)]
    others += [(45, 3, 4, 1, 0, 1), (45, 3, 4, 0, 0, 0), (0, 5, 0, 0, 0, 0)]
    others += [(45, 3, 4, 0, 1 << bit, 1) for bit in range(6)]
    for values in (chair, *others):
        seen[values] = empty.clone()
        seen[values][here] = torch.tensor(values, dtype=torch.uint8)
    found = [encoder(shown) for shown in seen.values()]
    assert all(each.shape == (1, 1, encoder.size) for each in found)
    apart = [(a - b).abs().max() for a, b in itertools.combinations(found, 2)]
    assert min(apart) > 1e-4


def test_an_agent_takes_a_map_in_place_of_pictures():
    network = replace(preset("small").network, observation="map", privileged=("mass",))
    config = replace(preset("small"), network=network)
    for method in ("ppo", "camp"):
        agent = make_agent(method, config)
        assert sensor_names(agent.sensors) == {"map", "goal", "held", "horizon"}
        assert "mass" in agent.sensors[0].description
        assert sensor_names(make_agent(method, preset("small")).sensors) == {*DEFAULT_SENSORS}
    with pytest.raises(UsageError, match="nie sees objects in pictures"):
        make_agent("nie", config)


def test_an_agent_of_ones_own_that_takes_no_map_is_refused(monkeypatch):
    class Blind(PPOAgent):
        def __init__(self, config):
            super().__init__(replace(config, network=preset("small").network))

    method = agents.Method(Blind, "takes pictures whatever it is asked for")
    monkeypatch.setitem(agents.AGENTS, "blind", method)
    config = replace(preset("small"), network=replace(preset("small").network, observation="map"))
    with pytest.raises(UsageError, match="'blind' takes no map"):
        make_agent("blind", config)


@pytest.mark.parametrize("setting", ["map_occlusion=true", 'privileged=["mass"]'])
def test_pictures_are_given_no_settings_of_maps(setting):
    with pytest.raises(UsageError, match="pictures have no use for it"):
        config_of("small", overrides=[f"network.{setting}"])
    assert config_of("small", overrides=["network.observation=map", f"network.{setting}"])
