"""Errors a user can mend. The command line prints them in one line and exits with their code."""

from __future__ import annotations

from typing import ClassVar


class InternavError(Exception):
    """Base of every error meant for a user: what, where, expected, got, what to do next."""

    exit_code: ClassVar[int] = 1


class UsageError(InternavError):
    """An option, config key or argument that cannot be meant."""

    exit_code: ClassVar[int] = 2


class ValidationError(InternavError):
    """A dataset that says something untrue."""

    exit_code: ClassVar[int] = 3


class QuarantineError(InternavError):
    """A scene that cannot be built within the stated bounds."""

    exit_code: ClassVar[int] = 4


class CorruptDataError(InternavError):
    """A file that is damaged, edited, missing or of a version this release cannot read."""

    exit_code: ClassVar[int] = 5


class NotFiniteError(InternavError):
    """Training met NaN or infinity: in what an environment said, or in a loss."""

    exit_code: ClassVar[int] = 6
