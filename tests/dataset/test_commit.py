"""Readers see a finished dataset or none, whatever is interrupted, extended or asked again."""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
import strategies

from internav_data.core import storage
from internav_data.core.hardware import hardware
from internav_data.dataset import (
    Identity,
    Staging,
    assemble,
    commit_scenes,
    done_scenes,
    has_manifest,
    held_config,
    load_dataset,
    open_staging,
    read_manifest,
    read_staged_rows,
    shards,
    stage_quarantine,
    stage_scene,
    staged_scenes,
    write_manifest,
)
from internav_data.records import Asset, Episode, House
from internav_data.records.errors import CorruptDataError, UsageError

IDENTITY = Identity("test", "1", 7, 1, "0" * 64, {"house": {"scale": 1.5}, "list": [1, 2]})
ASSETS = [strategies.plain(Asset, asset_id=name) for name in ("b", "a")]


@pytest.fixture(autouse=True)
def without_waiting_for_the_disk(request, monkeypatch):
    if "full_disk" not in request.node.name:
        monkeypatch.setattr(storage, "sync", lambda _: None)


def split_of(scene):
    return ("val", "test", "train")[min(scene % 120, 2)]


def staging_of(out, identity=IDENTITY):
    return Staging(storage.store_of(out), identity.digest())


def build(out, scenes, episodes=2, identity=IDENTITY, quarantined=()):
    staging = open_staging(out, identity)
    for scene in scenes:
        split, scene_id = split_of(scene), f"scene-{scene:06d}"
        if scene in quarantined:
            stage_quarantine(staging, scene, "too small", split=split, attempts=3)
            continue
        house = strategies.plain(House, scene_id=scene_id, scene=scene, split=split)
        rows = [
            strategies.plain(
                Episode,
                episode_id=f"{scene_id}/{index:04d}",
                scene_id=scene_id,
                split=split,
                index=index,
                room_count=1 + scene % 10,
            )
            for index in range(episodes)
        ]
        stage_scene(staging, scene, house, rows, redraws={"spot": 1})
    return staging


def tree(folder):
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture
def few_scenes_a_shard(monkeypatch):
    monkeypatch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 24, "scenes": 50})


def test_shards_are_of_the_stated_sizes_and_names(tmp_path):
    build(tmp_path, range(300), 1)
    manifest = assemble(tmp_path, IDENTITY, ASSETS, 300)
    rows = {f.path.removesuffix(f"-{f.sha256[:8]}.parquet"): f.rows for f in manifest.files}
    assert rows == {
        "data/episodes/train-00000": 240,
        "data/episodes/train-00001": 54,
        "data/episodes/val-00000": 3,
        "data/episodes/test-00000": 3,
        "data/scenes/train-00000": 294,
        "data/scenes/val-00000": 3,
        "data/scenes/test-00000": 3,
        "data/assets": 2,
    }
    assert not (tmp_path / ".work").exists()
    for file in manifest.files:
        data = (tmp_path / file.path).read_bytes()
        assert (len(data), hashlib.sha256(data).hexdigest()) == (file.bytes, file.sha256)


def test_same_bytes_in_any_order_of_work(tmp_path):
    trees = []
    for order in (range(40), reversed(range(40))):
        out = tmp_path / str(len(trees))
        build(out, order)
        assemble(out, IDENTITY, ASSETS if trees else ASSETS[::-1], 40)
        trees.append(tree(out))
    assert trees[0] == trees[1]


@pytest.mark.usefixtures("few_scenes_a_shard")
def test_an_extended_dataset_equals_one_built_at_once(tmp_path):
    once, grown = tmp_path / "once", tmp_path / "grown"
    build(once, range(130), quarantined={5, 90})
    assemble(once, IDENTITY, ASSETS, 130)
    for low, high in ((0, 10), (10, 31), (31, 100), (100, 130)):
        build(grown, range(low, high), quarantined={5, 90})
        assemble(grown, IDENTITY, ASSETS, high)
    assert tree(once) == tree(grown)
    manifest = read_manifest(grown)
    assert [q.scene for q in manifest.quarantined] == [5, 90]
    assert manifest.redraws == {"spot": 128}
    assert done_scenes(staging_of(grown)) == frozenset(range(130))


