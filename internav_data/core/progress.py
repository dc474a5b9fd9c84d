"""How far a run is: a line that renews itself on a terminal, a log line now and then elsewhere."""

from __future__ import annotations

import time
from typing import TextIO

REDRAW_S = 0.2

LOG_EVERY_S = 30.0

HOUR_S, MINUTE_S = 3600, 60


def clock(seconds: float) -> str:
    """Return a duration as people read it: 1 h 05 min, 3 min 20 s, 12 s."""
    whole = round(seconds)
    if whole >= HOUR_S:
        return f"{whole // HOUR_S} h {whole % HOUR_S // MINUTE_S:02d} min"
    if whole >= MINUTE_S:
        return f"{whole // MINUTE_S} min {whole % MINUTE_S:02d} s"
    return f"{whole} s"


class Ticker:
    """Tells a state in one line: on a terminal it renews itself, elsewhere it comes now and then.

    Parameters
    ----------
    stream
        Where; None: nowhere.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream
        self._terminal = stream is not None and stream.isatty()
        self._told = time.monotonic()
        self._width = 0

    def due(self) -> bool:
        """Return whether it is time to tell again."""
        every = REDRAW_S if self._terminal else LOG_EVERY_S
        return self._stream is not None and time.monotonic() - self._told >= every

    def tell(self, line: str) -> None:
        """Tell the state."""
        self._told = time.monotonic()
        if not self._terminal:
            self.say(line)
        elif self._stream is not None:
            self._stream.write("\r" + line.ljust(self._width))
            self._stream.flush()
            self._width = len(line)

    def say(self, text: str) -> None:
        """Tell something that stays on the screen."""
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
