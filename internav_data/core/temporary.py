"""Temporary folders of processes: removed at exit, and those of killed processes by the next one.

A folder is its process's for as long as that holds the lock of a file in it, which the kernel opens
when the process dies, however it dies. Process ids would not do: containers may share a folder for
temporary files, but not their ids.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import shutil
import tempfile
import time
from pathlib import Path

from internav_data.core.machine import user_id
from internav_data.core.storage import try_lock

_PREFIX = "internav-process-"
_LOCK = "process.lock"
_SETTLED_S = 60.0
"""Age from which a folder that nobody holds is taken for one of a killed process, seconds: a new
one is not locked for a moment."""


def process_folder() -> Path:
    """Return a new folder of this process, which is removed at exit; remove those of killed ones.

    Raises
    ------
    OSError
        No folder can be made.

    """
    sweep_folders()
    folder = Path(tempfile.mkdtemp(prefix=_PREFIX))
    # Open until the process ends; a forked child that lives on keeps the files that it may use.
    try_lock(os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o600))
    atexit.register(_remove, folder, os.getpid())
    return folder


def sweep_folders() -> None:
    """Remove this user's folders of processes that no longer run."""
    for folder in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
        with contextlib.suppress(OSError):  # somebody else sweeps, or it is not ours
            _sweep(folder)


def _sweep(folder: Path) -> None:
    if folder.is_symlink() or folder.stat().st_uid != user_id():
        return
    descriptor = os.open(folder / _LOCK, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
    try:
        settled = time.time() - os.fstat(descriptor).st_mtime > _SETTLED_S
        if settled and try_lock(descriptor):
            shutil.rmtree(folder, ignore_errors=True)
    finally:
        os.close(descriptor)


def _remove(folder: Path, pid: int) -> None:
    if pid == os.getpid():  # not in a forked child
        shutil.rmtree(folder, ignore_errors=True)
