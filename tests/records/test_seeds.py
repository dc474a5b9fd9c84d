"""Keys of random numbers: data and runs depend on them, so none may change."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

from internav_data.records import (
    EvaluationStream,
    FloorPlanStream,
    LoaderStream,
    ProgrammeStream,
    Purpose,
    SceneKey,
    TrainingStream,
    generator,
    seeds,
)

NUMBERS = {
    Purpose: {
        "CATALOG": 1,
        "PROGRAMME": 2,
        "FLOOR_PLAN": 3,
        "DOORS": 4,
        "FURNITURE": 5,
        "MATERIALS": 6,
        "EPISODE": 7,
        "SPAWN": 8,
        "LOADER": 9,
        "WINDOWS": 10,
        "EVALUATION": 11,
        "TRAINING": 12,
    },
    ProgrammeStream: {"COUNTS": 0, "ROOMS": 1},
    FloorPlanStream: {"CANDIDATES": 0, "CEILING": 1},
    LoaderStream: {"ROWS": 0, "HOUSES": 1, "EPISODES": 2},
    EvaluationStream: {"ACTIONS": 0, "SUBSET": 1, "BOOTSTRAP": 2},
    TrainingStream: {
        "ACTIONS": 0,
        "MINIBATCHES": 1,
        "PARAMETERS": 2,
        "EPISODES": 3,
        "AUXILIARY": 4,
        "TORCH": 5,
    },
}
"""Numbers as they were released: append only."""


@pytest.mark.parametrize("enum", NUMBERS, ids=lambda enum: enum.__name__)
def test_no_number_was_changed(enum):
    numbers = {name: int(member) for name, member in enum.__members__.items()}
    assert NUMBERS[enum].items() <= numbers.items()
    assert len(set(numbers.values())) == len(numbers), "two names share their random numbers"


def test_every_enum_of_the_module_is_listed():
    enums = {value for _, value in inspect.getmembers(seeds, inspect.isclass)}
    assert {enum for enum in enums if issubclass(enum, int)} - {seeds.IntEnum} == set(NUMBERS)


def test_every_part_of_the_key_counts():
    keys = [(0,) * 4, (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)]
    firsts = {float(generator(0, Purpose.EPISODE, *key).random()) for key in keys}
    assert len(firsts) == len(keys)
    assert float(generator(0, Purpose.SPAWN).random()) not in firsts
    assert float(generator(1, Purpose.EPISODE).random()) not in firsts


def test_a_scene_key_is_the_key_written_out():
    key = SceneKey(seed=3, scene=7, attempt=2)
    ours = key.generator(Purpose.FURNITURE, episode=1, draw=4).random(5)
    plain = np.random.Generator(
        np.random.PCG64(np.random.SeedSequence(3, spawn_key=(5, 7, 2, 1, 4)))
    )
    assert ours.tolist() == plain.random(5).tolist()
