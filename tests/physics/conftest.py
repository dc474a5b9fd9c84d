"""Fixtures of the physics tests."""

from __future__ import annotations

import pytest

from internav_data.physics import cache


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
