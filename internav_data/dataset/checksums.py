"""Checksums of column chunks: a damaged chunk is refused before Parquet's reader sees it.

A page's own checksum covers its body but not its header, and one bit of a header can cut a list
short without an error. So the footer's metadata hold the size and the CRC-32 of every column
chunk, page headers included. The chunks lie one after another from byte 4 up to the footer, which
the manifest's `footer_sha256` covers: together they cover the file, and a reader checks only the
chunks that it reads.
"""

from __future__ import annotations

import base64
import io
import itertools
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

KEY = b"internav.column_chunks"
"""Key of the footer's metadata: u32 size and u32 CRC-32 of each chunk, little-endian, in base64.

Chunks come in order: row group by row group, in each column by column.
"""
MAGIC_BYTES = 4
"""Length of the letters PAR1 at both ends of a file."""


def with_checksums(data: pa.Buffer, schema: pa.Schema) -> bytes:
    """Return a Parquet file of a schema with its chunks' checksums in the footer.

    The chunks stay as they are: they do not depend on the footer, which is written anew.
    """
    metadata = pq.read_metadata(pa.BufferReader(data))
    sizes = [size for _, size in _chunks(metadata)]
    end = MAGIC_BYTES + sum(sizes)
    checksums = [zlib.crc32(data[start : start + size]) for start, size in _chunks(metadata)]
    pairs = np.array([sizes, checksums], dtype="<u4").T
    empty = pa.BufferOutputStream()
    with pq.ParquetWriter(empty, schema) as writer:
        writer.add_key_value_metadata({KEY: base64.b64encode(pairs.tobytes())})
    whole = pq.read_metadata(pa.BufferReader(empty.getvalue()))
    whole.append_row_groups(metadata)
    footer = io.BytesIO()  # a file without chunks: PAR1, footer, length, PAR1
    whole.write_metadata_file(footer)
    return b"".join((memoryview(data)[:end], footer.getbuffer()[MAGIC_BYTES:]))


def _chunks(metadata: pq.FileMetaData) -> Iterator[tuple[int, int]]:
    """Yield the start and the size of each column chunk, in the order in which they lie."""
    for group in range(metadata.num_row_groups):
        columns = metadata.row_group(group)
        for k in range(metadata.num_columns):
            column = columns.column(k)
            start = column.dictionary_page_offset or column.data_page_offset
            yield start, column.total_compressed_size


@dataclass(frozen=True, slots=True)
class ChunkChecksums:
    """Places and checksums of a file's column chunks, as its footer states them.

    Each list has an item a row group, a list with one item a column.
    """

    starts: list[list[int]]
    ends: list[list[int]]
    checksums: list[list[int]]

    def ranges(self, groups: Sequence[int], columns: Sequence[int]) -> Iterator[tuple[int, int]]:
        """Yield the start and the end of chunks, by numbers of row groups and columns."""
        for group in groups:
            starts, ends = self.starts[group], self.ends[group]
            yield from ((starts[k], ends[k]) for k in columns)

    def verify(self, read: Callable[[int, int], bytes], group: int, columns: Sequence[int]) -> None:
        """Compare chunks of a row group with their checksums.

        Parameters
        ----------
        read
            Function of a number of bytes and a position, which returns these bytes of the file.
        group
            Number of the row group.
        columns
            Numbers of the columns, ascending.

        Raises
        ------
        ValueError
            A chunk is damaged.

        """
        starts, ends, wanted = self.starts[group], self.ends[group], self.checksums[group]
        for first, last in _runs(columns):  # neighbours in one go
            at = starts[first]
            block = memoryview(read(ends[last] - at, at))
            for k in range(first, last + 1):
                if zlib.crc32(block[starts[k] - at : ends[k] - at]) != wanted[k]:
                    raise ValueError(f"column {k} of row group {group} has another checksum")


def checksums_of(metadata: pq.FileMetaData) -> ChunkChecksums | None:
    """Return the checksums that a file's footer states; None if it is from before there were any.

    Raises
    ------
    ValueError
        They are not those of the file's chunks.

    """
    text = (metadata.metadata or {}).get(KEY)
    if text is None:
        return None
    pairs = np.frombuffer(base64.b64decode(text, validate=True), dtype="<u4")
    shape = metadata.num_row_groups, metadata.num_columns
    sizes, checksums = pairs.reshape(*shape, 2).transpose(2, 0, 1)
    ends = MAGIC_BYTES + np.cumsum(sizes, dtype=np.int64).reshape(shape)
    return ChunkChecksums((ends - sizes).tolist(), ends.tolist(), checksums.tolist())


def _runs(columns: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Yield the first and the last of each run of successive numbers."""
    for _, run in itertools.groupby(enumerate(columns), lambda item: item[1] - item[0]):
        numbers = [number for _, number in run]
        yield numbers[0], numbers[-1]
