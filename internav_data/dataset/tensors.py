"""Scalar columns as torch tensors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data.core.extras import require
from internav_data.dataset.decode import one_array
from internav_data.dataset.nodes import Leaf
from internav_data.dataset.tables import EPISODES

if TYPE_CHECKING:
    import pyarrow as pa


def tensors(table: pa.Table) -> dict[str, Any]:
    """Return scalar columns of episodes as tensors (n,) by name.

    Raises
    ------
    ModuleNotFoundError
        torch is not installed.

    """
    require("torch")
    import torch  # type: ignore[import-not-found,unused-ignore]  # noqa: PLC0415 - optional

    leaves = {
        f.name: (f.node, f.nullable) for f in EPISODES.node.fields if isinstance(f.node, Leaf)
    }
    arrays = {name: _numbers(table.column(name), *leaves[name]) for name in table.column_names}
    return {name: torch.from_numpy(a) for name, a in arrays.items() if a is not None}


def _numbers(
    column: pa.ChunkedArray,
    leaf: Leaf,
    nullable: bool,
) -> np.ndarray[Any, Any] | None:
    array = one_array(column)
    if leaf.kind == "string":
        if not leaf.choices:
            return None
        coded = array.dictionary_encode()
        numbers = [leaf.choices.index(word) for word in coded.dictionary.to_pylist()]
        return np.array([numbers[k] for k in coded.indices.to_pylist()], dtype=np.int8)
    if nullable and leaf.kind == "bool":
        array = array.cast("int8")  # 1, 0, and -1 for null, whether the rows have one or not
    if array.null_count:
        array = array.fill_null(float("nan") if leaf.kind == "float64" else -1)
    return np.array(array.to_numpy(zero_copy_only=False))
