"""Facts of the machine that operating systems tell in different ways, or not at all.

Whatever is asked of one system alone (POSIX, Linux) is asked here or in `core.storage`, which locks
and waits for the disk, or `core.processes`, which starts children; so there each has its other way.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from typing import Final

WINDOWS: Final = sys.platform == "win32"
"""Whether this is Windows, where no child inherits a file and nothing can be locked but a file."""
END_SIGNALS: Final = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""Signals by which a user, a batch system or a terminal that closes asks a command to end; the last
one is POSIX's."""
_GIB: Final = 1 << 30
_MALLOPT: Final = ((-3, 32 << 20), (-1, (1 << 31) - 1), (-2, 64 << 20))
"""Settings of glibc (mallopt(3)): M_MMAP_THRESHOLD at its maximum, M_TRIM_THRESHOLD at its maximum,
M_TOP_PAD. Bytes."""


def available_cores() -> int:
    """Return the number of processors that this process may use; of all where nobody knows."""
    if hasattr(os, "sched_getaffinity"):  # Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def memory_gib() -> float | None:
    """Return the machine's memory in GiB; None where the system does not say."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / _GIB
    except (AttributeError, ValueError, OSError):
        return None


def user_id() -> int:
    """Return the number of the user whose files this process makes; 0 where users have none."""
    return os.geteuid() if hasattr(os, "geteuid") else 0


def keep_freed_memory() -> bool:
    """Let this process keep memory that it frees, for its next use; return whether the system can.

    Training frees and takes the same buffers of a few MB hundreds of times a second. By default
    glibc gives each back to the system, which fills it with zeros again: up to a fifth of learning
    on a CPU. The process stays as large as it ever was.
    """
    mallopt = None if WINDOWS else getattr(ctypes.CDLL(None), "mallopt", None)  # glibc alone
    return mallopt is not None and all(mallopt(name, value) for name, value in _MALLOPT)
