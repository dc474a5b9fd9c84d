"""Cache that drops the entries used least recently.

For functions of their arguments `functools.lru_cache` does the same; this one bounds the weight of
its entries rather than their number, closes what it drops, and can be emptied or enlarged. Threads
may share it.
"""

from __future__ import annotations

from operator import itemgetter
from typing import TYPE_CHECKING, Generic, TypeVar

from internav_data.core.locks import ThreadLock

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

K = TypeVar("K", bound="Hashable")
V = TypeVar("V")


def _one(_: object) -> float:
    return 1.0


class _Entry(Generic[V]):
    """A value and when it was used last, counted in calls of `LRUCache.get`."""

    __slots__ = ("used", "value")

    def __init__(self, value: V, used: int) -> None:
        self.value, self.used = value, used


class LRUCache(Generic[K, V]):
    """Values by key; the least recently used ones go once all together weigh too much.

    The newest entry is pinned: it stays even where it alone is heavier than `capacity`, so a caller
    may use what it just asked for.

    Parameters
    ----------
    capacity
        Greatest weight of all entries together; may be changed later.
    weigh
        Weight of a value; 1 if not given, so that `capacity` is a number of entries. It must not
        change while the value is held.
    on_evict
        Called with every value that goes, as by `clear`.
    """

    __slots__ = (
        "_calls",
        "_entries",
        "_lock",
        "_oldest",
        "_on_evict",
        "_weigh",
        "_weight",
        "capacity",
    )

    def __init__(
        self,
        capacity: float,
        weigh: Callable[[V], float] = _one,
        on_evict: Callable[[V], object] | None = None,
    ) -> None:
        self.capacity = capacity
        self._weigh, self._on_evict = weigh, on_evict
        self._entries: dict[K, _Entry[V]] = {}
        self._oldest: list[tuple[int, K]] = []
        """Entries as they were once sorted by their last use, the oldest at the end. One that has
        been used since is newer than all of these."""
        self._calls = 0
        self._weight = 0.0
        self._lock = ThreadLock()

    def __len__(self) -> int:
        return len(self._entries)

    def __contains__(self, key: object) -> bool:
        return key in self._entries

    @property
    def weight(self) -> float:
        """Weight of all entries together."""
        return self._weight

    def get(self, key: K, make: Callable[[], V]) -> V:
        """Return the value of a key, made if the cache has none; it is now the newest entry.

        If `make` raises, nothing changes. A value is made by one thread; others wait for it.
        """
        with self._lock:
            self._calls += 1
            # One lookup, and no other order to keep: hashing a key may take longest.
            entry = self._entries.get(key)
            if entry is not None:
                entry.used = self._calls
                return entry.value
            value = make()
            self._calls += 1  # newer than what `make` has asked for
            self._entries[key] = _Entry(value, self._calls)
            self._weight += self._weigh(value)
            while self._weight > self.capacity and len(self._entries) > 1:
                self._evict()
            return value

    def clear(self) -> None:
        """Drop every entry."""
        with self._lock:
            while self._entries:
                self._evict()

    def _evict(self) -> None:
        """Drop the entry that was used least recently."""
        while True:
            if not self._oldest:
                uses = ((entry.used, key) for key, entry in self._entries.items())
                self._oldest = sorted(uses, key=itemgetter(0), reverse=True)
            used, key = self._oldest.pop()
            entry = self._entries.get(key)
            if entry is not None and entry.used == used:
                break
        del self._entries[key]
        self._weight -= self._weigh(entry.value)
        if self._on_evict:
            self._on_evict(entry.value)
