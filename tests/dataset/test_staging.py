"""Staged scenes are believed by runs of their identity, and written only for one that lasts."""

import shutil
from dataclasses import replace

import pytest
from memory_store import MemoryStore
from test_commit import ASSETS, IDENTITY, build, staging_of, without_waiting_for_the_disk

from internav_data.core.storage import FolderStore
from internav_data.dataset import (
    Staging,
    assemble,
    commit_scenes,
    done_scenes,
    open_staging,
    read_manifest,
    read_staged_rows,
    stage_quarantine,
    staged_scenes,
)
from internav_data.records.errors import CorruptDataError, InternavError

__all__ = ["without_waiting_for_the_disk"]
CHANGES = {
    "seed": {"seed": 8},
    "config": {"config": {"house": {"scale": 2.0}, "list": [1, 2]}},
    "catalogue": {"catalogue_digest": "1" * 64},
    "version": {"generator_version": "2"},
    "code": {"rules": "1" * 64},
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_scene_of_another_identity_is_not_done(tmp_path, change):
    other = replace(IDENTITY, **CHANGES[change])
    theirs = build(tmp_path / "other", range(3), identity=other)
    ours = build(tmp_path / "d", range(2))
    store = ours.store
    store.put(ours.name(2), theirs.store.read(theirs.name(2)))
    assert set(staged_scenes(ours)) == set(staged_scenes(ours, range(3))) == {0, 1}
    assert done_scenes(ours) == {0, 1}
    with pytest.raises(CorruptDataError, match="another run"):
        read_staged_rows(ours, 2, house=False)
    with pytest.raises(CorruptDataError, match="first 2"):
        assemble(tmp_path / "d", IDENTITY, ASSETS, 3)


@pytest.mark.parametrize("pair", [(1, 2), (1, 7)])
def test_a_scene_under_the_name_of_another_is_not_done(tmp_path, pair):
    staging = build(tmp_path, range(4))
    paths = [tmp_path / staging.name(scene) for scene in pair]
    blobs = [path.read_bytes() if path.exists() else b"" for path in paths]
    for path, blob in zip(paths, reversed(blobs), strict=True):
        path.write_bytes(blob)
    left = set(range(4)) - set(pair)
    assert done_scenes(staging) == set(staged_scenes(staging, range(9))) == left
    with pytest.raises(CorruptDataError, match="another scene"):
        read_staged_rows(staging, pair[1], house=True)


def test_scenes_of_other_code_are_removed_and_made_again(tmp_path):
    build(tmp_path, range(3), identity=replace(IDENTITY, rules="1" * 64))
    staging = open_staging(tmp_path, IDENTITY)
    assert done_scenes(staging) == frozenset()
    assert not [name for name in staging.store.names() if name.endswith(".work")]


def put(staging):
    stage_quarantine(staging, 4, "too small", split="train", attempts=3)


def test_a_worker_that_outlives_its_run_revives_no_folder(tmp_path, monkeypatch):
    out = tmp_path / "d"
    staging = build(out, range(2))
    shutil.rmtree(out)
    with pytest.raises(InternavError, match="removed, or another run's"):
        put(staging)
    assert not out.exists()
    monkeypatch.setattr(Staging, "check", lambda _: None)  # removed just after the check
    with pytest.raises(FileNotFoundError):
        put(staging)
    assert not out.exists()
    with monkeypatch.context() as patch:
        patch.setattr(FolderStore, "size", lambda *_: 0)  # removed later still
        with pytest.raises(FileNotFoundError):
            put(staging)
    assert not out.exists()
    FolderStore(out).put("another", b"")
    with pytest.raises(FileNotFoundError):
        put(staging)
    assert FolderStore(out).names() == ["another"]


@pytest.mark.parametrize("make", [MemoryStore, None])
def test_a_worker_that_outlives_its_run_leaves_another_run_alone(tmp_path, make):
    store = make() if make else FolderStore(tmp_path / "d")
    staging = build(store, range(2))
    for name in store.names():
        store.remove(name)
    build(store, range(2), identity=replace(IDENTITY, seed=8))
    before = store.names()
    with pytest.raises(InternavError, match="another run's"):
        put(staging)
    assert store.names() == before


def test_a_finished_dataset_is_no_staging(tmp_path):
    staging = build(tmp_path, range(3))
    assemble(tmp_path, IDENTITY, ASSETS, 3)
    with pytest.raises(InternavError, match="removed"):
        put(staging)
    assert not (tmp_path / ".work").exists()
    assert done_scenes(staging_of(tmp_path)) == {0, 1, 2}


def test_a_run_commits_nothing_into_a_folder_that_is_anothers_by_now(tmp_path):
    staging = build(tmp_path / "d", range(6))
    assemble(tmp_path / "d", IDENTITY, ASSETS, 3)
    shutil.move(tmp_path / "d", tmp_path / "away")
    other = replace(IDENTITY, seed=8)
    build(tmp_path / "d", range(3), identity=other)
    manifest = assemble(tmp_path / "d", other, ASSETS, 3)
    build(tmp_path / "d", range(3, 6), identity=other)
    with pytest.raises(InternavError, match="another run's by now"):
        commit_scenes(staging, IDENTITY, ASSETS, 6)
    assert read_manifest(tmp_path / "d") == manifest
