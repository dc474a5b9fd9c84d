"""A* over taut strings: the shortest path of the disc among a house's polygons and obstacles.

A state is a tangent about to be taken ("leaving directed arc a at progress t"); its cost is the
length of the path to there, its key that length plus the tangent's plus the straight line from its
end to the goal, which never overestimates. The house's own tangents stand ready. Those to the
start, to the goal and to obstacles' corners are listed when their directed arc is first reached,
and tested for clearness only when they come first in the heap, so that what lies outside the
ellipse of the answer costs next to nothing. Obstacles also close tangents of the house (tested in
turn) and parts of its arcs (`Query.forbidden`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

from internav_data.navigation.tangent_graph.boundary_arcs import HALF
from internav_data.navigation.tangent_graph.polygon_grid import (
    SLACK_M,
    PolygonGrid,
    segment_clear,
    segment_clear_of,
)
from internav_data.navigation.tangent_graph.tangents import (
    ARRIVE,
    FROM_X,
    FROM_Y,
    LEAVE,
    LENGTH,
    TO_X,
    TO_Y,
    Tangents,
    join,
    join_point,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.core.typing import Floats, Ints
    from internav_data.navigation.tangent_graph.tangents import Tangents


OUT_OF_HEAP, CLOSED = -1, -2
"""Values of `SearchTable.place` for states that are not in the heap."""


class SearchTable(NamedTuple):
    """State of one search: a row a tangent, the house's own first, then those listed on the way.

    Arrays have room for `capacity` tangents; integers are int64, other numbers float64.
    """

    target: Ints
    """(capacity,): directed arc of arrival, or GOAL."""
    data: Floats
    """(capacity, 7): see `tangents`."""
    cost: Floats
    """(capacity,): length of the best path to where the tangent leaves, metres."""
    key: Floats
    """(capacity,): cost + length + straight line to the goal, metres."""
    parent: Ints
    """(capacity,): tangent before this one on that path, -1 for the start."""
    place: Ints
    """(capacity,): position in the heap, OUT_OF_HEAP or CLOSED."""
    tested: NDArray[np.bool_]
    """(capacity,): whether the tangent was found clear."""
    link: Ints
    """(capacity,): next tangent listed of the same directed arc, -1 for none."""
    heap: Ints
    """(capacity,): open tangents, a binary heap by `key`."""
    first: Ints
    """(directed arcs,): first tangent listed of each, -1 for none."""
    listed: NDArray[np.bool_]
    """(directed arcs,): whether its further tangents are listed."""
    sizes: Ints
    """(2,): number of tangents, length of the heap."""


@njit(cache=True)
def new_table(tangents: Tangents, directed_arcs: int, extra: int) -> SearchTable:
    """Return a table of the house's tangents with room for `extra` more.

    `directed_arcs` is the number of directed arcs.
    """
    own = len(tangents.target)
    size = own + extra
    # Only the house's part is filled in: pages that are never touched cost nothing.
    target, data = np.empty(size, dtype=np.int64), np.empty((size, 7))
    target[:own], data[:own] = tangents.target, tangents.data
    cost, place = np.empty(size), np.empty(size, dtype=np.int64)
    cost[:own], place[:own] = np.inf, OUT_OF_HEAP
    tested = np.empty(size, dtype=np.bool_)
    tested[:own] = False
    sizes = np.array([own, 0])
    return SearchTable(
        target,
        data,
        cost,
        np.empty(size),
        np.empty(size, dtype=np.int64),
        place,
        tested,
        np.empty(size, dtype=np.int64),
        np.empty(size, dtype=np.int64),
        np.full(directed_arcs, -1),
        np.zeros(directed_arcs, dtype=np.bool_),
        sizes,
    )


@njit(cache=True)
def rise(table: SearchTable, state: int, at: int) -> None:
    """Move a state up the heap from the hole at index `at`."""
    while at > 0:
        above = (at - 1) // 2
        other = table.heap[above]
        if table.key[other] <= table.key[state]:
            break
        table.heap[at] = other
        table.place[other] = at
        at = above
    table.heap[at] = state
    table.place[state] = at


@njit(cache=True)
def pop(table: SearchTable) -> int:
    """Remove and return the state of the smallest key; ties by the heap's deterministic order."""
    best = table.heap[0]
    table.place[best] = OUT_OF_HEAP
    table.sizes[1] -= 1
    size = table.sizes[1]
    if size == 0:
        return best
    last = table.heap[size]
    at = 0
    while True:
        child = 2 * at + 1
        if child >= size:
            break
        if child + 1 < size and table.key[table.heap[child + 1]] < table.key[table.heap[child]]:
            child += 1
        if table.key[table.heap[child]] >= table.key[last]:
            break
        table.heap[at] = table.heap[child]
        table.place[table.heap[at]] = at
        at = child
    table.heap[at] = last
    table.place[last] = at
    return best


