"""Engines in tests: Bullet is absent where it has no wheel, which is all but CPython 3.11 on Linux.

There the tests' default is MuJoCo, and what is about Bullet itself is skipped: a test by
`bullet_only`, a file of tests by importing with `of_bullet`.
"""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path

import pytest

from internav_data.physics import engines
from internav_data.physics.engines.installed import available_engines

HAS_BULLET = "bullet" in available_engines()
NO_BULLET = "Bullet is not installed: pybullet has no wheel for this Python"
bullet_only = pytest.mark.skipif(not HAS_BULLET, reason=NO_BULLET)

if not HAS_BULLET:  # in this process before anybody else has imported it, and in those it starts
    engines.DEFAULT_ENGINE = "mujoco"
    paths = [str(Path(__file__).parent / "without_bullet"), os.environ.get("PYTHONPATH")]
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, paths))


def of_bullet(name):
    """Module that imports Bullet; the file of tests that asks for it is skipped without."""
    if not HAS_BULLET:
        pytest.skip(NO_BULLET, allow_module_level=True)
    return import_module(name)


def default_engine():
    """Engine that is taken where none is named."""
    return engines.ENGINES[engines.DEFAULT_ENGINE]()
