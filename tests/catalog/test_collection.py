from __future__ import annotations

import dataclasses
import math
import statistics
from pathlib import Path

import numpy as np
import pytest
from builders import bounds_of
from scipy.spatial import ConvexHull

from internav_data.catalog import ASSET_TYPES, FURNITURE, OBSTACLES, catalogue, split_of_asset
from internav_data.catalog.asset_types import by_name
from internav_data.catalog.collection import VERSION, generated_assets
from internav_data.catalog.digest import digest_of
from internav_data.catalog.drawing import draw_type, from_share
from internav_data.dataset import read_manifest
from internav_data.geometry import asset_corners, centre_of_mass

# Digests of the released catalogues, by VERSION. A change of any asset raises VERSION and adds a
# row; a row is never changed.
GOLDEN = {
    1: "d2638562630dc7501d1653e77b29538676f64aa077e53315d9bea479744f7ddf",
    2: "e485378d3d67478bfa875a89f811c597425719b91f9328edc6cd03f91a9832b5",
}

# Key of each released type's random numbers.
NUMBERS = {
    "ArmChair": 0,
    "DogBed": 1,
    "Box": 2,
    "Chair": 3,
    "Desk": 4,
    "DiningTable": 5,
    "SideTable": 6,
    "Sofa": 7,
    "Stool": 8,
    "Television": 9,
    "Pillow": 10,
    "Bread": 11,
    "Apple": 12,
    "AlarmClock": 13,
    "Lettuce": 14,
    "GarbageCan": 15,
    "Laptop": 16,
    "Microwave": 17,
    "Pot": 18,
    "Tomato": 19,
    "Bed": 20,
    "CoffeeTable": 21,
    "Dresser": 22,
    "TVStand": 23,
    "ShelvingUnit": 24,
    "Bookcase": 25,
    "Wardrobe": 26,
    "Nightstand": 27,
    "Fridge": 28,
    "CounterTop": 29,
    "Stove": 30,
    "Dishwasher": 31,
    "KitchenIsland": 32,
    "Sink": 33,
    "Toilet": 34,
    "Bathtub": 35,
    "Shower": 36,
    "FloorLamp": 37,
    "HousePlant": 38,
    "LaundryHamper": 39,
    "WashingMachine": 40,
    "ClothesDryer": 41,
    "Ottoman": 42,
    "Safe": 43,
    "OfficeChair": 44,
    "FilingCabinet": 45,
    "CoatRack": 46,
    "ShoeCabinet": 47,
    "Rug": 48,
    "Painting": 49,
    "Mirror": 50,
    "Piano": 51,
    "Bench": 52,
    "StorageRack": 53,
    "Crate": 54,
    "VanityTable": 55,
}

# Type: assets, pushable, pickable, fixed. Those of the paper's 20 types as counted in AI2-THOR; a
# type that is not of AI2-THOR has the numbers that its row of `OBSTACLES` is meant to give.
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
KEPT = Path(__file__).parents[1] / "data"


@pytest.mark.parametrize("type_", COUNTS)
def test_every_type_has_as_many_assets_as_meant(type_):
    assets = catalogue().of_type(type_)
    pushable = sum(a.pushable for a in assets)
    pickable = sum(a.pickable for a in assets)
    assert (len(assets), pushable, pickable, len(assets) - pushable - pickable) == COUNTS[type_]
    assert not any(a.pushable and a.pickable for a in assets)
    assert all(a.spawnable for a in assets)


def test_the_counts_name_every_obstacle_type():
    assert set(COUNTS) == {kind.type for kind in OBSTACLES}


def test_sums_agree():
    spawnable = catalogue().spawnable
    assert len(spawnable) == 655
    assert sum(a.pushable for a in spawnable) == 329
    assert sum(a.pickable for a in spawnable) == 274
    assert sum(not a.pushable and not a.pickable for a in spawnable) == 52
    assert [a.asset_id for a in spawnable] == sorted(a.asset_id for a in spawnable)


def test_furniture_is_not_movable_and_of_many_types():
    for kind in FURNITURE:
        for asset in catalogue().of_type(kind.type):
            assert not (asset.pushable)
            assert not (asset.pickable)
            assert not (asset.spawnable)
            assert asset.blocks == (kind.type != "Rug")
    assert len(FURNITURE) >= 30
    assert all(4 <= len(catalogue().of_type(s.type)) <= 12 for s in FURNITURE if s.type != "Piano")


@pytest.mark.parametrize("kind", ASSET_TYPES.values(), ids=lambda s: s.type)
def test_sizes_lie_in_the_sheet_with_its_median(kind):
    assets = catalogue().of_type(kind.type)
    for axis, (low, median, high) in enumerate((kind.width, kind.depth, kind.height)):
        sizes = [a.size[axis] for a in assets]
        assert min(sizes) >= low - 0.0011
        assert max(sizes) <= high + 0.0011
        if kind in OBSTACLES:
            assert statistics.median(sizes) == pytest.approx(median, rel=0.04, abs=0.0021)
            assert (min(sizes), max(sizes)) == pytest.approx((low, high), abs=0.0011)


