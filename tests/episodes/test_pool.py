"""Obstacles are drawn uniformly over the assets, or by weights of their types."""

from collections import Counter

import builders
import numpy as np
import pytest

from internav_data.catalog import catalogue
from internav_data.episodes import EpisodeConfig
from internav_data.episodes.balance import BALANCE_WEIGHTS
from internav_data.episodes.config import check_types
from internav_data.episodes.pool import ObstaclePool
from internav_data.records.errors import UsageError

ASSETS = [
    builders.crate(f"{kind}_{number}", (0.3, 0.3, 0.3), mass_kg=1.0)
    for kind, count in (("Box", 3), ("Pot", 1), ("Sofa", 2))
    for number in range(1, count + 1)
]


def test_without_weights_draws_are_those_of_uniform_numbers():
    pool = ObstaclePool.of(ASSETS, EpisodeConfig())
    drawn = [pool.draw(np.random.default_rng(k)) for k in range(50)]
    assert drawn == [ASSETS[int(np.random.default_rng(k).integers(6))] for k in range(50)]
    assert pool.shares() == {"Box": 0.5, "Pot": 0.166667, "Sofa": 0.333333}


def test_weights_are_those_of_each_asset_of_a_type():
    pool = ObstaclePool.of(ASSETS, EpisodeConfig(asset_weights={"Sofa": 3.0, "Pot": 0.0}))
    assert pool.shares() == {"Box": 0.333333, "Pot": 0.0, "Sofa": 0.666667}
    rng = np.random.default_rng(0)
    drawn = Counter(pool.draw(rng).asset_id for _ in range(9000))
    assert "Pot_1" not in drawn
    for asset_id, count in drawn.items():
        assert count == pytest.approx(3000 if asset_id.startswith("Sofa") else 1000, rel=0.1)


def test_balance_multiplies_the_weights():
    spawnable = catalogue().spawnable
    uniform = ObstaclePool.of(spawnable, EpisodeConfig()).shares()
    balanced = ObstaclePool.of(spawnable, EpisodeConfig(balance=True)).shares()
    assert set(BALANCE_WEIGHTS) == set(uniform)
    total = sum(share * BALANCE_WEIGHTS[kind] for kind, share in uniform.items())
    for kind, share in balanced.items():
        expected = uniform[kind] * BALANCE_WEIGHTS[kind] / total
        assert share == pytest.approx(expected, abs=1e-5)
    both = EpisodeConfig(balance=True, asset_weights={"Sofa": 0.0})
    assert ObstaclePool.of(spawnable, both).shares()["Sofa"] == 0.0


def test_unknown_types_and_weights_of_nothing_are_refused():
    types = [asset.type for asset in ASSETS]
    check_types({"Sofa": 2.0}, types)
    with pytest.raises(UsageError, match="no obstacle has the type 'Sofas'; did you mean Sofa"):
        check_types({"Sofas": 2.0}, types)
    with pytest.raises(UsageError, match="the type 'Zebra'; expected Box, Pot, Sofa"):
        check_types({"Zebra": 2.0}, types)
    nothing = EpisodeConfig(asset_weights={"Box": 0.0, "Pot": 0.0, "Sofa": 0.0})
    with pytest.raises(UsageError, match="a weight above 0 for one type at least, got 0 for all"):
        ObstaclePool.of(ASSETS, nothing)
