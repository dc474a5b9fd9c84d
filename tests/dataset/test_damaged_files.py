"""Missing and damaged files are found and get the bytes of before, or are refused."""

from __future__ import annotations

import shutil
from itertools import cycle
from pathlib import Path

import pytest
from memory_store import KilledError, MemoryStore
from test_commit import ASSETS, IDENTITY, build, staging_of

from internav_data.core import storage
from internav_data.dataset import (
    assemble,
    find_damage,
    load_dataset,
    repair_files,
    shards,
)
from internav_data.records.errors import CorruptDataError

KEPT = Path(__file__).parents[1] / "data" / "dataset-10"


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 8, "scenes": 20})
    monkeypatch.setattr(storage, "sync", lambda _: None)


@pytest.fixture
def finished():
    """30 scenes in four shards of episodes and two of houses."""
    store = MemoryStore()
    build(store, range(30), quarantined={5})
    return store, assemble(store, IDENTITY, ASSETS, 30)


def repaired(store, episodes=2):
    damage = find_damage(store)
    scenes = damage.all_scenes()
    staging = build(store, scenes, episodes=episodes)
    repair_files(staging, damage, ASSETS)
    return scenes


def test_nothing_is_wrong_with_a_finished_dataset(finished):
    store, _ = finished
    assert find_damage(store) is None
    assert find_damage(MemoryStore()) is None
    assert find_damage(storage.FolderStore(KEPT)) is None


DAMAGES = {
    "missing": lambda _: None,
    "empty": lambda _: b"",
    "cut": lambda data: data[:-1],
    "longer": lambda data: data + b"\n",
    "a bit": lambda data: data[:99] + bytes([data[99] ^ 1]) + data[100:],
}


def test_every_file_gets_its_bytes_again(finished):
    store, manifest = finished
    whole = dict(store.blobs)
    for path, kind in zip(sorted(manifest.paths() - {"manifest.json"}), cycle(DAMAGES)):
        data = DAMAGES[kind](whole[path])
        if data is None:
            del store.blobs[path]
        else:
            store.blobs[path] = data
        assert find_damage(store).paths == (path,)
        repaired(store)
        assert {n: d for n, d in store.blobs.items() if n != ".work/identity.json"} == whole
        store.remove(".work/identity.json")


def test_only_the_scenes_of_the_damaged_shard_are_asked_for(finished):
    store, manifest = finished
    second = manifest.of("episodes", "train")[1]
    store.remove(second.path)
    train = [k for k in range(2, 30) if k != 5]
    assert repaired(store) == tuple(train[8:16])


def test_other_bytes_are_refused_and_nothing_is_written(finished):
    store, manifest = finished
    file = manifest.of("episodes", "train")[0]
    store.remove(file.path)
    before = set(store.names())
    with pytest.raises(CorruptDataError, match=f"{file.path}: missing or damaged, and made again"):
        repaired(store, episodes=3)
    assert {name for name in store.names() if not name.startswith(".work/")} == before


def test_a_repair_that_is_killed_is_done_by_the_next(finished):
    store, manifest = finished
    whole = dict(store.blobs)
    for file in (*manifest.of("episodes"), *manifest.metadata[:2]):
        store.remove(file.path)
    damage = find_damage(store)
    build(store, damage.all_scenes())
    begun = dict(store.blobs)
    for deadline in range(0, 30, 6):
        dying = MemoryStore(begun, deadline)
        with pytest.raises(KilledError):
            repair_files(staging_of(dying), damage, ASSETS)
        left = MemoryStore(dying.blobs)
        if find_damage(left):
            repaired(left)
        assemble(left, IDENTITY, ASSETS, 30)
        assert left.blobs == whole


def test_metadata_of_a_dataset_that_does_not_list_it_is_left_alone(tmp_path):
    folder = shutil.copytree(KEPT, tmp_path / "kept")
    (folder / "README.md").unlink()
    assert find_damage(storage.FolderStore(folder)) is None
    assert len(load_dataset(folder))
