"""Rooms of points, all room paths and node paths, against networkx and by hand."""

from __future__ import annotations

import time

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from navigation_scenes import graph_house, house_of, two_rooms

from internav_data.navigation import node_paths, room_of, room_paths, rooms_of
from internav_data.records import OUTSIDE, Door, NodePath

ELLS = {
    0: [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (2.0, 2.0), (2.0, 4.0), (0.0, 4.0)],
    1: [(2.0, 2.0), (4.0, 2.0), (4.0, 4.0), (2.0, 4.0)],
}
graphs = st.integers(2, 7).flatmap(
    lambda n: st.tuples(
        st.just(n),
        st.sets(
            st.tuples(st.integers(0, n - 1), st.integers(0, n - 1)).filter(lambda e: e[0] != e[1])
        ),
    )
)


def brute(edges, count, a, b):
    graph = nx.Graph(list(edges))
    graph.add_nodes_from(range(count))
    paths = [(a,)] if a == b else [tuple(p) for p in nx.all_simple_paths(graph, a, b)]
    return sorted(paths, key=lambda p: (len(p), p))


@settings(max_examples=150, deadline=None)
@given(graphs, st.integers(1, 70), st.data())
def test_room_paths_are_all_simple_paths_in_order(graph, limit, data):
    count, edges = graph
    a, b = (data.draw(st.integers(0, count - 1)) for _ in range(2))
    expected = brute(edges, count, a, b)
    paths, cut = room_paths(graph_house(edges, count), a, b, limit)
    assert list(paths) == expected[:limit]
    assert cut == (len(expected) > limit)


def test_room_paths_by_default_stop_at_64():
    complete = [(a, b) for a in range(7) for b in range(a)]
    paths, cut = room_paths(graph_house(complete, 7), 0, 6)
    assert (len(paths), cut) == (64, True)
    assert paths[:3] == ((0, 6), (0, 1, 6), (0, 2, 6))


def test_room_paths_stay_quick_where_a_dense_part_leads_nowhere():
    # 38 rooms all joined with each other hang on one room: billions of dead ends, two ways.
    dense = [(a, b) for a in range(4, 42) for b in range(4, a)]
    house = graph_house([(0, 1), (1, 2), (0, 3), (3, 2), (3, 4), *dense], 42)
    begin = time.process_time()
    assert room_paths(house, 0, 2) == (((0, 1, 2), (0, 3, 2)), False)
    # Milliseconds of this process: other work on the machine does not count.
    assert time.process_time() - begin < 5.0


def test_room_of_a_point_is_its_polygon_and_a_border_has_one_owner():
    house = house_of(ELLS, [], [])
    assert room_of(house, 1.0, 3.0) == 0
    assert room_of(house, 3.0, 3.0) == 1
    assert room_of(house, 2.0, 3.0) == 1  # an upright border belongs to larger x
    assert room_of(house, 3.0, 2.0) == 1  # a level one to larger y
    assert room_of(house, 2.0, 2.0) == 1
    assert room_of(house, 0.0, 0.0) == 0
    assert room_of(house, -0.1, 1.0) == OUTSIDE
    assert room_of(house, 5.0, 5.0) == OUTSIDE


@settings(max_examples=60)
@given(st.lists(st.tuples(st.integers(-4, 20), st.integers(-4, 20)), max_size=30))
def test_rooms_of_many_points_are_those_of_each_and_of_shapely(quarters):
    house = house_of(ELLS, [], [])
    points = np.array(quarters, dtype=float).reshape(-1, 2) / 4
    found = rooms_of(house, points)
    assert found.tolist() == [room_of(house, x, y) for x, y in points]
    for (x, y), room in zip(points, found, strict=True):
        inside = [k for k, p in ELLS.items() if shapely.Polygon(p).contains(shapely.Point(x, y))]
        near = [k for k, p in ELLS.items() if shapely.Polygon(p).covers(shapely.Point(x, y))]
        assert inside in ([], [room])
        assert room == OUTSIDE or room in near


def doors_of(pairs):
    return [
        Door(n, pair, "single", float(n), 0.5, 90.0, 1.0, 2.1, pair != (0, 9))
        for n, pair in enumerate(pairs)
    ]


def test_node_paths_take_every_choice_of_door():
    house = house_of({}, doors_of([(0, 1), (1, 2), (0, 1), (0, 9), (0, 2)]), [(0, 1), (1, 2)])
    start, goal = (0.5, 0.25), (2.5, 0.75)
    paths, cut = node_paths(house, start, goal, [(0, 2), (0, 1, 2)])
    assert not cut
    assert paths == (
        NodePath((4,), (start, (4.0, 0.5), goal)),
        NodePath((0, 1), (start, (0.0, 0.5), (1.0, 0.5), goal)),
        NodePath((2, 1), (start, (2.0, 0.5), (1.0, 0.5), goal)),
    )


def test_node_paths_go_back_through_a_door_as_well():
    paths, _ = node_paths(two_rooms(), (5.0, 1.0), (1.0, 1.0), [(1, 0)])
    assert paths == (NodePath((0,), ((5.0, 1.0), (3.0, 2.0), (1.0, 1.0))),)


def test_node_paths_within_one_room_have_no_door():
    paths, cut = node_paths(two_rooms(), (1.0, 1.0), (2.0, 1.0), [(0,)])
    assert paths == (NodePath((), ((1.0, 1.0), (2.0, 1.0))),)
    assert not cut


@pytest.mark.parametrize(("per_wall", "cut"), [(8, False), (9, True)])
def test_node_paths_are_cut_at_64_and_say_so(per_wall, cut):
    house = house_of({}, doors_of([(0, 1)] * per_wall + [(1, 2)] * per_wall), [])
    paths, was_cut = node_paths(house, (0.0, 0.0), (1.0, 1.0), [(0, 1, 2)])
    assert len(paths) == 64
    assert was_cut is cut
    assert [p.doors for p in paths] == sorted(p.doors for p in paths)
    assert len({p.doors for p in paths}) == 64


def test_closed_doors_are_no_way():
    paths, cut = node_paths(house_of({}, doors_of([(0, 9)]), []), (0, 0), (1, 1), [(0, 9)])
    assert (paths, cut) == ((), False)
