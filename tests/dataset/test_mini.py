"""The dataset that ships with the package: found by its name, whole, and small."""

from __future__ import annotations

import shutil

import pytest

from internav_data import load_dataset
from internav_data.dataset.location import MINI_FOLDER, folder_to_read, origin
from internav_data.records.errors import CorruptDataError


def test_it_is_found_by_name_from_anywhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_dataset("mini").path == MINI_FOLDER
    monkeypatch.setenv("INTERNAV_DATASET", "mini")
    assert load_dataset().path == MINI_FOLDER
    assert origin(folder_to_read()) == "ships with internav-data"


def test_a_folder_of_ones_own_of_that_name_comes_first(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(MINI_FOLDER, "mini")
    assert load_dataset("mini").path == tmp_path / "mini"
    (tmp_path / "mini" / "manifest.json").unlink()
    with pytest.raises(CorruptDataError, match=r"manifest\.json"):
        load_dataset("mini")


def test_it_has_what_a_first_look_wants():
    data = load_dataset("mini")
    assert len(data.scene_ids) == 40
    assert 350 <= len(data) <= 400  # draws that the expert refused are missing
    assert {episode.mode for episode in data} == {"blocked", "lengthened"}
    assert {len(data.scene(scene_id).rooms) for scene_id in data.scene_ids} >= set(range(1, 7))
    for episode in data:
        assert episode.expert is not None
        assert all(obstacle.outcomes for obstacle in episode.obstacles)
    assert all(len(load_dataset("mini", split)) for split in ("train", "val", "test"))


def test_it_is_small_and_nothing_else_lies_there():
    files = {path for path in MINI_FOLDER.rglob("*") if path.is_file()}
    assert {str(path.relative_to(MINI_FOLDER)) for path in files} == load_dataset(
        "mini"
    ).manifest.paths()
    assert sum(path.stat().st_size for path in files) < 1_200_000
