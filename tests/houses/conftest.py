"""Shared by the tests of houses: the oracle, the catalogue and a sample of houses."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def oracle():
    """Plain checks of a house with shapely and networkx."""
    path = Path(__file__).with_name("houses_oracle.py")
    spec = importlib.util.spec_from_file_location("houses_oracle", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["houses_oracle"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def assets():
    """The catalogue."""
    from internav_data.catalog import catalogue

    return catalogue()


@pytest.fixture(scope="session")
def sample(assets):
    """Some houses of every size, by preset."""
    from internav_data.houses import HouseConfig, build_house

    return {
        preset: [
            build_house(5, scene, HouseConfig(preset=preset, rooms=str(count)), assets)
            for count in range(1, 11)
            for scene in range(3)
        ]
        for preset in ("paper", "realistic")
    }
