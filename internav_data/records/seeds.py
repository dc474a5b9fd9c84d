"""The only source of random numbers: a generator derived from (seed, purpose, scene, …)."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.random import Generator


class Purpose(IntEnum):
    """What random numbers are for. Stored data depends on these values: never renumber."""

    CATALOG = 1
    PROGRAMME = 2
    FLOOR_PLAN = 3
    DOORS = 4
    FURNITURE = 5
    MATERIALS = 6
    EPISODE = 7
    SPAWN = 8
    LOADER = 9
    WINDOWS = 10
    EVALUATION = 11
    TRAINING = 12


def generator(
    seed: int, purpose: Purpose, scene: int = 0, attempt: int = 0, episode: int = 0, draw: int = 0
) -> Generator:
    """Return the random numbers of one purpose, the same in any process and after any history."""
    key = (int(purpose), scene, attempt, episode, draw)
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
