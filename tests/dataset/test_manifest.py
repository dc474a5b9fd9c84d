"""A manifest that is damaged, newer or points elsewhere is refused with what to do."""

from __future__ import annotations

import json

import pytest

from internav_data.dataset import load_dataset, read_manifest, write_manifest
from internav_data.records.errors import CorruptDataError


def edit(folder, change):
    path = folder / "manifest.json"
    raw = json.loads(path.read_text())
    change(raw)
    path.write_text(json.dumps(raw))


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
    with pytest.raises(CorruptDataError, match="generate the dataset anew"):
        load_dataset(damaged_folder)


def test_unknown_keys_are_ignored_unless_required(damaged_folder):
    before = read_manifest(damaged_folder)

    def add(raw):
        raw.update(news=[1])
        raw["files"][0].update(news=2)
        raw["counts"]["train"].update(news=3)

    edit(damaged_folder, add)
    assert read_manifest(damaged_folder) == before
    edit(damaged_folder, lambda raw: raw.update(requires=["counts", "episodes.sealed"]))
    assert read_manifest(damaged_folder).requires == ("counts", "episodes.sealed")
    edit(damaged_folder, lambda raw: raw.update(requires=["news"]))
    with pytest.raises(CorruptDataError, match="does not know news"):
        read_manifest(damaged_folder)


def test_keys_with_a_default_may_be_absent(damaged_folder):
    before = read_manifest(damaged_folder)
    edit(damaged_folder, lambda raw: raw.pop("requires"))
    assert read_manifest(damaged_folder) == before


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
    with pytest.raises(CorruptDataError, match="Parquet file below data/"):
        read_manifest(damaged_folder)


def test_link_out_of_the_dataset_is_refused(damaged_folder, tmp_path):
    path = damaged_folder / read_manifest(damaged_folder).files[0].path
    outside = tmp_path / "outside.parquet"
    path.rename(outside)
    path.symlink_to(outside)
    with pytest.raises(CorruptDataError, match="link out of the dataset"):
        load_dataset(damaged_folder)


@pytest.mark.parametrize("name", ["rows", "bytes"])
@pytest.mark.parametrize("value", [-1, 1 << 60, "9", None, 1.5, True])
def test_sizes_are_bounded(damaged_folder, name, value):
    edit(damaged_folder, lambda raw: raw["files"][0].update({name: value}))
    with pytest.raises(CorruptDataError, match=f"{name}: expected"):
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


def test_errors_of_unfinished_and_absent_datasets_differ(tmp_path):
    with pytest.raises(CorruptDataError, match="no dataset here"):
        load_dataset(tmp_path)
    (tmp_path / ".work").mkdir()
    (tmp_path / ".work" / "identity.json").write_text("{}")
    with pytest.raises(CorruptDataError, match="resume"):
        load_dataset(tmp_path)
