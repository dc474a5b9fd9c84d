"""A damaged file is named, and never read as if it were whole."""

from __future__ import annotations

import pytest
from strategies import rng

from internav_data.dataset import load_dataset, parquet, read_manifest
from internav_data.records.errors import CorruptDataError


def read_all(folder):
    ds = load_dataset(folder)
    return list(ds), [ds.scene(scene_id) for scene_id in ds.scene_ids[::40]], dict(ds.assets)


@pytest.fixture(scope="module")
def truth(dataset_folder):
    return read_all(dataset_folder)


@pytest.mark.parametrize("table", ["episodes", "scenes", "assets"])
def test_flipped_bytes_are_never_silently_wrong(damaged_folder, truth, table):
    file = read_manifest(damaged_folder).of(table)[0]
    path = damaged_folder / file.path
    data = path.read_bytes()
    places = {"episodes": 50, "scenes": 15, "assets": 15}[table]
    messages = []
    for at in rng(5).integers(0, len(data), places).tolist():
        path.write_bytes(data[:at] + bytes([data[at] ^ (1 << at % 8)]) + data[at + 1 :])
        try:
            assert read_all(damaged_folder) == truth
        except CorruptDataError as error:
            messages.append(str(error))
    assert len(messages) > places // 2
    assert all(file.path in words and "generate" in words for words in messages)
    path.write_bytes(data)
    assert read_all(damaged_folder) == truth


def test_footer_flips_are_noticed_on_opening(damaged_folder):
    file = read_manifest(damaged_folder).of("episodes")[0]
    path = damaged_folder / file.path
    data = path.read_bytes()
    length = int.from_bytes(data[-8:-4], "little") + 8
    for at in rng(6).integers(len(data) - length, len(data), 50).tolist():
        path.write_bytes(data[:at] + bytes([data[at] ^ 4]) + data[at + 1 :])
        with pytest.raises(CorruptDataError, match="damaged"):
            load_dataset(damaged_folder)[0]


@pytest.mark.parametrize("table", ["episodes", "scenes", "assets"])
@pytest.mark.parametrize("keep", [0, 3, 0.5, -1])
def test_truncated_files_are_noticed_on_loading(damaged_folder, table, keep):
    file = read_manifest(damaged_folder).of(table)[0]
    path = damaged_folder / file.path
    data = path.read_bytes()
    path.write_bytes(data[: int(keep * len(data)) if isinstance(keep, float) else keep])
    with pytest.raises(CorruptDataError, match=f"{file.path}.*bytes"):
        load_dataset(damaged_folder)


@pytest.mark.parametrize("table", ["episodes", "scenes", "assets"])
def test_missing_files_are_noticed_on_loading(damaged_folder, table):
    file = read_manifest(damaged_folder).of(table)[0]
    (damaged_folder / file.path).unlink()
    with pytest.raises(CorruptDataError, match=f"{file.path}.*missing"):
        load_dataset(damaged_folder)


def test_another_file_of_the_same_size_is_noticed(damaged_folder):
    file = read_manifest(damaged_folder).of("episodes")[0]
    (damaged_folder / file.path).write_bytes(b"\0" * file.bytes)
    with pytest.raises(CorruptDataError, match=file.path):
        load_dataset(damaged_folder)[0]


@pytest.mark.parametrize("limit", ["MAX_VALUES", "MAX_GROUP_BYTES", "MAX_FOOTER_BYTES"])
def test_row_groups_that_state_too_much_are_not_read(damaged_folder, monkeypatch, limit):
    monkeypatch.setattr(parquet, limit, 100)
    with pytest.raises(CorruptDataError, match=r"states \d+ (rows|bytes)|end like a Parquet file"):
        load_dataset(damaged_folder)[0]
