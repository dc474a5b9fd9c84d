"""Errors that a user can mend; the command line prints them in one line and exits with a code."""

from __future__ import annotations

from typing import ClassVar


class InternavError(Exception):
    """Base of every error meant for a user; its text names the place, the cause and a remedy."""

    exit_code: ClassVar[int] = 1
    """Exit status of the command line."""


class UsageError(InternavError):
    """Option, config key or argument that is wrong."""

    exit_code: ClassVar[int] = 2


class MissingEngineError(InternavError):
    """Physics engine whose library is not installed; the text has the command that installs it."""


class ValidationError(InternavError):
    """Dataset whose contents are wrong by the validator's own computation."""

    exit_code: ClassVar[int] = 3


class QuarantineError(InternavError):
    """Scene that cannot be built within the stated numbers of tries."""

    exit_code: ClassVar[int] = 4

    def __init__(self, message: str, attempts: int = 1) -> None:
        super().__init__(message)
        self.attempts = attempts
        """Number of tries that failed."""


class CorruptDataError(InternavError):
    """File that is damaged, edited, missing or of a version that this release cannot read."""

    exit_code: ClassVar[int] = 5


class NotFiniteError(InternavError):
    """NaN or infinity in training: in an observation, a reward or a loss."""

    exit_code: ClassVar[int] = 6
