"""A* over taut strings: the shortest way of the disc among a house's polygons and obstacles.

A state is a tangent about to be taken ("leaving slot s at progress t"); its cost is the way to
there. The house's own tangents stand ready. Those to the start, to the goal and to obstacles'
corners are listed when their slot is first reached, and tested for clearness only when their turn
comes, so that what lies outside the ellipse of the answer costs next to nothing. Obstacles also
close tangents of the house (tested in turn) and parts of its arcs (`shadows`).

The table of an A* search over tangents: states, their costs and a heap of the open ones.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

from internav_data.navigation.tangent_graph.arcs import HALF
from internav_data.navigation.tangent_graph.polygon_grid import (
    SLACK_M,
    Scene,
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


class States(NamedTuple):
    """Tangents on the table: the house's own first, then those listed during the search.

    Shapes (capacity,) each but data (capacity, 7); `link` chains the listed ones of a slot, whose
    first is in `first` (slots,). `heap` holds states by `key`, `place` is where in it they are.
    `sizes`: number of states, length of the heap.
    """

    target: Ints
    data: Floats
    cost: Floats
    key: Floats
    parent: Ints
    place: Ints
    tested: NDArray[np.bool_]
    link: Ints
    heap: Ints
    first: Ints
    listed: NDArray[np.bool_]
    sizes: Ints


@njit(cache=True)
def states_of(tangents: Tangents, slots: int, extra: int) -> States:
    """Lay out the table with room for `extra` listed tangents."""
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
    return States(
        target,
        data,
        cost,
        np.empty(size),
        np.empty(size, dtype=np.int64),
        place,
        tested,
        np.empty(size, dtype=np.int64),
        np.empty(size, dtype=np.int64),
        np.full(slots, -1),
        np.zeros(slots, dtype=np.bool_),
        sizes,
    )


@njit(cache=True)
def rise(states: States, state: int, at: int) -> None:
    """Move a state up the heap from a hole."""
    while at > 0:
        above = (at - 1) // 2
        other = states.heap[above]
        if states.key[other] <= states.key[state]:
            break
        states.heap[at] = other
        states.place[other] = at
        at = above
    states.heap[at] = state
    states.place[state] = at


@njit(cache=True)
def pop(states: States) -> int:
    """Take the state of least key; ties by the heap's own, deterministic order."""
    best = states.heap[0]
    states.place[best] = OUT_OF_HEAP
    states.sizes[1] -= 1
    size = states.sizes[1]
    if size == 0:
        return best
    last = states.heap[size]
    at = 0
    while True:
        child = 2 * at + 1
        if child >= size:
            break
        if child + 1 < size and states.key[states.heap[child + 1]] < states.key[states.heap[child]]:
            child += 1
        if states.key[states.heap[child]] >= states.key[last]:
            break
        states.heap[at] = states.heap[child]
        states.place[states.heap[at]] = at
        at = child
    states.heap[at] = last
    states.place[last] = at
    return best


GOAL = -1
ORDER_SLACK = 1e-9
"""Arriving and leaving in one direction (along a wall) may differ by rounding, radians."""


class Query(NamedTuple):
    """What one search looks at. Shapes: arcs (n, 6), the house's own first; obstacles' polygons.

    shadow_starts (own arcs + 1,) into shadows (m, 2): closed parts of the house's own arcs, as
    angles from the arc's middle, counter-clockwise.
    """

    own: int
    arcs: Floats
    vertices: Floats
    offsets: Ints
    boxes: Floats
    shadow_starts: Ints
    shadows: Floats
    start: Floats
    goal: Floats
    radius: float


@njit(cache=True)
def _relax(states: States, query: Query, state: int, cost: float, parent: int) -> None:
    if states.place[state] == CLOSED or cost >= states.cost[state]:
        return
    data = states.data
    ahead = math.hypot(data[state, TO_X] - query.goal[0], data[state, TO_Y] - query.goal[1])
    states.cost[state] = cost
    states.key[state] = cost + data[state, LENGTH] + ahead
    states.parent[state] = parent
    at = states.place[state]
    if at == OUT_OF_HEAP:
        at = states.sizes[1]
        states.sizes[1] += 1
    rise(states, state, at)


@njit(cache=True)
def _append(states: States, slot: int, target: int) -> int:
    """Make the row behind the last one a state that leaves a slot (or the start: -1)."""
    state = states.sizes[0]
    states.sizes[0] += 1
    states.target[state] = target
    states.cost[state] = np.inf
    states.place[state] = OUT_OF_HEAP
    states.tested[state] = False
    if slot >= 0:
        states.link[state] = states.first[slot]
        states.first[slot] = state
    return state


@njit(cache=True)
def _list(states: States, query: Query, slot: int) -> None:
    """List a slot's tangents to the goal and to or from obstacles' corners."""
    states.listed[slot] = True
    data, arcs, radius = states.data, query.arcs, query.radius
    if join_point(data, states.sizes[0], arcs, slot, query.goal[0], query.goal[1], radius):
        _append(states, slot, GOAL)
    own = slot // 2
    for other in range(query.own if own < query.own else 0, len(arcs)):
        if other != own:
            bits = join(data, states.sizes[0], arcs, slot, other, radius)
            if bits & 1:
                _append(states, slot, 2 * other)
            if bits & 2:
                _append(states, slot, 2 * other + 1)


