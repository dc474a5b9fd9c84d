"""Datasets in any store; the folder as a store."""

import errno
import multiprocessing
import os
import pickle
import socket
from pathlib import Path
from types import SimpleNamespace

import pytest
from memory_store import KilledError, MemoryStore
from pyarrow import fs
from test_commit import ASSETS, IDENTITY, build, staging_of

from internav_data.core import object_store, storage
from internav_data.core.object_store import ObjectStore
from internav_data.core.storage import (
    FolderStore,
    LockedError,
    OutsideError,
    Store,
    StoreError,
    disk_errors,
    exists,
    store_of,
)
from internav_data.dataset import (
    assemble,
    compute_stats,
    done_scenes,
    has_manifest,
    load_dataset,
    open_staging,
    parquet,
    read_manifest,
    shards,
)
from internav_data.records.errors import CorruptDataError, InternavError, UsageError


class Bucket:
    """A client of a bucket that is a folder: pyarrow's calls, without a server."""

    def __init__(self, root):
        self.files = fs.SubTreeFileSystem(str(root), fs.LocalFileSystem())
        self.reads, self.cut = [], False

    def __getattr__(self, name):
        return getattr(self.files, name)

    def open_output_stream(self, key):
        self.files.create_dir(key.rpartition("/")[0])
        return self.files.open_output_stream(key)

    def open_input_file(self, key):
        return Opened(self, self.files.open_input_file(key))


class Opened:
    """A file of a bucket, which notes each read."""

    def __init__(self, bucket, file):
        self.bucket, self.file = bucket, file

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()

    def __getattr__(self, name):
        return getattr(self.file, name)

    def read_at(self, size, at):
        self.bucket.reads.append((at, size))
        if self.bucket.cut:
            raise OSError("AWS Error NETWORK_CONNECTION during GetObject operation: curlCode: 56")
        return self.file.read_at(size, at)


@pytest.fixture
def client(tmp_path, monkeypatch):
    client = Bucket(tmp_path)
    monkeypatch.setattr(object_store, "_client", lambda *_: client)
    return client


@pytest.fixture
def bucket(client):
    return ObjectStore("s3://bucket/prefix")


@pytest.fixture(params=["folder", "memory", "bucket"])
def store(request, tmp_path, bucket):
    made = {"folder": FolderStore(tmp_path / "store"), "memory": MemoryStore(), "bucket": bucket}
    return made[request.param]


def test_all_are_stores(store):
    assert isinstance(store, Store)


def test_blobs_are_put_read_listed_and_removed(store):
    assert store.names() == []
    for name, data in (("a", b"0123"), ("b/c", b"x"), ("b/d", b""), ("a", b"456")):
        store.put(name, data)
    assert store.names() == ["a", "b/c", "b/d"]
    assert store.names("b/") == ["b/c", "b/d"]
    assert store.read("a") == b"456"
    assert store.read("a", 1) == b"56"
    assert store.read("a", 0, 2) == b"45"
    assert store.size("a") == 3
    assert (exists(store, "b/c"), exists(store, "b/e"), exists(store, "a/b")) == (1, 0, 0)
    for reading in (store.read, store.size):
        with pytest.raises(FileNotFoundError):
            reading("b/e")
    store.remove("b/e")
    store.remove("b/c")
    store.prune("b/")
    assert store.names() == ["a", "b/d"]
    store.remove("b/d")
    store.prune("b/")
    assert store.names() == ["a"]


def test_a_dataset_in_memory_is_that_in_a_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 8, "scenes": 20})
    memory, folder = MemoryStore(), FolderStore(tmp_path)
    for store in (memory, folder):
        for low, high in ((0, 10), (10, 30)):
            build(store, range(low, high), quarantined={5})
            assemble(store, IDENTITY, ASSETS, high)
    assert memory.blobs == {name: folder.read(name) for name in folder.names()}
    dataset = load_dataset(memory, "train")
    assert list(dataset) == list(load_dataset(tmp_path, "train"))
    assert dataset.scene("scene-000004").scene == 4
    assert compute_stats(memory) == compute_stats(tmp_path) == compute_stats(load_dataset(memory))
    again = pickle.loads(pickle.dumps(dataset))  # noqa: S301 - our own
    assert again[3] == dataset[3]
    with pytest.raises(UsageError, match="another configuration"):
        open_staging(memory, type(IDENTITY)("other", "1", 0, 1, "0", {}))
    with pytest.raises(CorruptDataError, match="no dataset here"):
        read_manifest(MemoryStore())


