"""Encoders: one of the table for each sensor that an agent takes."""

from __future__ import annotations

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