@njit(cache=True)
def _begin(states: States, query: Query) -> None:
    """List the tangents from the start to every arc, and straight to the goal."""
    x, y = query.start[0], query.start[1]
    data, k = states.data, states.sizes[0]
    data[k, LEAVE] = data[k, ARRIVE] = 0.0
    data[k, FROM_X], data[k, FROM_Y] = x, y
    data[k, TO_X], data[k, TO_Y] = query.goal[0], query.goal[1]
    data[k, LENGTH] = math.hypot(query.goal[0] - x, query.goal[1] - y)
    _relax(states, query, _append(states, -1, GOAL), 0.0, -1)
    for slot in range(2 * len(query.arcs)):
        k = states.sizes[0]
        # What arrives from a point is what leaves for it in the opposite sense, reversed.
        if join_point(data, k, query.arcs, slot ^ 1, x, y, query.radius):
            data[k, ARRIVE] = -data[k, LEAVE]
            data[k, TO_X], data[k, TO_Y] = data[k, FROM_X], data[k, FROM_Y]
            data[k, FROM_X], data[k, FROM_Y] = x, y
            _relax(states, query, _append(states, -1, slot), 0.0, -1)


@njit(cache=True)
def _reach(query: Query, slot: int, begin: float) -> float:
    """How far round its arc one can go from a progress before an obstacle is in the way."""
    arc = slot // 2
    reach = query.arcs[arc, HALF]
    if arc < query.own:
        for k in range(query.shadow_starts[arc], query.shadow_starts[arc + 1]):
            low, high = query.shadows[k, 0], query.shadows[k, 1]
            if slot % 2 == 1:
                low, high = -high, -low
            if high > begin + ORDER_SLACK:
                reach = min(reach, low)
    return reach


@njit(cache=True)
def _arrive(tangents: Tangents, states: States, query: Query, state: int) -> None:
    """Offer every tangent that leaves further round the arc on which a state has arrived."""
    slot, begin = states.target[state], states.data[state, ARRIVE]
    cost = states.cost[state] + states.data[state, LENGTH]
    if not states.listed[slot]:
        _list(states, query, slot)
    reach = _reach(query, slot, begin) + ORDER_SLACK
    if slot // 2 < query.own:
        for k in range(tangents.starts[slot], tangents.starts[slot + 1]):
            turn = tangents.data[k, LEAVE] - begin
            if turn >= -ORDER_SLACK and tangents.data[k, LEAVE] <= reach:
                _relax(states, query, k, cost + query.radius * max(0.0, turn), state)
    k = states.first[slot]
    while k >= 0:
        turn = states.data[k, LEAVE] - begin
        if turn >= -ORDER_SLACK and states.data[k, LEAVE] <= reach:
            _relax(states, query, k, cost + query.radius * max(0.0, turn), state)
        k = states.link[k]


@njit(cache=True)
def _clear(scene: Scene, states: States, query: Query, state: int, own: int) -> bool:
    x, y = states.data[state, FROM_X], states.data[state, FROM_Y]
    a, b = states.data[state, TO_X], states.data[state, TO_Y]
    limit = query.radius - SLACK_M
    return segment_clear_of(query.vertices, query.offsets, query.boxes, x, y, a, b, limit) and (
        state < own or segment_clear(scene, x, y, a, b, limit)
    )


@njit(cache=True)
def search(scene: Scene, tangents: Tangents, query: Query) -> tuple[float, Floats, Ints]:
    """Find the shortest way: its length, its tangents (n, 7), the slots they arrive in (n,).

    The length is infinite and nothing follows it where there is no way.
    """
    own, arcs = len(tangents.target), len(query.arcs)
    new = arcs - query.own
    # Each slot lists its tangents once; the start may have two for every arc.
    extra = 2 + 2 * arcs + 2 * new * 2 * arcs + 2 * query.own * 2 * new + 4 * arcs + 4
    states = states_of(tangents, 2 * arcs, extra)
    _begin(states, query)
    while states.sizes[1] > 0:
        state = pop(states)
        if not states.tested[state]:
            if not _clear(scene, states, query, state, own):
                states.place[state] = CLOSED
                continue
            states.tested[state] = True
        if states.target[state] != GOAL:
            _arrive(tangents, states, query, state)
            continue
        count, k = 0, state
        while k >= 0:
            count, k = count + 1, states.parent[k]
        rows, slots = np.empty((count, 7)), np.empty(count, dtype=np.int64)
        k = state
        while k >= 0:
            count -= 1
            rows[count], slots[count] = states.data[k], states.target[k]
            k = states.parent[k]
        return states.cost[state] + states.data[state, LENGTH], rows, slots
    return np.inf, np.empty((0, 7)), np.empty(0, dtype=np.int64)
