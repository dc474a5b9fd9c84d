"""Messages between a worker pool and its workers. Plain data: they travel pickled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.records.errors import InternavError


@dataclass(frozen=True, slots=True)
class Recipe:
    """Work of a worker: `setup(payload)` once, then the function that it returned for every task.

    Payload, tasks and results travel pickled.
    """

    setup: Callable[[Any], Callable[[Any], Any]]
    """A module-level function: workers import it by name."""
    payload: Any
    """Argument of `setup`."""


@dataclass(frozen=True, slots=True)
class Ready:
    """Setup is done: tasks may come."""

    seconds: float
    """Duration of the setup; shows whether kernels were compiled."""


@dataclass(frozen=True, slots=True)
class Done:
    """Result of a task that succeeded."""

    task: Any
    value: Any
    """Return value of the recipe's function."""


@dataclass(frozen=True, slots=True)
class Failed:
    """Result of a task that was given up."""

    task: Any
    reason: str
    attempts: int
    """Number of tries."""
    died: bool = False
    """Whether the processes that did it died; otherwise it would fail in the same way again."""


@dataclass(frozen=True, slots=True)
class Fatal:
    """Error that ends the run: setup failed, or a file cannot be read or written."""

    kind: type[InternavError | OSError]
    """Class of the error: it has the exit code of the command."""
    reason: str
    errno: int | None = None
    """Number of an OSError."""
    filename: str | None = None
    """File of an OSError."""

    def error(self) -> InternavError | OSError:
        """Return the error that the worker met."""
        if issubclass(self.kind, OSError):
            return OSError(self.errno or 0, self.reason, self.filename)
        return self.kind(self.reason)


@dataclass(frozen=True, slots=True)
class WorkerExited:
    """A worker process has ended."""

    cause: str
    """Signal or exit code, and the last line on stderr."""


Message = Ready | Done | Failed | Fatal | WorkerExited
