"""Parts of a dataset joined: the bytes of a run in one piece, or one line that says why not."""

from __future__ import annotations

import dataclasses

import pytest
import strategies
from manifests import edit_manifest
from memory_store import KilledError, MemoryStore
from test_commit import ASSETS, IDENTITY, build, split_of

from internav_data.core import storage
from internav_data.core.storage import FolderStore, LockedError
from internav_data.dataset import (
    DatasetPart,
    assemble,
    commit_scenes,
    has_manifest,
    is_unfinished,
    load_dataset,
    merge,
    open_staging,
    read_manifest,
    shards,
    stage_scene,
)
from internav_data.dataset.staging import MERGING
from internav_data.records import Episode, House, Physics
from internav_data.records.errors import CorruptDataError, InternavError, UsageError
from internav_data.records.version import __version__

OURS = dataclasses.replace(IDENTITY, generator_version=__version__)
RULES = "a" * 64
QUARANTINED = {5, 12, 13}
RANGES = {
    2: [(0, 9), (9, 26)],
    5: [(0, 3), (3, 12), (12, 14), (14, 25), (25, 26)],
}


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(storage, "sync", lambda _: None)
    monkeypatch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 8, "scenes": 10})


def part_of(store, first, end, identity=OURS, rules=RULES):
    build(store, range(first, end), identity=identity, quarantined=QUARANTINED)
    assemble(store, identity, ASSETS, end, DatasetPart(first, end, rules))
    return store


@pytest.fixture(scope="module")
def parts():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 8, "scenes": 10})
        return {k: [part_of(MemoryStore(), *each) for each in RANGES[k]] for k in RANGES}


@pytest.fixture(scope="module")
def whole():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 8, "scenes": 10})
        store = MemoryStore()
        build(store, range(26), identity=OURS, quarantined=QUARANTINED)
        assemble(store, OURS, ASSETS, 26)
        return store.blobs


def test_parts_of_two_kinds_of_processors_say_which_scenes_are_whose(monkeypatch):
    monkeypatch.setattr("internav_data.dataset.staging.hardware", lambda: "one")
    first = part_of(MemoryStore(), 0, 4)
    monkeypatch.setattr("internav_data.dataset.staging.hardware", lambda: "two")
    last = part_of(MemoryStore(), 4, 8)
    out = MemoryStore()
    held = merge([first, last], out)
    assert held.hardware == ("one", "two")
    assert held.hardware_scenes == {"one": "0:4", "two": "4:5,6:8"}, "5 is quarantined"


@pytest.mark.parametrize("count", RANGES)
def test_parts_merged_are_a_run_in_one_piece(parts, whole, count):
    before = [dict(part.blobs) for part in parts[count]]
    out, lines = MemoryStore(), []
    manifest = merge(parts[count][::-1], out, lines.append)
    assert out.blobs == whole
    assert manifest == read_manifest(out)
    assert (manifest.part, manifest.requires, manifest.scenes) == (None, (), 26)
    assert lines[-1] == "26 of 26 scenes can be read in memory:"
    assert [part.blobs for part in parts[count]] == before, "parts are only read"


def test_a_part_is_a_dataset_that_says_so(parts):
    part = parts[5][3]
    manifest = read_manifest(part)
    assert manifest.part == DatasetPart(14, 25, RULES)
    assert manifest.requires == ("part",), "earlier releases would believe that scenes begin at 0"
    assert manifest.scene_numbers == range(14, 25)
    dataset = load_dataset(part)
    assert len(dataset) == 2 * (25 - 14)
    assert dataset.scene("scene-000024").scene == 24
    assert "part 14:25" in repr(dataset)
    assert "scenes 14 to 24" in part.blobs["README.md"].decode()


def test_a_part_of_quarantined_scenes_alone_is_one(parts):
    dataset = load_dataset(parts[5][2])
    assert (len(dataset), dataset.scene_ids) == (0, ())
    assert [entry.scene for entry in dataset.manifest.quarantined] == [12, 13]


