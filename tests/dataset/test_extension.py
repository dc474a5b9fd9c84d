"""Readers of a dataset that is being extended: no error, no wrong row, no row twice."""

from __future__ import annotations

import multiprocessing
import pickle
import shutil
import time
from dataclasses import replace

import pytest
from memory_store import MemoryStore
from test_commit import ASSETS, IDENTITY, build, split_of

from internav_data.core import storage
from internav_data.dataset import (
    assemble,
    compute_stats,
    load_dataset,
    read_manifest,
    shards,
    snapshot,
)
from internav_data.dataset.parquet import TableFile
from internav_data.records.errors import CorruptDataError

SIZES = {"episodes": 8, "scenes": 20}
FORK = multiprocessing.get_context("fork")


@pytest.fixture(autouse=True)
def few_scenes_a_shard(monkeypatch):
    monkeypatch.setattr(shards, "SCENES_PER_SHARD", SIZES)
    monkeypatch.setattr(storage, "sync", lambda _: None)


def extend(store, low, high, identity=IDENTITY):
    build(store, range(low, high), identity=identity)
    return assemble(store, identity, ASSETS, high)


def expected(scenes):
    """Ids of the episodes of the first scenes, in the dataset's order."""
    return [
        f"scene-{scene:06d}/{index:04d}"
        for split in ("train", "val", "test")
        for scene in range(scenes)
        if split_of(scene) == split
        for index in range(2)
    ]


def contents(ds):
    """Read everything that a dataset offers."""
    return {
        "records": list(ds),
        "stream": list(ds.iterable(seed=3, epoch=1)),
        "houses": [ds.scene(scene_id) for scene_id in ds.scene_ids],
        "assets": dict(ds.assets),
        "table": ds.to_table().to_pylist(),
        "stats": compute_stats(ds),
        "fingerprint": ds.fingerprint,
    }


OPENINGS = {
    "all": {},
    "a split": {"split": "train"},
    "filtered": {"filters": [("room_count", ">", 3)]},
}


@pytest.mark.parametrize(
    ("opening", "pickled"), [("all", False), ("a split", True), ("filtered", True)]
)
def test_an_open_dataset_goes_on_with_its_own_episodes(tmp_path, opening, pickled):
    """Nothing is read before the extension, so every file is opened too late."""
    extend(tmp_path, 0, 10)
    before = contents(load_dataset(tmp_path, **OPENINGS[opening]))
    ds = load_dataset(tmp_path, **OPENINGS[opening])
    data = pickle.dumps(ds)
    gone = {file.path for file in ds.manifest.files}
    for low, high in ((10, 11), (11, 19), (19, 60)):
        manifest = extend(tmp_path, low, high)
    assert gone - {file.path for file in manifest.files}, "shards were replaced"
    if pickled:
        ds = pickle.loads(data)  # noqa: S301 - our own
    assert contents(ds) == before
    assert len(load_dataset(tmp_path)) == 120


def test_a_file_taken_from_those_who_hold_it_open_is_found_again(tmp_path, monkeypatch):
    """As network file systems do when another machine removes it."""
    extend(tmp_path, 0, 9)
    ds = load_dataset(tmp_path)
    before = list(ds)
    ds.row_group_cache.clear()
    extend(tmp_path, 9, 19)
    taken = []
    monkeypatch.setattr(TableFile, "read_group", _stale(tmp_path, taken))
    assert list(ds) == before
    assert taken, "a shard was replaced"


def _stale(folder, seen):
    real, paths = TableFile.read_group, {file.path for file in read_manifest(folder).files}

    def read_group(file, *args):
        name = file.place.removeprefix(f"{folder}/")
        if name not in paths and not seen:
            seen.append(name)
            raise CorruptDataError(f"{file.place}: the file is damaged (Stale file handle)")
        return real(file, *args)

    return read_group


class ExtendedWhileRead(MemoryStore):
    """A store that a generator extends just before a reader looks for a shard, some times."""

    def __init__(self, blobs, times):
        super().__init__(blobs)
        self.times = times

    def size(self, name):
        if self.times and name.startswith("data/"):
            self.times -= 1
            scenes = read_manifest(MemoryStore(self.blobs)).scenes
            grown = MemoryStore(self.blobs)
            extend(grown, scenes, scenes + 1)
            self.blobs = grown.blobs
        return super().size(name)


@pytest.mark.parametrize("times", [1, 4])
def test_a_reader_that_loses_the_race_has_the_new_dataset(times):
    store = MemoryStore()
    extend(store, 0, 10)
    ds = load_dataset(ExtendedWhileRead(store.blobs, times))
    assert [episode.episode_id for episode in ds] == expected(10 + times)


class ExtendedBetweenLooks(MemoryStore):
    """A store that is extended between two looks at a shard: at size, footer (read) and source."""

    def __init__(self, blobs, later, call):
        super().__init__(blobs)
        self.later, self.call = later, call

    def read(self, name, start=0, stop=None):
        self.extend_at("read", name)
        return super().read(name, start, stop)

    def source(self, name):
        self.extend_at("source", name)
        return super().source(name)

    def extend_at(self, call, name):
        if call == self.call and name.startswith("data/") and name not in self.later:
            self.blobs = self.later


