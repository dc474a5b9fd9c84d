"""Fixtures of the physics tests."""

from __future__ import annotations

import pytest

from internav_data.physics.engines.bullet import Bullet


@pytest.fixture
def solved(monkeypatch):
    """Scenes that Bullet was asked to push in, in order."""
    asked = []
    solve = Bullet.push

    def watched(self, scene, spec):
        asked.append(scene)
        return solve(self, scene, spec)

    monkeypatch.setattr(Bullet, "push", watched)
    return asked
