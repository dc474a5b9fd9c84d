from __future__ import annotations

import numpy as np
import pytest

from internav_data.catalog import OBSTACLES, catalogue
from internav_data.records import Asset, Part
from internav_data.records.errors import UsageError
from internav_data.views.asset_sheet import draw_asset_sheet, draw_assets, write_asset_sheet
from internav_data.views.orthographic import OrthographicView, asset_surface, draw_surface

UPRIGHT = (0.0, 0.0, 0.0, 1.0)


def boxes(*parts):
    made = tuple(
        Part("box", centre, size, UPRIGHT, (), colour, "wood") for centre, size, colour in parts
    )
    return Asset("Thing_01", "Thing", (1.0, 1.0, 1.0), 1.0, 0.5, True, False, True, True, made)


def view(**changes):
    settings = {
        "width": 60,
        "height": 40,
        "pixels_per_m": 20.0,
        "centre": (0.0, 0.0, 0.5),
        "yaw_deg": 0.0,
        "pitch_deg": 0.0,
        "oversample": 1,
        "background": (0, 0, 0),
        "floor": False,
    }
    return OrthographicView(**(settings | changes))


def test_a_box_covers_its_own_pixels():
    asset = boxes(((0.0, 0.0, 0.5), (1.0, 0.5, 1.0), (200, 0, 0)))
    image = draw_surface(asset_surface(asset), view())
    rows, columns = np.nonzero(image[:, :, 0])
    assert image.shape == (40, 60, 3)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (10, 29, 20, 39)
    assert len(rows) == 400


@pytest.mark.parametrize(("yaw", "seen"), [(0, 0), (180, 1)])
def test_the_nearer_part_hides_the_farther(yaw, seen):
    front = ((0.0, -0.3, 0.5), (0.6, 0.2, 1.0), (200, 0, 0))
    back = ((0.0, 0.3, 0.5), (0.6, 0.2, 1.0), (0, 200, 0))
    image = draw_surface(asset_surface(boxes(front, back)), view(yaw_deg=float(yaw)))
    assert image[20, 30, seen] > 50
    assert image[20, 30, 1 - seen] == 0


def test_from_above_the_top_is_seen_and_yaw_turns_the_viewer():
    asset = boxes(((0.0, 0.0, 0.5), (1.0, 0.5, 1.0), (200, 0, 0)))
    top = draw_surface(asset_surface(asset), view(pitch_deg=90.0))
    assert np.ptp(np.nonzero(top[:, :, 0])[0]) == 9
    side = draw_surface(asset_surface(asset), view(yaw_deg=90.0))
    assert np.ptp(np.nonzero(side[:, :, 0])[1]) == 9


def test_a_shadow_falls_on_the_floor():
    asset = boxes(((0.0, 0.0, 0.5), (0.4, 0.4, 1.0), (200, 0, 0)))
    changes = {"pitch_deg": 40.0, "floor": True, "background": (240, 240, 240)}
    image = draw_surface(asset_surface(asset), view(**changes))
    grey = (image[:, :, 0] == image[:, :, 1]) & (image[:, :, 0] < 230)
    assert grey.sum() > 20
    assert tuple(image[0, 0]) == (240, 240, 240)


def test_the_same_picture_twice():
    asset = catalogue().assets["Chair_07"]
    first, second = (draw_assets([asset], 80, 60) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 20


def test_things_lie_within_the_picture():
    for sheet in OBSTACLES:
        image = draw_assets(catalogue().of_type(sheet.type)[:1], 60, 50)
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
    with pytest.raises(UsageError, match="cannot be written"):
        write_asset_sheet(tmp_path / "missing" / "x.png", catalogue(), ["Stool"])
