from __future__ import annotations

import math
import statistics

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from internav_data.catalog import FURNITURE, OBSTACLES, SHEETS, catalogue, split_of_asset
from internav_data.catalog.collection import VERSION, _own
from internav_data.catalog.digest import digest_of
from internav_data.catalog.drawing import draw_type, from_share
from internav_data.geometry import asset_bounds, asset_corners, centre_of_mass

# Content of the released catalogue. A change of any design needs a new VERSION and a new digest.
GOLDEN = "d2638562630dc7501d1653e77b29538676f64aa077e53315d9bea479744f7ddf"

# Type: assets, pushable, pickable, fixed, as counted in the simulator.
COUNTS = {
    "ArmChair": (38, 32, 0, 6),
    "DogBed": (3, 3, 0, 0),
    "Box": (34, 0, 34, 0),
    "Chair": (56, 44, 0, 12),
    "Desk": (35, 28, 0, 7),
    "DiningTable": (30, 24, 0, 6),
    "SideTable": (74, 66, 0, 8),
    "Sofa": (37, 32, 0, 5),
    "Stool": (10, 10, 0, 0),
    "Television": (32, 26, 0, 6),
    "Pillow": (32, 0, 30, 2),
    "Bread": (30, 0, 30, 0),
    "Apple": (31, 1, 30, 0),
    "AlarmClock": (31, 1, 30, 0),
    "Lettuce": (30, 0, 30, 0),
    "GarbageCan": (31, 31, 0, 0),
    "Laptop": (31, 1, 30, 0),
    "Microwave": (30, 30, 0, 0),
    "Pot": (30, 0, 30, 0),
    "Tomato": (30, 0, 30, 0),
}

ASSETS = list(catalogue().assets.values())


@pytest.mark.parametrize("type_", COUNTS)
def test_counts_are_those_of_the_simulator(type_):
    assets = catalogue().of_type(type_)
    pushable = sum(a.pushable for a in assets)
    pickable = sum(a.pickable for a in assets)
    assert (len(assets), pushable, pickable, len(assets) - pushable - pickable) == COUNTS[type_]
    assert not any(a.pushable and a.pickable for a in assets)
    assert all(a.spawnable for a in assets)


def test_sums_agree():
    spawnable = catalogue().spawnable
    assert len(spawnable) == 655
    assert sum(a.pushable for a in spawnable) == 329
    assert sum(a.pickable for a in spawnable) == 274
    assert sum(not a.pushable and not a.pickable for a in spawnable) == 52
    assert [a.asset_id for a in spawnable] == sorted(a.asset_id for a in spawnable)


def test_furniture_is_not_movable_and_of_many_types():
    for sheet in FURNITURE:
        for asset in catalogue().of_type(sheet.type):
            assert not (asset.pushable)
            assert not (asset.pickable)
            assert not (asset.spawnable)
            assert asset.blocks == (sheet.type != "Rug")
    assert len(FURNITURE) >= 30
    assert all(4 <= len(catalogue().of_type(s.type)) <= 12 for s in FURNITURE if s.type != "Piano")


@pytest.mark.parametrize("sheet", SHEETS.values(), ids=lambda s: s.type)
def test_sizes_lie_in_the_sheet_with_its_median(sheet):
    assets = catalogue().of_type(sheet.type)
    for axis, (low, median, high) in enumerate((sheet.width, sheet.depth, sheet.height)):
        sizes = [a.size[axis] for a in assets]
        assert min(sizes) >= low - 0.0011
        assert max(sizes) <= high + 0.0011
        if sheet in OBSTACLES:
            assert statistics.median(sizes) == pytest.approx(median, rel=0.04, abs=0.0021)
            assert (min(sizes), max(sizes)) == pytest.approx((low, high), abs=0.0011)


