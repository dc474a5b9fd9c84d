"""No column escapes the validator: a new one needs a rule, and a mutation that is found."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import pyarrow as pa
import pytest
from builders import part
from scenery import ASSETS, small_scenes, write_dataset
from test_mutations import EPISODE_CHANGES

from internav_data.dataset import EPISODES, TABLES, to_table
from internav_data.records import Window
from internav_data.verification import validate
from internav_data.verification.ranges import RULES

WITHOUT_RULE = {
    "episodes": {},
    "scenes": {
        "doors.element.yaw_deg": "house.door-rooms",
        "windows.element.x": "house.window",
        "windows.element.y": "house.window",
        "windows.element.yaw_deg": "house.window",
        "objects.element.type": "object.type",
    },
    "assets": {
        **{
            f"parts.element.{point}.{axis}": "object.support" if axis == "z" else "object.room"
            for point in ("centre", "corners.element")
            for axis in "xyz"
        },
    },
}
"""Columns that only the geometry or another row restricts, and the predicate that finds a wrong
value; colours are any bytes."""
MUTATED_BY_PARTS = {"start", "goal", "expert", "blind_expert", "physics"}
"""Columns of episodes that have tables of mutations, or tests, of their own."""


def leaves(kind, path):
    """Yield the dotted paths of a type's numbers and words; booleans can hold no wrong value."""
    if pa.types.is_struct(kind):
        for field in kind:
            yield from leaves(field.type, f"{path}.{field.name}".lstrip("."))
    elif pa.types.is_list(kind):
        yield from leaves(kind.value_type, f"{path}.element")
    elif not pa.types.is_boolean(kind):
        yield path


@pytest.mark.parametrize("spec", TABLES, ids=lambda spec: spec.name)
def test_every_column_has_a_rule(spec):
    columns = {path for path in leaves(pa.struct(list(spec.schema)), "") if ".colour." not in path}
    assert columns - set(RULES[spec.name]) == set(WITHOUT_RULE[spec.name])
    assert set(RULES[spec.name]) <= columns


def wrong_everywhere(value, names):
    """A row's value with one leaf, reached by field names, overwritten wherever it occurs."""
    if not names:
        return "-77" if isinstance(value, str) else -77
    if names[0] == "element":
        return [wrong_everywhere(element, names[1:]) for element in value]
    return {**value, names[0]: wrong_everywhere(value[names[0]], names[1:])}


def found_with(root, monkeypatch, table="", path=""):
    """Predicates that find a column of -77 in a dataset with a window and a cupboard of a hull."""

    def changed(records, spec):
        rows = to_table(records, spec)
        if spec.name != table:
            return rows
        wrong = [wrong_everywhere(row, path.split(".")) for row in rows.to_pylist()]
        return pa.Table.from_pylist(wrong, schema=rows.schema)

    for module in ("staging", "shards"):
        monkeypatch.setattr(f"internav_data.dataset.{module}.to_table", changed)
    house, episodes = small_scenes()[0]
    window = Window(0, 0, 2.0, -0.06, 0.0, 1.0, 1.0, 0.9)
    corners = tuple(product((-0.5, 0.5), (-0.25, 0.25), (-0.9, 0.9)))
    hull = part("hull", (0.0, 0.0, 0.9), (1.0, 0.5, 1.8), corners=corners)
    assets = {**ASSETS, "Cupboard_1": replace(ASSETS["Cupboard_1"], parts=(hull,))}
    write_dataset(root, [(replace(house, windows=(window,)), episodes)], assets)
    return set(validate(root).by_predicate)


@pytest.mark.parametrize(
    ("table", "path"), [(table, path) for table, paths in WITHOUT_RULE.items() for path in paths]
)
def test_a_column_without_rule_is_found_where_it_is_wrong(tmp_path, monkeypatch, table, path):
    predicate = WITHOUT_RULE[table][path]
    assert predicate not in found_with(tmp_path / "right", monkeypatch)
    assert predicate in found_with(tmp_path / "wrong", monkeypatch, table, path)


def test_parts_of_an_unknown_shape_are_a_finding_and_no_error(tmp_path, monkeypatch):
    found = found_with(tmp_path / "wrong", monkeypatch, "assets", "parts.element.shape")
    assert {"schema.assets.parts.element.shape", "schema.assets.corners"} <= found


def test_assets_without_parts_are_a_finding_and_no_error(tmp_path):
    assets = {**ASSETS, "Cupboard_1": replace(ASSETS["Cupboard_1"], parts=())}
    write_dataset(tmp_path / "wrong", small_scenes()[:1], assets)
    assert set(validate(tmp_path / "wrong").by_predicate) == {"schema.assets.parts"}


def test_every_column_of_episodes_is_mutated():
    changed = {name for changes, _ in EPISODE_CHANGES.values() for name in changes}
    assert set(EPISODES.schema.names) - changed == MUTATED_BY_PARTS
