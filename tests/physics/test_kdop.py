"""Octagons against shapely: never smaller than what they stand for, and turned like points."""

import math

import numpy as np
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from internav_data.geometry import yaw_quaternion
from internav_data.geometry.headings import turned
from internav_data.physics.frames import Frame
from internav_data.physics.kdop import (
    EMPTY,
    dop8_of_rectangle,
    grown,
    overlap,
    touching,
    widen,
)

NORMALS = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))
NEARLY = 1e-9
SPOTS = st.floats(-2.0, 2.0, allow_subnormal=False)
SHAPES = st.lists(st.tuples(SPOTS, SPOTS), min_size=1, max_size=6).map(
    # A corner of 10 cm goes with every first point: thin shapes are shapely's own trouble.
    lambda p: (
        shapely.MultiPoint([*p, (p[0][0] + 0.1, p[0][1]), (p[0][0], p[0][1] + 0.1)]).convex_hull
    )
)


def dop8_of(shape):
    """Return the 8-DOP by the kernel, from corners at some height, not rotated."""
    xy = shapely.get_coordinates(shape)
    reach = np.full(8, -math.inf)
    widen(reach, np.column_stack([xy, np.full(len(xy), 0.7)]), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    return tuple(reach.tolist())


def polygon_of(dop8):
    """Return the polygon of an 8-DOP: the intersection of its eight half-planes."""
    out = shapely.box(-50, -50, 50, 50)
    for (nx, ny), far in zip(NORMALS, dop8, strict=True):
        size = math.hypot(nx, ny)
        ux, uy = nx / size, ny / size
        x, y = far / size * ux, far / size * uy
        corners = [(0, -200), (0, 200), (-400, 200), (-400, -200)]
        out &= shapely.Polygon([(x + a * ux - b * uy, y + a * uy + b * ux) for a, b in corners])
    return out


@settings(max_examples=60, deadline=None)
@given(SHAPES)
def test_an_octagon_holds_its_shape_and_touches_it_on_every_side(shape):
    dop8 = dop8_of(shape)
    assert polygon_of(dop8).buffer(1e-6).covers(shape)
    corners = shapely.get_coordinates(shape)
    for (nx, ny), far in zip(NORMALS, dop8, strict=True):
        assert abs(max(nx * x + ny * y for x, y in corners.tolist()) - far) < NEARLY


@settings(max_examples=120, deadline=None)
@given(SHAPES, SHAPES)
@example(shapely.box(0.0, 0.0, 1.0, 1.0), shapely.box(0.5, 0.5, 1.5, 1.5))
@example(shapely.box(0.0, 0.0, 1.0, 1.0), shapely.box(3.0, 3.0, 4.0, 4.0))
def test_overlap_says_yes_wherever_shapes_do(one, other):
    a, b = dop8_of(one), dop8_of(other)
    assert overlap(a, b) == overlap(b, a)
    assert overlap(a, b) or one.intersection(other).area <= 1e-6
    # And of octagons themselves it is the whole truth, but for touching to rounding.
    shared = polygon_of(a).intersection(polygon_of(b))
    assert overlap(a, b) or shared.area <= 1e-6
    assert not overlap(a, b) or polygon_of(a).distance(polygon_of(b)) <= 1e-6


@settings(max_examples=60, deadline=None)
@given(SHAPES, SHAPES, st.floats(0.001, 1.0))
@example(shapely.box(0.0, 0.0, 1.0, 1.0), shapely.box(1.2, 0.0, 2.0, 1.0), 0.3)
def test_a_margin_reaches_all_within_it(one, other, margin):
    a = grown(dop8_of(one), margin)
    assert overlap(a, dop8_of(other)) or one.distance(other) >= margin - 1e-6
    assert polygon_of(a).buffer(1e-6).covers(one.buffer(margin))


@given(SPOTS, SPOTS, st.floats(0.0, 2.0), st.floats(0.0, 2.0))
def test_a_rectangle_is_its_own_octagon(x, y, wide, deep):
    expected = dop8_of(shapely.box(x, y, x + wide + 0.01, y + deep + 0.01))
    found = dop8_of_rectangle(x, y, x + wide + 0.01, y + deep + 0.01)
    assert np.allclose(found, expected, rtol=0.0, atol=NEARLY)


@settings(max_examples=60, deadline=None)
@given(st.lists(SHAPES, max_size=6), SHAPES)
def test_touching_is_overlap_with_each(shapes, one):
    dop8s = [dop8_of(shape) for shape in shapes] + [EMPTY]
    rows = np.array(dop8s).reshape(-1, 8)
    wanted = dop8_of(one)
    expected = [k for k, other in enumerate(dop8s) if overlap(other, wanted)]
    assert touching(rows, wanted) == expected
    assert len(dop8s) - 1 not in expected, "what is held touches nothing"


def test_shapes_side_by_side_do_not_overlap():
    one = dop8_of_rectangle(0.0, 0.0, 1.0, 1.0)
    for dx, dy in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.5), (1.0, 1.0)):
        assert not overlap(one, dop8_of_rectangle(dx, dy, dx + 1.0, dy + 1.0))
    # Slanted neighbours whose boxes overlap are told apart: boxes alone would not.
    diamond = dop8_of(shapely.Polygon([(1.0, 0.1), (1.9, 1.0), (1.0, 1.9), (0.1, 1.0)]))
    assert not overlap(diamond, dop8_of_rectangle(0.0, 0.0, 0.5, 0.5))
    assert overlap(diamond, dop8_of_rectangle(0.0, 0.0, 0.6, 0.6))


@settings(max_examples=60, deadline=None)
@given(SHAPES, st.integers(0, 3), SPOTS, SPOTS)
def test_leaving_a_frame_turns_an_octagon_as_it_turns_points(shape, heading, x, y):
    points = [turned(heading, *point) for point in shapely.get_coordinates(shape).tolist()]
    moved = shapely.Polygon([(px + x, py + y) for px, py in points])
    left = Frame(x, y, heading).leave_dop8(dop8_of(shape))
    assert np.allclose(left, dop8_of(moved), rtol=0.0, atol=NEARLY)


@settings(max_examples=100, deadline=None)
@given(SHAPES, st.floats(-180.0, 180.0), SPOTS, SPOTS)
def test_a_kernel_turns_and_moves_corners(shape, yaw, x, y):
    xy = shapely.get_coordinates(shape)
    reach = np.full(8, -math.inf)
    widen(reach, np.column_stack([xy, np.zeros(len(xy))]), x, y, *yaw_quaternion(yaw))
    c, s = math.cos(math.radians(yaw)), math.sin(math.radians(yaw))
    points = [(c * px - s * py + x, s * px + c * py + y) for px, py in xy.tolist()]
    expected = dop8_of(shapely.MultiPoint(points))
    # Stored quaternions are rounded to 1e-6, two metres away.
    assert np.allclose(reach, expected, rtol=0.0, atol=2e-5)