@pytest.mark.usefixtures("few_scenes_a_shard")
def test_extending_in_different_steps_to_the_same_scenes_is_the_same(tmp_path):
    build(tmp_path, range(60))
    assemble(tmp_path, IDENTITY, ASSETS, 60)
    before = tree(tmp_path)
    open_staging(tmp_path, IDENTITY)
    assemble(tmp_path, IDENTITY, ASSETS, 60)
    assert tree(tmp_path) == before


class _KilledError(Exception):
    pass


@pytest.mark.parametrize("first", [0, 10])
def test_killed_anywhere_readers_are_safe_and_the_next_call_finishes(tmp_path, monkeypatch, first):
    monkeypatch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 8, "scenes": 20})
    wanted, begun = tmp_path / "wanted", tmp_path / "begun"
    build(wanted, range(20))
    assemble(wanted, IDENTITY, ASSETS, 20)
    if first:
        build(begun, range(first))
        assemble(begun, IDENTITY, ASSETS, first)
    build(begun, range(first, 20))
    steps = killed_after(shutil.copytree(begun, tmp_path / "whole"), None, monkeypatch)
    # Every step while things are put in place, every fourth while shards are made.
    for deadline in (*range(0, steps - 24, 4), *range(max(0, steps - 24), steps)):
        out = shutil.copytree(begun, tmp_path / f"out-{deadline}")
        assert killed_after(out, deadline, monkeypatch) == deadline
        assert has_manifest(out) or not first
        if has_manifest(out):
            ids = [episode.episode_id for episode in load_dataset(out)]
            assert len(ids) in {2 * first, 40}
            assert len(set(ids)) == len(ids)
        open_staging(out, IDENTITY)
        assert done_scenes(staging_of(out)) == frozenset(range(20))
        assemble(out, IDENTITY, ASSETS, 20)
        assert tree(out) == tree(wanted)
        shutil.rmtree(out)


def killed_after(out, deadline, monkeypatch):
    """Assemble 20 scenes, killed after some renames and removals; return how many there were."""
    real = {name: getattr(Path, name) for name in ("replace", "unlink")}
    steps = 0

    def counted(name):
        def step(*args, **kwargs):
            nonlocal steps
            if steps == deadline:
                raise _KilledError
            steps += 1
            return real[name](*args, **kwargs)

        return step

    with monkeypatch.context() as patch, contextlib.suppress(_KilledError):
        for name in real:
            patch.setattr(Path, name, counted(name))
        assemble(out, IDENTITY, ASSETS, 20)
    return steps


@pytest.mark.parametrize("committed", [False, True])
def test_quarantined_scenes_are_done_unless_they_are_to_be_tried_again(tmp_path, committed):
    staging = build(tmp_path, range(5), quarantined={4})
    stage_quarantine(staging, 5, "killed", split="train", attempts=3, died=True)
    if committed:
        assemble(tmp_path, IDENTITY, ASSETS, 6)
    again = {
        retry: set(range(6)) - done_scenes(staging, retry) for retry in ("none", "died", "all")
    }
    assert again == {"none": set(), "died": {5}, "all": {4, 5}}


def test_missing_scene_is_named(tmp_path):
    build(tmp_path, [0, 1, 3])
    with pytest.raises(CorruptDataError, match="first 2"):
        assemble(tmp_path, IDENTITY, ASSETS, 4)
    assert not has_manifest(tmp_path)


def test_a_scene_without_episodes_stays(tmp_path):
    build(tmp_path, range(3), episodes=0)
    assert assemble(tmp_path, IDENTITY, ASSETS, 3).counts["train"].scenes == 1
    build(tmp_path, range(3, 6))
    assemble(tmp_path, IDENTITY, ASSETS, 6)
    assert len(load_dataset(tmp_path)) == 6


