"""The logical digest: of the values of a table, not of its row groups, encodings or pyarrow.

Definition, since format version 1. sha256 over the leaf columns in schema order. A leaf column is

    text(path)  text(type)  u64(rows)  level …  level

where path is `obstacles.element.outcomes.element.action`, type is `string`, `bool`, `float64`,
`int8` …, text(s) is the u32 length of s in UTF-8 and its bytes, and there is one level for each
node from the table's field down to the leaf. A level is one validity byte (1 or 0) for each slot,
followed, for a list, by the u32 length of every list (0 where null), and for a leaf by its values:
little-endian numbers (booleans a byte) with zeros where null, or for strings the u32 length of
each (0 where null) and then all their bytes. A struct's slots are its parent's, a list's items
are the slots of the next level; what lies under a null struct is null. All integers are unsigned
and little-endian.
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from internav_data.dataset.decode import one_array

if TYPE_CHECKING:
    from hashlib import _Hash

    from numpy.typing import NDArray

_NAMES = {
    pa.string(): "string",
    pa.bool_(): "bool",
    pa.float64(): "float64",
    pa.int8(): "int8",
    pa.uint8(): "uint8",
    pa.int16(): "int16",
    pa.int32(): "int32",
    pa.int64(): "int64",
}


def logical_digest(table: pa.Table) -> str:
    """Return the logical digest of a table as 64 hexadecimal digits."""
    digest = hashlib.sha256()
    for name in table.column_names:
        array = one_array(table.column(name))
        _feed(digest, name, array, np.ones(len(array), dtype=np.uint8), [], len(array))
    return digest.hexdigest()


def _text(value: str) -> bytes:
    data = value.encode()
    return len(data).to_bytes(4, "little") + data


def _feed(
    digest: _Hash, path: str, array: pa.Array, above: NDArray[Any], levels: list[bytes], rows: int
) -> None:
    valid = above
    if array.null_count:
        valid = above & array.is_valid().to_numpy(zero_copy_only=False).astype(np.uint8)
    if pa.types.is_struct(array.type):
        for k in range(array.type.num_fields):
            child = f"{path}.{array.type.field(k).name}"
            _feed(digest, child, array.field(k), valid, [*levels, valid.tobytes()], rows)
        return
    if pa.types.is_list(array.type):
        lengths, items = _list_items(array, valid)
        level = valid.tobytes() + lengths.astype("<u4").tobytes()
        every = np.ones(len(items), dtype=np.uint8)
        _feed(digest, f"{path}.element", items, every, [*levels, level], rows)
        return
    digest.update(_text(path) + _text(_NAMES[array.type]) + rows.to_bytes(8, "little"))
    for level in levels:
        digest.update(level)
    digest.update(valid.tobytes())
    digest.update(_leaf_values(array, valid))


def _list_items(array: pa.Array, valid: NDArray[Any]) -> tuple[NDArray[Any], pa.Array]:
    """Return the length of each list and the items of those that are not null."""
    offsets = array.offsets.to_numpy()
    lengths = np.diff(offsets)
    items = array.values.slice(offsets[0], offsets[-1] - offsets[0])
    hidden = (valid == 0) & (lengths > 0)
    if hidden.any():
        items = items.filter(pa.array(np.repeat(valid.astype(bool), lengths)))
        lengths = np.where(hidden, 0, lengths)
    return lengths, items


def _leaf_values(array: pa.Array, valid: NDArray[Any]) -> bytes:
    if pa.types.is_string(array.type):
        array = pc.if_else(pa.array(valid.astype(bool)), array, "")
        lengths = pc.binary_length(array).to_numpy(zero_copy_only=False)
        joined = b"".join(array.cast(pa.binary()).to_pylist())
        return bytes(lengths.astype("<u4").tobytes()) + joined
    if array.null_count:
        array = array.fill_null(False if pa.types.is_boolean(array.type) else 0)
    values = array.to_numpy(zero_copy_only=False)
    values = np.where(valid.astype(bool), values, np.zeros(1, dtype=values.dtype))
    if values.dtype == bool:
        values = values.astype(np.uint8)
    return bytes(values.astype(values.dtype.newbyteorder("<")).tobytes())
