"""A small generated dataset, and results made by hand."""

from __future__ import annotations

import pytest

from internav_data.dataset import load_dataset
from internav_data.evaluation.archive import About, Evaluation
from internav_data.evaluation.metrics import EpisodeResult
from internav_data.generation import generate, load_config


@pytest.fixture(scope="session")
def played_data(tmp_path_factory):
    """Four houses of one and two rooms, four episodes each; scene 0 is val, scene 1 test."""
    out = tmp_path_factory.mktemp("camp") / "data"
    config = load_config(overrides=["episodes_per_scene=4", "house.rooms=1-2"])
    generate(out, config, 4, workers=1)
    return load_dataset(out)


@pytest.fixture(scope="session")
def row():
    """Make a result: a success on a blocked two-room episode unless told otherwise."""

    def make(number=0, scene=0, **changes):
        said = {
            "episode_id": f"scene-{scene:06d}/{number:04d}", "scene_id": f"scene-{scene:06d}",
            "room_count": 2, "obstacle_count": 1, "mode": "blocked", "success": True, "steps": 40,
            "distance_m": 0.0, "shortest_path_m": 5.0, "path_m": 6.25, "spl": 0.8, "sts": 0.5,
            "pushes_tried": 0, "pushes_done": 0, "picks_tried": 0, "picks_done": 0,
            "drops_tried": 0, "drops_done": 0, "interaction_m": 0.0, "openings": 0, "closings": 0,
            "reward_sum": 10.0, "actions": (11,),
        }  # fmt: skip
        return EpisodeResult(**(said | changes))

    return make


@pytest.fixture(scope="session")
def evaluation():
    """Make an evaluation of some results."""

    def make(results, name="camp", **changes):
        said = {"method": name, "dataset": "d", "split": "test", "seed": 0, "max_steps": 500}
        return Evaluation(About(name=name, **(said | changes)), tuple(results))

    return make