def test_damaged_work_counts_as_not_done(tmp_path):
    staging = build(tmp_path, range(4))
    assert set(staged_scenes(staging)) == set(range(4))
    path = tmp_path / staging.name(2)
    data = path.read_bytes()
    for at in range(0, len(data), 97):
        path.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
        assert set(staged_scenes(staging)) == {0, 1, 3}
        with pytest.raises(CorruptDataError):
            read_staged_rows(staging, 2, house=False)
    path.write_bytes(data[:-5])
    assert set(staged_scenes(staging, range(3))) == {0, 1}


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"seed": 8}, "seed: there 7, asked for 8"),
        ({"config": {"house": {"scale": 2.0}, "list": [1, 2]}}, "config.house.scale"),
        ({"catalogue_digest": "1" * 64}, "catalogue_digest"),
    ],
)
def test_another_configuration_is_refused(tmp_path, change, named):
    other = Identity(**{**{f: getattr(IDENTITY, f) for f in IDENTITY.__slots__}, **change})
    build(tmp_path, range(2))
    with pytest.raises(UsageError, match=named):
        open_staging(tmp_path, other)
    assemble(tmp_path, IDENTITY, ASSETS, 2)
    before = tree(tmp_path)
    with pytest.raises(UsageError, match=named):
        open_staging(tmp_path, other)
    assert tree(tmp_path) == before


def test_a_setting_that_is_younger_than_the_dataset_has_its_default(tmp_path):
    values = {f: getattr(IDENTITY, f) for f in IDENTITY.__slots__}
    config = {**IDENTITY.config, "house": {**IDENTITY.config["house"], "roof": "flat"}}
    today = Identity(**{**values, "config": config})
    build(tmp_path, range(2))
    assemble(tmp_path, IDENTITY, ASSETS, 2)
    open_staging(tmp_path, today, config)
    with pytest.raises(UsageError, match=r"config\.house\.roof"):
        open_staging(tmp_path, today, {"house": {"roof": "steep"}})


def test_a_setting_that_has_moved_is_the_same_setting(tmp_path):
    values = {f: getattr(IDENTITY, f) for f in IDENTITY.__slots__}
    before = Identity(**{**values, "config": {"episodes": {"push_model": "kick"}}})
    today = Identity(**{**values, "config": {"episodes": {}, "world": {"push_model": "kick"}}})
    staging = open_staging(tmp_path, before)
    staging.check()
    open_staging(tmp_path, today)
    other = Identity(**{**values, "config": {"episodes": {}, "world": {"push_model": "force"}}})
    with pytest.raises(UsageError, match=r"config\.world\.push_model"):
        open_staging(tmp_path, other)


def test_tuples_in_a_configuration_are_lists_on_disk(tmp_path):
    values = {f: getattr(IDENTITY, f) for f in IDENTITY.__slots__}
    same = Identity(**{**values, "config": {"house": {"scale": 1.5}, "list": (1, 2)}})
    build(tmp_path, range(2))
    assemble(tmp_path, IDENTITY, ASSETS, 2)
    open_staging(tmp_path, same)
    assert done_scenes(staging_of(tmp_path)) == frozenset(range(2)), "nothing is made again"


def test_the_config_of_a_folder_is_that_of_its_dataset_or_of_its_staged_scenes(tmp_path):
    assert held_config(tmp_path) is None
    open_staging(tmp_path, IDENTITY)
    assert held_config(tmp_path) is None, "nothing of that config is there yet"
    build(tmp_path, range(2))
    assert held_config(tmp_path) == IDENTITY.config
    assemble(tmp_path, IDENTITY, ASSETS, 2)
    assert held_config(tmp_path) == IDENTITY.config