@pytest.mark.parametrize("sheet", OBSTACLES, ids=lambda s: s.type)
def test_mass_grows_with_volume_around_the_sheets(sheet):
    assets = sorted(catalogue().of_type(sheet.type), key=lambda a: math.prod(a.size))
    masses = [a.mass_kg for a in assets]
    assert masses == sorted(masses)
    assert 0.49 * sheet.mass_kg <= masses[0] <= sheet.mass_kg <= masses[-1] <= 2.01 * sheet.mass_kg
    frictions = [a.friction for a in assets]
    assert min(frictions) >= 0.4
    assert max(frictions) <= 0.8
    assert statistics.median(frictions) == pytest.approx(0.6, abs=0.02)


@pytest.mark.parametrize("type_", SHEETS)
def test_bounds_are_the_size_exactly(type_):
    for asset in catalogue().of_type(type_):
        low, high = asset_bounds(asset)
        w, d, h = asset.size
        np.testing.assert_allclose(low, (-w / 2, -d / 2, 0.0), atol=1e-6, err_msg=asset.asset_id)
        np.testing.assert_allclose(high, (w / 2, d / 2, h), atol=1e-6, err_msg=asset.asset_id)


@pytest.mark.parametrize("type_", [t for t in SHEETS if t not in {"Painting", "Mirror"}])
def test_stands_stably(type_):
    """The centre of mass lies above the hull of what touches the floor, 4 mm or 5 % within."""
    for asset in catalogue().of_type(type_):
        corners, _ = asset_corners(asset)
        feet = corners[corners[:, 2] < 0.002][:, :2]
        hull = ConvexHull(feet)
        x, y, _ = centre_of_mass(asset)
        inside = -(hull.equations[:, :2] @ (x, y) + hull.equations[:, 2])
        assert inside.min() >= min(0.004, 0.05 * min(asset.size[:2])), asset.asset_id


def test_stored_numbers_are_rounded():
    for asset in ASSETS:
        lengths = [asset.size]
        for part in asset.parts:
            lengths += [part.centre, part.size, *part.corners]
            assert all(q == round(q, 6) for q in part.rotation)
            assert all(0 <= c <= 255 and isinstance(c, int) for c in part.colour)
        for triple in lengths:
            assert all(v == round(v, 4) for v in triple), asset.asset_id


def test_ids_are_unique_and_sorted():
    own = _own()
    assert len({a.asset_id for a in own}) == len(own) == len(ASSETS)
    assert list(catalogue().assets) == sorted(catalogue().assets)
    assert all(key == asset.asset_id for key, asset in catalogue().assets.items())


def test_digest_is_the_released_one():
    assert VERSION == 1
    assert catalogue().digest == GOLDEN


def test_digest_sees_every_change():
    import dataclasses

    asset = ASSETS[0]
    first = digest_of(1, [asset])
    assert digest_of(2, [asset]) != first
    changes = {"friction": 0.41, "blocks": False, "mass_kg": 1.5, "type": "Other"}
    for field, value in changes.items():
        assert digest_of(1, [dataclasses.replace(asset, **{field: value})]) != first
    part = dataclasses.replace(asset.parts[0], colour=(1, 2, 3))
    assert digest_of(1, [dataclasses.replace(asset, parts=(part, *asset.parts[1:]))]) != first


def test_drawing_a_type_needs_no_other():
    sheet = SHEETS["Pot"]
    place = list(SHEETS).index("Pot")
    assert draw_type(sheet, place, spawnable=True) == tuple(a for a in _own() if a.type == "Pot")


def test_shares_reach_the_three_figures():
    assert [from_share((1.0, 2.0, 5.0), s) for s in (0.0, 0.5, 1.0)] == [1.0, 2.0, 5.0]
    values = [from_share((1.0, 2.0, 5.0), k / 100) for k in range(101)]
    assert values == sorted(values)


def test_splits_take_their_shares():
    for sheet in OBSTACLES:
        splits = [split_of_asset(a) for a in catalogue().of_type(sheet.type)]
        if sheet.type == "DogBed":
            assert set(splits) == {"train"}
            continue
        count = len(splits)
        assert splits.count("train") == pytest.approx(count * 2 / 3, abs=1.4)
        assert splits.count("val") == pytest.approx(count / 6, abs=1.0)
        assert splits.count("test") == pytest.approx(count / 6, abs=1.0)
    assert all(split_of_asset(a) == "train" for a in catalogue().of_type("Fridge"))
