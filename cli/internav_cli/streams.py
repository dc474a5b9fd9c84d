"""Standard streams of a command: closed, full or of a narrow encoding, they end no command.

A closed stream's number would be given to the next file that is opened, and what is printed would
go into it: the null device takes its place. What cannot be written on stderr is lost, as the exit
code says the rest. Characters that stdout's encoding lacks become question marks.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_STDERR = 2


class _ForgivingFile(io.FileIO):
    """A file that takes whatever is written, even where the device is full or gone."""

    def write(self, data: ReadableBuffer, /) -> int:
        """Write bytes; return how many were taken: all, after an error."""
        try:
            return super().write(data)
        except OSError:
            return memoryview(data).nbytes


def prepare_streams() -> None:
    """Make the standard streams of this process safe to write to; those of tests stay."""
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
    if sys.stdout is None:
        sys.stdout = io.TextIOWrapper(io.FileIO(1, "w", closefd=False), "utf-8")
    if sys.stdout is sys.__stdout__ and isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")
    if sys.stderr is sys.__stderr__:
        encoding = sys.stderr.encoding if sys.stderr is not None else "utf-8"
        with contextlib.suppress(OSError):
            sys.stderr = io.TextIOWrapper(
                io.BufferedWriter(_ForgivingFile(_STDERR, "w", closefd=False)),
                encoding,
                errors="backslashreplace",
                line_buffering=True,
            )


def leave_unwritten() -> None:
    """Leave out what stdout cannot take, as on a full device: the interpreter's end fails on it.

    Since Python 3.13 it then exits with 120, after lines of its own.
    """
    try:
        sys.stdout.flush()
    except OSError:
        sys.stdout = None
