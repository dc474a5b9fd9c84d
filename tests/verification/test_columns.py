"""No column escapes the validator: a new one needs a rule, and a mutation that is found."""

from __future__ import annotations

import pyarrow as pa
import pytest
from test_mutations import EPISODE_CHANGES

from internav_data.dataset import EPISODES, TABLES
from internav_data.verification.ranges import RULES

WITHOUT_RULE = {
    "episodes": set(),
    "scenes": {
        *(f"materials.element.{name}" for name in ("name", "pattern")),
        *(f"{thing}.element.yaw_deg" for thing in ("doors", "windows")),
        *(f"rooms.element.{name}" for name in ("floor_material", "wall_material")),
        *("windows.element.x", "windows.element.y", "objects.element.type", "preset"),
    },
    "assets": {
        *(f"parts.element.{point}.{axis}" for point in ("centre", "rotation") for axis in "xyz"),
        *(f"parts.element.corners.element.{axis}" for axis in "xyz"),
        *("parts.element.rotation.w", "parts.element.material"),
    },
}
"""Columns that only the geometry or another row restricts; colours are any bytes."""
MUTATED_BY_PARTS = {"start", "goal", "expert", "physics"}
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
    assert columns - set(RULES[spec.name]) == WITHOUT_RULE[spec.name]
    assert set(RULES[spec.name]) <= columns


def test_every_column_of_episodes_is_mutated():
    changed = {name for changes, _ in EPISODE_CHANGES.values() for name in changes}
    assert set(EPISODES.schema.names) - changed == MUTATED_BY_PARTS
