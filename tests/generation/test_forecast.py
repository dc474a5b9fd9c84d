"""A dry run answers within its time, whatever the settings ask of an episode."""

from __future__ import annotations

import pytest

from internav_data.generation import forecast as module
from internav_data.generation import load_config
from internav_data.generation.forecast import _TimeUpError
from internav_data.records.errors import QuarantineError

ONE_ROOM = load_config(overrides=["house.rooms=1", "episodes_per_scene=1"])


def test_a_scene_that_is_never_finished_is_given_up(monkeypatch):
    monkeypatch.setattr(module, "SAMPLE_S", 0.0)
    with pytest.raises(QuarantineError, match="the first was not finished after 0 s; settings"):
        module.forecast(ONE_ROOM, 5, 1)


def test_it_is_measured_on_the_scenes_that_were_made_in_time(monkeypatch):
    made = []

    def late(until):
        if len(made) >= 6:  # two scenes, each three times at the most
            raise _TimeUpError

    def build_scene(scene, *given, **more):
        made.append(scene)
        return original(scene, *given, **more)

    original = module.build_scene
    monkeypatch.setattr(module, "build_scene", build_scene)
    monkeypatch.setattr(module, "_check_time", late)
    found = module.forecast(ONE_ROOM, 40, 1)
    assert found.sampled_scenes == 2
    assert found.scenes == 40
    assert found.quarantined_share == 0.0
