"""The folder of a dataset is a dataset repository: `datasets` and `mlcroissant` read it.

Both are tried in their newest versions by `make test-interop`; elsewhere these tests are skipped.
"""

from __future__ import annotations

import json
import math

import pytest

from internav_data.dataset import load_dataset, read_manifest
from internav_data.dataset.eval_yaml import TASKS as EVALUATED


@pytest.fixture
def hugging_face(monkeypatch, tmp_path):
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    module = pytest.importorskip("datasets")
    monkeypatch.setattr(module.config, "HF_DATASETS_CACHE", str(tmp_path / "cache"))
    return module


@pytest.mark.parametrize("streaming", [False, True])
def test_configurations_and_splits_are_loaded(hugging_face, dataset_folder, tmp_path, streaming):
    ours = load_dataset(dataset_folder)
    for table, expected in (("episodes", len(ours)), ("scenes", len(ours.scene_ids))):
        parts = hugging_face.load_dataset(
            str(dataset_folder), table, streaming=streaming, cache_dir=str(tmp_path)
        )
        assert set(parts) == {"train", "val", "test"}
        assert sum(sum(1 for _ in part) for part in parts.values()) == expected
    (assets,) = hugging_face.load_dataset(
        str(dataset_folder), "assets", streaming=streaming, cache_dir=str(tmp_path)
    ).values()
    assert {row["asset_id"] for row in assets} == set(ours.assets)


def test_rows_hold_what_the_records_hold(hugging_face, dataset_folder, tmp_path):
    rows = hugging_face.load_dataset(str(dataset_folder), split="val", cache_dir=str(tmp_path))
    for row, episode in zip(rows, load_dataset(dataset_folder, "val"), strict=True):
        assert row["episode_id"] == episode.episode_id
        assert row["start"]["yaw_deg"] == episode.start.yaw_deg
        assert (row["expert"] is None) == (episode.expert is None)
        if episode.expert is not None:
            assert tuple(row["expert"]["actions"]) == episode.expert.actions
        for held, obstacle in zip(row["obstacles"], episode.obstacles, strict=True):
            assert [each["opened"] for each in held["outcomes"]] == [
                each.opened for each in obstacle.outcomes
            ]


def test_croissant_is_1_1_and_its_reader_iterates_it(dataset_folder):
    croissant = pytest.importorskip("mlcroissant")
    described = croissant.Dataset(str(dataset_folder / "croissant.json"))
    context = described.metadata.ctx
    assert context.conforms_to.value == "http://mlcommons.org/croissant/1.1"
    assert not context.issues.errors
    # A date would be the clock's: the same seed gives the same bytes.
    assert all("datePublished" in warning for warning in context.issues.warnings)
    ours = {episode.episode_id: episode for episode in load_dataset(dataset_folder)}
    seen = 0
    for row in described.records("episodes"):
        episode = ours[row["episodes/episode_id"].decode()]
        assert math.isclose(row["episodes/shortest_path_m"], episode.shortest_path_m)
        assert row["episodes/start"]["episodes/start/i"] == episode.start.i
        seen += 1
    assert seen == len(ours)
    scenes = sum(1 for _ in described.records("scenes"))
    assert scenes == len(load_dataset(dataset_folder).scene_ids)


def test_croissant_has_a_licence_and_a_citation(dataset_folder):
    described = json.loads((dataset_folder / "croissant.json").read_text())
    assert described["conformsTo"].endswith("/1.1")
    assert described["license"] == "https://spdx.org/licenses/Apache-2.0.html"
    assert "internav-data" in described["citeAs"]


def test_the_card_says_licence_size_limits_and_citation(dataset_folder):
    card = (dataset_folder / "README.md").read_text()
    size = sum(file.bytes for file in read_manifest(dataset_folder).files) / 1e6
    for words in ("license: apache-2.0", f"{size:.1f} MB", "## Limits", "## Licence and citation"):
        assert words in card


def test_evaluation_tasks_stand_on_a_split_that_is_there(dataset_folder):
    yaml = pytest.importorskip("yaml")
    text = yaml.safe_load((dataset_folder / "eval.yaml").read_text())
    assert set(text) == {"name", "description", "evaluation_framework", "tasks"}
    assert [task["id"] for task in text["tasks"]] == list(EVALUATED)
    splits = {file.split for file in read_manifest(dataset_folder).of("episodes")}
    for task in text["tasks"]:
        assert task["config"] == "episodes"
        assert task["split"] == "test"
        assert task["split"] in splits
