"""Second opinions that are not true are found: by their row, by poses, and by asking again."""

from dataclasses import replace

import physical
import pytest
from scenery import ASSETS, write_dataset
from test_physics import changed, outcome_changed

from internav_data.dataset import read_manifest
from internav_data.physics.engines import DEFAULT_ENGINE, ENGINES, MODULES, second_engine
from internav_data.records.errors import MissingEngineError, UsageError
from internav_data.verification import validate
from internav_data.verification.agreement import check_agreement
from internav_data.verification.checked_config import CheckedConfig, checked_config
from internav_data.verification.findings import FindingCollector
from internav_data.verification.scenes import check_scene
from internav_data.verification.shapes import Shapes

pytest.importorskip("pybullet")
pytest.importorskip("mujoco")
OTHER = second_engine(DEFAULT_ENGINE)
ASKED = CheckedConfig(engine=DEFAULT_ENGINE, cross_check=True)


@pytest.fixture(scope="module")
def scenes():
    return physical.physical_scenes(other_engine=OTHER)


def by_row(episode):
    report = FindingCollector("episodes", episode.scene_id)
    check_agreement(episode, report)
    return set(report.by_predicate)


def by_asking(scenes, scene, index, config=ASKED):
    house, episodes = scenes[scene]
    return check_scene(house, episodes[index : index + 1], Shapes(ASSETS), "", config)


def test_true_ones_are_valid(scenes):
    seen = [o.agrees for _, es in scenes for e in es for b in e.obstacles for o in b.outcomes]
    assert {None, True} <= set(seen)
    for scene, (_, episodes) in enumerate(scenes):
        for index, episode in enumerate(episodes):
            assert by_row(episode) == set()
            report = by_asking(scenes, scene, index)
            assert not report.by_predicate
            assert not any("opinions" in note for note in report.notes)


OPENS = (0, 0, "push_west", 0)
"""A bar pushed out of a door: both engines move it, and the row does not say if it opens."""
ROWS = {
    "null": ({"agrees": None}, "outcomes.agrees"),
    "no end, and agrees": ({"other_pose": None}, "outcomes.agrees"),
    "pick": ((0, 0, "pick", 0, {"agrees": True}), "outcomes.agrees"),
    "end of a pick": ((0, 0, "pick", 0, {"other_pose": "pose"}), "outcomes.other_pose"),
    "lengthened": ((0, 1, "push_north", 0, {"agrees": False}), "outcomes.agrees"),
    "too heavy": ((2, 0, "push_north", 0, {"agrees": False}), "outcomes.agrees"),
    "one moves it": ((2, 0, "push_north", 0, {"other_pose": "pose"}), "outcomes.agrees"),
}


@pytest.mark.parametrize("case", ROWS)
def test_a_row_that_contradicts_itself_is_found(scenes, case):
    changes, predicate = ROWS[case]
    if isinstance(changes, dict):
        changes = (*OPENS, changes)
    scene, index, action, number, values = changes
    values = {k: scenes[0][1][0].obstacles[0].pose if v == "pose" else v for k, v in values.items()}
    wrong = outcome_changed(scenes, scene, index, action, number, **values)
    assert f"schema.episodes.{predicate}" in by_row(wrong[scene][1][index])


def test_what_an_episode_says_of_all_is_found(scenes):
    episode = scenes[0][1][0]
    assert episode.agreed is True
    for agreed in (False, None):
        assert by_row(replace(episode, agreed=agreed)) == {"schema.episodes.agreed"}
    same = replace(episode.physics, other_engine=episode.physics.engine)
    assert by_row(replace(episode, physics=same)) == {"schema.episodes.physics.other_engine"}
    unnamed = replace(episode.physics, other_engine=None, other_build=None)
    assert "schema.episodes.outcomes.agrees" in by_row(replace(episode, physics=unnamed))


def test_an_end_too_near_for_a_success_is_found_by_its_pose(scenes):
    bar = scenes[0][1][0].obstacles[0]
    near = replace(bar.pose, x=bar.x + 0.04)
    wrong = outcome_changed(scenes, *OPENS, other_pose=near)
    house, episodes = wrong[0]
    assert "outcome.other-displacement" in check_scene(house, episodes, Shapes(ASSETS)).by_predicate


