"""schemas/ is what the dataclasses say, and what rows and files obey."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest

from internav_data.dataset import (
    TABLES,
    locate,
    read_manifest,
    read_table,
    schema_folder,
    schema_text,
    schemas,
)
from internav_data.dataset.tables import arrow_type


@pytest.mark.parametrize("name", sorted(schemas()))
def test_committed_schema_is_the_generated_one(name):
    folder = Path(__file__).resolve().parents[2] / "schemas"
    expected = schema_text(schemas()[name])
    assert (folder / name).read_text() == expected, "write_schemas() makes them anew"


def test_no_schema_file_without_a_source():
    assert sorted(p.name for p in schema_folder().glob("*.json")) == sorted(schemas())


@pytest.mark.parametrize("name", sorted(schemas()))
def test_schema_is_valid_2020_12(name):
    jsonschema.Draft202012Validator.check_schema(schemas()[name])


@pytest.mark.parametrize("spec", TABLES, ids=lambda spec: spec.name)
def test_rows_obey_their_schema_and_changed_ones_don_t(dataset_folder, spec):
    check = jsonschema.Draft202012Validator(schemas()[f"{spec.name}.schema.json"])
    file = read_manifest(dataset_folder).of(spec.name)[0]
    rows = read_table(locate(dataset_folder, file), spec).slice(0, 5).to_pylist()
    for row in rows:
        check.validate(row)
        for key in row:
            assert not check.is_valid({k: v for k, v in row.items() if k != key})
            assert not check.is_valid(row | {key: {"of": "no type"}})


def test_files_obey_their_schemas(dataset_folder):
    for name in ("manifest", "stats"):
        schema = json.loads((dataset_folder / "schemas" / f"{name}.schema.json").read_text())
        check = jsonschema.Draft202012Validator(schema)
        values = json.loads((dataset_folder / f"{name}.json").read_text())
        check.validate(values)
        assert schema["required"]
        for key in schema["required"]:
            assert not check.is_valid({k: v for k, v in values.items() if k != key}), key


def test_arrow_and_json_schemas_have_the_same_columns_and_nulls():
    for spec in TABLES:
        schema = schemas()[f"{spec.name}.schema.json"]
        assert spec.schema.names == list(schema["properties"])
        for field in spec.schema:
            assert field.nullable == ("anyOf" in schema["properties"][field.name])


def test_no_dictionary_type_and_no_unknown_unit():
    for spec in TABLES:
        assert "dictionary" not in str(arrow_type(spec.node))
    units = {f.name: f.unit for spec in TABLES for f in spec.node.fields}
    assert units["shortest_path_m"] == "m"
    assert units["mass_kg"] == "kg"
    assert units["area_m2"] == "m^2"
    assert units["mode"] is None