def test_foreign_folder_and_file_are_refused_untouched(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(UsageError, match="no dataset"):
        open_staging(tmp_path, IDENTITY)
    assert tree(tmp_path).keys() == {"thesis.tex"}
    with pytest.raises(UsageError, match="is a file"):
        open_staging(tmp_path / "thesis.tex", IDENTITY)


def test_full_disk_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "x"
    storage.write_atomically(path, b"old")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        storage.write_atomically(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_all_hardware_that_made_a_dataset_is_named(tmp_path, monkeypatch):
    def extended(low, high):
        build(tmp_path, range(low, high))
        return assemble(tmp_path, IDENTITY, ASSETS, high)

    first, ours = extended(0, 3), hardware()
    assert (first.hardware, first.hardware_scenes) == ((ours,), None)
    monkeypatch.setattr("internav_data.dataset.staging.hardware", lambda: "another")
    manifest = extended(3, 5)
    assert manifest.hardware == tuple(sorted((ours, "another")))
    assert manifest.hardware_scenes == {ours: "0:3", "another": "3:5"}
    monkeypatch.undo()
    manifest = extended(5, 6)
    assert manifest.hardware_scenes == {ours: "0:3,5:6", "another": "3:5"}
    assert read_manifest(tmp_path) == manifest
    for wrong, message in (
        ({ours: "0:3,5:6", "another": "3:4"}, "scene 4 is named 0 times"),
        ({ours: "0:3,5:6", "another": "2:5"}, "scene 2 is named 2 times"),
        ({ours: "0:3,5:6", "another": "3:7"}, "expected scenes of"),
        ({ours: "5:6,0:3", "another": "3:5"}, "expected ranges that ascend"),
        ({ours: "0:3,5:6", "another": 3}, "expected ranges of scenes"),
        ({ours: "0:3,5:6", "another": "\N{ARABIC-INDIC DIGIT THREE}:5"}, "expected ranges of"),
        ({ours: "0:6"}, "expected an object with the keys"),
    ):
        with pytest.raises(CorruptDataError, match=message):
            write_manifest(tmp_path, replace(manifest, hardware_scenes=wrong))
    write_manifest(tmp_path, replace(manifest, hardware=(), hardware_scenes=None))
    assert extended(6, 7).hardware == (), "who made its first scenes is not known"


def test_scenes_that_a_run_staged_on_another_machine_are_told_apart(tmp_path, monkeypatch):
    """One began on another machine, where the last of its scenes failed; it goes on here."""
    monkeypatch.setattr("internav_data.dataset.staging.hardware", lambda: "another")
    staging = open_staging(tmp_path, IDENTITY)
    build(tmp_path, range(2))
    stage_quarantine(staging, 2, "no way", split="train", attempts=3, died=True)
    commit_scenes(staging, IDENTITY, ASSETS, 3)
    monkeypatch.undo()
    build(tmp_path, range(3, 5))
    manifest = assemble(tmp_path, IDENTITY, ASSETS, 5)
    assert manifest.hardware_scenes == {"another": "0:2", hardware(): "3:5"}
    build(tmp_path, range(2, 3))  # tried again
    manifest = assemble(tmp_path, IDENTITY, ASSETS, 5)
    assert manifest.hardware_scenes == {"another": "0:2", hardware(): "2:5"}


@pytest.mark.usefixtures("few_scenes_a_shard")
def test_shards_of_another_release_are_extended_under_todays_names(tmp_path):
    """Releases before this one named shards by their number and count."""
    grown, once = tmp_path / "grown", tmp_path / "once"
    build(grown, range(60))
    manifest = assemble(grown, IDENTITY, ASSETS, 60)
    files = []
    for file in manifest.files:
        name = f"{file.path.rsplit('-', 1)[0]}-of-00009.parquet"
        (grown / file.path).rename(grown / name)
        files.append(replace(file, path=name))
    write_manifest(grown, replace(manifest, files=tuple(files)))
    assert len(load_dataset(grown)) == 120
    for out, scenes in ((grown, range(60, 70)), (once, range(70))):
        build(out, scenes)
        assemble(out, IDENTITY, ASSETS, 70)
    assert tree(grown) == tree(once)
