"""Logs of a run: a JSON row an update in `log.jsonl`, TensorBoard beside it, progress in words."""

from __future__ import annotations

import io
import json
import math
import os
import socket
import time
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, Self, TextIO

from internav_data.core.progress import ProgressLine, clock
from internav_data.records.errors import CorruptDataError, NotFiniteError

Row = dict[str, Any]
"""Plain JSON: numbers by name, one level of groups."""

LOG: Final = "log.jsonl"
BOARD: Final = "tensorboard"
_SUCCESS_RATES: Final = {
    "interaction": ("pushes", "picks", "drops"),
    "push": ("pushes",),
    "pick": ("picks",),
    "drop": ("drops",),
}
"""Success rates that are logged, and the counters that each is made of."""


class MetricsLogger:
    """Writer of a run's rows; it goes on after those that a checkpoint knows of.

    Parameters
    ----------
    run
        The run's folder.
    position
        Size in bytes of the log that the checkpoint knows of; later rows are cut off, as their
        updates are done again.
    board
        Write TensorBoard's files too, if the `tensorboard` package is installed.

    Raises
    ------
    CorruptDataError
        The log is shorter than that.
    """

    def __init__(self, run: Path, position: int = 0, *, board: bool = True) -> None:
        path = run / LOG
        size = path.stat().st_size if path.exists() else 0
        if size < position:
            raise CorruptDataError(
                f"{path}: {size} bytes, the checkpoint knows of {position}: put the log back that "
                "belongs to it"
            )
        self._file = path.open("ab", buffering=0)
        self._file.truncate(position)
        self.position = position
        # A resumed run repeats its updates to the last bit, so no step is to be purged.
        drawn = board and find_spec("tensorboard") is not None
        self._board = _board_file(run / BOARD) if drawn else None

    def write(self, row: Row) -> None:
        """Append a row; TensorBoard draws it at its "step".

        Raises
        ------
        NotFiniteError
            A number of the row is NaN or infinite, as a task's own metric may be.
        OSError
            The disk is full: the log ends with the last row that is whole.
        """
        odd = [name for name, value in _scalars(row) if not math.isfinite(value)]
        if odd:
            raise NotFiniteError(f"{self._file.name}: {', '.join(odd)}: no finite number to log")
        line = (json.dumps(row, allow_nan=False) + "\n").encode()
        try:
            write_all(self._file, line)
        except OSError:
            self._file.truncate(self.position)
            raise
        self.position += len(line)
        if self._board is not None:
            values = [{"tag": name, "simple_value": value} for name, value in _scalars(row)]
            write_all(self._board, _event(step=row["step"], summary={"value": values}))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Close the files."""
        self._file.close()
        if self._board is not None:
            self._board.close()


def _board_file(folder: Path) -> io.FileIO:
    """Begin a TensorBoard file.

    torch's SummaryWriter writes in a thread of its own, where a full disk ends in a traceback.
    """
    folder.mkdir(parents=True, exist_ok=True)
    name = f"events.out.tfevents.{time.time_ns()}.{socket.gethostname()}.{os.getpid()}"
    file = (folder / name).open("xb", buffering=0)
    write_all(file, _event(file_version="brain.Event:2"))
    return file


def _event(**fields: Any) -> bytes:  # noqa: ANN401 - those of an event
    """Return a record of a TensorBoard file."""
    from tensorboard.compat.proto.event_pb2 import Event  # noqa: PLC0415 - optional
    from tensorboard.summary.writer.record_writer import RecordWriter  # noqa: PLC0415

    record = io.BytesIO()
    RecordWriter(record).write(Event(wall_time=time.time(), **fields).SerializeToString())
    return record.getvalue()


def write_all(file: io.FileIO, data: bytes) -> None:
    """Write all bytes to an unbuffered file, which may take a part at a time.

    Raises
    ------
    OSError
        The disk is full: the file is named.
    """
    rest = memoryview(data)
    try:
        while rest:
            rest = rest[file.write(rest) :]
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(file.name)) from error


def _scalars(row: Mapping[str, Any]) -> Iterable[tuple[str, float]]:
    """Yield a row's numbers by name, groups joined by a slash."""
    for name, value in row.items():
        if isinstance(value, dict):
            yield from ((f"{name}/{inner}", number) for inner, number in _scalars(value))
        elif isinstance(value, int | float) and name != "step":
            yield name, float(value)


