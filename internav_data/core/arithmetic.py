"""Arithmetic that is the same on every Python."""

from __future__ import annotations

from functools import reduce
from operator import add
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterable

N = TypeVar("N", int, float)


def plain_sum(numbers: Iterable[N]) -> N | int:
    """Return the sum of numbers, added from left to right.

    The builtin `sum` compensates floats for what rounding takes away since Python 3.12 (Neumaier
    1974): its last bits are others than those of Python 3.11, and so would be the data.
    """
    return reduce(add, numbers, 0)
