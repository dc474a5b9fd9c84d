"""Places of the page headers in a Parquet file, by as much of Thrift as they need."""

from __future__ import annotations

_COMPRESSED_SIZE = 3
"""Number of the header's field with the size of the page that follows it."""


def page_headers(data, metadata):
    """Yield the column path, start and end of every page header of a file."""
    for group in range(metadata.num_row_groups):
        for k in range(metadata.num_columns):
            column = metadata.row_group(group).column(k)
            at = column.dictionary_page_offset or column.data_page_offset
            end = at + column.total_compressed_size
            while at < end:
                fields, stop = _struct(data, at)
                yield column.path_in_schema, at, stop
                at = stop + fields[_COMPRESSED_SIZE]


def _struct(data, at):
    """Return the whole numbers of a struct by field, and its end."""
    fields, field = {}, 0
    while head := data[at]:
        field, kind = field + (head >> 4), head & 15
        at += 1
        if kind in {4, 5, 6}:  # whole numbers, zigzag
            value, at = _varint(data, at)
            fields[field] = (value >> 1) ^ -(value & 1)
        elif kind == 8:  # bytes
            length, at = _varint(data, at)
            at += length
        elif kind == 12:
            _, at = _struct(data, at)
        else:
            assert kind in {1, 2}, "true and false have no body"
    return fields, at + 1


def _varint(data, at):
    value = shift = 0
    while True:
        value |= (data[at] & 127) << shift
        at, shift = at + 1, shift + 7
        if data[at - 1] < 128:
            return value, at