@pytest.mark.parametrize("case", ["agrees", "other-pose"])
def test_what_another_engine_never_said_is_found_by_asking(scenes, case):
    if case == "agrees":
        changes = {"agrees": False}
    else:
        pose = scenes[0][1][0].obstacles[0].outcomes[2].other_pose
        changes = {"other_pose": replace(pose, y=round(pose.y + 0.01, 4))}
    wrong = outcome_changed(scenes, *OPENS, **changes)
    wrong = changed(wrong, 0, 0, agreed=case != "agrees")
    assert by_row(wrong[0][1][0]) == set()
    assert set(by_asking(wrong, 0, 0).by_predicate) == {f"physics.outcome-{case}"}


def test_another_engine_than_the_config_names_is_found(scenes):
    for config, predicate in (
        (replace(ASKED, engine=OTHER), "physics.engine"),
        (replace(ASKED, cross_check=False), "physics.cross-check"),
    ):
        assert set(by_asking(scenes, 1, 0, config).by_predicate) == {predicate}


def test_second_opinions_that_cannot_be_asked_here_are_a_note(scenes, monkeypatch):
    monkeypatch.setitem(MODULES, OTHER, "nowhere_to_be_found")
    report = by_asking(scenes, 1, 0)
    assert not report.by_predicate
    assert any(f"{OTHER} is not installed" in note for note in report.notes)
    monkeypatch.undo()
    old = replace(scenes[1][1][0].physics, other_build="an older one")
    report = by_asking(changed(scenes, 1, 0, physics=old), 1, 0)
    assert any("second opinions of an older one" in note for note in report.notes)


def test_another_engine_is_asked_for_a_dataset_that_is_there(tmp_path, scenes):
    """The share is that of `agrees`; nothing is written, and a difference is no finding."""
    config = {"physics": {"engine": DEFAULT_ENGINE, "cross_check": True}}
    write_dataset(tmp_path / "ds", scenes, config=config)
    before = {p: p.read_bytes() for p in (tmp_path / "ds").rglob("*") if p.is_file()}
    findings = validate(tmp_path / "ds", "physics", engine=OTHER)
    assert findings.ok, findings.summary()
    assert {p: p.read_bytes() for p in (tmp_path / "ds").rglob("*") if p.is_file()} == before
    stored = [
        (b.type, o)
        for _, episodes in scenes
        for e in episodes
        for b in e.obstacles
        for o in b.outcomes
        if o.agrees is not None
    ]
    whole = findings.agreement["all"]
    assert (whole.agree, whole.asked) == (sum(o.agrees for _, o in stored), len(stored))
    for group, found in findings.agreement.items():
        kind, _, name = group.partition(" ")
        mine = [
            o
            for type_name, o in stored
            if kind == "all" or name == (type_name if kind == "type" else o.reason or "success")
        ]
        assert (found.agree, found.asked) == (sum(o.agrees for o in mine), len(mine)), group
    assert "replayed" not in findings.checked
    assert f"agreement, all: {whole}" in findings.summary()
    own = validate(tmp_path / "ds", "physics", engine=DEFAULT_ENGINE)
    assert own.checked["replayed"] == findings.checked["compared episodes"]
    assert own.agreement == {}


def test_an_engine_that_cannot_be_asked_is_one_line(tmp_path, scenes, monkeypatch):
    write_dataset(tmp_path / "ds", scenes[:1])
    with pytest.raises(UsageError, match="only the level physics"):
        validate(tmp_path / "ds", "geometry", engine=OTHER)
    with pytest.raises(UsageError, match="no physics engine is called 'havok'"):
        validate(tmp_path / "ds", "physics", engine="havok")
    monkeypatch.setitem(ENGINES, OTHER, object)
    monkeypatch.setitem(MODULES, OTHER, "nowhere_to_be_found")
    with pytest.raises(MissingEngineError, match=f"{OTHER} is not installed: pip install"):
        validate(tmp_path / "ds", "physics", engine=OTHER)
    assert checked_config(read_manifest(tmp_path / "ds").config).cross_check is False
