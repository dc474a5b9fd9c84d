"""Files that the generator did not write stay as they are, wherever they lie."""

from __future__ import annotations

import hashlib
import json
import os

import pytest
from memory_store import KilledError, MemoryStore
from test_commit import ASSETS, IDENTITY, build, staging_of

from internav_data.core import storage
from internav_data.core.files import with_sha256
from internav_data.core.storage import FolderStore
from internav_data.dataset import (
    assemble,
    clear_staging,
    commit_scenes,
    done_scenes,
    end_staging,
    load_dataset,
    open_staging,
    read_manifest,
    shards,
    staged_scenes,
)
from internav_data.dataset.journal import journal_bytes, journal_names
from internav_data.dataset.metadata_files import METADATA
from internav_data.records.errors import CorruptDataError, UsageError

BESIDE = {
    name: f"precious: {name}".encode()
    for name in (
        "notes.txt",
        "README.md.bak",
        ".stats.json.4711.tmp",
        f".README.md.{os.getpid()}.tmp",
        f".manifest.json.{os.getpid()}.tmp",
        ".git/config",
        "schemas/mine.schema.json",
        "schemas/.episodes.schema.json.1.tmp",
        "data/mine.parquet",
        "data/notes.tmp",
        "data/.x.1.tmp",
        "data/episodes/train-00000-deadbeef.parquet",
        "data/episodes/train-00009-of-00010.parquet",
        "data/episodes/.train-00000-deadbeef.parquet.4711.tmp",
        "data/scenes/mine/mine.parquet",
        ".work/notes.txt",
        ".work/.draft.12.tmp",
        ".work/scenes/mine.work",
        ".work/scenes/000000/mine.work",
    )
}
"""Names that look like the generator's, and some that do not."""


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 8, "scenes": 20})
    monkeypatch.setattr(storage, "sync", lambda _: None)


def found(store):
    return {name: store.read(name) for name in store.names() if name in BESIDE}


@pytest.mark.parametrize("kind", ["folder", "memory"])
def test_a_strangers_files_survive_an_extension(tmp_path, kind):
    store = FolderStore(tmp_path) if kind == "folder" else MemoryStore()
    build(store, range(10))
    assemble(store, IDENTITY, ASSETS, 10)
    for name, data in BESIDE.items():
        store.put(name, data)
    for high in (13, 22):
        staging = build(store, range(high - 9, high))
        commit_scenes(staging, IDENTITY, ASSETS, high - 1)
        assemble(store, IDENTITY, ASSETS, high)
        end_staging(store)
    assert found(store) == BESIDE
    build(wanted := MemoryStore(), range(22))
    assemble(wanted, IDENTITY, ASSETS, 22)
    assert {n: store.read(n) for n in store.names() if n not in BESIDE} == wanted.blobs
    assert len(load_dataset(store)) == 44


def test_a_strangers_files_survive_a_commit_killed_anywhere():
    begun = MemoryStore()
    build(begun, range(4))
    assemble(begun, IDENTITY, ASSETS, 4)
    build(begun, range(4, 12))
    whole = MemoryStore({**begun.blobs, **BESIDE})
    assemble(whole, IDENTITY, ASSETS, 12)
    for deadline in range(0, whole.changes, 3):
        store = MemoryStore({**begun.blobs, **BESIDE}, deadline)
        with pytest.raises(KilledError):
            assemble(store, IDENTITY, ASSETS, 12)
        left = MemoryStore(store.blobs)
        open_staging(left, IDENTITY)
        assemble(left, IDENTITY, ASSETS, 12)
        assert left.blobs == whole.blobs
        assert found(left) == BESIDE


@pytest.mark.parametrize("name", ["manifest.json", "README.md", ".work/journal.json"])
def test_the_half_of_a_file_that_a_kill_left_goes_with_the_next_commit(name):
    begun = MemoryStore()
    build(begun, range(4))
    whole = MemoryStore(begun.blobs)
    assemble(whole, IDENTITY, ASSETS, 4)
    store = MemoryStore(begun.blobs, whole.log.index(("put", name)))
    with pytest.raises(KilledError):
        assemble(store, IDENTITY, ASSETS, 4)
    assert storage.temporary_of(name) in store.blobs
    left = MemoryStore(store.blobs)
    assemble(left, IDENTITY, ASSETS, 4)
    assert left.blobs == whole.blobs


@pytest.mark.parametrize("name", sorted(METADATA))
def test_a_first_commit_writes_over_nobodys_file(name):
    store = MemoryStore()
    build(store, range(4))
    store.put(name, b"theirs")
    for call in (assemble, commit_scenes):
        with pytest.raises(UsageError, match="in the way"):
            call(store if call is assemble else staging_of(store), IDENTITY, ASSETS, 4)
    with pytest.raises(UsageError, match="in the way"):
        open_staging(store, IDENTITY)
    assert store.read(name) == b"theirs"
    store.remove(name)
    open_staging(store, IDENTITY)
    assemble(store, IDENTITY, ASSETS, 4)
    assert {file.path for file in read_manifest(store).metadata} == METADATA