GOAL = -1
"""Target of a tangent that ends at the goal."""
ORDER_SLACK = 1e-9
"""Arriving and leaving in one direction (along a wall) may differ by rounding, radians."""


class Query(NamedTuple):
    """One question to the search: start, goal and obstacles, and the arcs that come with them."""

    own: int
    """Number of the house's own arcs."""
    boundary_arcs: Floats
    """(n, 6) float64: the house's own arcs, then the obstacles'."""
    vertices: Floats
    offsets: Ints
    boxes: Floats
    """Obstacles' polygons, as arrays of `boundary_arcs`."""
    forbidden_starts: Ints
    """(own + 1,) int64 into `forbidden`."""
    forbidden: Floats
    """(m, 2) float64: parts of the house's own arcs that obstacles forbid, as angles from the arc's
    middle, counter-clockwise, radians."""
    start: Floats
    goal: Floats
    """(2,) float64: positions of the disc's centre, metres."""
    radius: float
    """Radius of the disc, metres."""


@njit(cache=True)
def _relax(table: SearchTable, query: Query, state: int, cost: float, parent: int) -> None:
    if table.place[state] == CLOSED or cost >= table.cost[state]:
        return
    data = table.data
    ahead = math.hypot(data[state, TO_X] - query.goal[0], data[state, TO_Y] - query.goal[1])
    table.cost[state] = cost
    table.key[state] = cost + data[state, LENGTH] + ahead
    table.parent[state] = parent
    at = table.place[state]
    if at == OUT_OF_HEAP:
        at = table.sizes[1]
        table.sizes[1] += 1
    rise(table, state, at)


@njit(cache=True)
def _append(table: SearchTable, directed_arc: int, target: int) -> int:
    """Make the row behind the last one a state that leaves a directed arc (or the start: -1)."""
    state = table.sizes[0]
    table.sizes[0] += 1
    table.target[state] = target
    table.cost[state] = np.inf
    table.place[state] = OUT_OF_HEAP
    table.tested[state] = False
    if directed_arc >= 0:
        table.link[state] = table.first[directed_arc]
        table.first[directed_arc] = state
    return state


@njit(cache=True)
def _list(table: SearchTable, query: Query, directed_arc: int) -> None:
    """List a directed arc's tangents to the goal and to or from obstacles' corners."""
    table.listed[directed_arc] = True
    data, boundary_arcs, radius = table.data, query.boundary_arcs, query.radius
    if join_point(
        data, table.sizes[0], boundary_arcs, directed_arc, query.goal[0], query.goal[1], radius
    ):
        _append(table, directed_arc, GOAL)
    own = directed_arc // 2
    for other in range(query.own if own < query.own else 0, len(boundary_arcs)):
        if other != own:
            bits = join(data, table.sizes[0], boundary_arcs, directed_arc, other, radius)
            if bits & 1:
                _append(table, directed_arc, 2 * other)
            if bits & 2:
                _append(table, directed_arc, 2 * other + 1)


@njit(cache=True)
def _begin(table: SearchTable, query: Query) -> None:
    """List the tangents from the start to every arc, and straight to the goal."""
    x, y = query.start[0], query.start[1]
    data, k = table.data, table.sizes[0]
    data[k, LEAVE] = data[k, ARRIVE] = 0.0
    data[k, FROM_X], data[k, FROM_Y] = x, y
    data[k, TO_X], data[k, TO_Y] = query.goal[0], query.goal[1]
    data[k, LENGTH] = math.hypot(query.goal[0] - x, query.goal[1] - y)
    _relax(table, query, _append(table, -1, GOAL), 0.0, -1)
    for directed_arc in range(2 * len(query.boundary_arcs)):
        k = table.sizes[0]
        # What arrives from a point is what leaves for it in the opposite sense, reversed.
        if join_point(data, k, query.boundary_arcs, directed_arc ^ 1, x, y, query.radius):
            data[k, ARRIVE] = -data[k, LEAVE]
            data[k, TO_X], data[k, TO_Y] = data[k, FROM_X], data[k, FROM_Y]
            data[k, FROM_X], data[k, FROM_Y] = x, y
            _relax(table, query, _append(table, -1, directed_arc), 0.0, -1)


