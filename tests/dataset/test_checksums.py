"""Every byte of a data file is watched: chunks, page headers too, by the footer, the footer by the
manifest."""

from __future__ import annotations

import io

import pyarrow.parquet as pq
import pytest
from damage import flipped
from memory_store import MemoryStore
from page_headers import page_headers
from strategies import rng
from synthetic import write_synthetic

from internav_data.dataset import (
    ASSETS,
    EPISODES,
    SCENES,
    compute_stats,
    load_dataset,
    read_manifest,
    read_table,
)
from internav_data.dataset.checksums import KEY, checksums_of
from internav_data.dataset.manifest import open_file
from internav_data.dataset.parquet import parquet_bytes
from internav_data.records.errors import CorruptDataError

COLUMNS = ("room_count", "expert.actions.list.element", "obstacles.list.element.type")
"""A plain column, a list and a list in a list, whose page headers are damaged bit by bit."""


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    """A dataset of two scenes, and a file of its episodes."""
    folder = tmp_path_factory.mktemp("checksums") / "few"
    write_synthetic(folder, 2, 3, full=True)
    return folder, read_manifest(folder).of("episodes")[0]


def test_a_file_without_rows_is_read_by_columns(tmp_path):
    (tmp_path / "none.parquet").write_bytes(parquet_bytes(EPISODES.schema.empty_table(), EPISODES))
    table = read_table(tmp_path / "none.parquet", EPISODES, ["mode", "obstacles"])
    assert (table.num_rows, table.column_names) == (0, ["mode", "obstacles"])


def opened(file, data, spec=EPISODES):
    """Open a file's bytes as the manifest's file, without its size having been compared."""
    return open_file(MemoryStore({file.path: data}), file, spec)


def read_plainly(data, column):
    """Return a column as Parquet's reader gives it with page checksums; None if it refuses."""
    try:
        with pq.ParquetFile(io.BytesIO(data), page_checksum_verification=True) as file:
            table = file.read([column])
            table.validate(full=True)
    except Exception:  # noqa: BLE001 - whatever pyarrow raises for damage
        return None
    return table


@pytest.mark.parametrize("column", COLUMNS)
def test_a_flipped_bit_of_a_page_header_is_refused(few, column):
    folder, file = few
    data = (folder / file.path).read_bytes()
    truth = read_plainly(data, column)
    silent = 0
    for path, start, stop in page_headers(data, pq.read_metadata(folder / file.path)):
        for place in range(8 * start, 8 * stop, 3) if path == column else ():
            damaged = flipped(data, place // 8, place % 8)
            found = read_plainly(damaged, column)
            silent += found is not None and not found.equals(truth)
            with opened(file, damaged) as ours, pytest.raises(CorruptDataError, match="checksum"):
                ours.read_all([column])
    assert silent, "page checksums notice none of these, or the test has lost its point"


def unnoticed(few, places):
    """Return the places of a file at which a flipped bit changes rows without an error."""
    folder, file = few
    data = (folder / file.path).read_bytes()
    with opened(file, data) as whole:
        truth = whole.read_all()
    found = []
    for place in places:
        try:
            with opened(file, flipped(data, place // 8, place % 8)) as damaged:
                if not damaged.read_all().equals(truth):
                    found.append(place)
        except CorruptDataError:
            continue
    return found


def bits_of_headers(few, columns, step):
    """Return every so many bits of the page headers of some columns, which no page covers."""
    folder, file = few
    data, metadata = (folder / file.path).read_bytes(), pq.read_metadata(folder / file.path)
    return [
        place
        for column, start, stop in page_headers(data, metadata)
        if column in columns
        for place in range(8 * start, 8 * stop, step)
    ]


def test_no_flipped_bit_of_a_file_gives_other_rows(few):
    bits = 8 * few[1].bytes
    ends = [*range(64), *range(bits - 64, bits)]
    headers = bits_of_headers(few, COLUMNS[1:2], 3)
    assert not unnoticed(few, [*ends, *headers, *rng(0).integers(0, bits, 300).tolist()])


@pytest.mark.slow
def test_no_flipped_bit_of_any_byte_gives_other_rows(few):
    bytes_ = [8 * at + at % 8 for at in range(few[1].bytes)]
    assert not unnoticed(few, [*bits_of_headers(few, COLUMNS, 1), *bytes_])


@pytest.fixture
def damaged_header(damaged_folder):
    """A dataset with a damaged page header in the column room_count."""
    path = damaged_folder / read_manifest(damaged_folder).of("episodes")[0].path
    data = path.read_bytes()
    headers = page_headers(data, pq.read_metadata(path))
    start = next(start for column, start, _ in headers if column == "room_count")
    path.write_bytes(flipped(data, start + 1, 1))
    return damaged_folder


READERS = {
    "a record": lambda folder: load_dataset(folder)[0],
    "some columns of a record": lambda folder: load_dataset(folder, columns=["room_count"])[0],
    "iteration": lambda folder: list(load_dataset(folder)),
    "a stream": lambda folder: list(load_dataset(folder).iterable()),
    "a table": lambda folder: load_dataset(folder).to_table(["room_count"]),
    "filters": lambda folder: load_dataset(folder, filters=[("room_count", ">", 1)]),
    "statistics": compute_stats,
    "a file": lambda folder: read_table(
        folder / read_manifest(folder).of("episodes")[0].path, EPISODES
    ),
}


@pytest.mark.parametrize("reader", READERS)
def test_every_reader_refuses_a_damaged_page_header(damaged_header, reader):
    with pytest.raises(CorruptDataError, match="another checksum"):
        READERS[reader](damaged_header)


def test_chunks_that_are_not_read_are_not_checked(damaged_header):
    dataset = load_dataset(damaged_header, columns=["mode", "expert"])
    assert {row["mode"] for row in dataset} == {"blocked", "lengthened"}
    assert dataset.to_table(["sealed"]).num_rows == len(dataset)


@pytest.mark.parametrize("spec", [EPISODES, SCENES, ASSETS], ids=lambda spec: spec.name)
def test_checksums_cover_the_file_up_to_its_footer(few, spec):
    folder, _ = few
    for file in read_manifest(folder).of(spec.name):
        metadata = pq.read_metadata(folder / file.path)
        checksums = checksums_of(metadata)
        bounds = [
            (start, end)
            for starts, ends in zip(checksums.starts, checksums.ends, strict=True)
            for start, end in zip(starts, ends, strict=True)
        ]
        assert [start for start, _ in bounds] == [4, *(end for _, end in bounds[:-1])]
        assert bounds[-1][1] == file.bytes - metadata.serialized_size - 8


@pytest.mark.parametrize("text", [b"", b"AAAA", b"no base64!"])
def test_checksums_of_another_file_are_refused(few, text, monkeypatch):
    monkeypatch.setattr("internav_data.dataset.checksums.base64.b64encode", lambda _: text)
    folder, file = few
    table = read_table(folder / file.path, EPISODES)
    (folder / "other.parquet").write_bytes(parquet_bytes(table, EPISODES))
    with pytest.raises(CorruptDataError, match="damaged"):
        read_table(folder / "other.parquet", EPISODES)


def test_rows_carry_no_checksums(few):
    folder, file = few
    assert KEY in pq.read_metadata(folder / file.path).metadata
    table = read_table(folder / file.path, EPISODES)
    assert not table.schema.metadata
