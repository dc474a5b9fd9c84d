"""Hypothesis strategies and plain builders of records, for every room's tests."""

from __future__ import annotations

import dataclasses
import functools
import typing
from typing import Any

import numpy as np
from hypothesis import strategies as st

from internav_data.dataset.nodes import Coordinates, Leaf, Node, Record, Sequence, record_node
from internav_data.records import Asset, Episode, House

_BOUNDS = {"int8": 7, "int16": 15, "int32": 31, "int64": 63}


def _leaf(leaf: Leaf) -> st.SearchStrategy[Any]:
    if leaf.choices:
        return st.sampled_from(leaf.choices)
    if leaf.kind == "string":
        return st.text(max_size=8)
    if leaf.kind == "bool":
        return st.booleans()
    if leaf.kind == "float64":
        return st.floats(allow_nan=False, allow_infinity=False)
    if leaf.kind == "uint8":
        return st.integers(0, 255)
    bound = 1 << _BOUNDS[leaf.kind]
    return st.integers(-bound, bound - 1)


def _of(node: Node) -> st.SearchStrategy[Any]:
    if isinstance(node, Leaf):
        return _leaf(node)
    if isinstance(node, Coordinates):
        return st.tuples(*[_leaf(node.leaf)] * len(node.names))
    if isinstance(node, Sequence):
        low, high = (0, 2) if node.length is None else (node.length, node.length)
        return st.lists(_of(node.item), min_size=low, max_size=high).map(tuple)
    return records(node.cls)


@functools.cache
def records(cls: type[Any]) -> st.SearchStrategy[Any]:
    """Any values that a record's columns can hold, sense or nonsense: for formats."""
    node: Record = record_node(cls)
    fields = {
        field.name: st.none() | _of(field.node) if field.nullable else _of(field.node)
        for field in node.fields
    }
    if cls is House:
        fields["assets"] = st.just({})
    return st.builds(cls, **fields)


episodes: st.SearchStrategy[Episode] = records(Episode)
houses: st.SearchStrategy[House] = records(House)
assets: st.SearchStrategy[Asset] = records(Asset)


def plain(cls: type[Any], **values: Any) -> Any:
    """Return a record of zeros, empty strings and nothing, but for the values given."""
    from internav_data.dataset.encode import zero_value

    made = {field.name: zero_value(field.node, field.nullable) for field in record_node(cls).fields}
    if cls is House:
        made["assets"] = {}
    assert values.keys() <= {f.name for f in dataclasses.fields(cls)}
    return cls(**{**made, **values})


def rng(seed: int) -> np.random.Generator:
    """Return random numbers of a test's own."""
    return np.random.default_rng(seed)


__all__ = ["assets", "episodes", "houses", "plain", "records", "rng", "typing"]
