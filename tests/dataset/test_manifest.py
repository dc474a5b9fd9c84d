"""A manifest that is damaged, newer or points elsewhere is refused with what to do."""

from __future__ import annotations

import errno
import json
from dataclasses import replace
from pathlib import Path

import pytest
from manifests import edit_manifest as edit
from memory_store import MemoryStore

from internav_data.dataset import load_dataset, locate, read_manifest, write_manifest
from internav_data.records.errors import CorruptDataError

BEFORE_DIGESTS = Path(__file__).parents[1] / "data" / "dataset-10" / "manifest.json"
"""Manifest of the last release that wrote no digest."""


def test_manifest_returns_as_written(dataset_folder, tmp_path):
    manifest = read_manifest(dataset_folder)
    write_manifest(tmp_path, manifest)
    assert read_manifest(tmp_path) == manifest
    assert (tmp_path / "manifest.json").read_bytes() == (
        dataset_folder / "manifest.json"
    ).read_bytes()


def test_newer_version_says_upgrade(damaged_folder):
    edit(damaged_folder, lambda raw: raw.update(format_version=3, news=[1]))
    with pytest.raises(CorruptDataError, match="upgrade"):
        load_dataset(damaged_folder)


def test_version_1_is_refused_with_advice(damaged_folder):
    edit(damaged_folder, lambda raw: raw.update(format_version=1))
    with pytest.raises(CorruptDataError, match=r"format version 1, .*: generate the dataset anew"):
        load_dataset(damaged_folder)


def test_unknown_keys_are_ignored_unless_required(damaged_folder):
    before = read_manifest(damaged_folder)

    def add(raw):
        raw.update(news=[1])
        raw["files"][0].update(news=2)
        raw["counts"]["train"].update(news=3)

    edit(damaged_folder, add)
    assert replace(read_manifest(damaged_folder), sha256=before.sha256) == before
    edit(damaged_folder, lambda raw: raw.update(requires=["counts", "episodes.sealed"]))
    assert read_manifest(damaged_folder).requires == ("counts", "episodes.sealed")
    edit(damaged_folder, lambda raw: raw.update(requires=["news"]))
    with pytest.raises(CorruptDataError, match="does not know news"):
        read_manifest(damaged_folder)


def test_keys_with_a_default_may_be_absent(damaged_folder):
    before = read_manifest(damaged_folder)
    edit(damaged_folder, lambda raw: raw.pop("requires"))
    assert replace(read_manifest(damaged_folder), sha256=before.sha256) == before


@pytest.mark.parametrize("version", [None, "1", 0, True, 1.5])
def test_no_version_is_refused(damaged_folder, version):
    edit(damaged_folder, lambda raw: raw.update(format_version=version))
    with pytest.raises(CorruptDataError, match="format_version"):
        read_manifest(damaged_folder)


@pytest.mark.parametrize(
    "path",
    [
        "/etc/passwd.parquet",
        "data/../../x.parquet",
        "../x.parquet",
        "data\\x.parquet",
        "data/x.txt",
        "",
        None,
        7,
        ["data/x.parquet"],
        "data/\0.parquet",
        "manifest.json",
    ],
)
def test_paths_out_of_the_dataset_are_refused(damaged_folder, path):
    edit(damaged_folder, lambda raw: raw["files"][0].update(path=path))
    with pytest.raises(CorruptDataError, match=r"Parquet file below data/|NUL"):
        read_manifest(damaged_folder)


@pytest.mark.parametrize(
    "path", ["/etc/passwd", "../x", "data/x.txt", "manifest.json", ".work/x", "", None]
)
def test_paths_that_are_not_beside_the_data_are_refused(damaged_folder, path):
    edit(damaged_folder, lambda raw: raw["metadata"][0].update(path=path))
    with pytest.raises(CorruptDataError, match="expected a file beside data/"):
        read_manifest(damaged_folder)


def flipped(text, bits):
    """Yield a text with one bit flipped, for each of some numbers of bits."""
    for bit in bits:
        at, mask = bit // 8, 1 << bit % 8
        yield text[:at] + bytes([text[at] ^ mask]) + text[at + 1 :]


def unnoticed(text, bits):
    """Return the damaged texts that are read, though they say something else."""
    whole = json.loads(text)
    found = []
    for damaged in flipped(text, bits):
        try:
            read_manifest(MemoryStore({"manifest.json": damaged}))
        except CorruptDataError:
            continue
        if json.loads(damaged) != whole:
            found.append(damaged)
    return found