class EpisodeWindow:
    """The last episodes that ended, whose means are logged.

    Parameters
    ----------
    size
        Number of episodes.
    episodes
        Metrics of earlier episodes.
    """

    def __init__(self, size: int, episodes: Iterable[Mapping[str, float]] = ()) -> None:
        self.episodes: deque[dict[str, float]] = deque((dict(each) for each in episodes), size)

    def add(self, ended: Sequence[Mapping[str, Any]]) -> Row:
        """Add the metrics of the episodes that ended in a rollout; return the row to be logged."""
        for metrics in ended:
            self.episodes.append({name: float(value) for name, value in metrics.items()})
        values: dict[str, list[float]] = {}
        for episode in self.episodes:
            for name, value in episode.items():
                values.setdefault(name, []).append(value)
        if not values:
            return {"ended": len(ended)}
        means = {name: sum(column) / len(column) for name, column in values.items()}
        row = {"ended": len(ended), **means}
        for rate, names in _SUCCESS_RATES.items():
            tried = sum(sum(values.get(f"{name}_tried", ())) for name in names)
            if tried:
                done = sum(sum(values.get(f"{name}_done", ())) for name in names)
                row[f"{rate}_success"] = done / tried
        return row


def rates(steps: int, seconds: Sequence[float]) -> Row:
    """Return steps a second in three tiers: environments alone, rollouts, all of training."""
    names = ("env_steps_per_s", "collect_steps_per_s", "steps_per_s")
    return {
        name: round(steps / spent, 2) if spent > 0.0 else 0.0
        for name, spent in zip(names, seconds, strict=True)
    }


class ProgressReporter(ProgressLine):
    """Progress line of a run, from the rows of its log.

    Parameters
    ----------
    stream
        Text stream of the line; None for none.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        super().__init__(stream)
        self._last: Row = {}
        self._validation: Row = {}

    def __call__(self, row: Row) -> None:
        """Show a row."""
        if "validation" in row:
            self._validation = row["validation"]
            words = _validation_words(self._validation)
            self.log(f"{row['stage']}, {row['step']:,} steps: validation {words}")
            return
        if self._last and self._last.get("stage") != row.get("stage"):
            self.log(self.line())
        self._last = row
        if self.due():
            self.update(self.line())

    def line(self) -> str:
        """Return the progress in one line."""
        row = self._last
        cloning = row.get("cloning")
        counts = row if cloning is None else cloning
        rate = row["time"]["steps_per_s"] if cloning is None else cloning["frames_per_s"]
        steps_left = (counts["updates"] - counts["update"]) * row["step"] / counts["update"]
        share, left = counts["update"] / counts["updates"], clock(steps_left / max(rate, 1e-9))
        if cloning is not None:
            skipped = cloning.get("without_expert", 0)
            more = f", {skipped:,} episodes without an expert skipped" if skipped else ""
            return (
                f"cloning, epoch {cloning['epoch']} of {cloning['epochs']}: {row['step']:,} frames "
                f"({share:.0%}), loss {cloning['loss']:.3f}, "
                f"{rate:,.0f} frames/s, {left} left{more}"
            )
        success = row["episode"].get("success")
        words = "" if success is None else f"success {success:.0%}, "
        new = row["time"]["new_push_share"]
        return (
            f"{row['stage']}: {row['step']:,} steps ({share:.0%}), {words}{rate:,.0f} steps/s "
            f"({new:.0%} of pushes new), {left} left"
        )

    def summary(self, run: Path) -> str:
        """Return the last line of a run."""
        if not self._last:
            return f"{run}: was finished already"
        line = f"{run}: {self._last['step']:,} steps"
        success = self._last.get("episode", {}).get("success")
        if success is not None:
            line += f", success {success:.0%} of the last training episodes"
        if self._validation:
            line += f"; validation {_validation_words(self._validation)}"
        return line

    def plain(self, run: Path) -> dict[str, Any]:
        """Return the summary as plain JSON."""
        return {
            "run": str(run),
            "step": self._last.get("step"),
            "episode": self._last.get("episode"),
            "validation": self._validation or None,
        }


def _validation_words(means: Mapping[str, float]) -> str:
    return (
        f"success {means['success']:.0%}, SPL {means['spl']:.2f}, STS {means['sts']:.2f} "
        f"over {means['episodes']:.0f} episodes"
    )