@pytest.mark.parametrize("call", ["read", "source"])
def test_a_shard_that_is_removed_between_two_looks_is_found_in_its_successor(call):
    store = MemoryStore()
    extend(store, 0, 5)
    later = MemoryStore(store.blobs)
    extend(later, 5, 10)
    ds = load_dataset(ExtendedBetweenLooks(store.blobs, later.blobs, call))
    assert [episode.episode_id for episode in ds] == expected(5)
    assert ds.store.blobs == later.blobs, "no shard was replaced"


def test_a_race_that_never_ends_is_given_up(monkeypatch):
    digests = iter(range(1000))
    monkeypatch.setattr(snapshot, "read_manifest_and_digest", lambda _: (None, str(next(digests))))
    tried = []

    def use(*_):
        tried.append(1)
        raise CorruptDataError("the file is missing")

    with pytest.raises(CorruptDataError, match="missing"):
        snapshot.with_manifest(MemoryStore(), use)
    assert len(tried) == snapshot.MAX_TRIES


def test_a_missing_file_of_the_manifest_in_place_is_an_error_at_once(tmp_path):
    manifest = extend(tmp_path, 0, 10)
    ds = load_dataset(tmp_path)
    (tmp_path / manifest.of("episodes")[0].path).unlink()
    with pytest.raises(CorruptDataError, match="missing"):
        ds[0]


def test_another_dataset_in_the_same_folder_is_never_read(tmp_path):
    extend(tmp_path, 0, 10)
    data = pickle.dumps(load_dataset(tmp_path))
    ds = load_dataset(tmp_path)
    shutil.rmtree(tmp_path)
    other = replace(IDENTITY, seed=8)
    build(tmp_path, range(12), episodes=3, identity=other)
    assemble(tmp_path, other, ASSETS, 12)
    for reader in (ds, pickle.loads(data)):  # noqa: S301 - our own
        with pytest.raises(CorruptDataError, match="load it again"):
            reader[0]


def write(folder, stop, first):
    """Extend a dataset by a few scenes at a time until told to stop."""
    scenes = first
    while not stop.is_set():
        extend(folder, scenes, scenes + 1 + scenes % 3)
        scenes += 1 + scenes % 3


def read(folder, stop, counts, problems):
    """Open and read a dataset until told to stop; older openings go on being read."""
    old, opened = [], 0
    try:
        while not stop.is_set():
            ds = load_dataset(folder)
            old = [*old[-3:], (pickle.dumps(ds), ds)]
            for data, each in (*old, (b"", ds)):
                if data:
                    again = pickle.loads(data)  # noqa: S301 - our own
                    check(again)
                check(each)
            ds.scene("scene-000003")
            compute_stats(folder)
            opened += 1 + len(old)
    except Exception as error:  # noqa: BLE001 - told to the test
        problems.put(f"{type(error).__name__}: {error}")
    counts.put(opened)


def check(ds):
    scenes = ds.manifest.scenes
    assert [row["episode_id"] for row in ds.to_table(["episode_id"]).to_pylist()] == expected(
        scenes
    )
    assert ds[len(ds) - 1].episode_id == expected(scenes)[-1]
    stream = [e.episode_id for e in ds.iterable(seed=1)]
    assert sorted(stream) == sorted(expected(scenes))


def readers_beside_a_writer(folder, scenes, first=10):
    """Extend a dataset to so many scenes under two readers; return how often they opened it."""
    extend(folder, 0, first)
    stop, counts, problems = FORK.Event(), FORK.Queue(), FORK.Queue()
    writer = FORK.Process(target=write, args=(folder, stop, first))
    readers = [FORK.Process(target=read, args=(folder, stop, counts, problems)) for _ in range(2)]
    for process in (writer, *readers):
        process.start()
    while read_manifest(folder).scenes < scenes and writer.is_alive() and problems.empty():
        time.sleep(0.05)
    stop.set()
    opened = sum(counts.get(timeout=60) for _ in readers)
    for process in (writer, *readers):
        process.join(60)
    assert problems.empty(), problems.get()
    assert writer.exitcode == 0
    return opened


def test_readers_beside_a_writer_meet_no_error(tmp_path):
    assert readers_beside_a_writer(tmp_path, 18) > 1


@pytest.mark.slow
def test_hundreds_of_readers_beside_a_writer_meet_no_error(tmp_path):
    opened = 0
    while opened < 500:
        opened += readers_beside_a_writer(tmp_path / str(opened), 100)


@pytest.mark.slow
@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_workers_of_a_data_loader_beside_a_writer_meet_no_error(tmp_path, start):
    from torch.utils.data import DataLoader

    extend(tmp_path, 0, 10)
    stop = FORK.Event()
    writer = FORK.Process(target=write, args=(tmp_path, stop, 10))
    writer.start()
    try:
        ds = load_dataset(tmp_path)
        for _ in range(10):
            for given in (ds, load_dataset(tmp_path)):
                loader = DataLoader(
                    given,
                    batch_size=4,
                    num_workers=2,
                    collate_fn=list,
                    multiprocessing_context=start,
                )
                ids = [episode.episode_id for batch in loader for episode in batch]
                assert ids == expected(given.manifest.scenes)
    finally:
        stop.set()
        writer.join(60)
    assert read_manifest(tmp_path).scenes > 20
