"""Attributes by the validator's own tables: hidden ones are levels of the type or the asset's."""

from __future__ import annotations

from dataclasses import replace

import builders
import numpy as np
import pytest

from internav_data.catalog import attributes, catalogue
from internav_data.catalog.attributes import hidden_attributes
from internav_data.catalog.config import CatalogConfig
from internav_data.generation import generate, load_config
from internav_data.records.errors import CorruptDataError
from internav_data.verification import attributes as checked
from internav_data.verification import validate
from internav_data.verification.attributes import AttributeCheck, levels_by_type
from internav_data.verification.findings import FindingCollector

HALF = {"catalog": {"attributes": "hidden", "strength": 0.5}}
FULL = {"catalog": {"attributes": "hidden", "strength": 1.0}}


def test_tables_are_those_of_the_catalogue():
    assert dict(attributes.FIXED_SHARES) == checked.FIXED
    assert attributes.MASS_FACTORS == checked.MASSES
    assert attributes.FRICTION_SIXTHS == checked.SIXTHS
    hidden = hidden_attributes(CatalogConfig("hidden"), catalogue().spawnable)
    assert hidden is not None
    derived = levels_by_type(catalogue().assets.values())
    assert set(derived) == set(hidden.types)
    for type_, known in hidden.types.items():
        own = derived[type_]
        assert (own.affordance, own.masses, own.frictions) == (
            *(known.affordance, known.masses_kg, known.frictions),
        )


def furniture(strength, count=600, wrong=None):
    """Chairs and tables whose attributes are drawn as the generator does, `wrong` changed."""
    hidden = hidden_attributes(CatalogConfig("hidden", strength), catalogue().spawnable)
    assets = catalogue().of_type("Chair") + catalogue().of_type("Sofa")
    rows = np.random.default_rng(4).random((count, attributes.DRAWS)).tolist()
    objects = []
    for number, row in enumerate(rows):
        asset = assets[number % len(assets)]
        dynamics = hidden.dynamics(asset, row)
        if wrong is not None:
            dynamics = wrong(number, dynamics, hidden.types[asset.type].masses_kg)
        placed = builders.scene_object(number, asset.asset_id, 0, 1.0, 1.0)
        own = None if dynamics == asset.dynamics else dynamics
        objects.append(replace(placed, dynamics=own, affordance="push"))
    return replace(builders.one_room(4.0, 4.0), objects=tuple(objects))


def found(house, config):
    report = FindingCollector()
    check = AttributeCheck.of(config, catalogue().assets.values())
    check.house(house, report)
    check.shares(report)
    return set(report.by_predicate)


@pytest.mark.parametrize("strength", [0.0, 0.5, 1.0])
def test_what_the_generator_draws_is_valid(strength):
    config = {"catalog": {"attributes": "hidden", "strength": strength}}
    assert found(furniture(strength), config) == set()


FAULTS = {
    "a mass between the levels": (
        lambda k, d, _: replace(d, mass_kg=11.1) if k == 7 else d,
        {"object.attributes"},
    ),
    "picked up and pushed": (
        lambda k, d, _: replace(d, pickable=True, pushable=True) if k == 7 else d,
        {"object.abilities"},
    ),
    "none is fixed": (lambda _, d, __: replace(d, pushable=True), {"object.fixed-share"}),
    "all are light": (
        lambda _, d, masses: replace(d, mass_kg=masses[0]),
        {"object.mass-share"},
    ),
}


@pytest.mark.parametrize("case", FAULTS)
def test_other_attributes_are_found(case):
    wrong, predicates = FAULTS[case]
    assert predicates <= found(furniture(1.0, wrong=wrong), FULL)


def test_another_strength_is_found():
    assert "object.own-share" in found(furniture(0.2), HALF)
    assert "object.attributes" in found(furniture(0.5), FULL)


def test_hidden_attributes_in_a_dataset_of_looks_are_found():
    assert {"object.affordance", "object.mass_kg"} <= found(furniture(1.0), {})


def test_attributes_of_the_asset_are_null():
    house = furniture(1.0)
    first = house.objects[0]
    asset = catalogue().assets[first.asset_id]
    same = replace(house, objects=(replace(first, dynamics=asset.dynamics), *house.objects[1:]))
    assert "object.dynamics" in found(same, HALF)


@pytest.mark.parametrize("value", [{"attributes": "seen"}, {"strength": 2.0}, {"strength": "1"}])
def test_a_config_that_no_generator_writes(value):
    with pytest.raises(CorruptDataError, match=r"config\.catalog"):
        AttributeCheck.of({"catalog": value}, ())


@pytest.fixture(scope="module")
def hidden_dataset(tmp_path_factory):
    """Two houses of one room, hidden attributes at full strength."""
    out = tmp_path_factory.mktemp("hidden") / "d"
    overrides = ["episodes_per_scene=2", "house.rooms=1", "catalog.attributes=hidden"]
    generate(out, load_config(overrides=overrides), 2, workers=1)
    return out


def test_a_dataset_with_hidden_attributes_is_valid_and_replayed(hidden_dataset):
    findings = validate(hidden_dataset, "physics")
    assert findings.ok, findings.summary()
    assert findings.checked["replayed"] == findings.checked["episodes"]
