"""Lock between the threads of a process, for whatever they share."""

from __future__ import annotations

import os
import threading
import weakref
from functools import wraps
from typing import TYPE_CHECKING, Final, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

V = TypeVar("V")


class ThreadLock:
    """Reentrant lock as a context manager.

    Unlike `threading.RLock`, it is free in a forked process, whoever held it in the parent, and an
    object that has one can be copied and pickled: the copy's lock is another one.
    """

    __slots__ = ("__weakref__", "_lock")

    def __init__(self) -> None:
        self._lock = threading.RLock()
        _LOCKS.add(self)

    def __enter__(self) -> None:
        self._lock.acquire()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._lock.release()

    def __reduce__(self) -> tuple[type[ThreadLock], tuple[()]]:
        return ThreadLock, ()

    def renew(self) -> None:
        """Free the lock in a forked process: its holder stayed behind in the parent."""
        self._lock = threading.RLock()


_LOCKS: Final[weakref.WeakSet[ThreadLock]] = weakref.WeakSet()


def _renew_all() -> None:
    for lock in list(_LOCKS):
        lock.renew()


if hasattr(os, "register_at_fork"):  # not on Windows, which has no fork either
    os.register_at_fork(after_in_child=_renew_all)


def once_per_process(make: Callable[[], V]) -> Callable[[], V]:
    """Return a function that calls `make` the first time and returns the same value ever after.

    A forked process makes a value of its own, and keeps the one that it inherits alive. The lock is
    taken only until there is a value.
    """
    made: dict[int, V] = {}
    lock = ThreadLock()

    @wraps(make)
    def value() -> V:
        process = os.getpid()
        try:
            return made[process]
        except KeyError:
            with lock:
                if process not in made:
                    made[process] = make()
                return made[process]

    return value
