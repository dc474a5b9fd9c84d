"""Forbidden directions and boundary arcs against a walk round the circle by shapely."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from navigation_oracles import RADIUS, shapes, shortest
from navigation_scenes import convex, rectangle, ring

from internav_data.geometry import Polygons
from internav_data.navigation import TangentGraph
from internav_data.navigation.tangent_graph.boundary_arcs import (
    ALL,
    HALF,
    MID_X,
    MID_Y,
    NONE,
    SOME,
    X,
    Y,
    find_boundary_arcs,
    forbidden_directions,
)
from internav_data.navigation.tangent_graph.disconnection import closest
from internav_data.navigation.tangent_graph.polygon_grid import boxes_of

TURNS = np.radians(np.arange(720) / 2 + 0.123)
HAIR = 1e-7
near = convex(1.2, 1.2)
places = st.tuples(st.integers(0, 120), st.integers(0, 120)).map(lambda c: (c[0] / 100, c[1] / 100))


def arcs_of(polygons):
    """Boundary arcs of polygons among themselves."""
    vertices, offsets = Polygons.of(polygons).vertices, Polygons.of(polygons).offsets
    none = Polygons.of([])
    return find_boundary_arcs(
        vertices, offsets, boxes_of(vertices, offsets),
        none.vertices, none.offsets, np.empty((0, 4)), RADIUS,
    )  # fmt: skip


def round_circle(x, y):
    return shapely.points(x + RADIUS * np.cos(TURNS), y + RADIUS * np.sin(TURNS))


@settings(max_examples=200, deadline=None)
@given(near, places)
def test_directions_are_forbidden_where_the_disc_would_meet_the_polygon(polygon, corner):
    state, low, high = forbidden_directions(*corner, RADIUS, np.array(polygon), 0, len(polygon))
    apart = shapely.distance(shapely.Polygon(polygon), round_circle(*corner))
    if state == SOME:
        assert 0.0 < high - low < 2 * math.pi
        offset = (TURNS - low) % (2 * math.pi)
        denied = offset <= high - low
        sure = np.minimum(np.abs(offset - (high - low)), np.minimum(offset, 2 * math.pi - offset))
    else:
        denied, sure = np.full(len(TURNS), state == ALL), np.ones(len(TURNS))
        assert state in (NONE, ALL)
    decided = (np.abs(apart - RADIUS) > HAIR) & (sure > HAIR)
    assert np.array_equal(denied[decided], apart[decided] < RADIUS)


@settings(max_examples=60, deadline=None)
@given(st.lists(near, min_size=1, max_size=5))
def test_boundary_arcs_are_what_all_polygons_leave_of_their_corners_circles(polygons):
    solid = shapes(polygons)
    arcs = arcs_of(polygons)
    corners = {tuple(corner) for polygon in polygons for corner in polygon}
    assert {(a[X], a[Y]) for a in arcs} <= corners
    for x, y in corners:
        apart = shapely.distance(solid[:, None], round_circle(x, y)[None]).min(axis=0)
        mine = arcs[(arcs[:, X] == x) & (arcs[:, Y] == y)]
        middles = np.arctan2(mine[:, MID_Y], mine[:, MID_X])
        off = np.abs((TURNS[None] - middles[:, None] + math.pi) % (2 * math.pi) - math.pi)
        inside = (off < mine[:, HALF, None] - HAIR).any(axis=0)
        outside = (off > mine[:, HALF, None] + HAIR).all(axis=0)
        assert (apart[inside] >= RADIUS - HAIR).all()
        # Within its own normal cone the circle keeps the radius; else it is nearer than that.
        assert (apart[outside] < RADIUS + HAIR).all()


def test_flush_walls_leave_no_corner_between_them():
    flush = [rectangle(0.0, 0.0, 1.0, 0.12), rectangle(1.0, 0.0, 2.0, 0.12)]
    arcs = arcs_of(flush)
    found = sorted({(a[X], a[Y]) for a in arcs})
    assert found == [
        (0.0, 0.0),
        (0.0, 0.12),
        (2.0, 0.0),
        (2.0, 0.12),
    ]


crumbs = st.tuples(st.integers(-30, 45), st.integers(-30, 45), st.integers(1, 12)).map(
    lambda c: rectangle(c[0] / 100, c[1] / 100, (c[0] + c[2]) / 100, (c[1] + c[2]) / 100)
)


@settings(max_examples=50, deadline=None)
@given(st.lists(crumbs, min_size=1, max_size=2))
def test_an_obstacle_in_the_middle_of_a_turn_closes_it(objects):
    corner = [rectangle(-3.0, -3.0, 0.0, 0.0)]
    p, q = (-2.0, 0.3), (0.3, -2.0)
    graph = TangentGraph.of_polygons(Polygons.of(corner))
    found = graph.distance(p, q, Polygons.of(objects))
    whole = TangentGraph.of_polygons(Polygons.of([*corner, *objects])).distance(p, q)
    assert found == pytest.approx(whole, abs=1e-7)
    assert found == pytest.approx(shortest([*corner, *objects], p, q), rel=2e-3)


def test_a_crumb_beyond_the_corner_sends_the_disc_round_itself():
    graph = TangentGraph.of_polygons(Polygons.of([rectangle(-3.0, -3.0, 0.0, 0.0)]))
    p, q = (-2.0, 0.3), (0.3, -2.0)
    crumb = Polygons.of([rectangle(0.22, 0.22, 0.24, 0.24)])
    clear = graph.distance(p, q)
    assert clear < 4.4
    # Round the crumb it is two tangents to a circle about (0.24, 0.24) and a turn on it.
    assert graph.distance(p, q, crumb) > clear + 0.15


@settings(max_examples=200, deadline=None)
@given(near, near)
def test_closest_points_are_as_far_apart_as_the_polygons(first, second):
    d, ax, ay, bx, by = closest(np.array(first), 0, len(first), np.array(second), 0, len(second))
    a, b = shapely.Polygon(first), shapely.Polygon(second)
    assert d == pytest.approx(a.distance(b), abs=1e-9)
    assert math.dist((ax, ay), (bx, by)) == pytest.approx(d, abs=1e-9)
    assert a.distance(shapely.Point(ax, ay)) < 1e-9
    assert b.distance(shapely.Point(bx, by)) < 1e-9


def test_a_room_without_things_has_no_corner_to_turn_round():
    arcs = arcs_of(ring(4.0, 3.0))
    assert all(not (0 < a[X] < 4.0 and 0 < a[Y] < 3.0) for a in arcs)
