"""A run's progress in words: the line while it trains, and what is said at its end."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from internav_data.generation.progress import Ticker, clock

if TYPE_CHECKING:
    from pathlib import Path
    from typing import TextIO

    from internav_data.camp.logbook import Row


class Teller(Ticker):
    """Takes in the rows of a run's log and tells how far it is.

    Parameters
    ----------
    stream
        Where; None: nowhere.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        super().__init__(stream)
        self._stage = ""
        self._last: Row = {}
        self._validation: Row = {}

    def __call__(self, row: Row) -> None:
        """Take in a row."""
        if "validation" in row:
            self._validation = row["validation"]
            self.say(f"{row['stage']}, {row['step']:,} steps: validation {_words(row)}")
            return
        stage = str(row.get("stage", "cloning"))
        if stage != self._stage and self._stage:
            self.say(self.line())
        self._stage, self._last = stage, row
        if self.due():
            self.tell(self.line())

    def line(self) -> str:
        """Return how far it is, in one line."""
        row = self._last
        if "cloning" in row:
            said = row["cloning"]
            rate = said["frames_per_s"]
            left = said["updates"] - said["update"]
            frames = row["step"] / said["update"]
            share = said["update"] / said["updates"]
            return (
                f"cloning: {row['step']:,} frames ({share:.0%}), loss {said['loss']:.3f}, "
                f"{rate:,.0f} frames/s, {clock(left * frames / max(rate, 1e-9))} left"
            )
        rate = row["time"]["steps_per_s"]
        left = (row["updates"] - row["update"]) * row["step"] / row["update"]
        share = row["update"] / row["updates"]
        parts = [f"{row['stage']}: {row['step']:,} steps ({share:.0%})"]
        episode = row["episode"]
        if "success" in episode:
            parts.append(f"success {episode['success']:.0%}")
        parts += [f"{rate:,.0f} steps/s", f"{clock(left / max(rate, 1e-9))} left"]
        return ", ".join(parts)

    def summary(self, run: Path) -> str:
        """Return what is said at the end."""
        if not self._last:
            return f"{run}: was finished already"
        said = f"{run}: {self._last['step']:,} steps"
        success = self._last.get("episode", {}).get("success")
        if success is not None:
            said += f", success {success:.0%} of the last training episodes"
        if self._validation:
            said += f"; validation {_words({'validation': self._validation})}"
        return said

    def plain(self, run: Path) -> dict[str, Any]:
        """Return the same as plain JSON."""
        return {
            "run": str(run),
            "step": self._last.get("step"),
            "episode": self._last.get("episode"),
            "validation": self._validation or None,
        }


def _words(row: Row) -> str:
    said = row["validation"]
    return (
        f"success {said['success']:.0%}, SPL {said['spl']:.2f}, STS {said['sts']:.2f} "
        f"over {said['episodes']:.0f} episodes"
    )
