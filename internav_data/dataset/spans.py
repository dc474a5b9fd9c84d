"""Spans: ranges of positions in an epoch's order, cut, shared and padded as one sequence.

A list of spans [(start, stop), …] stands for all its positions in turn. The unread rest of an epoch
is a few spans, however many episodes it holds, so it fits into a state. With n episodes, position
p >= n is padding: the episode at p % n once more.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

Spans = list[tuple[int, int]]
"""Ranges [start, stop) of positions, none empty."""


def share(count: int, member: int, members: int) -> tuple[int, int]:
    """Return the range [start, stop) of `count` positions that belongs to one of several members.

    Shares are disjoint, cover everything and differ in size by one at most.
    """
    return count * member // members, count * (member + 1) // members


def span_length(spans: Spans) -> int:
    """Return the number of positions."""
    return sum(stop - start for start, stop in spans)


def cut(spans: Spans, first: int, end: int) -> Spans:
    """Return the positions number `first` … `end` - 1 of the sequence."""
    found: Spans = []
    before = 0
    for start, stop in spans:
        low, high = max(start, start + first - before), min(stop, start + end - before)
        if low < high:
            found.append((low, high))
        before += stop - start
    return found


def share_of(spans: Spans, member: int, members: int) -> Spans:
    """Return the share of one of several members, as `share` has it."""
    return cut(spans, *share(span_length(spans), member, members))


def make_even(spans: Spans, count: int, members: int, *, drop_last: bool | None) -> Spans:
    """Make the number of positions a multiple of `members`.

    Parameters
    ----------
    spans
        Positions below `count`.
    count
        Number of episodes of the epoch.
    members
        Number of ranks.
    drop_last
        True drops the last positions, False repeats the first as padding; None changes nothing.
    """
    length = span_length(spans)
    if drop_last is None or not length:
        return spans
    if drop_last:
        return cut(spans, 0, length - length % members)
    even, missing = list(spans), -length % members
    while missing:
        repeated = cut(spans, 0, missing)
        even += [(start + count, stop + count) for start, stop in repeated]
        missing -= span_length(repeated)
    return even


def union(parts: Iterable[Spans], count: int) -> Spans:
    """Return the positions of parts in ascending order, each once, without padding."""
    whole: Spans = []
    for start, stop in sorted((a, min(b, count)) for part in parts for a, b in part if a < count):
        if whole and start <= whole[-1][1]:
            whole[-1] = (whole[-1][0], max(stop, whole[-1][1]))
        else:
            whole.append((start, stop))
    return whole


def positions(spans: Spans) -> NDArray[np.int64]:
    """Return all positions, (n,) int64."""
    parts = [np.arange(start, stop, dtype=np.int64) for start, stop in spans]
    return np.concatenate([*parts, np.empty(0, np.int64)])


def spans_of(values: Sequence[Any]) -> Spans:
    """Read spans that JSON has written.

    Raises
    ------
    ValueError
        They are no pairs of positions.
    """
    spans = [(start, stop) for start, stop in values]
    for start, stop in spans:
        if type(start) is not int or type(stop) is not int or not 0 <= start < stop:
            raise ValueError(f"{[start, stop]} is no range of positions")
    return spans
