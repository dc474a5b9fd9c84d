"""Euclidean paths against closed forms, a full visibility graph and shapely's areas."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from navigation_oracles import OUTSIDE_IN, RADIUS, grown, joined, shapes, shortest
from navigation_scenes import (
    cluttered,
    convex,
    random_rooms,
    rectangle,
    ring,
    round_object,
    turned,
    two_rooms,
)

from internav_data.geometry import Polygons
from internav_data.navigation import Lattice, TangentGraph

FREE = TangentGraph.of_polygons(Polygons.of([]))
places = st.tuples(st.integers(20, 580), st.integers(20, 380)).map(
    lambda c: (c[0] / 100, c[1] / 100)
)


def graph_of(polygons):
    return TangentGraph.of_polygons(Polygons.of(polygons))


def test_nothing_in_the_way_is_a_straight_line():
    assert FREE.distance((0, 0), (3, 4)) == 5.0
    assert FREE.distance((1, 1), (1, 1)) == 0.0
    assert np.array_equal(FREE.path((0, 0), (3, 4)), [[0, 0], [3, 4]])


def test_round_the_end_of_a_wall_in_closed_form():
    wall = rectangle(-0.06, -10, 0.06, 0)
    tangent = math.sqrt(1.94**2 + 1 - RADIUS**2)
    # Direction from the corner to the start, less the tangent's own angle, is where it touches.
    touch = math.atan2(-1, -1.94) % (2 * math.pi) - math.acos(RADIUS / math.hypot(1.94, 1))
    expected = 2 * (tangent + RADIUS * (touch - math.pi / 2) + 0.06)
    assert graph_of([wall]).distance((-2, -1), (2, -1)) == pytest.approx(expected, abs=1e-9)
    assert FREE.distance((-2, -1), (2, -1), Polygons.of([wall])) == pytest.approx(
        expected, abs=1e-9
    )


def test_round_a_column_is_a_taut_string_round_its_hull():
    column = round_object(0, 0, 0.5)
    # A string round 16 corners rolled by R: tangents and the turn between them on the outline.
    length = graph_of([column]).distance((-3, 0), (3, 0))
    outline = grown([column])
    # Upper half of hull(start, goal, grown column).
    hull = shapely.union_all([outline, shapely.Point(-3, 0), shapely.Point(3, 0)]).convex_hull
    assert length == pytest.approx(hull.length / 2, rel=2e-4)
    assert length > hull.length / 2


def test_gap_of_two_radii_passes_and_a_narrower_one_does_not():
    for gap, passes in ((0.4, True), (0.4001, True), (0.399, False), (0.3999, False)):
        walls = [rectangle(-0.06, -9, 0.06, 0), rectangle(-0.06, gap, 0.06, 9), *ring(0, 0)]
        house = [*walls[:2], rectangle(-9, -9.1, 9, -9), rectangle(-9, 9, 9, 9.1)]
        house += [rectangle(-9, -9, -8.9, 9), rectangle(8.9, -9, 9, 9)]
        graph = graph_of(house)
        assert graph.sealed((-1, 0.2), (1, 0.2)) is not passes
        assert (graph.distance((-1, 0.2), (1, 0.2)) is not None) is passes
        if passes:
            assert graph.distance((-1, 0.2), (1, 0.2)) == pytest.approx(2.0, abs=1e-6)
        # The same, with the lower wall as an obstacle that comes later.
        late = graph_of([*house[1:]])
        assert late.sealed((-1, 0.2), (1, 0.2), Polygons.of(house[:1])) is not passes


def test_a_pair_of_obstacles_that_only_together_seal_a_door():
    house = two_rooms()
    graph, lattice = TangentGraph.of(house), Lattice.of(house)
    left = rectangle(2.9, 1.55, 3.1, 1.75)
    right = rectangle(2.9, 2.1, 3.1, 2.45)
    p, q = (1.0, 2.0), (5.0, 2.0)
    assert graph.distance(p, q) == pytest.approx(4.0)
    assert not graph.sealed(p, q, Polygons.of([right]))  # 1.5 to 2.1 m: 0.6 m is left
    assert graph.sealed(p, q, Polygons.of([left, right]))
    assert graph.distance(p, q, Polygons.of([left, right])) is None
    assert graph.path(p, q, Polygons.of([left, right])) is None
    assert lattice.distance((4, 8), (20, 8)) == 16


def test_no_place_to_stand_is_sealed():
    graph = graph_of(ring(6, 4))
    assert graph.sealed((0.1, 1.0), (3, 2))
    assert not graph.can_stand((0.1, 1.0))
    assert graph.sealed((1, 1), (3, 2), Polygons.of([rectangle(2.9, 1.9, 3.1, 2.1)]))
    assert not graph.can_stand((3, 2), Polygons.of([rectangle(2.9, 1.9, 3.1, 2.1)]))
    assert graph.sealed((-2, 1), (3, 2))  # outside, and inside: apart without any obstacle
    assert graph.sealed((-2, 1), (3, 2), Polygons.of([rectangle(4, 1, 4.2, 1.2)]))


def test_a_cage_of_obstacles_far_from_any_wall():
    bars = [rectangle(x, y, x + 0.2, y + 0.2) for x in (2.0, 2.5, 3.0) for y in (1.0, 1.5, 2.0)]
    cage = [b for b in bars if b[0] != (2.5, 1.5)]
    graph = graph_of(ring(6, 4))
    assert graph.sealed((2.6, 1.6), (5, 3), Polygons.of(cage)) is True
    assert graph.sealed((1, 3), (5, 3), Polygons.of(cage)) is False
    wide = [*cage[:3], *cage[4:]]
    assert graph.sealed((2.6, 1.6), (5, 3), Polygons.of(wide)) is False


def check(fixed, objects, p, q):
    """All that must hold of a distance, given everything in the house or some as obstacles."""
    everything = [*fixed, *objects]
    whole, part, none = graph_of(everything), graph_of(fixed), FREE
    solid = shapes(everything)
    assume(shapely.distance(solid, shapely.Point(p)).min() >= RADIUS)
    assume(shapely.distance(solid, shapely.Point(q)).min() >= RADIUS)
    added = Polygons.of(objects)
    d = whole.distance(p, q)
    for graph, late in ((part, added), (none, Polygons.of(everything))):
        late_d = graph.distance(p, q, late)
        assert (late_d is None) == (d is None)
        assert d is None or late_d == pytest.approx(d, abs=1e-7)
        assert graph.sealed(p, q, late) is (d is None)
        back = graph.distance(q, p, late)
        assert d is None or back == pytest.approx(d, abs=1e-7)
    low, high = RADIUS, RADIUS * OUTSIDE_IN
    if not joined(everything, p, q, low):
        assert d is None
        return
    if joined(everything, p, q, high):
        assert d is not None
        upper = shortest(everything, p, q, high)
        assert upper is None or d <= upper + 1e-6
    if d is None:
        return
    assert d >= math.dist(p, q) - 1e-9
    assert d >= shortest(everything, p, q, low) - 1e-6
    points = whole.path(p, q)
    assert math.dist(points[0], p) < 1e-9
    assert math.dist(points[-1], q) < 1e-9
    line = shapely.LineString(points) if len(points) > 1 else shapely.Point(points[0])
    assert shapely.distance(solid, line).min() >= RADIUS - 1e-3
    assert line.length == pytest.approx(d, rel=2e-3, abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(scene=cluttered(), p=places, q=places)
def test_agrees_with_the_visibility_graph_and_areas_of_shapely(scene, p, q):
    check(*scene, p, q)


@pytest.mark.slow
@settings(max_examples=1500, deadline=None)
@given(scene=cluttered(max_objects=14), p=places, q=places)
def test_agrees_with_the_visibility_graph_campaign(scene, p, q):
    check(*scene, p, q)


@settings(max_examples=40, deadline=None)
@given(objects=st.lists(convex(), min_size=1, max_size=10), p=places, q=places, r=places)
def test_is_a_metric_and_does_not_mind_mirrors(objects, p, q, r):
    fixed = ring(6, 4)
    graph, obstacles = graph_of(fixed), Polygons.of(objects)
    pq, qr, pr = (graph.distance(a, b, obstacles) for a, b in ((p, q), (q, r), (p, r)))
    if pq is not None and qr is not None:
        assert pr is not None
        assert pr <= pq + qr + 1e-7
    mirrored = Polygons.of([[(6 - x, y) for x, y in reversed(t)] for t in objects])
    other = graph.distance((6 - p[0], p[1]), (6 - q[0], q[1]), mirrored)
    assert (other is None) == (pq is None)
    assert pq is None or other == pytest.approx(pq, abs=1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_in_a_whole_house_bounded_by_lattice_and_line(seed):
    polygons, outline = random_rooms(seed)
    graph, lattice = TangentGraph.of_polygons(polygons), Lattice.of_polygons(polygons, outline)
    rng = np.random.default_rng(seed)
    free = np.argwhere(lattice.free)
    bounded = 0
    for _ in range(40):
        a, b = (tuple(int(v) for v in free[rng.integers(len(free))]) for _ in range(2))
        p, q = (0.25 * a[0], 0.25 * a[1]), (0.25 * b[0], 0.25 * b[1])
        x, y = 0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])
        obstacles = Polygons.of([turned(x, y, 1.0, 0.5, 15 * int(rng.integers(24)))])
        handle = lattice.add(obstacles)
        steps, d = lattice.distance(a, b), graph.distance(p, q, obstacles)
        lattice.remove(handle)
        assert d is None or d >= math.dist(p, q) - 1e-9
        if steps is not None:
            bounded += 1
            assert d is not None
            assert d <= 0.25 * steps + 1e-7
        whole = TangentGraph.of_polygons(Polygons.joined([polygons, obstacles])).distance(p, q)
        assert (whole is None) == (d is None)
        assert d is None or whole == pytest.approx(d, abs=1e-7)
    assert bounded >= 10


def test_answers_do_not_depend_on_what_was_asked_before():
    polygons, outline = random_rooms(5)
    fresh, used = TangentGraph.of_polygons(polygons), TangentGraph.of_polygons(polygons)
    wall = Polygons.of([rectangle(9.0, 3.0, 9.5, 3.4)])
    lattice = Lattice.of_polygons(Polygons.joined([polygons, wall]), outline)
    labels, counts = np.unique(lattice.components()[lattice.free], return_counts=True)
    joined_nodes = np.argwhere(lattice.components() == labels[counts.argmax()]) * 0.25
    start, *others, goal = map(tuple, joined_nodes.tolist())
    for other in others[:300]:  # more than are cached
        assert used.distance(other, goal) is not None
    first, second = fresh.path(start, goal, wall), used.path(start, goal, wall)
    assert first is not None
    assert len(first) > 2
    assert np.array_equal(first, second)
