"""Fixtures of the physics tests."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import pytest

from internav_data import physics
from internav_data.physics import cache
from internav_data.physics.engines.installed import available_engines

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))  # `holds`


@pytest.fixture
def solved(monkeypatch):
    """Scenes whose pushes were simulated, in order."""
    asked = []
    solve = cache.solve_push

    def watched(engine, scene, spec):
        asked.append(scene)
        return solve(engine, scene, spec)

    monkeypatch.setattr(cache, "solve_push", watched)
    return asked


@pytest.fixture(params=available_engines())
def engine(request):
    """Name of each engine in turn: what physics promises, it promises on every one."""
    return request.param


@pytest.fixture
def push(engine):
    """Push on an engine."""
    return partial(physics.push, engine=engine)


@pytest.fixture
def settle(engine):
    """Settle on an engine."""
    return partial(physics.settle, engine=engine)
