"""Progress of a generation run, on stderr."""

from __future__ import annotations

import time
from typing import TextIO

from internav_data.core.progress import ProgressLine, clock

COMPILING_AFTER_S = 8.0
"""Time without a scene after which numba must be compiling, seconds: workers start in two."""


class GenerationProgress(ProgressLine):
    """Counts scenes and writes rate and remaining time on a stream; silent without one."""

    def __init__(self, stream: TextIO | None = None) -> None:
        super().__init__(stream)
        self._began = self._updated
        self.scenes = self.scenes_before = self.scenes_total = 0
        self.episodes = self.episodes_left = 0
        self.quarantined = 0
        self.readable = 0
        """Number of first scenes that can be read already."""

    def begin(self, scenes: int, done: int, episodes_left: int) -> None:
        """Begin a run of `scenes` scenes, of which `done` were made before."""
        self._began = self._updated = time.monotonic()
        self.scenes_total, self.scenes_before = scenes, done
        self.episodes_left = episodes_left

    def scene(self, episodes: int, *, expected: int) -> None:
        """Count a scene that ended with `episodes` of the `expected` episodes; 0: quarantined."""
        self.scenes += 1
        self.episodes += episodes
        self.episodes_left -= expected
        self.quarantined += episodes == 0

    @property
    def seconds(self) -> float:
        """Wall time since the beginning of the run, seconds."""
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
        if self.readable:
            parts.append(f"the first {self.readable} can be read")
        return ", ".join(parts)

    def tick(self) -> None:
        """Write the state if it is time for an update."""
        if self.due():
            self.update(self.line())
