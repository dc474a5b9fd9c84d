"""Name of the process that holds a lock, so that who is refused knows whom to ask."""

from __future__ import annotations

import os
import socket
import time
from pathlib import Path
from typing import Final

_LOCKS: Final = Path("/proc/locks")
"""Linux's table of locks: number, FLOCK, …, process, device (two hexadecimal numbers) and inode."""
_START_FIELD: Final = 19
"""Place of the start, in ticks since the machine's, among the fields after a process's name."""


def lock_holder(descriptor: int) -> str:
    """Return which process holds the lock of a file, in words; empty where the system won't say."""
    try:
        process = _holder(os.fstat(descriptor))
        began = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(_start_s(process)))
    except (AttributeError, OSError, ValueError, IndexError):  # not on Linux, or not told
        return ""
    return f"process {process} on {socket.gethostname()}, which began at {began}"


def _holder(file: os.stat_result) -> int:
    device = f"{os.major(file.st_dev):02x}:{os.minor(file.st_dev):02x}:{file.st_ino}"
    # Some file systems name another device there than stat() does; no two locks share an inode.
    ours = (device, f":{file.st_ino}")
    rows = [line.split() for line in _LOCKS.read_text().splitlines()]
    held = [row for row in rows if row[1] == "FLOCK"]
    found = [row for end in ours for row in held if row[5].endswith(end)]
    return int(found[0][4])


def _start_s(process: int) -> float:
    """Return the time at which a process began, seconds since 1970."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    uptime = float(Path("/proc/uptime").read_text().split()[0])
    return time.time() - uptime + int(fields[_START_FIELD]) / os.sysconf("SC_CLK_TCK")
