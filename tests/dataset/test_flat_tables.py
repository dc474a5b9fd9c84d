"""Obstacles and outcomes as flat tables, and statistics of a dataset as a page."""

from __future__ import annotations

import shutil
from xml.etree import ElementTree as ET

import pytest

from internav_data import load_dataset
from internav_data.records.errors import UsageError


@pytest.fixture(scope="module")
def data():
    return load_dataset("mini", filters=[("room_count", "<=", 4)])


def test_a_row_an_obstacle(data):
    rows = data.to_table("obstacles").to_pylist()
    expected = [
        (episode.episode_id, episode.scene_id, episode.split, k, obstacle)
        for episode in data
        for k, obstacle in enumerate(episode.obstacles)
    ]
    assert len(rows) == len(expected)
    for row, (episode_id, scene_id, split, number, obstacle) in zip(rows, expected, strict=True):
        assert (row["episode_id"], row["scene_id"], row["split"]) == (episode_id, scene_id, split)
        assert row["obstacle"] == number
        for name in ("asset_id", "type", "x", "mass_kg", "pushable", "relevant", "affordance"):
            assert row[name] == getattr(obstacle, name)
        assert tuple(row[f"quaternion_{axis}"] for axis in "xyzw") == obstacle.quaternion


def test_a_row_an_outcome(data):
    rows = data.to_table("outcomes").to_pylist()
    expected = [
        (episode.episode_id, k, obstacle, outcome)
        for episode in data
        for k, obstacle in enumerate(episode.obstacles)
        for outcome in obstacle.outcomes
    ]
    assert len(rows) == len(expected)
    for row, (episode_id, number, obstacle, outcome) in zip(rows, expected, strict=True):
        assert (row["episode_id"], row["obstacle"]) == (episode_id, number)
        assert (row["asset_id"], row["type"]) == (obstacle.asset_id, obstacle.type)
        for name in ("action", "success", "opened", "path_m_after", "reason", "displacement_m"):
            assert row[name] == getattr(outcome, name)
        pose = outcome.pose
        assert row["pose_x"] == (None if pose is None else pose.x)
        assert row["pose_quaternion_w"] == (None if pose is None else pose.quaternion[3])
        assert row["moved_count"] == len(outcome.moved)


def test_obstacles_without_outcomes_have_none():
    """A dataset of an earlier release holds no `moved`."""
    from pathlib import Path

    old = load_dataset(Path(__file__).parents[1] / "data" / "dataset-10")
    rows = old.to_table("outcomes")
    assert rows.num_rows == sum(len(o.outcomes or ()) for e in old for o in e.obstacles)
    assert rows["moved_count"].null_count == sum(
        outcome.moved is None for e in old for o in e.obstacles for outcome in o.outcomes or ()
    )


def test_nothing_selected_is_an_empty_table():
    nothing = load_dataset("mini", filters=[("room_count", ">", 99)])
    for name in ("obstacles", "outcomes"):
        table = nothing.to_table(name)
        assert table.num_rows == 0
        assert "asset_id" in table.column_names


def test_pandas_has_flat_frames(data):
    pytest.importorskip("pandas")
    frame = data.to_pandas("outcomes")
    assert len(frame) == data.to_table("outcomes").num_rows
    assert frame["pose_x"].dtype == float


def test_another_word_is_refused_with_those_that_are_known(data):
    pytest.importorskip("pandas")
    for read in (data.to_table, data.to_pandas):
        with pytest.raises(UsageError, match=r"one of \['obstacles', 'outcomes'\], got 'mode'"):
            read("mode")


def test_a_dataset_is_its_statistics(tmp_path):
    folder = shutil.copytree(load_dataset("mini").path, tmp_path / "a&b")
    page = load_dataset(folder, "train")._repr_html_()
    text = "".join(ET.fromstring(page).itertext())  # noqa: S314 - our own
    for words in ("380", "(2.05)", "blocked", "a&b", "seed 0"):
        assert words in text
    (folder / "stats.json").write_text("cut sho")
    assert "380" in load_dataset(folder)._repr_html_()