def test_a_dataset_in_a_bucket_is_that_in_a_folder(bucket, tmp_path, monkeypatch):
    monkeypatch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 8, "scenes": 20})
    folder = FolderStore(tmp_path / "d")
    for store in (bucket, folder):
        for low, high in ((0, 10), (10, 24)):
            build(store, range(low, high), quarantined={5})
            assemble(store, IDENTITY, ASSETS, high)
    assert bucket.names() == folder.names()
    assert all(bucket.read(name) == folder.read(name) for name in folder.names())
    ours, theirs = load_dataset("s3://bucket/prefix"), load_dataset(folder)
    assert list(ours) == list(theirs)
    assert ours[5] == theirs[5]
    assert ours.to_table(["index"]) == theirs.to_table(["index"])
    assert repr(ours).startswith("Dataset('s3://bucket/prefix', ")
    with bucket.lock("busy"), pytest.raises(LockedError, match="s3://bucket/prefix: come back"):
        bucket.lock("come back").__enter__()


def test_a_row_group_far_away_is_one_request(bucket, client, monkeypatch):
    monkeypatch.setattr(parquet, "ROWS_PER_GROUP", 20)
    build(bucket, range(24))
    assemble(bucket, IDENTITY, ASSETS, 24)
    dataset = load_dataset(bucket, "train")
    dataset[0]
    client.reads.clear()
    assert dataset[25].index == 1
    assert len(client.reads) == 1, "all chunks in one request"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "When uploading part for key 'x': AWS Error ACCESS_DENIED during UploadPart operation",
            r"access is denied \(UploadPart\): give these credentials the right to do it",
        ),
        (
            "AWS Error UNKNOWN (HTTP status 503) during HeadObject operation: No response body.",
            r"requests are throttled \(HeadObject\): what is finished is kept, .*fewer --workers",
        ),
        (
            "AWS Error NETWORK_CONNECTION during PutObject operation: curlCode: 56",
            r"the connection was lost \(PutObject\): what is finished is kept, run the same",
        ),
        ("AWS Error ODD during GetObject operation: x", r"ODD \(GetObject\): what is finished"),
        ("Something\nelse", "Something else: what is finished is kept"),
    ],
)
def test_errors_of_a_bucket_are_one_line(bucket, monkeypatch, text, line):
    def fail(*_):
        raise OSError(text)

    failing = SimpleNamespace(
        **dict.fromkeys(
            ("get_file_info", "open_input_file", "open_output_stream", "delete_file"), fail
        )
    )
    monkeypatch.setattr(object_store, "_client", lambda *_: failing)
    for call in (
        lambda: bucket.size("a"),
        lambda: bucket.read("a"),
        lambda: bucket.source("a"),
        lambda: bucket.put("a", b"1"),
        bucket.names,
        lambda: bucket.remove("a"),
    ):
        with pytest.raises(StoreError, match=f"^s3://bucket/prefix.*: {line}"):
            call()


def test_a_connection_lost_while_reading_is_no_damage(bucket, client):
    build(bucket, range(24))
    assemble(bucket, IDENTITY, ASSETS, 24)
    dataset = load_dataset(bucket, "train")
    client.cut = True
    with pytest.raises(StoreError, match="the connection was lost"):
        dataset[0]
    client.cut = False
    assert dataset[0] == load_dataset(bucket, "train")[0]


def test_an_object_of_another_size_than_was_sent_is_refused(bucket, monkeypatch):
    monkeypatch.setattr(ObjectStore, "size", lambda *_: 2)
    with pytest.raises(StoreError, match="2 of 3 bytes arrived: what is finished is kept"):
        bucket.put("a", b"123")


def test_urls_of_buckets_are_known_as_paths_too(tmp_path):
    for given in ("s3://b/a/c", "s3://b/a/c/", Path("s3://b/a/c")):
        assert store_of(given) == ObjectStore("s3://b/a/c")
    assert store_of("s3x/a") == FolderStore(Path("s3x/a"))
    for wrong in ("s3://", "s3:///a", "s3://bucket", "s3://bucket/"):
        with pytest.raises(UsageError, match=r"expected s3://bucket/prefix"):
            store_of(wrong)


@pytest.mark.parametrize("first", [0, 10])
def test_killed_before_any_change_readers_are_safe_and_the_next_call_finishes(monkeypatch, first):
    monkeypatch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 8, "scenes": 20})
    begun = MemoryStore()
    if first:
        build(begun, range(first))
        assemble(begun, IDENTITY, ASSETS, first)
    build(begun, range(first, 20))
    whole = MemoryStore(begun.blobs)
    assemble(whole, IDENTITY, ASSETS, 20)
    assert whole.changes > 20
    sizes = set()
    for deadline in range(whole.changes):
        store = MemoryStore(begun.blobs, deadline)
        with pytest.raises(KilledError):
            assemble(store, IDENTITY, ASSETS, 20)
        left = MemoryStore(store.blobs)
        assert has_manifest(left) or not first
        if has_manifest(left):
            sizes.add(len({e.episode_id for e in load_dataset(left)}))
        open_staging(left, IDENTITY)
        assert done_scenes(staging_of(left)) == frozenset(range(20))
        assemble(left, IDENTITY, ASSETS, 20)
        assert left.blobs == whole.blobs
    assert sizes == {2 * first, 40} - {0}, "readers see the old dataset or the new one"


