"""What workers tell the process that started them. Plain data: it travels pickled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from internav_data.records.errors import (
    CorruptDataError,
    InternavError,
    QuarantineError,
    UsageError,
    ValidationError,
)

_KINDS = {
    kind.__name__: kind
    for kind in (InternavError, UsageError, ValidationError, QuarantineError, CorruptDataError)
}


@dataclass(frozen=True, slots=True)
class Ready:
    """Setup is done: tasks may come."""

    seconds: float
    """How long it took; shows whether kernels were compiled."""


@dataclass(frozen=True, slots=True)
class Done:
    """A task is finished."""

    task: Any
    value: Any


@dataclass(frozen=True, slots=True)
class Failed:
    """A task cannot be done; doing it again would fail in the same way."""

    task: Any
    reason: str
    attempts: int
    """How often it was tried."""


@dataclass(frozen=True, slots=True)
class Fatal:
    """Nothing can be done any more: setup failed, or the disk is full or read-only."""

    kind: str
    reason: str

    def error(self) -> InternavError:
        """Return the error that the worker met."""
        return _KINDS.get(self.kind, InternavError)(self.reason)


@dataclass(frozen=True, slots=True)
class WorkerExited:
    """The process is gone."""

    cause: str


Message = Ready | Done | Failed | Fatal | WorkerExited
