"""The table of an A* search over tangents: states, their costs and a heap of the open ones."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.navigation.tangents import Tangents

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

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