def test_a_flipped_bit_of_the_manifest_is_noticed(dataset_folder):
    text = (dataset_folder / "manifest.json").read_bytes()
    assert not unnoticed(text, [8 * at + (at + at // 8) % 8 for at in range(len(text))])
    digest = text.index(b'"sha256": "', text.rindex(b"requires"))
    assert not unnoticed(text, range(8 * (digest - 4), 8 * len(text)))


@pytest.mark.slow
def test_every_flipped_bit_of_the_manifest_is_noticed(dataset_folder):
    text = (dataset_folder / "manifest.json").read_bytes()
    assert not unnoticed(text, range(8 * len(text)))


def test_an_edited_manifest_is_refused(damaged_folder):
    path = damaged_folder / "manifest.json"
    path.write_text(path.read_text().replace('"seed": 0', '"seed": 1'))
    with pytest.raises(CorruptDataError, match="damaged or edited"):
        read_manifest(damaged_folder)


def test_another_indentation_is_the_same_manifest(damaged_folder):
    before = read_manifest(damaged_folder)
    path = damaged_folder / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text())))
    assert read_manifest(damaged_folder) == before


def test_a_manifest_from_before_digests_is_read_and_one_that_lost_it_is_not(damaged_folder):
    before = json.loads(BEFORE_DIGESTS.read_text())
    assert "sha256" not in before
    assert read_manifest(BEFORE_DIGESTS.parent).scenes == before["scenes"]
    path = damaged_folder / "manifest.json"
    path.write_text(path.read_text().replace('\n "sha256"', '\n "sha356"'))
    with pytest.raises(CorruptDataError, match="'hardware' but no sha256"):
        read_manifest(damaged_folder)


def counted(**values):
    return lambda raw: raw["counts"]["val"].update(values)


def of_file(number, **values):
    return lambda raw: raw["files"][number].update(values)


def given_up(**values):
    entry = {"scene": 3, "scene_id": "scene-000003", "attempts": 1, "reason": "x"} | values
    return lambda raw: raw.update(quarantined=[entry], scenes=raw["scenes"] + 1)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (of_file(0, table="dpisodes"), "table: expected"),
        (of_file(0, table=["episodes"]), "table: expected"),
        (of_file(0, table="assets"), "split: expected null"),
        (of_file(0, split="vbl"), "split: expected one of"),
        (of_file(-1, split="val"), "split: expected null"),
        (of_file(0, split="val"), "counts: train"),
        (of_file(0, sha256="0"), "sha256: expected 64"),
        (of_file(0, rows=1), "counts: train"),
        (lambda raw: raw["files"].append(raw["files"][0]), "named 2 times"),
        (lambda raw: raw["files"].pop(0), "counts: train"),
        (lambda raw: raw["files"].pop(), "expected 1 of assets, got 0"),
        (lambda raw: raw.update(scenes=0), "scenes: 130 in its files"),
        (lambda raw: raw.update(scenes="130"), "scenes: 130 in its files"),
        (lambda raw: raw["counts"].pop("test"), "counts: expected"),
        (counted(scenes=3), "counts: val: 2 scenes"),
        (counted(episodes=True), "counts: val: 12 episodes"),
        (lambda raw: raw.update(seed="0"), "seed: expected"),
        (lambda raw: raw.update(config=[]), "config: expected"),
        (lambda raw: raw.update(generator=1), "generator: expected"),
        (lambda raw: raw.update(redraws=[]), "redraws: expected"),
        (lambda raw: raw.update(redraws={"x": -1}), "redraws: 'x'"),
        (given_up(scene=300, scene_id="scene-000300"), "expected a scene of 0 … 130"),
        (given_up(scene_id="scene-000004"), "quarantined: 'scene-.*expected its scene"),
        (given_up(scene="3"), "quarantined: 'scene-.*expected its scene"),
        (lambda raw: raw.update(quarantined=[{**Q}, {**Q}], scenes=132), "named 2 times"),
    ],
)
def test_a_manifest_that_contradicts_itself_is_refused(damaged_folder, change, words):
    edit(damaged_folder, change)
    with pytest.raises(CorruptDataError, match=words):
        load_dataset(damaged_folder)


Q = {"scene": 3, "scene_id": "scene-000003", "attempts": 1, "reason": "x"}


def test_a_manifest_that_contradicts_itself_is_not_written(damaged_folder):
    before = read_manifest(damaged_folder)
    with pytest.raises(CorruptDataError, match="scenes: 130 in its files"):
        write_manifest(damaged_folder, replace(before, scenes=131))
    assert read_manifest(damaged_folder) == before


