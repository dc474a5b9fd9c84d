"""Folder in which numba keeps compiled kernels, where its own choices cannot be written.

Numba keeps them beside a module or in the user's cache folder, and refuses to compile a kernel for
later processes where it can write neither: in read-only packages of a user without a home.
"""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path
from typing import Final

VARIABLE: Final = "NUMBA_CACHE_DIR"
"""Environment variable that names the folder; numba reads it, child processes inherit it."""
TEMPORARY_PREFIX: Final = "internav-numba-"
"""Beginning of the temporary folder's name."""
_PACKAGE: Final = Path(__file__).parents[1]


def ensure_compile_cache() -> None:
    """Name a temporary folder for compiled kernels if there is no other; call before numba does.

    The folder is the user's alone, as numba unpickles what lies there. Without any writable folder
    nothing changes, and compiling fails.
    """
    if any(is_writable(folder) for folder in own_choices()):
        return
    folder = _temporary_folder()
    if folder is None:
        return
    os.environ[VARIABLE] = str(folder)
    if "numba" in sys.modules:  # it has read the variable already
        sys.modules["numba"].config.CACHE_DIR = str(folder)


def own_choices() -> list[Path]:
    """Return the folders that numba tries, in order."""
    chosen = os.environ.get(VARIABLE)
    caches = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")  # noqa: PTH111 - no error without a home
    if sys.platform == "darwin":
        caches = os.path.expanduser("~/Library/Caches")  # noqa: PTH111
    beside = _PACKAGE / "geometry" / "__pycache__"
    return [*([Path(chosen)] if chosen else []), beside, Path(caches) / "numba"]


def is_writable(folder: Path) -> bool:
    """Return whether a folder can be written, or made."""
    while not os.path.lexists(folder) and folder != folder.parent:
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def _temporary_folder() -> Path | None:
    """Return a folder of this user in a temporary one that only he can write; None without any."""
    import tempfile  # noqa: PLC0415 - hardly ever needed, and slow to import

    user = os.getuid() if hasattr(os, "getuid") else 0
    try:
        shared = Path(tempfile.gettempdir())
        folder = shared / f"{TEMPORARY_PREFIX}{user}"
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if stat.S_ISDIR(found.st_mode) and found.st_uid == user and not found.st_mode & 0o022:
            return folder
        return Path(tempfile.mkdtemp(prefix=TEMPORARY_PREFIX, dir=shared))  # somebody was there
    except OSError:
        return None
