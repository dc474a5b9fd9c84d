"""A dataset of other hardware is compared within a millimetre, and by kinds of results."""

from dataclasses import replace

import physical
import pytest
from scenery import ASSETS, write_dataset
from test_physics import obstacle_changed, outcome_changed

from internav_data.core.hardware import hardware
from internav_data.dataset.manifest import read_manifest, write_manifest
from internav_data.verification import validate
from internav_data.verification.checked_config import CheckedConfig
from internav_data.verification.checked_layout import CheckedLayout
from internav_data.verification.findings import FindingCollector
from internav_data.verification.replay import CheckedScene, replay_episode
from internav_data.verification.shapes import Shapes

OTHER = "riscv64, arithmetic 00000000"


@pytest.fixture(scope="module")
def scenes():
    return physical.physical_scenes()


def replayed(scenes, *, same, scene=0):
    """Replay a scene's episodes as data of this hardware or of another."""
    house, episodes = scenes[scene]
    report = FindingCollector("episodes", house.scene_id)
    layout = CheckedLayout(house, Shapes(ASSETS))
    checked = CheckedScene(layout, CheckedConfig(same_hardware=same))
    for episode in episodes:
        replay_episode(checked, episode, report)
    if not same:
        report.judge_differences(OTHER)
    return report.findings("physics")


def toppled(scenes, index, action):
    """Change one outcome as if its object had not moved."""
    episode = scenes[0][1][index]
    after = {"path_steps_after": episode.obstructed_path_steps, "path_m_after": None}
    failed = {"success": False, "displacement_m": 0.0, "opened": False, "reason": "too heavy"}
    return outcome_changed(scenes, 0, index, action, **failed, **after)


NEARLY = {
    "pose": (obstacle_changed, {"z": 0.0015}),
    "time": (obstacle_changed, {"settle_s": 0.5}),
    "depth": (obstacle_changed, {"settle_penetration_m": 0.001}),
    "distance": (outcome_changed, {"action": "push_east", "displacement_m": 0.4}),
}


@pytest.mark.parametrize("case", NEARLY)
def test_small_differences_pass_on_other_hardware_alone(scenes, case):
    change, values = NEARLY[case]
    assert scenes[0][1][0].obstacles[0].z == 0.001
    nearly = change(scenes, 0, 0, **values)
    found = replayed(nearly, same=False)
    assert found.ok, found.summary()
    (note,) = found.notes
    assert note.startswith(f"made on {OTHER}: compared within 1 mm; 0 of ")
    assert not replayed(nearly, same=True).ok


def test_a_pose_beyond_a_millimetre_is_wrong_on_any_hardware(scenes):
    found = replayed(obstacle_changed(scenes, 0, 0, z=0.0022), same=False)
    assert set(found.by_predicate) == {"physics.settle-pose"}


def test_one_other_end_is_listed_and_more_are_wrong(scenes):
    once = toppled(scenes, 0, "push_east")
    assert replayed(once, same=True).total > 1
    found = replayed(once, same=False)
    assert found.ok, found.summary()
    made, listed = sorted(found.notes, reverse=True)
    assert "; 1 of " in made
    assert listed.startswith("ends otherwise here: episodes: scene-000000/0000: ")
    assert "push_east" in listed
    twice = replayed(toppled(once, 1, "push_north"), same=False)
    assert twice.by_predicate == {"physics.outcome-reason": 2}


def test_a_way_that_opens_here_alone_is_another_end(scenes):
    found = replayed(outcome_changed(scenes, 0, 0, "push_west", opened=False), same=False)
    assert found.checked["differing"] == 1


def test_the_manifest_decides_how_a_dataset_is_compared(tmp_path, scenes):
    """Datasets of this hardware alone are compared to the last bit."""
    nearly = obstacle_changed(scenes[:1], 0, 0, settle_s=0.5)
    root = tmp_path / "ds"
    manifest = write_dataset(root, nearly)
    assert read_manifest(root).hardware == (hardware(),)
    assert set(validate(root, "physics").by_predicate) == {"physics.settle-time"}
    for names in ((OTHER,), (), (hardware(), OTHER)):
        write_manifest(root, replace(manifest, hardware=names))
        found = validate(root, "physics")
        assert found.ok, found.summary()
        (note,) = found.notes
        made_on = "; ".join(names) or "hardware that is not stated"
        assert note.startswith(f"made on {made_on}: compared within 1 mm")


def test_scenes_that_this_hardware_made_are_compared_to_the_last_bit(tmp_path, scenes):
    root = tmp_path / "ds"
    nearly = obstacle_changed(scenes[:2], 0, 0, settle_s=0.5)
    manifest = write_dataset(root, nearly)
    both = tuple(sorted((hardware(), OTHER)))
    for mine, theirs in (("0:1", "1:2"), ("1:2", "0:1")):
        whose = {hardware(): mine, OTHER: theirs}
        write_manifest(root, replace(manifest, hardware=both, hardware_scenes=whose))
        found = validate(root, "physics")
        note = next(note for note in found.notes if "compared within" in note)
        assert note.startswith(f"made on {OTHER}: ")
        number = int(theirs[0])
        assert found.notes[note] == len(scenes[number][1])
        wrong = {"physics.settle-time": 1} if mine == "0:1" else {}
        assert found.by_predicate == wrong
