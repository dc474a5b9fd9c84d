"""Integers that a process shares with the worker processes started from it."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import MutableSequence


class SharedNumbers:
    """A few 64-bit integers that forked and spawned workers read as this process last wrote them.

    A copy, or a pickle that starts no process, has numbers of its own.
    """

    def __init__(self, *values: int) -> None:
        self._owner = os.getpid()
        self._values: MutableSequence[int] = _shared(values)

    @property
    def in_worker(self) -> bool:
        """Whether this process is a worker of the one that made the numbers."""
        return os.getpid() != self._owner

    def __getitem__(self, place: int) -> int:
        return int(self._values[place])

    def __setitem__(self, place: int, value: int) -> None:
        self._values[place] = value

    def __getstate__(self) -> dict[str, Any]:
        from multiprocessing import context  # noqa: PLC0415 - only streams in workers need it

        if context.get_spawning_popen() is None:
            return {"copy": list(self._values)}
        return {"owner": self._owner, "values": self._values}

    def __setstate__(self, state: dict[str, Any]) -> None:
        if "copy" in state:
            self.__init__(*state["copy"])  # type: ignore[misc] # numbers of its own
        else:
            self._owner, self._values = state["owner"], state["values"]


def _shared(values: tuple[int, ...]) -> MutableSequence[int]:
    """Return the values in memory that child processes inherit."""
    from multiprocessing import sharedctypes  # noqa: PLC0415 - takes longer than all of this

    try:
        array: MutableSequence[int] = sharedctypes.RawArray("q", values)
    except OSError:
        return list(values)  # no writable folder for it: workers keep the numbers of their start
    return array