@pytest.mark.parametrize("identity", [None, b"{}", b'{"of": "another"}', b"\x00", b"[]"])
def test_a_work_folder_of_somebody_else_is_refused_untouched(tmp_path, identity):
    store = FolderStore(tmp_path)
    theirs = {
        ".work/scenes/000000/scene-000000.work": b"theirs",
        ".work/scenes/0123456789abcdef/000000/scene-000000.work": b"theirs",
        ".work/.identity.json.12.tmp": b"theirs",
        ".work/journal.json": b'["notes.txt"]',
        "notes.txt": b"theirs",
    }
    if identity is not None:
        theirs[".work/identity.json"] = identity
    for name, data in theirs.items():
        store.put(name, data)
    clear_staging(store)
    with pytest.raises((UsageError, CorruptDataError), match=r"no dataset|move \.work/ away"):
        open_staging(store, IDENTITY)
    assert {name: store.read(name) for name in store.names()} == theirs


def test_what_a_kill_left_of_ours_goes_and_no_more(tmp_path):
    """Shards, temporary files and replaced files are told by the journal, not by their names."""
    store = FolderStore(tmp_path)
    build(store, range(10))
    assemble(store, IDENTITY, ASSETS, 10)
    staging = build(store, range(10, 12))
    left = ["data/episodes/train-00001-01234567.parquet", f".stats.json.{os.getpid()}.tmp"]
    theirs = ["data/episodes/train-00001-76543210.parquet", ".stats.json.99.tmp"]
    for name in (*left, *theirs, staging.name(30).replace("scene-", ".scene-") + ".7.tmp"):
        store.put(name, b"")
    store.put(".work/journal.json", journal_bytes(left))
    assemble(store, IDENTITY, ASSETS, 12)
    assert not set(left) & set(store.names())
    assert set(theirs) < set(store.names())
    assert not (tmp_path / ".work").exists()


@pytest.mark.parametrize(
    "names", ['["../thesis.tex"]', '["/etc/passwd"]', '[".work/x"]', "[1]", "{}", "[", '["a\\\\b"]']
)
def test_a_journal_that_names_anything_else_is_refused(tmp_path, names):
    store = FolderStore(tmp_path / "d")
    (tmp_path / "thesis.tex").write_text("precious")
    build(store, range(3))
    values = json.loads(names) if names != "[" else {}
    for text in (names, json.dumps(with_sha256({"names": values}))):
        store.put(".work/journal.json", text.encode())
        for use in (lambda: assemble(store, IDENTITY, ASSETS, 3), lambda: end_staging(store)):
            with pytest.raises(CorruptDataError, match=r"journal\.json"):
                use()
    assert (tmp_path / "thesis.tex").read_text() == "precious"


def test_a_flipped_bit_of_the_journal_removes_no_file_of_somebody_else(tmp_path):
    store = FolderStore(tmp_path)
    build(store, range(3))
    whole = journal_bytes(["data/mine.parquet.tmp"])
    for bit in range(8 * len(whole)):
        damaged = bytearray(whole)
        damaged[bit // 8] ^= 1 << bit % 8
        store.put(".work/journal.json", bytes(damaged))
        with pytest.raises(CorruptDataError, match=r"journal\.json"):
            journal_names(store)


def test_later_scenes_stay_staged_after_a_commit(tmp_path):
    staging = build(tmp_path, range(12))
    commit_scenes(staging, IDENTITY, ASSETS, 9)
    assert read_manifest(tmp_path).scenes == 9
    assert set(staged_scenes(staging)) == {9, 10, 11}, "those of the commit are in the dataset"
    assert done_scenes(staging) == frozenset(range(12))
    assert len(load_dataset(tmp_path)) == 18
    open_staging(tmp_path, IDENTITY)
    assemble(tmp_path, IDENTITY, ASSETS, 12)
    assert done_scenes(staging_of(tmp_path)) == frozenset(range(12))
    assert not (tmp_path / ".work").exists()


def test_a_temporary_file_of_somebody_else_is_not_written_over(tmp_path):
    theirs = tmp_path / storage.temporary_of("x")
    theirs.write_text("precious")
    storage.write_atomically(tmp_path / "x", b"new")
    folder = tmp_path / storage.temporary_of("y")
    folder.mkdir()
    (folder / "thesis.tex").write_text("precious")
    storage.write_folder_atomically(tmp_path / "y", lambda made: (made / "a").touch())
    assert theirs.read_text() == (folder / "thesis.tex").read_text() == "precious"
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        [theirs.name, folder.name, "x", "y"]
    )


@pytest.mark.parametrize(
    ("name", "final"),
    [
        (".x.12.tmp", "x"),
        ("data/.x.parquet.12.tmp", "data/x.parquet"),
        ("x.12.tmp", None),
        (".x.tmp", None),
        (".x.a.tmp", None),
        ("..12.tmp", None),
    ],
)
def test_temporary_names_are_told_exactly(name, final):
    assert storage.final_of(name) == final


def test_metadata_files_are_listed_with_their_digests(tmp_path):
    build(tmp_path, range(3))
    manifest = assemble(tmp_path, IDENTITY, ASSETS, 3)
    names = {"README.md", "croissant.json", "stats.json", "schemas/episodes.schema.json"}
    assert names < {file.path for file in manifest.metadata}
    for file in manifest.metadata:
        data = (tmp_path / file.path).read_bytes()
        assert (len(data), hashlib.sha256(data).hexdigest()) == (file.bytes, file.sha256)
    assert read_manifest(tmp_path) == manifest
    assert manifest.paths() == set(FolderStore(tmp_path).names())
