from __future__ import annotations

import numpy as np
import pytest
from builders import asset, box

from internav_data.catalog import OBSTACLES, catalogue
from internav_data.records.errors import InternavError, UsageError
from internav_data.views.asset_sheet import draw_asset_sheet, draw_assets, write_asset_sheet


def boxes(*parts):
    made = (box(*one) for one in parts)
    return asset("Thing_01", *made)


def red(image):
    return image[:, :, 0].astype(int) - image[:, :, 1] > 60


def green(image):
    return image[:, :, 1].astype(int) - image[:, :, 0] > 60


def test_an_asset_is_as_large_as_fits_and_in_the_middle():
    asset = boxes(((0.0, 0.0, 0.5), (1.0, 1.0, 1.0), (200, 0, 0)))
    for width, height in ((240, 90), (60, 180)):
        image = draw_assets([asset], width, height)
        rows, columns = np.nonzero(red(image))
        assert image.shape == (height, width, 3)
        assert rows.min() + rows.max() == pytest.approx(height - 1, abs=2)
        assert columns.min() + columns.max() == pytest.approx(width - 1, abs=2)
        filled = max((np.ptp(rows) + 1) / height / 0.86, (np.ptp(columns) + 1) / width / 0.92)
        assert filled == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(("turn", "seen"), [(0, red), (180, green)])
def test_the_nearer_part_hides_the_farther(turn, seen):
    front = ((0.0, -0.3, 0.5), (0.6, 0.2, 1.0), (200, 0, 0))
    back = ((0.0, 0.3, 0.5), (0.6, 0.2, 0.9), (0, 200, 0))
    image = draw_assets([boxes(front, back)], 60, 60, turn_deg=float(turn))
    hidden = {red: green, green: red}[seen]
    lower = image[35:]
    assert seen(lower).sum() > 200
    assert not hidden(lower).any()


def test_assets_stand_side_by_side_in_order():
    first = boxes(((0.0, 0.0, 0.5), (0.5, 0.5, 1.0), (200, 0, 0)))
    second = boxes(((0.0, 0.0, 0.5), (0.5, 0.5, 1.0), (0, 200, 0)))
    image = draw_assets([first, second], 120, 60)
    assert np.nonzero(red(image))[1].max() < np.nonzero(green(image))[1].min()


def test_a_shadow_falls_on_the_floor():
    asset = boxes(((0.0, 0.0, 0.5), (0.4, 0.4, 1.0), (200, 0, 0)))
    image = draw_assets([asset], 120, 120)
    grey = (np.ptp(image, axis=2) < 4) & (image[:, :, 0] < 230)
    assert grey.sum() > 20
    assert tuple(image[0, 0]) == (247, 247, 245)


def test_no_assets_are_refused():
    with pytest.raises(UsageError, match="give at least one"):
        draw_assets([], 60, 60)


def test_the_same_picture_twice():
    asset = catalogue().assets["Chair_07"]
    first, second = (draw_assets([asset], 80, 60) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 20


def test_things_lie_within_the_picture():
    for sheet in OBSTACLES:
        image = draw_assets(catalogue().of_type(sheet.type)[:1], 60, 50)
        assert (np.ptp(image[0], axis=1) < 4).all(), sheet.type
        assert (np.ptp(image[-1], axis=1) < 4).all(), sheet.type
        assert (image[0] >= 180).all(), sheet.type
        assert (image[-1] >= 150).all(), sheet.type


def test_sheet(tmp_path):
    import cv2

    image = draw_asset_sheet(catalogue(), ["Chair", "Apple", "Pot"], columns=2, cell_px=(120, 90))
    assert image.shape == (180, 240, 3)
    path = tmp_path / "sheet.png"
    write_asset_sheet(path, catalogue(), ["Stool"])
    assert cv2.imread(str(path)) is not None
    with pytest.raises(UsageError, match="Chiar"):
        draw_asset_sheet(catalogue(), ["Chiar"])
    with pytest.raises(InternavError, match="cannot be written"):
        write_asset_sheet(path / "x.png", catalogue(), ["Stool"])
