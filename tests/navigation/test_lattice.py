"""Nodes, swept edges and steps against shapely and networkx; blockers that come and go."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from navigation_oracles import lattice_graph
from navigation_scenes import convex, random_rooms, rectangle, ring, turned, two_rooms

from internav_data.geometry import Polygons
from internav_data.navigation import Lattice
from internav_data.records.errors import UsageError

ROOM = rectangle(0.0, 0.0, 3.0, 2.0)
ELL = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.1), (1.6, 1.1), (1.6, 2.0), (0.0, 2.0)]
STEPS = ((1, 0), (0, 1), (-1, 0), (0, -1))
small = convex(3.0, 2.0)


def lattice_of(polygons, outline=ROOM):
    return Lattice.of_polygons(Polygons.of(polygons), outline)


def edges(lattice):
    """Every node's edges to its four neighbours."""
    nx_, ny = lattice.shape
    return [
        [lattice.edge_free(i, j, di, dj) for di, dj in STEPS] for i in range(nx_) for j in range(ny)
    ]


def same(first, second):
    return np.array_equal(first.free, second.free) and edges(first) == edges(second)


def check(lattice, graph):
    """Nodes, edges, steps, components and paths are those of the graph."""
    free = {(int(i), int(j)) for i, j in np.argwhere(lattice.free)}
    assert free == set(graph)
    for i, j in free:
        for di, dj in STEPS:
            assert lattice.edge_free(i, j, di, dj) == graph.has_edge((i, j), (i + di, j + dj))
    labels = lattice.components()
    parts = sorted(nx.connected_components(graph), key=min)
    assert [labels[min(part)] for part in parts] == list(range(len(parts)))
    assert all(len({labels[n] for n in part}) == 1 for part in parts)
    assert ((labels >= 0) == lattice.free).all()
    for source in sorted(free)[:: max(1, len(free) // 3)]:
        expected = nx.single_source_shortest_path_length(graph, source)
        steps = lattice.distances(*source)
        assert {(int(i), int(j)): steps[i, j] for i, j in np.argwhere(steps >= 0)} == expected
        for goal in sorted(free)[:: max(1, len(free) // 5)]:
            assert lattice.distance(goal, source) == expected.get(goal)
            path = lattice.path(goal, source)
            if goal not in expected:
                assert path is None
                continue
            nodes = [(int(i), int(j)) for i, j in path]
            assert (nodes[0], nodes[-1], len(nodes)) == (goal, source, expected[goal] + 1)
            assert nx.is_path(graph, nodes)


@settings(max_examples=40, deadline=None)
@given(st.lists(small, max_size=6), st.sampled_from([ROOM, ELL]))
def test_nodes_edges_and_steps_are_those_of_shapely_and_networkx(polygons, outline):
    lattice = lattice_of(polygons, outline)
    check(lattice, lattice_graph(polygons, outline, lattice.shape))


def test_a_furnished_house_is_that_of_shapely_and_networkx():
    polygons, outline = random_rooms(3, columns=2, rows=1, objects=14)
    lattice = Lattice.of_polygons(polygons, outline)
    assert lattice.shape == (41, 29)
    check(lattice, lattice_graph(list(polygons), outline, lattice.shape))


def test_of_a_house_sees_its_walls_and_furniture_but_not_its_lintels():
    house = two_rooms(objects=[(1.5, 3.5, 30.0)])
    lattice = Lattice.of(house)
    assert lattice.shape == (25, 17)
    walls = [rectangle(w.x_min, w.y_min, w.x_max, w.y_max) for w in house.walls if w.z_min < 1.8]
    polygons = [*walls, turned(1.5, 3.5, 1.2, 0.8, 30.0)]
    check(lattice, lattice_graph(polygons, house.outline, lattice.shape))
    assert lattice.edge_free(12, 8, 1, 0)  # through the door
    assert not lattice.free[12, 4]  # in the wall


@pytest.mark.parametrize(
    ("wall_from", "free"), [(1.2, True), (1.19999, False), (1.2001, True), (1.1999, False)]
)
def test_a_wall_exactly_a_radius_away_leaves_the_node_free(wall_from, free):
    # Node (4, 4) lies at (1, 1): a wall from x = 1.2 m on is 0.2 m away, but for the last bit.
    lattice = lattice_of([rectangle(wall_from, 0.0, wall_from + 0.1, 2.0)])
    assert lattice.free[4, 4] == free
    assert lattice.edge_free(4, 4, 0, 1) == free


@pytest.mark.parametrize("k", range(60))
def test_exact_ties_are_free_whatever_the_last_bits_are(k):
    x = 0.25 * k
    wall = Polygons.of([rectangle(x + 0.2, 0.0, x + 0.3, 2.0)])
    assert Lattice.of_polygons(wall, rectangle(0.0, 0.0, 20.0, 2.0)).free[k, 4]


def test_doors_leave_the_columns_that_the_design_says():
    for at in (0.0, 0.01, 0.1, 0.13, 0.24):
        for wide, columns in ((1.0, (2, 3)), (0.77, (1, 2)), (0.39, (0,))):
            walls = [rectangle(0.0, 0.95, 0.5 + at, 1.05)]
            walls.append(rectangle(0.5 + at + wide, 0.95, 3.0, 1.05))
            lattice = lattice_of(walls)
            open_columns = sum(lattice.edge_free(i, 4, 0, -1) for i in range(13))
            assert open_columns in columns


def test_an_edge_is_blocked_by_what_lies_between_two_free_nodes():
    # A spike whose tip comes within 0.2 m of the edge's middle only.
    tip = [(1.125, 0.81), (1.1, 0.3), (1.15, 0.3)]
    lattice = lattice_of([[tip[0], tip[1], tip[2]]])
    assert lattice.free[4, 4]
    assert lattice.free[5, 4]
    assert not lattice.edge_free(4, 4, 1, 0)
    assert not lattice.edge_free(5, 4, -1, 0)


groups = st.lists(st.lists(small, max_size=3), min_size=1, max_size=5)


@settings(max_examples=60, deadline=None)
@given(st.lists(small, max_size=4), groups, st.data())
def test_adding_and_removing_equals_building_anew(fixed, later, data):
    lattice = lattice_of(fixed)
    held = {lattice.add(Polygons.of(group)): group for group in later}
    # All go in the end: a count that is wrong by one shows at the latest when it should be zero.
    for handle in data.draw(st.permutations(sorted(held))):
        anew = lattice_of([*fixed, *(p for group in held.values() for p in group)])
        assert same(lattice, anew)
        lattice.remove(handle)
        del held[handle]
    assert same(lattice, lattice_of(fixed))


def test_copies_change_apart_from_each_other():
    lattice = lattice_of(ring(3.0, 2.0))
    handle = lattice.add(Polygons.of([rectangle(1.0, 0.0, 1.2, 2.0)]))
    other = lattice.copy()
    other.remove(handle)
    again = other.add(Polygons.of([rectangle(2.0, 0.0, 2.2, 2.0)]))
    assert lattice.distance((1, 1), (11, 1)) is None
    other.remove(again)
    assert other.distance((1, 1), (11, 1)) == 10
    lattice.remove(handle)
    assert same(lattice, other)


def test_what_lies_off_the_lattice_costs_and_changes_nothing():
    lattice = lattice_of(ring(3.0, 2.0))
    before = lattice.copy()
    lattice.add(Polygons.of([rectangle(50.0, 50.0, 51.0, 51.0), rectangle(-9.0, 0.0, -8.0, 2.0)]))
    lattice.add(Polygons.of([]))
    assert same(lattice, before)


def test_a_path_goes_straight_on_where_it_can():
    path = lattice_of(ring(3.0, 2.0)).path((1, 1), (9, 5))
    turns = np.abs(np.diff(path, n=2, axis=0)).any(axis=1).sum()
    assert len(path) == 13
    assert turns == 1


def test_misuse_says_what_and_what_to_do():
    lattice = lattice_of(ring(3.0, 2.0))
    with pytest.raises(UsageError, match=r"node \(13, 0\).*0 <= i < 13"):
        lattice.distances(13, 0)
    with pytest.raises(UsageError, match="node"):
        lattice.path((1, 1), (1, -1))
    with pytest.raises(UsageError, match="no step"):
        lattice.edge_free(1, 1, 1, 1)
    handle = lattice.add(Polygons.of([]))
    lattice.remove(handle)
    with pytest.raises(UsageError, match="handle 0"):
        lattice.remove(handle)


def test_a_blocked_node_is_cut_off_even_from_itself():
    lattice = lattice_of(ring(3.0, 2.0))
    assert not lattice.free[0, 0]
    assert (lattice.distances(0, 0) == -1).all()
    assert lattice.distance((0, 0), (0, 0)) is None
    assert lattice.path((0, 0), (0, 0)) is None
    assert lattice.path((2, 2), (2, 2)).tolist() == [[2, 2]]