@pytest.mark.parametrize("kind", OBSTACLES, ids=lambda s: s.type)
def test_mass_grows_with_volume_around_the_sheets(kind):
    assets = sorted(catalogue().of_type(kind.type), key=lambda a: math.prod(a.size))
    masses = [a.mass_kg for a in assets]
    assert masses == sorted(masses)
    assert 0.49 * kind.mass_kg <= masses[0] <= kind.mass_kg <= masses[-1] <= 2.01 * kind.mass_kg
    frictions = [a.friction for a in assets]
    assert min(frictions) >= 0.4
    assert max(frictions) <= 0.8
    assert statistics.median(frictions) == pytest.approx(0.6, abs=0.02)


@pytest.mark.parametrize("type_", ASSET_TYPES)
def test_bounds_are_the_size_exactly(type_):
    for asset in catalogue().of_type(type_):
        low, high = bounds_of(asset)
        w, d, h = asset.size
        np.testing.assert_allclose(low, (-w / 2, -d / 2, 0.0), atol=1e-6, err_msg=asset.asset_id)
        np.testing.assert_allclose(high, (w / 2, d / 2, h), atol=1e-6, err_msg=asset.asset_id)


@pytest.mark.parametrize("type_", [t for t in ASSET_TYPES if t not in {"Painting", "Mirror"}])
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
    generated = generated_assets()
    assert len({a.asset_id for a in generated}) == len(generated) == len(ASSETS)
    assert list(catalogue().assets) == sorted(catalogue().assets)
    assert all(key == asset.asset_id for key, asset in catalogue().assets.items())


def test_digest_is_the_released_one():
    assert max(GOLDEN) == VERSION
    assert catalogue().digest == GOLDEN[VERSION], (
        f"the catalogue is not that of VERSION {VERSION}: raise VERSION and add a row to GOLDEN"
    )


def test_the_released_digests_are_those_of_the_kept_datasets():
    """These datasets are never written again: no row of `GOLDEN` can be changed beside them."""
    kept = [read_manifest(path.parent) for path in KEPT.glob("*/manifest.json")]
    assert kept
    for manifest in kept:
        version = manifest.catalogue_version
        assert GOLDEN[version] == manifest.catalogue_digest, f"row {version} of GOLDEN was changed"


def other(value):
    """Another value of the same kind."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, str):
        return f"{value}x"
    if isinstance(value, tuple):
        return (*value, *(value[:1] or (1,)))
    return value + 1


def test_digest_sees_every_change():
    asset = ASSETS[0]
    first = digest_of(1, [asset])
    assert digest_of(2, [asset]) != first
    for field in dataclasses.fields(asset):
        changed = dataclasses.replace(asset, **{field.name: other(getattr(asset, field.name))})
        assert digest_of(1, [changed]) != first, field.name
    part = asset.parts[0]
    for field in dataclasses.fields(part):
        changed = dataclasses.replace(part, **{field.name: other(getattr(part, field.name))})
        parts = (changed, *asset.parts[1:])
        assert digest_of(1, [dataclasses.replace(asset, parts=parts)]) != first, field.name


def test_drawing_a_type_needs_no_other():
    pots = tuple(asset for asset in generated_assets() if asset.type == "Pot")
    assert draw_type(ASSET_TYPES["Pot"], spawnable=True) == pots


def test_a_new_type_redraws_no_other():
    """An obstacle type in the middle of the table leaves all other assets as they are."""
    free = max(kind.number for kind in ASSET_TYPES.values()) + 1
    new = ASSET_TYPES["Box"]._replace(type="Parcel", number=free)
    grown = by_name((*OBSTACLES[:7], new, *OBSTACLES[7:], *FURNITURE))
    drawn = [
        asset
        for kind in grown.values()
        for asset in draw_type(kind, spawnable=kind in (new, *OBSTACLES))
    ]
    others = tuple(asset for asset in drawn if asset.type != "Parcel")
    assert len(drawn) == len(others) + new.asset_count
    assert others == generated_assets()


def test_numbers_are_the_released_ones():
    """A changed number would redraw its type; a new type's number is written down here."""
    assert {kind.type: kind.number for kind in ASSET_TYPES.values()} == NUMBERS


def test_numbers_and_names_stand_once():
    taken = ASSET_TYPES["Pot"]._replace(type="Pan")
    with pytest.raises(ValueError, match="'Pot' and 'Pan' have the same number 18"):
        by_name((*ASSET_TYPES.values(), taken))
    twice = ASSET_TYPES["Pot"]._replace(number=1000)
    with pytest.raises(ValueError, match="'Pot' stands twice"):
        by_name((*ASSET_TYPES.values(), twice))


def test_shares_reach_the_three_figures():
    assert [from_share((1.0, 2.0, 5.0), s) for s in (0.0, 0.5, 1.0)] == [1.0, 2.0, 5.0]
    values = [from_share((1.0, 2.0, 5.0), k / 100) for k in range(101)]
    assert values == sorted(values)


def test_splits_take_their_shares():
    for kind in OBSTACLES:
        splits = [split_of_asset(a) for a in catalogue().of_type(kind.type)]
        if kind.type == "DogBed":
            assert set(splits) == {"train"}
            continue
        count = len(splits)
        assert splits.count("train") == pytest.approx(count * 2 / 3, abs=1.4)
        assert splits.count("val") == pytest.approx(count / 6, abs=1.0)
        assert splits.count("test") == pytest.approx(count / 6, abs=1.0)
    assert {split_of_asset(a) for a in catalogue().of_type("Fridge")} == {"train"}
