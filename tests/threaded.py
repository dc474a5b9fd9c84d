"""Threads for tests: all begin at once, and switch as often as Python allows."""

from __future__ import annotations

import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


def run_in_threads(work: Callable[[int], T], count: int) -> list[T]:
    """Return what `work(k)` returns in each of `count` threads; an error in one is raised."""
    barrier, before = threading.Barrier(count), sys.getswitchinterval()

    def one(number: int) -> T:
        barrier.wait()
        return work(number)

    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(count) as pool:
            return list(pool.map(one, range(count)))
    finally:
        sys.setswitchinterval(before)
