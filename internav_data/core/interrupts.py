"""Ctrl-C, SIGTERM and a hang-up end a run in order: what is under way is finished and kept."""

from __future__ import annotations

import os
import signal
import threading
from typing import TYPE_CHECKING, Self

from internav_data.core.machine import END_SIGNALS
from internav_data.records.errors import InternavError

if TYPE_CHECKING:
    from types import FrameType, TracebackType


class InterruptedRunError(InternavError):
    """A signal ended a run; the same command continues it."""

    def __init__(self, message: str, signum: int) -> None:
        super().__init__(message)
        self.signum = signum


class Interrupts:
    """Flag that the first signal raises; the second one ends the process.

    Signals are caught inside a `with` block only; one that is ignored, as under nohup or in a
    background job of a plain shell, stays ignored. Outside the main thread Python cannot catch
    them; there the flag never rises.
    """

    def __init__(self) -> None:
        self.signum = 0
        self._before: dict[int, object] = {}

    def __call__(self) -> bool:
        """Return whether a signal came."""
        return self.signum != 0

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for signum in END_SIGNALS:
                if signal.getsignal(signum) is not signal.SIG_IGN:
                    self._before[signum] = signal.signal(signum, self._caught)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Restore the handlers from before."""
        for signum, handler in self._before.items():
            signal.signal(signum, handler)  # type: ignore[arg-type] # what signal() returned
        self._before.clear()

    def _caught(self, signum: int, _frame: FrameType | None) -> None:
        if self.signum:
            os._exit(128 + signum)  # asked twice: workers see their pipes close and end
        self.signum = signum
