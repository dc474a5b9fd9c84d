"""Ranges of a file that are fetched at once, against a plain file of the same bytes."""

from __future__ import annotations

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from internav_data.core import ranges_file
from internav_data.core.ranges_file import RangesFile

DATA = bytes(range(256)) * 4


class Counted(io.BytesIO):
    def __init__(self, data):
        super().__init__(data)
        self.reads = []

    def read(self, size=-1):
        self.reads.append((self.tell(), size))
        return super().read(size)


SPANS = st.lists(st.tuples(st.integers(0, 1024), st.integers(0, 300)), max_size=6)


@given(
    held=SPANS,
    asked=st.lists(st.tuples(st.integers(0, 1100), st.integers(-1, 300)), max_size=8),
    gap=st.sampled_from([0, 10, 500]),
)
def test_it_reads_what_a_plain_file_reads(held, asked, gap):
    ours, plain = RangesFile(io.BytesIO(DATA)), io.BytesIO(DATA)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ranges_file, "MAX_GAP_BYTES", gap)
        ours.hold((start, min(start + size, len(DATA))) for start, size in held)
    for at, size in asked:
        assert ours.seek(at) == plain.seek(at)
        assert ours.read(size) == plain.read(size)
        assert ours.tell() == plain.tell()
    assert ours.seek(-3, io.SEEK_END) == plain.seek(-3, io.SEEK_END)
    assert (ours.read(), plain.read()) == (DATA[-3:], DATA[-3:])


def test_neighbours_are_fetched_at_once_and_not_again(monkeypatch):
    monkeypatch.setattr(ranges_file, "MAX_GAP_BYTES", 10)
    source = Counted(DATA)
    file = RangesFile(source)
    file.hold([(100, 120), (40, 60), (65, 90), (300, 310)])
    assert source.reads == [(40, 80), (300, 10)]
    for start, end in ((40, 60), (65, 90), (50, 119), (300, 310)):
        file.seek(start)
        assert file.read(end - start) == DATA[start:end]
    assert len(source.reads) == 2
    file.release()
    file.seek(40)
    assert file.read(20) == DATA[40:60]
    assert source.reads[2:] == [(40, 20)], "forgotten"
    file.close()
    assert source.closed
    assert file.closed
