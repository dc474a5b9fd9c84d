"""Progress of a run: one line that renews itself on a terminal, rare lines of a log elsewhere."""

from __future__ import annotations

import time
from typing import TextIO

REDRAW_S = 0.2
"""Shortest time between two updates on a terminal, seconds."""
LOG_EVERY_S = 30.0
"""The same in a log."""
HOUR_S, MINUTE_S = 3600, 60


def clock(seconds: float) -> str:
    """Return a duration as people read it: 1 h 05 min, 3 min 20 s, 12 s."""
    whole = round(seconds)
    if whole >= HOUR_S:
        return f"{whole // HOUR_S} h {whole % HOUR_S // MINUTE_S:02d} min"
    if whole >= MINUTE_S:
        return f"{whole // MINUTE_S} min {whole % MINUTE_S:02d} s"
    return f"{whole} s"


class ProgressLine:
    """A line about the state of a run.

    Parameters
    ----------
    stream
        Stream to write on; None: silent.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream
        self._terminal = stream is not None and stream.isatty()
        self._updated = time.monotonic()
        self._width = 0

    def due(self) -> bool:
        """Return whether it is time for another update."""
        every = REDRAW_S if self._terminal else LOG_EVERY_S
        return self._stream is not None and time.monotonic() - self._updated >= every

    def update(self, line: str) -> None:
        """Write the state: over the last one on a terminal, as a new line elsewhere."""
        self._updated = time.monotonic()
        if not self._terminal:
            self.log(line)
        elif self._stream is not None:
            self._stream.write("\r" + line.ljust(self._width))
            self._stream.flush()
            self._width = len(line)

    def log(self, text: str) -> None:
        """Write a line that stays on the screen."""
        if self._stream is None:
            return
        self.end()
        self._stream.write(f"{text}\n")
        self._stream.flush()

    def end(self) -> None:
        """Remove the line that renews itself."""
        if self._stream is not None and self._terminal and self._width:
            self._stream.write("\r" + " " * self._width + "\r")
            self._stream.flush()
            self._width = 0