def test_killed_anywhere_the_same_call_goes_on(parts, whole):
    counting, sizes = MemoryStore(), set()
    merge(parts[2], counting)
    for deadline in range(0, counting.changes, counting.changes // 5):
        store = MemoryStore(deadline=deadline)
        with pytest.raises(KilledError):
            merge(parts[2], store)
        left = MemoryStore(store.blobs)
        if has_manifest(left):
            held = read_manifest(left).scenes
            sizes.add(held)
            assert is_unfinished(left) or held == 26
            if is_unfinished(left):
                with pytest.raises(CorruptDataError, match="the part is not finished"):
                    merge([left], MemoryStore())
            assert len({e.episode_id for e in load_dataset(left)}) == len(load_dataset(left))
        merge(parts[2], left)
        assert left.blobs == whole
        assert not is_unfinished(left)
    assert 9 in sizes, "it goes on from its last commit"


def test_parts_that_come_later_extend_it(parts, whole):
    out = MemoryStore()
    merge(parts[5][:2], out)
    assert merge(parts[5], out).scenes == 26
    assert out.blobs == whole
    changes = out.changes
    merge(parts[5], out)
    assert out.blobs == whole
    assert out.changes - changes <= 1, "nothing is written again"


def test_a_run_finishes_what_a_merge_left(parts, whole):
    out = MemoryStore()
    merge(parts[2][:1], out)
    out.put(MERGING, b"{}")  # killed before the second part came
    build(out, range(9, 26), identity=OURS, quarantined=QUARANTINED)
    assemble(out, OURS, ASSETS, 26)
    assert out.blobs == whole


def test_a_merged_dataset_is_extended_like_any_other(parts):
    out, once = MemoryStore(), MemoryStore()
    merge(parts[2], out)
    for store, first in ((out, 26), (once, 0)):
        build(store, range(first, 30), identity=OURS, quarantined=QUARANTINED)
        assemble(store, OURS, ASSETS, 30)
    assert out.blobs == once.blobs


def test_a_part_is_extended_and_committed_a_prefix_at_a_time(whole):
    first, rest = part_of(MemoryStore(), 0, 6), MemoryStore()
    staging = build(rest, range(6, 26), identity=OURS, quarantined=QUARANTINED)
    for end in (7, 15, 26):
        commit_scenes(staging, OURS, ASSETS, end, DatasetPart(6, 26, RULES))
        assert read_manifest(rest).scene_numbers == range(6, end)
        if end < 26:
            with pytest.raises(CorruptDataError, match=r"is not finished \(scenes 6 to \d+ so"):
                merge([first, rest], MemoryStore())
    assemble(rest, OURS, ASSETS, 26, DatasetPart(6, 26, RULES))
    out = MemoryStore()
    merge([first, rest], out)
    assert out.blobs == whole


def test_ranges_that_overlap_or_leave_a_hole_are_refused(parts):
    out = MemoryStore()
    two, five = parts[2], parts[5]
    for given, message in (
        ([*two, five[1]], r"holds scenes 3 to 11, of which .* holds those up to 8"),
        ([two[0], two[0]], r"holds scenes 0 to 8, of which .* holds those up to 8"),
        ([five[0], five[3]], r"scenes 3 to 13 are in no part: .*--scene-range 3:14"),
        (two[1:], r"scenes 0 to 8 are in no part"),
        ([], "expected at least one folder of a part"),
    ):
        with pytest.raises(UsageError, match=message):
            merge(given, out)
    assert out.blobs == {}


def other(first, end, **changes):
    return part_of(MemoryStore(), first, end, dataclasses.replace(OURS, **changes))


def test_parts_of_other_origin_are_refused(parts):
    out, one = MemoryStore(), parts[2][0]
    for part, message in (
        (other(9, 11, seed=8), r"no part of the same dataset .*\(seed: there 7, here 8\)"),
        (other(9, 11, catalogue_digest="1" * 64), "catalogue_digest: there '0000"),
        (other(9, 11, config={"house": {"scale": 2.0}, "list": [1, 2]}), r"config\.house\.scale"),
        (other(9, 11, generator_version="0.0.9"), r"version 0\.0\.9 of internav-data, and this"),
        (part_of(MemoryStore(), 9, 11, rules="b" * 64), f"by other code than .*{__version__}"),
    ):
        with pytest.raises(UsageError, match=message):
            merge([one, part], out)
    assert out.blobs == {}


def test_parts_of_another_version_of_the_engine_are_refused(parts):
    scene, scene_id = 9, "scene-000009"
    store, out = MemoryStore(), MemoryStore()
    staging = open_staging(store, OURS)
    house = strategies.plain(House, scene_id=scene_id, scene=scene, split=split_of(scene))
    row = strategies.plain(
        Episode,
        episode_id=f"{scene_id}/0000",
        scene_id=scene_id,
        split=split_of(scene),
        physics=strategies.plain(Physics, engine="bullet", build="3.99"),
    )
    stage_scene(staging, scene, house, [row])
    assemble(store, OURS, ASSETS, 10, DatasetPart(9, 10, RULES))
    with pytest.raises(UsageError, match=r"its physics is another version's .*bullet 3\.99"):
        merge([parts[2][0], store], out)
    assert out.blobs == {}


def test_what_is_unfinished_or_damaged_is_refused(parts, tmp_path):
    out, begun = MemoryStore(), MemoryStore()
    build(begun, range(3), identity=OURS)
    for part, message in ((begun, "not finished"), (MemoryStore(), "no dataset here")):
        with pytest.raises(CorruptDataError, match=message):
            merge([part], out)
    for name in [name for name in parts[2][0].blobs if name.startswith(("data", "stats"))]:
        damaged = MemoryStore(parts[2][0].blobs)
        damaged.blobs[name] = b"x" + damaged.blobs[name][1:]
        with pytest.raises(CorruptDataError, match=f"{name}.*: missing or damaged: run the comm"):
            merge([damaged, parts[2][1]], out)
        del damaged.blobs[name]
        with pytest.raises(CorruptDataError, match="missing or damaged"):
            merge([damaged, parts[2][1]], out)
    assert out.blobs == {}


@pytest.mark.parametrize("count", [2, 5])
def test_a_damaged_dataset_in_place_is_refused_before_anything_is_written(parts, count):
    store = MemoryStore()
    merge(parts[5][:count], store)
    name = next(name for name in store.names() if name.startswith("data/episodes/"))
    store.put(name, store.read(name)[:-1] + b"?")
    before = {name: store.read(name) for name in store.names()}
    with pytest.raises(CorruptDataError, match=rf"{name}: missing or damaged: run `generate`"):
        merge(parts[5], store)
    assert {name: store.read(name) for name in store.names()} == before


def test_folders_that_hold_something_else_are_refused(parts, tmp_path):
    two, held = parts[2], MemoryStore()
    build(held, range(3), identity=dataclasses.replace(OURS, seed=9))
    for out, message in (
        (MemoryStore({"notes": b"mine"}), "holds something that is no dataset"),
        (MemoryStore({"data/x": b"mine"}), "holds something that is no dataset"),
        (MemoryStore(held.blobs), "an unfinished run of `generate` is there"),
        (MemoryStore(two[1].blobs), "holds a part of a dataset"),
        (other(0, 3, seed=9), "holds a part of a dataset|holds another dataset"),
    ):
        before = dict(out.blobs)
        with pytest.raises(UsageError, match=message):
            merge(two, out)
        assert out.blobs == before
    within = MemoryStore()
    build(within, range(12), identity=OURS, quarantined=QUARANTINED)
    assemble(within, OURS, ASSETS, 12)
    with pytest.raises(UsageError, match=r"ends after scene 11, within .*\(scenes 9 to 25\)"):
        merge(two, within)
    (tmp_path / "file").touch()
    with pytest.raises(InternavError, match="file"):
        merge(two, tmp_path / "file")
    out = FolderStore(tmp_path / "out")
    with out.lock("busy"), pytest.raises(LockedError, match="somebody is writing this dataset"):
        merge(two, out)


def test_a_full_disk_is_one_line_and_the_same_call_goes_on(parts, whole, tmp_path, monkeypatch):
    def full(self, name, data, *, beside=""):
        if name.startswith("data/scenes"):
            raise OSError(28, "No space left on device", str(self.root / name))
        put(self, name, data, beside=beside)

    put = FolderStore.put
    monkeypatch.setattr(FolderStore, "put", full)
    with pytest.raises(InternavError, match=r"cannot write to .*No space left .* same command"):
        merge(parts[5], tmp_path / "out")
    monkeypatch.setattr(FolderStore, "put", put)
    merge(parts[5], tmp_path / "out")
    store = FolderStore(tmp_path / "out")
    assert {name: store.read(name) for name in store.names()} == whole


def test_a_part_that_contradicts_itself_is_refused(tmp_path):
    part_of(FolderStore(tmp_path), 3, 9)
    for change, message in (
        ({"first_scene": 9}, "expected scenes from a first one up to an end, got 9 up to 9"),
        ({"first_scene": -1}, "got -1 up to 9"),
        ({"end_scene": 7}, "4 scenes from 3 up to 7, but 6 stated"),
        ({"end_scene": "9"}, "got 3 up to '9'"),
        ({"rules": "x"}, "rules: expected 64 hexadecimal digits"),
    ):
        manifest = (tmp_path / "manifest.json").read_bytes()
        edit_manifest(tmp_path, lambda raw, change=change: raw["part"].update(change))
        with pytest.raises(CorruptDataError, match=message):
            read_manifest(tmp_path)
        (tmp_path / "manifest.json").write_bytes(manifest)
    edit_manifest(
        tmp_path, lambda raw: raw["quarantined"][0].update(scene=2, scene_id="scene-000002")
    )
    with pytest.raises(CorruptDataError, match="expected a scene of 3 … 8"):
        read_manifest(tmp_path)
