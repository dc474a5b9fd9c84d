"""Distances in the plane against shapely."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from internav_data.geometry import planar

# Multiples of 0.1 mm, as stored: touching, collinear and overlapping cases come up by themselves.
coordinate = st.integers(-30, 30).map(lambda k: k / 10) | st.integers(-30000, 30000).map(
    lambda k: k / 10000
)
point = st.tuples(coordinate, coordinate)


@st.composite
def convex(draw):
    """Corners of a convex polygon of at least 1 cm², counter-clockwise, or of a turned box."""
    x, y = draw(point)
    if draw(st.booleans()):
        turns = sorted(draw(st.lists(st.integers(0, 71), min_size=3, max_size=8, unique=True)))
        angles = [math.radians(5 * t) for t in turns]
        radius = draw(st.integers(5, 200)) / 100
        return np.array([(x + radius * math.cos(a), y + radius * math.sin(a)) for a in angles])
    w, d = draw(st.integers(1, 30)) / 10, draw(st.integers(1, 30)) / 10
    return np.array([(x, y), (x + w, y), (x + w, y + d), (x, y + d)])


def solid(corners):
    return shapely.Polygon(corners)


@given(point, point, point)
def test_point_to_segment(p, a, b):
    found = math.sqrt(planar.point_segment_squared(*p, *a, *b))
    assert found == pytest.approx(shapely.distance(shapely.Point(p), line(a, b)), abs=1e-9)


def line(a, b):
    return shapely.LineString([a, b])


@given(point, point, point, point)
def test_segment_to_segment(a, b, c, d):
    found = math.sqrt(planar.segment_segment_squared(*a, *b, *c, *d))
    assert found == pytest.approx(shapely.distance(line(a, b), line(c, d)), abs=1e-9)
    assert found == pytest.approx(
        math.sqrt(planar.segment_segment_squared(*d, *c, *b, *a)), abs=1e-12
    )


@given(point, convex())
def test_point_to_polygon(p, corners):
    found = planar.point_polygon_distance(*p, corners, 0, len(corners))
    assert found == pytest.approx(shapely.distance(shapely.Point(p), solid(corners)), abs=1e-9)
    within = planar.inside(*p, corners, 0, len(corners))
    boundary = shapely.distance(shapely.Point(p), solid(corners).exterior)
    if boundary > 1e-9:
        assert within == solid(corners).contains(shapely.Point(p))


@given(point, point, convex())
def test_segment_to_polygon_is_the_clearance_of_a_swept_disc(a, b, corners):
    found = planar.segment_polygon_distance(*a, *b, corners, 0, len(corners))
    assert found == pytest.approx(shapely.distance(line(a, b), solid(corners)), abs=1e-9)


@given(convex(), convex())
def test_polygon_to_polygon(first, second):
    found = planar.polygon_distance(first, 0, len(first), second, 0, len(second))
    assert found == pytest.approx(shapely.distance(solid(first), solid(second)), abs=1e-9)
    back = planar.polygon_distance(second, 0, len(second), first, 0, len(first))
    assert back == pytest.approx(found, abs=1e-12)


@given(convex(), convex())
def test_ranges_of_rows_pick_one_polygon_of_many(first, second):
    both = np.vstack([first, second])
    n = len(first)
    assert planar.polygon_distance(both, 0, n, both, n, len(both)) == planar.polygon_distance(
        first, 0, n, second, 0, len(second)
    )


def test_a_bar_across_a_bar_is_no_distance_away():
    across = np.array([(-2.0, -0.1), (2.0, -0.1), (2.0, 0.1), (-2.0, 0.1)])
    upright = np.ascontiguousarray(across[:, ::-1][::-1])
    assert planar.polygon_distance(across, 0, 4, upright, 0, 4) == 0.0
    assert planar.segment_polygon_distance(0.0, -3.0, 0.0, 3.0, across, 0, 4) == 0.0


def test_points_and_segments_are_polygons_too():
    dot, rod = np.array([(1.0, 1.0)]), np.array([(0.0, 0.0), (2.0, 0.0)])
    assert planar.point_polygon_distance(1.0, 3.0, dot, 0, 1) == 2.0
    assert planar.point_polygon_distance(1.0, 3.0, rod, 0, 2) == 3.0
    assert planar.polygon_distance(rod, 0, 2, dot, 0, 1) == 1.0
    assert not planar.inside(1.0, 1.0, dot, 0, 1)


def test_a_triangle_is_the_smallest_polygon_that_holds_a_point():
    corners = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]])
    assert planar.inside(1.0, 1.0, corners, 0, 3)
    assert not planar.inside(1.0, 0.0, corners, 0, 2), "a segment holds none"


def test_a_polygon_may_stand_in_any_rows_and_holds_its_boundary():
    corners = np.array([[9.0, 9.0], [8.0, 8.0], [7.0, 9.0], [0.0, 0.0], [3.0, 0.0], [0.0, 3.0]])
    for point in ((1.0, 1.0), (1.5, 0.0), (1.5, 1.5), (3.0, 0.0)):
        assert planar.inside(*point, corners, 3, 6)
    assert not planar.inside(1.0, -0.1, corners, 3, 6)
    assert not planar.inside(1.5, 0.0, corners, 3, 5), "a segment holds none"
    assert not planar.inside(1.0, 1.0, corners, 3, 4), "nor does a point"
