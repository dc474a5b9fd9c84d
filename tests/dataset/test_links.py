"""Datasets of links: read like others, and never written through."""

from __future__ import annotations

import hashlib
import shutil

import pytest
from test_commit import ASSETS, IDENTITY, build, tree

from internav_data.dataset import assemble, load_dataset, open_staging
from internav_data.records.errors import UsageError


def snapshot_of(folder, cache):
    """Lay a dataset out as the Hugging Face Hub's cache does: links into a folder of blobs."""
    (cache / "blobs").mkdir(parents=True)
    snapshot = cache / "snapshots" / "main"
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        blob = cache / "blobs" / hashlib.sha256(path.read_bytes()).hexdigest()
        shutil.copy(path, blob)
        link = snapshot / path.relative_to(folder)
        link.parent.mkdir(parents=True, exist_ok=True)
        up = "../" * len(link.relative_to(cache).parts[:-1])
        link.symlink_to(f"{up}blobs/{blob.name}")
    return snapshot


def made(folder, scenes):
    build(folder, scenes)
    assemble(folder, IDENTITY, ASSETS, scenes.stop)


def test_a_snapshot_of_the_hub_is_read(dataset_folder, tmp_path):
    snapshot = snapshot_of(dataset_folder, tmp_path / "cache")
    ours, theirs = load_dataset(dataset_folder), load_dataset(snapshot)
    assert list(ours) == list(theirs)
    assert ours.scene(ours.scene_ids[3]) == theirs.scene(theirs.scene_ids[3])


def test_a_linked_data_folder_is_read(damaged_folder, tmp_path):
    before = list(load_dataset(damaged_folder))
    (damaged_folder / "data").rename(tmp_path / "elsewhere")
    (damaged_folder / "data").symlink_to(tmp_path / "elsewhere")
    assert list(load_dataset(damaged_folder)) == before


def test_a_snapshot_is_extended_in_its_place_and_its_blobs_stay(tmp_path):
    once = tmp_path / "once"
    made(tmp_path / "few", range(5))
    made(once, range(9))
    snapshot = snapshot_of(tmp_path / "few", tmp_path / "cache")
    blobs = tree(tmp_path / "cache" / "blobs")
    made(snapshot, range(5, 9))
    assert tree(snapshot) == tree(once)
    assert tree(tmp_path / "cache" / "blobs") == blobs


@pytest.mark.parametrize("folder", ["data", "data/episodes", "schemas", ".work"])
def test_nothing_is_written_through_a_linked_folder(tmp_path, folder):
    made(tmp_path / "ds", range(5))
    elsewhere = tmp_path / "elsewhere"
    link = tmp_path / "ds" / folder
    link.rename(elsewhere) if link.exists() else elsewhere.mkdir()
    link.symlink_to(elsewhere)
    before = tree(elsewhere)
    with pytest.raises(UsageError, match=f"{folder}: is a link"):
        open_staging(tmp_path / "ds", IDENTITY)
    assert tree(elsewhere) == before
