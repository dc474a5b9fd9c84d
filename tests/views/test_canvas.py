from __future__ import annotations

import numpy as np
import pytest
from builders import UPRIGHT, asset, box, part
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import symmetric_difference
from shapely.geometry import MultiPoint, Polygon

from internav_data.geometry import transform, yaw_quaternion
from internav_data.records import Pose
from internav_data.views.canvas import OVERSAMPLING, Canvas
from internav_data.views.captions import with_caption
from internav_data.views.silhouettes import shaded, silhouettes

WHITE = (255, 255, 255)
corner = st.tuples(st.floats(0.5, 9.5), st.floats(0.5, 5.5))


@settings(max_examples=40, deadline=None)
@given(st.lists(corner, min_size=3, max_size=8))
def test_a_mask_covers_a_polygons_own_area(points):
    hull = MultiPoint(points).convex_hull
    if not isinstance(hull, Polygon) or hull.area < 0.5:
        return
    canvas = Canvas((0.0, 0.0), (10.0, 6.0), 400, WHITE)
    mask = canvas.mask([list(hull.exterior.coords)[:-1]])
    covered = mask.sum() / 255.0 / (canvas.scale * OVERSAMPLING) ** 2
    # cv2 draws the rim too: half a pixel on each side of the outline.
    rim = hull.length / (canvas.scale * OVERSAMPLING)
    assert hull.area - 0.3 * rim <= covered <= hull.area + 1.2 * rim


def test_y_points_up_and_x_right():
    canvas = Canvas((0.0, 0.0), (4.0, 2.0), 400, WHITE)
    canvas.fill([(3.0, 1.5), (3.5, 1.5), (3.5, 1.9), (3.0, 1.9)], (200, 0, 0))
    picture = canvas.finished()
    assert picture.shape == (200, 400, 3)
    assert tuple(picture[30, 325]) == (200, 0, 0)
    assert tuple(picture[170, 325]) == WHITE


def test_pixels_know_where_they_are():
    canvas = Canvas((-1.0, 2.0), (3.0, 4.0), 200, WHITE)
    window = canvas.window((0.0, 2.5), (1.0, 3.0))
    x, y = canvas.metres(window)
    assert x[0] == pytest.approx(0.0, abs=0.02)
    assert x[-1] == pytest.approx(1.0, abs=0.02)
    assert y[0] == pytest.approx(3.0, abs=0.02)
    assert y[-1] == pytest.approx(2.5, abs=0.02)


def test_dashes_leave_gaps_of_their_own_length():
    canvas = Canvas((0.0, 0.0), (4.0, 1.0), 800, WHITE)
    canvas.dashes([(0.0, 0.5), (2.0, 0.5), (4.0, 0.5)], (0, 0, 0), 2.0, 0.25)
    row = canvas.finished()[100, :, 0] < 128
    assert row.mean() == pytest.approx(0.5, abs=0.08)
    assert np.count_nonzero(np.diff(row.astype(int)) == 1) in {7, 8}


def test_blending_moves_towards_the_colour_by_the_strength():
    canvas = Canvas((0.0, 0.0), (1.0, 1.0), 50, (100, 100, 100))
    canvas.blend(canvas.mask([[(0, 0), (1, 0), (1, 1), (0, 1)]]), (200, 100, 0), 0.5)
    assert tuple(canvas.finished()[25, 25]) == (150, 100, 50)
    canvas.blend(np.zeros(canvas.image.shape[:2], np.uint8), (0, 0, 0), 1.0)
    assert tuple(canvas.finished()[25, 25]) == (150, 100, 50)


def test_text_is_as_long_as_it_says():
    canvas = Canvas((0.0, 0.0), (4.0, 1.0), 400, WHITE)
    width = canvas.text_width("living room", 12.0)
    canvas.text((2.0, 0.5), "living room", 12.0, (0, 0, 0))
    columns = np.flatnonzero((canvas.finished()[..., 0] < 128).any(axis=0))
    assert (columns[-1] - columns[0]) / 100 == pytest.approx(width, abs=0.06)
    assert (columns[-1] + columns[0]) / 200 == pytest.approx(2.0, abs=0.05)


def test_long_captions_are_broken_and_nothing_is_cut_off():
    picture = np.full((40, 300, 3), 255, np.uint8)
    short = with_caption(picture, ["one"], [])
    long = with_caption(picture, ["   ".join(["a piece of text"] * 8)], [((1, 2, 3), "swatch")] * 6)
    assert short.shape[1] == long.shape[1] == 300
    assert long.shape[0] > short.shape[0] + 40
    assert (long[:, -6:] > 200).all(), "the right edge stays empty"


@settings(max_examples=30, deadline=None)
@given(st.floats(0.0, 360.0), st.floats(-3.0, 3.0), st.tuples(*[st.floats(0.05, 2.0)] * 3))
def test_an_outline_is_the_hull_of_the_projected_corners(yaw, x, size):
    one = box((0.1, -0.2, 0.5), size)
    pose = Pose(x, 1.0, 0.0, yaw_quaternion(yaw))
    (outline,) = silhouettes(asset("Box_0", one), pose)
    half = np.array(size) / 2.0
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    corners = transform(signs * half + np.array(one.centre), pose)
    hull = MultiPoint(corners[:, :2]).convex_hull
    differing = symmetric_difference(Polygon(outline.plan), hull, grid_size=1e-9)
    assert differing.area < 1e-4
    assert outline.top_m == pytest.approx(0.5 + size[2] / 2.0)
    assert outline.shades == pytest.approx(1.0), "only the level top is seen from above"


def test_a_leaning_face_is_darker_on_the_far_side_from_the_light():
    roof = ((-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (-1.0, 1.0, 0.0), (1.0, 1.0, 0.0))
    ridge = ((0.0, -1.0, 1.0), (0.0, 1.0, 1.0))
    hull = part("hull", (0, 0, 0), (2, 2, 1), corners=(*roof, *ridge))
    (outline,) = silhouettes(asset("Roof_0", hull), Pose(0.0, 0.0, 0.0, UPRIGHT))
    west = [s for f, s in zip(outline.faces, outline.shades, strict=True) if f[:, 0].mean() < 0]
    east = [s for f, s in zip(outline.faces, outline.shades, strict=True) if f[:, 0].mean() > 0]
    assert min(west) > max(east)
    assert shaded((200, 100, 10), 2.0) == (255, 200, 20)
