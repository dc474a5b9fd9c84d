"""Encoders: one of the table for each sensor that an agent takes."""

from __future__ import annotations

import copy

import numpy as np
import pytest
import torch
from torch import nn

from internav_data.camp import networks
from internav_data.camp.config import preset
from internav_data.envs.sensors import DEFAULT_SENSORS


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


def test_a_new_sensor_needs_a_row_of_the_table_alone(config, observations, monkeypatch):
    monkeypatch.setitem(networks.ENCODERS, "grid", GridEncoder)
    plain = networks.Encoder(config.network)
    assert "grid" not in plain.parts, "an agent without the sensor does not pay for it"
    encoder = networks.Encoder(config.network, (*DEFAULT_SENSORS, "grid"))
    assert encoder.size == plain.size + GridEncoder.size
    encoder(observations)[..., -GridEncoder.size :].sum().backward()
    assert encoder.parts["grid"].linear.weight.grad.abs().sum() > 0.0


def test_an_agent_without_pictures_has_no_convolutions(config, observations):
    encoder = networks.Encoder(config.network, ("goal", "held", "horizon"))
    assert sorted(encoder.parts) == ["goal", "held", "horizon"]
    del observations["rgb"], observations["depth"]
    assert encoder(observations).shape == (2, 3, config.network.goal_embedding + 1 + 4)


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
