"""Footprints against a slower clipping of meshes and shapely's hulls."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest
import shapely
from builders import UPRIGHT, asset, part
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from internav_data.geometry import (
    HIGHEST_M,
    LOWEST_M,
    Polygons,
    clearance,
    footprint,
    house_footprints,
    part_corners,
    transform,
    wall_footprints,
    yaw_quaternion,
)
from internav_data.geometry.footprints import convex_hull
from internav_data.records import Pose

ROUNDING_M2 = 2e-7
"""Area by which a footprint may differ: its corners lie on a nanometre grid."""

centimetres = st.integers(-100, 100).map(lambda k: k / 100)
sizes = st.integers(1, 150).map(lambda k: k / 100)
quaternions = (
    st.tuples(*[st.integers(-10, 10)] * 4)
    .filter(any)
    .map(lambda q: tuple(c / math.sqrt(sum(k * k for k in q)) for c in q))
)


@st.composite
def parts(draw):
    shape = draw(st.sampled_from(["box", "cylinder", "sphere"]))
    centre = (draw(centimetres), draw(centimetres), draw(st.integers(-20, 220)) / 100)
    size = tuple(draw(sizes) for _ in range(3))
    turn = draw(st.just(UPRIGHT) | quaternions)
    return part(shape, centre, size, turn)


def made_of(*pieces, **changes):
    return asset("Thing_0", *pieces, **changes)


def slice_of(corners):
    """Plan of a convex polyhedron between the two heights: hull of every pair's clipped segment.

    Each pair of corners is a segment within it; clipping by its parameters is another way than
    the kernel's crossing of planes.
    """
    points = []
    for a, b in [*combinations(corners, 2), *((c, c) for c in corners)]:
        low, high = 0.0, 1.0
        rise = b[2] - a[2]
        if rise == 0.0:
            if not LOWEST_M <= a[2] <= HIGHEST_M:
                continue
        else:
            t = sorted(((LOWEST_M - a[2]) / rise, (HIGHEST_M - a[2]) / rise))
            low, high = max(low, t[0]), min(high, t[1])
            if low > high:
                continue
        points += [(a + t * (b - a))[:2] for t in (low, high)]
    if not points:
        return shapely.Point()
    # GEOS's hull stumbles over many points that are nearly or wholly the same (an example below).
    return shapely.MultiPoint(np.unique(np.round(points, 9), axis=0)).convex_hull


def union(polygons):
    return shapely.union_all([shapely.Polygon(p) for p in polygons if len(p) > 2])


ROD = part("cylinder", (0.0, -0.02, 0.0), (0.14, 0.01, 0.01))
TILT = (0.13608276348795434, 0.13608276348795434, 0.5443310539518174, -0.816496580927726)


@settings(max_examples=60, deadline=None)
@given(st.lists(parts(), min_size=1, max_size=4), centimetres, centimetres, quaternions)
@example([ROD], 0.0, 0.0, TILT)
@example(
    [part("box", (-0.04, -0.04, 0.03), (0.01, 0.36, 0.9))],
    0.01,
    0.01,
    (-0.6172133998483676, -0.6172133998483676, 0.4629100498862757, 0.1543033499620919),
)
def test_footprints_are_the_plans_of_what_stands_between_the_heights(pieces, x, y, turn):
    pose = Pose(x, y, 0.1, turn)
    found = footprint(made_of(*pieces), pose)
    slices = [slice_of(transform(part_corners(p), pose)) for p in pieces]
    expected = shapely.union_all([s for s in slices if s.geom_type == "Polygon"])
    # On a grid: without one, GEOS finds two copies of a polygon disjoint (an example above).
    differing = shapely.symmetric_difference(union(found), expected, grid_size=1e-9)
    assert differing.area <= ROUNDING_M2
    for polygon in found:
        ring = shapely.LinearRing(polygon) if len(polygon) > 2 else None
        assert ring is None or ring.is_ccw
        hull = shapely.MultiPoint(polygon).convex_hull
        # Every corner is one of the hull: convex, nothing collinear left but rounding.
        assert all(hull.exterior.distance(shapely.Point(c)) < 1e-8 for c in polygon if ring)


sixteenths = st.integers(-64, 64).map(lambda k: k / 16)
"""Exact in binary, so that three points on a line are on it to the last bit."""


@given(st.lists(st.tuples(sixteenths, sixteenths), min_size=3, max_size=30))
def test_hulls_are_shapelys(points):
    expected = shapely.MultiPoint(points).convex_hull
    found = convex_hull(np.array(points))
    if expected.geom_type != "Polygon":
        # All points on a line, or one point: its ends are left.
        assert len(found) <= 2
        assert shapely.MultiPoint(found).convex_hull.equals(expected)
        return
    assert shapely.Polygon(found).equals(expected)
    assert shapely.LinearRing(found).is_ccw
    assert len(found) == len(shapely.get_coordinates(expected)) - 1


def box(x, y, z, w, d, h):
    return part("box", (x, y, z + h / 2), (w, d, h))


def test_what_is_flat_hangs_high_or_does_not_block_is_no_obstacle():
    here = Pose(0.0, 0.0, 0.0, UPRIGHT)
    assert len(footprint(made_of(box(0, 0, 0, 2, 1, 0.0199)), here)) == 0
    assert len(footprint(made_of(box(0, 0, 0, 2, 1, 0.02)), here)) == 1
    assert len(footprint(made_of(box(0, 0, 1.81, 2, 1, 0.5)), here)) == 0
    assert len(footprint(made_of(box(0, 0, 1.8, 2, 1, 0.5)), here)) == 1
    assert len(footprint(made_of(box(0, 0, 0, 2, 1, 0.5), blocks=False), here)) == 0


def test_parts_hidden_by_others_of_the_same_asset_are_dropped():
    legs = [box(x, y, 0, 0.05, 0.05, 0.7) for x in (-0.4, 0.4) for y in (-0.2, 0.2)]
    table = made_of(*legs, box(0, 0, 0.7, 1.0, 0.6, 0.04))
    assert len(footprint(table, Pose(3.0, 2.0, 0.0, yaw_quaternion(30.0)))) == 1
    twice = made_of(box(0, 0, 0, 1, 1, 0.5), box(0, 0, 0.5, 1, 1, 0.5))
    assert len(footprint(twice, Pose(0.0, 0.0, 0.0, UPRIGHT))) == 1


def test_a_turned_box_by_hand():
    found = footprint(made_of(box(0, 0, 0, 2, 1, 1)), Pose(5.0, 1.0, 0.0, yaw_quaternion(90.0)))
    (corners,) = list(found)
    assert sorted(map(tuple, corners.round(9))) == [(4.5, 0.0), (4.5, 2.0), (5.5, 0.0), (5.5, 2.0)]


def test_a_leaning_plank_counts_only_up_to_the_agents_head():
    # 4 m long, leaning at 45 degrees from the floor: 1.8 m high after 1.8 m.
    lean = (0.0, -math.sin(math.pi / 8), 0.0, math.cos(math.pi / 8))
    rod = part("box", (0.0, 0.0, 0.0), (8.0, 0.1, 0.001), lean)
    (corners,) = list(footprint(made_of(rod), Pose(0.0, 0.0, 0.0, UPRIGHT)))
    assert corners[:, 0].min() == pytest.approx(0.02, abs=1e-3)
    assert corners[:, 0].max() == pytest.approx(1.8, abs=1e-3)


def test_a_houses_footprints_are_its_walls_then_its_objects(hand_house):
    walls = wall_footprints(hand_house.walls)
    low = [w for w in hand_house.walls if w.z_min < HIGHEST_M]
    assert [tuple(p[0]) for p in walls] == [(w.x_min, w.y_min) for w in low]
    everything = list(house_footprints(hand_house))
    objects = [
        p for o in hand_house.objects for p in footprint(hand_house.assets[o.asset_id], o.pose)
    ]
    assert len(everything) == len(walls) + len(objects)
    assert all(np.array_equal(a, b) for a, b in zip(everything[len(walls) :], objects, strict=True))


@settings(max_examples=60, deadline=None)
@given(parts(), parts(), centimetres, centimetres, st.integers(0, 300))
def test_clearance_is_shapelys_distance_up_to_a_limit(first, second, x, y, limit):
    a = footprint(made_of(first), Pose(0.0, 0.0, 0.0, UPRIGHT))
    b = footprint(made_of(second), Pose(x + 1, y, 0.0, UPRIGHT))
    assume(all(len(p) > 2 for p in [*a, *b]))
    apart = union(a).distance(union(b)) if len(a) and len(b) else math.inf
    expected = min(apart, limit / 100)
    assert clearance(a, b, limit / 100) == pytest.approx(expected, abs=1e-9)
    assert clearance(b, a, limit / 100) == pytest.approx(expected, abs=1e-9)


def test_clearance_of_nothing_is_the_limit():
    none, some = Polygons.of([]), Polygons.of([[(0, 0), (1, 0), (0, 1)]])
    assert clearance(none, some) == 1e6
    assert clearance(some, none, 0.5) == 0.5


def test_polygons_keep_their_order():
    first, second = [(0, 0), (1, 0), (0, 1)], [(2, 2), (3, 2), (3, 3), (2, 3)]
    both = Polygons.joined([Polygons.of([first]), Polygons.of([]), Polygons.of([second])])
    assert [p.tolist() for p in both] == [[list(map(float, c)) for c in p] for p in (first, second)]
    assert both.offsets.tolist() == [0, 3, 7]
