"""JSON Schemas (2020-12) of every row and file written, from the same dataclasses as the tables.

A row is described as pyarrow's `to_pylist` and any JSON writer give it: points, quaternions and
colours are objects. Descriptions are the docstrings that stand below the dataclasses' fields.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from internav_data.core.field_docs import class_description, descriptions
from internav_data.core.storage import StoreLike, store_of
from internav_data.dataset.manifest import Manifest
from internav_data.dataset.nodes import (
    Coordinates,
    Field,
    Keyed,
    Leaf,
    Node,
    Record,
    record_node,
)
from internav_data.dataset.stats import Stats
from internav_data.dataset.tables import FORMAT_VERSION, TABLES

_DRAFT = "https://json-schema.org/draft/2020-12/schema"
_BITS = {"int8": (-(1 << 7), (1 << 7) - 1), "uint8": (0, 255)} | {
    f"int{bits}": (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) for bits in (16, 32)
}


def schemas() -> dict[str, dict[str, Any]]:
    """Return every JSON Schema by file name: a row of each table, manifest.json and stats.json."""
    made = {
        f"{spec.name}.schema.json": _document(spec.name, spec.cls, bounded=True) for spec in TABLES
    }
    made["manifest.schema.json"] = _document("manifest", Manifest, bounded=False)
    made["stats.schema.json"] = _document("stats", Stats, bounded=False)
    return made


def schema_text(schema: dict[str, Any]) -> str:
    """Return the text of a schema's file."""
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def write_schemas(root: StoreLike) -> None:
    """Write every schema into a folder."""
    store = store_of(root)
    for name, schema in schemas().items():
        store.put(name, schema_text(schema).encode())


def schema_folder() -> Path:
    """Return the folder of the schemas: in the installed package, else in the repository."""
    package = Path(__file__).resolve().parents[1]
    installed = package / "schemas"
    return installed if installed.is_dir() else package.parent / "schemas"


def _document(name: str, cls: type[Any], *, bounded: bool) -> dict[str, Any]:
    head = {"$schema": _DRAFT, "$id": f"urn:internav:{name}:{FORMAT_VERSION}", "title": name}
    return head | _record(record_node(cls), bounded=bounded)


def _record(node: Record, *, bounded: bool) -> dict[str, Any]:
    notes = descriptions(node.cls)
    return {
        "description": class_description(node.cls),
        "type": "object",
        "properties": {
            field.name: _field(field, notes.get(field.name), bounded=bounded)
            for field in node.fields
        },
        "required": [field.name for field in node.fields],
        "additionalProperties": False,
    }


def _field(field: Field, note: str | None, *, bounded: bool) -> dict[str, Any]:
    schema = _node(field.node, bounded=bounded)
    if field.nullable:
        schema = {"anyOf": [schema, {"type": "null"}]}
    if note:
        schema = {"description": note} | {k: v for k, v in schema.items() if k != "description"}
    return schema | ({"unit": field.unit} if field.unit else {})


def _node(node: Node, *, bounded: bool) -> dict[str, Any]:
    if isinstance(node, Leaf):
        return _leaf(node, bounded=bounded)
    if isinstance(node, Coordinates):
        leaf = _leaf(node.leaf, bounded=bounded)
        return {
            "type": "object",
            "properties": dict.fromkeys(node.names, leaf),
            "required": list(node.names),
            "additionalProperties": False,
        }
    if isinstance(node, Record):
        return _record(node, bounded=bounded)
    if isinstance(node, Keyed):
        values = True if node.item is None else _node(node.item, bounded=bounded)
        return {"type": "object", "additionalProperties": values}
    schema: dict[str, Any] = {"type": "array", "items": _node(node.item, bounded=bounded)}
    if node.length is not None:
        schema |= {"minItems": node.length, "maxItems": node.length}
    return schema


def _leaf(node: Leaf, *, bounded: bool) -> dict[str, Any]:
    if node.choices:
        return {"enum": list(node.choices)}
    if node.kind in {"string", "bool", "float64"}:
        return {"type": {"string": "string", "bool": "boolean", "float64": "number"}[node.kind]}
    if not bounded or node.kind not in _BITS:
        return {"type": "integer"}
    low, high = _BITS[node.kind]
    return {"type": "integer", "minimum": low, "maximum": high}
