"""One generator at a time in a folder: a lock that the kernel opens when its holder dies."""

from __future__ import annotations

import contextlib
import fcntl
import os
from typing import TYPE_CHECKING

from internav_data.records.errors import InternavError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


class LockedError(InternavError):
    """Another generator is at work in the same folder."""


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, which must exist. Nothing is written into it.

    Raises
    ------
    LockedError
        Somebody else holds it.

    """
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        # Some network file systems cannot lock folders: there we trust the user.
        with contextlib.suppress(OSError):
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise LockedError(
                    f"{folder}: another internav-gen is writing this dataset; "
                    "wait for it to end or choose another --out"
                ) from None
        yield
    finally:
        os.close(descriptor)
