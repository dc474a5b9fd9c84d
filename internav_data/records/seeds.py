"""The only source of random numbers: a generator derived from (seed, purpose, scene, …).

A purpose with several uses has sub-streams, whose id takes the place of one word of the key:

=========== ================== ========================
purpose     sub-streams        word that holds their id
=========== ================== ========================
PROGRAMME   `ProgrammeStream`  `episode`
FLOOR_PLAN  `FloorPlanStream`  `draw`
LOADER      `LoaderStream`     `attempt`
EVALUATION  `EvaluationStream` `attempt`
TRAINING    `TrainingStream`   `attempt`
=========== ================== ========================

Stored data and training runs depend on every number here. Never renumber: append.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.random import Generator


class Purpose(IntEnum):
    """Use of random numbers: the first word of a generator's key."""

    CATALOG = 1
    """Assets: `scene` is the number of the asset type, `episode` that of the asset."""
    PROGRAMME = 2
    """Rooms of a house: see `ProgrammeStream`."""
    FLOOR_PLAN = 3
    """Floor plan of a house: see `FloorPlanStream`."""
    DOORS = 4
    """Doors beyond those of the plan, their kinds, widths and positions."""
    FURNITURE = 5
    """Furniture of one room: `draw` is the room's id."""
    MATERIALS = 6
    """Floor and wall materials of a house."""
    EPISODE = 7
    """Start and goal of an episode: `draw` counts how often it was drawn again."""
    SPAWN = 8
    """Obstacles of an episode: `draw` as for `EPISODE`."""
    LOADER = 9
    """Order of episodes: see `LoaderStream`."""
    WINDOWS = 10
    """Windows of a house."""
    EVALUATION = 11
    """Evaluation of policies: see `EvaluationStream`."""
    TRAINING = 12
    """Training of agents: see `TrainingStream`."""
    OBSTACLE_ATTRIBUTES = 13
    """Hidden attributes of the obstacles of an episode: key as for `SPAWN`."""
    FURNITURE_ATTRIBUTES = 14
    """Hidden attributes of the furniture of a house."""
    CLUTTER = 15
    """Small things in one room: `draw` is the room's id."""


class ProgrammeStream(IntEnum):
    """Sub-stream ids within `Purpose.PROGRAMME`, passed as `episode`."""

    COUNTS = 0
    """Offset of the sequence of room counts."""
    ROOMS = 1
    """Types and areas of the rooms of a scene."""
    SIZES = 2
    """Offset of the sequence of sizes of houses."""


class FloorPlanStream(IntEnum):
    """Sub-stream ids within `Purpose.FLOOR_PLAN`, passed as `draw`."""

    CANDIDATES = 0
    """Candidate plans and their door trees."""
    CEILING = 1
    """Height of the ceiling."""


class LoaderStream(IntEnum):
    """Sub-stream ids within `Purpose.LOADER`, passed as `attempt`."""

    ROWS = 0
    """Order of all rows, or rows to sample."""
    HOUSES = 1
    """Order of runs of episodes, each within one house."""
    EPISODES = 2
    """Order of the episodes within one house."""


class EvaluationStream(IntEnum):
    """Sub-stream ids within `Purpose.EVALUATION`, passed as `attempt`."""

    ACTIONS = 0
    """Actions of a policy in one episode."""
    SUBSET = 1
    """Episodes to evaluate where not all are."""
    BOOTSTRAP = 2
    """Resamples of a bootstrap interval."""


class TrainingStream(IntEnum):
    """Sub-stream ids within `Purpose.TRAINING`, passed as `attempt`."""

    ACTIONS = 0
    """Actions of one environment; `scene` is its index."""
    MINIBATCHES = 1
    """Order of environments in the minibatches."""
    PARAMETERS = 2
    """Initial parameters of the networks."""
    EPISODES = 3
    """Order of episodes; `draw` is the stage."""
    AUXILIARY = 4
    """Obstacle that an auxiliary episode is about."""
    TORCH = 5
    """Torch's own random numbers of an update; `scene` is the stage, `draw` the update."""


def generator(
    seed: int, purpose: Purpose, scene: int = 0, attempt: int = 0, episode: int = 0, draw: int = 0
) -> Generator:
    """Return the random numbers of one purpose, the same in any process and after any history.

    Parameters
    ----------
    seed
        Seed of a dataset, a run or an evaluation.
    purpose
        Use of the numbers. No two purposes share any.
    scene, attempt, episode, draw
        The rest of the key. Where a purpose has sub-streams, one of them holds a sub-stream id.
    """
    key = (int(purpose), int(scene), int(attempt), int(episode), int(draw))
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))


@dataclass(frozen=True, slots=True)
class SceneKey:
    """Key of one scene's random numbers: everything about its house derives from it."""

    seed: int
    """Seed of the dataset."""
    scene: int
    """Index of the scene, from 0."""
    attempt: int = 0
    """Count of failed attempts before this one."""

    def generator(self, purpose: Purpose, *, episode: int = 0, draw: int = 0) -> Generator:
        """Return this scene's random numbers for one purpose; see the function `generator`."""
        return generator(self.seed, purpose, self.scene, self.attempt, episode, draw)
