"""Rugs are floor, and things on furniture lie within its top; early catalogues promise neither."""

from __future__ import annotations

from dataclasses import replace

import builders
import pytest
from scenery import ASSETS, Grid

from internav_data.verification.findings import FindingCollector
from internav_data.verification.scenes import check_scene
from internav_data.verification.shapes import Shapes
from internav_data.verification.surfaces import check_flat

RUG = replace(builders.crate("Rug_1", (2.0, 1.4, 0.004)), blocks=False)
THICK = replace(builders.crate("Rug_2", (2.0, 1.4, 0.005)), blocks=False)


def findings(*objects, version=2):
    """Predicates that a house with some objects breaks."""
    house = Grid(1, 1).house(objects=objects)
    shapes = Shapes({**ASSETS, "Rug_1": RUG})
    return set(check_scene(house, [], shapes, catalogue_version=version).by_predicate)


def table_with(x, version=2):
    """A table at x = 2 m with a pot of 0.4 m on it."""
    table = builders.scene_object(0, "Table_1", 0, 2.0, 2.0, group=0)
    pot = replace(builders.scene_object(1, "Pot_1", 0, x, 2.0, group=0), z=0.75, support=0)
    return findings(table, pot, version=version)


@pytest.mark.parametrize("x", [2.0, 2.5, 1.5])
def test_a_thing_up_to_the_edge_is_carried(x):
    assert not table_with(x)


@pytest.mark.parametrize("x", [2.505, 1.495, 2.65])
def test_a_thing_over_the_edge_is_found(x):
    assert table_with(x) == {"object.overhang"}
    assert not table_with(x, version=1), "datasets of the first catalogue stay valid"


def test_a_rug_holds_nothing():
    rug = builders.scene_object(0, "Rug_1", 0, 2.0, 2.0, group=0)
    safe = builders.scene_object(1, "Safe_1", 0, 2.0, 2.0, group=0)
    assert not findings(rug, safe)
    held = replace(safe, z=0.004, support=0)
    assert findings(rug, held) == {"object.support"}
    assert not findings(rug, held, version=1)


@pytest.mark.parametrize(
    ("asset", "wrong"), [(RUG, False), (THICK, True), (ASSETS["Safe_1"], False)]
)
def test_an_asset_that_blocks_nothing_is_thin(asset, wrong):
    report = FindingCollector()
    check_flat(asset, report)
    assert ("schema.assets.rug" in report.by_predicate) == wrong
