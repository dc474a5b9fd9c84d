"""Child processes: only their parent ends them, and none outlives it.

A terminal sends Ctrl-C to every process of a command, and batch systems send SIGTERM likewise. The
parent alone answers: it finishes what is under way, writes what is whole, and then ends its
children. When the parent is killed, nobody is left to end them, so they end themselves.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import FrameType

_PR_SET_PDEATHSIG = 1
"""Option of Linux's prctl: signal that a process receives when its parent dies."""
_ORPHANED = 1
"""Exit code of a process whose parent is gone; nobody reads it."""

_child: tuple[int, int] | None = None
"""Process ids of this process and of its parent, if this process is a child."""


def become_child(parent: int | None = None) -> None:
    """Set up this process as a child; called first of all in it, in its main thread.

    SIGINT and SIGTERM have no effect from here on while the parent lives, and the process ends
    when the parent does: at once on Linux, elsewhere when it next asks `parent_is_gone` or reads
    from a pipe of the parent's.

    Parameters
    ----------
    parent
        Process id of the parent, to notice that it died before this call; None for the process
        that the system names.

    """
    global _child  # noqa: PLW0603 - a fact about the process
    _child = os.getpid(), os.getppid() if parent is None else parent
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Linux also sends the death signal when only the thread ends that started this process, so it
    # must be one that a handler may look into.
    signal.signal(signal.SIGTERM, _end_if_orphaned)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    end_if_orphaned()


def parent_is_gone() -> bool:
    """Return whether this process is a child whose parent has died: then it must write nothing."""
    if _child is None or _child[0] != os.getpid():  # a fork of a child serves somebody else
        return False
    return os.getppid() != _child[1]


def end_if_orphaned() -> None:
    """End this process at once if it is a child whose parent has died."""
    if parent_is_gone():
        os._exit(_ORPHANED)


def _end_if_orphaned(_signum: int, _frame: FrameType | None) -> None:
    end_if_orphaned()
