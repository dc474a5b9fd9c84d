"""How far a run is: a line that renews itself on a terminal, a log line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from typing import TextIO

REDRAW_S = 0.2
LOG_EVERY_S = 30.0
COMPILING_AFTER_S = 8.0
"""Workers start within two seconds; what takes longer is numba compiling."""
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


class Progress(Ticker):
    """Counts what ends and tells it on a stream; silent without one."""

    def __init__(self, stream: TextIO | None = None) -> None:
        super().__init__(stream)
        self._began = self._told
        self.scenes = self.scenes_before = self.scenes_total = 0
        self.episodes = self.episodes_left = 0
        self.quarantined = 0

    def begin(self, scenes: int, done: int, episodes_left: int) -> None:
        """State how much there is to do, and how much was done before."""
        self._began = self._told = time.monotonic()
        self.scenes_total, self.scenes_before = scenes, done
        self.episodes_left = episodes_left

    def scene(self, episodes: int, *, expected: int) -> None:
        """Count a scene that ended with so many episodes of those expected."""
        self.scenes += 1
        self.episodes += episodes
        self.episodes_left -= expected
        self.quarantined += episodes == 0

    @property
    def seconds(self) -> float:
        """Wall time since the beginning."""
        return time.monotonic() - self._began

    def line(self) -> str:
        """Return the state in one line."""
        done = self.scenes_before + self.scenes
        share = done / self.scenes_total if self.scenes_total else 1.0
        parts = [f"{done}/{self.scenes_total} scenes ({share:.0%})"]
        if self.episodes:
            rate = self.episodes / max(self.seconds, 1e-9)
            parts += [f"{rate:.1f} episodes/s", f"{clock(self.episodes_left / rate)} left"]
        elif self.seconds > COMPILING_AFTER_S:
            parts.append("compiling for the first run, about a minute")
        if self.quarantined:
            parts.append(f"{self.quarantined} quarantined")
        return ", ".join(parts)

    def tick(self) -> None:
        """Tell the state if it is time to."""
        if self.due():
            self.tell(self.line())


def to_stderr() -> Progress:
    """Return a progress that tells on stderr."""
    return Progress(sys.stderr)