def test_nothing_that_the_old_manifest_names_changes_before_the_new_one_is_there(monkeypatch):
    monkeypatch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 8, "scenes": 20})
    store = MemoryStore()
    build(store, range(10))
    named = {file.path for file in assemble(store, IDENTITY, ASSETS, 10).files}
    build(store, range(10, 30))
    store.log.clear()
    new = {file.path for file in assemble(store, IDENTITY, ASSETS, 30).files}
    at = store.log.index(("put", "manifest.json"))
    assert not named & {name for _, name in store.log[:at]}
    assert {name for kind, name in store.log if kind == "remove"} >= named - new
    assert named & new, "finished shards stay"
    assert named - new, "the last ones are replaced"


def test_a_folder_follows_links_and_writes_through_none_that_leads_out(tmp_path):
    store = FolderStore(tmp_path / "store")
    store.put("a", b"inside")
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "b").write_bytes(b"outside")
    (store.root / "b").symlink_to(tmp_path / "outside" / "b")
    (store.root / "c").symlink_to("a")
    (store.root / "d").symlink_to(tmp_path / "outside")
    assert (store.size("c"), store.size("b"), store.read("d/b")) == (6, 7, b"outside")
    store.put("b", b"ours")
    store.remove("c")
    assert (store.read("a"), store.read("b"), store.read("d/b")) == (b"inside", b"ours", b"outside")
    for change in (
        lambda: store.put("d/b", b"ours"),
        lambda: store.put("d/new/e", b"ours"),
        lambda: store.remove("d/b"),
        lambda: store.prune("d/"),
    ):
        with pytest.raises(OutsideError, match="leads out of"):
            change()
    assert [path.name for path in (tmp_path / "outside").iterdir()] == ["b"]
    assert store.read("d/b") == b"outside"
    store.remove("d")
    assert not (store.root / "d").exists()


def test_a_temporary_file_is_no_link(tmp_path):
    (tmp_path / "outside").write_bytes(b"outside")
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / storage.temporary_of("a")).symlink_to(tmp_path / "outside")
    FolderStore(tmp_path / "store").put("a", b"ours")
    assert (tmp_path / "outside").read_bytes() == b"outside"
    assert (tmp_path / "store" / "a").read_bytes() == b"ours"


def test_a_folder_may_be_a_link_itself(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    store = FolderStore(tmp_path / "link")
    store.put("deep/a", b"1")
    assert (tmp_path / "real" / "deep" / "a").read_bytes() == b"1"
    store.remove("deep/a")
    store.prune("deep/")
    assert list((tmp_path / "real").iterdir()) == []


def _try(store, pipe):
    try:
        with store.lock("busy"):
            pipe.send("locked")
    except LockedError as error:
        pipe.send(str(error))


def in_another_process(store):
    """Return what another process gets when it locks a store."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_try, args=(store, theirs))
    process.start()
    answer = ours.recv()
    process.join()
    return answer


def test_a_folder_is_locked_once(tmp_path):
    store = FolderStore(tmp_path / "store")
    with store.lock("busy"):
        with pytest.raises(LockedError) as caught, store.lock("come back later"):
            pass
        holder = f"(held by process {os.getpid()} on {socket.gethostname()}, which began at 2"
        assert str(caught.value).startswith(f"{store.root}: come back later {holder}")
        assert in_another_process(store).startswith(f"{store.root}: busy {holder}")
    assert in_another_process(store) == "locked", "released when the block ended"
    assert store.names() == [], "nothing is written"


def test_only_the_store_links_renames_and_locks():
    import re
    from pathlib import Path

    package = Path(storage.__file__).parents[1]
    calls = re.compile(r"os\.(link|rename|replace)\(|\.rename\(|\.hardlink_to\(|flock\(")
    found = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        if calls.search(path.read_text())
    }
    assert found == {"core/storage.py"}


def test_a_full_disk_leaves_the_old_folder(tmp_path, monkeypatch):
    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        storage.write_folder_atomically(tmp_path / "x", lambda folder: (folder / "a").touch())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", [errno.EMFILE, errno.ENFILE, errno.EAGAIN, errno.ENOMEM])
def test_what_the_system_has_no_more_of_is_no_fault_of_the_disk(tmp_path, number):
    refused = pytest.raises(InternavError, match="ask for fewer workers")
    with refused as error, disk_errors(tmp_path, "try again"):
        raise OSError(number, os.strerror(number))
    assert str(error.value).startswith(f"{tmp_path}: {os.strerror(number)}: ")
    assert "free some space" not in str(error.value)
