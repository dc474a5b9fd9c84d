"""The dataset that ships is what `make mini` would write today."""

from __future__ import annotations

import pytest

from internav_data.core.hardware import hardware
from internav_data.dataset import load_dataset, read_manifest
from internav_data.dataset.location import MINI_FOLDER
from internav_data.generation import GenerationConfig, generate
from internav_data.physics.config import PhysicsConfig

SCENES = 4
MADE_WITH = GenerationConfig(episodes_per_scene=10, physics=PhysicsConfig("mujoco"))


@pytest.mark.slow
def test_the_generator_makes_it_today(tmp_path):
    shipped = read_manifest(MINI_FOLDER)
    if shipped.hardware != (hardware(),):
        pytest.skip("made on a machine with other arithmetic")
    generate(tmp_path / "again", MADE_WITH, SCENES, workers=1)
    made = load_dataset(tmp_path / "again")
    first = [episode for episode in load_dataset("mini") if episode.scene_id in made.scene_ids]
    assert sorted(made, key=lambda episode: episode.episode_id) == sorted(
        first, key=lambda episode: episode.episode_id
    ), "run `make mini`"
