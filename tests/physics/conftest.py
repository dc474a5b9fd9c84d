"""Fixtures of the physics tests."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from internav_data.physics import cache

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