@njit(cache=True)
def _reach(query: Query, directed_arc: int, begin: float) -> float:
    """Return the progress up to which one can turn from progress `begin`, radians."""
    arc = directed_arc // 2
    reach = query.boundary_arcs[arc, HALF]
    if arc < query.own:
        for k in range(query.forbidden_starts[arc], query.forbidden_starts[arc + 1]):
            low, high = query.forbidden[k, 0], query.forbidden[k, 1]
            # Clockwise, progress counts from the other end.
            if directed_arc % 2 == 1:
                low, high = -high, -low
            if high > begin + ORDER_SLACK:
                reach = min(reach, low)
    return reach


@njit(cache=True)
def _arrive(tangents: Tangents, table: SearchTable, query: Query, state: int) -> None:
    """Offer every tangent that leaves further round the arc on which a state has arrived."""
    directed_arc, begin = table.target[state], table.data[state, ARRIVE]
    cost = table.cost[state] + table.data[state, LENGTH]
    if not table.listed[directed_arc]:
        _list(table, query, directed_arc)
    reach = _reach(query, directed_arc, begin) + ORDER_SLACK
    if directed_arc // 2 < query.own:
        for k in range(tangents.starts[directed_arc], tangents.starts[directed_arc + 1]):
            turn = tangents.data[k, LEAVE] - begin
            if turn >= -ORDER_SLACK and tangents.data[k, LEAVE] <= reach:
                _relax(table, query, k, cost + query.radius * max(0.0, turn), state)
    k = table.first[directed_arc]
    while k >= 0:
        turn = table.data[k, LEAVE] - begin
        if turn >= -ORDER_SLACK and table.data[k, LEAVE] <= reach:
            _relax(table, query, k, cost + query.radius * max(0.0, turn), state)
        k = table.link[k]


@njit(cache=True)
def _clear(grid: PolygonGrid, table: SearchTable, query: Query, state: int, own: int) -> bool:
    x, y = table.data[state, FROM_X], table.data[state, FROM_Y]
    a, b = table.data[state, TO_X], table.data[state, TO_Y]
    limit = query.radius - SLACK_M
    return segment_clear_of(query.vertices, query.offsets, query.boxes, x, y, a, b, limit) and (
        state < own or segment_clear(grid, x, y, a, b, limit)
    )


@njit(cache=True)
def search(grid: PolygonGrid, tangents: Tangents, query: Query) -> tuple[float, Floats, Ints]:
    """Return the shortest path: its length, its tangents and the directed arcs they arrive in.

    Length in metres, tangents (n, 7) float64, directed arcs (n,) int64 with GOAL last. Where there
    is no path the length is infinite and n is 0.
    """
    own, arcs = len(tangents.target), len(query.boundary_arcs)
    new = arcs - query.own
    # Each directed arc lists its tangents once; the start may have two for every arc.
    extra = 2 + 2 * arcs + 2 * new * 2 * arcs + 2 * query.own * 2 * new + 4 * arcs + 4
    table = new_table(tangents, 2 * arcs, extra)
    _begin(table, query)
    while table.sizes[1] > 0:
        state = pop(table)
        if not table.tested[state]:
            if not _clear(grid, table, query, state, own):
                table.place[state] = CLOSED
                continue
            table.tested[state] = True
        if table.target[state] != GOAL:
            _arrive(tangents, table, query, state)
            continue
        count, k = 0, state
        while k >= 0:
            count, k = count + 1, table.parent[k]
        rows, directed_arcs = np.empty((count, 7)), np.empty(count, dtype=np.int64)
        k = state
        while k >= 0:
            count -= 1
            rows[count], directed_arcs[count] = table.data[k], table.target[k]
            k = table.parent[k]
        return table.cost[state] + table.data[state, LENGTH], rows, directed_arcs
    return np.inf, np.empty((0, 7)), np.empty(0, dtype=np.int64)