def test_a_file_of_other_rows_than_stated_is_refused(damaged_folder):
    def change(raw):
        raw["files"][0]["rows"] += 1
        raw["counts"]["train"]["episodes"] += 1

    edit(damaged_folder, change)
    with pytest.raises(CorruptDataError, match=r"expected \d+ rows"):
        load_dataset(damaged_folder)[0]


def test_a_file_longer_than_stated_is_refused(damaged_folder):
    file = read_manifest(damaged_folder).files[0]
    with (damaged_folder / file.path).open("ab") as longer:
        longer.write(b"x")
    with pytest.raises(
        CorruptDataError, match=rf"expected {file.bytes} bytes, got {file.bytes + 1}"
    ):
        load_dataset(damaged_folder)[0]


@pytest.mark.parametrize("name", ["rows", "bytes"])
@pytest.mark.parametrize("value", [-1, 1 << 60, "9", None, 1.5, True])
def test_sizes_are_bounded(damaged_folder, name, value):
    edit(damaged_folder, lambda raw: raw["files"][0].update({name: value}))
    with pytest.raises(CorruptDataError, match=f"{name}: expected"):
        read_manifest(damaged_folder)


@pytest.mark.parametrize("value", [-1, 1 << 60, "9", None])
def test_sizes_of_files_beside_the_data_are_bounded(damaged_folder, value):
    edit(damaged_folder, lambda raw: raw["metadata"][0].update(bytes=value))
    with pytest.raises(CorruptDataError, match="bytes: expected"):
        read_manifest(damaged_folder)


def test_a_table_may_have_no_rows(damaged_folder):
    edit(damaged_folder, lambda raw: raw["files"][-1].update(rows=0))
    assert read_manifest(damaged_folder).of("assets")[0].rows == 0


def test_more_files_than_a_dataset_has_are_refused(damaged_folder):
    entry = dict.fromkeys(("path", "table", "sha256", "footer_sha256", "logical_digest"), "")
    entry |= {"split": None, "rows": 0, "bytes": 0}
    edit(damaged_folder, lambda raw: raw.update(files=[entry] * 100_001))
    with pytest.raises(CorruptDataError, match="names more than 100000 files"):
        read_manifest(damaged_folder)


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "[" * 100_000, '{"format_version": 1}'])
def test_no_manifest_at_all(damaged_folder, text):
    (damaged_folder / "manifest.json").write_text(text)
    with pytest.raises(CorruptDataError, match=r"manifest\.json"):
        read_manifest(damaged_folder)


@pytest.mark.parametrize(
    "change",
    [
        lambda raw: raw["files"].append("x"),
        lambda raw: raw.update(files=3),
        lambda raw: raw.update(counts=[]),
        lambda raw: raw["counts"].update(val=None),
        lambda raw: raw.pop("seed"),
        lambda raw: raw["quarantined"].append({"scene": 1}),
        lambda raw: raw["files"][0].pop("sha256"),
    ],
)
def test_wrong_shapes_are_refused(damaged_folder, change):
    edit(damaged_folder, change)
    with pytest.raises(CorruptDataError, match="not a manifest"):
        read_manifest(damaged_folder)


def test_nothing_of_the_machine_is_in_it(dataset_folder):
    text = (dataset_folder / "manifest.json").read_text()
    assert str(dataset_folder.parent) not in text


def test_a_manifest_that_the_disk_does_not_give_is_one_line():
    class Broken(MemoryStore):
        def read(self, name, **_):
            raise OSError(errno.EIO, "Input/output error", name)

    with pytest.raises(
        CorruptDataError, match=r"manifest\.json: cannot be read: Input/output error"
    ):
        read_manifest(Broken())


def test_errors_of_unfinished_and_absent_datasets_differ(tmp_path):
    with pytest.raises(CorruptDataError, match="no dataset here"):
        load_dataset(tmp_path)
    (tmp_path / ".work").mkdir()
    (tmp_path / ".work" / "identity.json").write_text("{}")
    with pytest.raises(CorruptDataError, match="resume"):
        load_dataset(tmp_path)


def test_the_place_of_a_file_that_is_cut_or_missing_is_not_given(damaged_folder):
    file = read_manifest(damaged_folder).files[0]
    path = locate(damaged_folder, file)
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(CorruptDataError, match="bytes"):
        locate(damaged_folder, file)
    path.unlink()
    with pytest.raises(CorruptDataError, match="missing"):
        locate(damaged_folder, file)
