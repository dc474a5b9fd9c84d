"""Clutter: more small things, within every rule of furniture; at 0 nothing changes."""

from __future__ import annotations

from dataclasses import replace

import pytest

from internav_data.houses import HouseConfig, build_house
from internav_data.houses.clutter import FLOOR_THINGS, SURFACES
from internav_data.records.errors import UsageError


def built(assets, clutter, scene=0, **settings):
    return build_house(6, scene, HouseConfig(clutter=clutter, **settings), assets)


@pytest.mark.parametrize(("preset", "scene"), [("paper", 0), ("realistic", 1)])
def test_a_cluttered_house_keeps_all_rules(assets, oracle, preset, scene):
    house = built(assets, 1.0, scene, preset=preset, rooms="4")
    oracle.check_house(house)


def test_clutter_is_added_to_the_furniture_and_can_be_moved(assets):
    bare, full = (built(assets, clutter, rooms="3") for clutter in (0.0, 1.0))
    assert replace(full, objects=(), assets={}) == replace(bare, objects=(), assets={})

    def keys(house):
        return {(t.asset_id, t.x, t.y, t.z) for t in house.objects}

    assert keys(bare) < keys(full)
    added = [t for t in full.objects if (t.asset_id, t.x, t.y, t.z) not in keys(bare)]
    assert {t.support >= 0 for t in added} == {False, True}
    dynamics = [full.assets[t.asset_id].dynamics for t in added]
    assert sum(d.pushable or d.pickable for d in dynamics) > len(added) / 2


def test_clutter_adds_about_ten_things_a_room(assets):
    def count(clutter):
        return sum(len(built(assets, clutter, scene, rooms="3").objects) for scene in range(4))

    assert 9 < (count(1.0) - count(0.0)) / (4 * 3) < 13


def test_half_the_clutter_is_less(assets):
    def count(clutter):
        return len(built(assets, clutter, rooms="3").objects)

    assert count(0.0) < count(0.5) < count(1.0)


def test_every_type_of_clutter_and_surface_exists(assets):
    kinds = {kind for surface in SURFACES.values() for kind in surface.kinds}
    assert {*SURFACES, *kinds, *FLOOR_THINGS} <= set(assets.types)


@pytest.mark.parametrize("value", [-0.1, 1.5, float("nan")])
def test_clutter_out_of_its_bounds_is_refused_in_one_line(assets, value):
    with pytest.raises(UsageError, match=r"house\.clutter: expected 0\.0 … 1\.0, got ") as error:
        built(assets, value)
    assert "\n" not in str(error.value)
