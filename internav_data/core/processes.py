"""Child processes: only their parent ends them, and none outlives it.

A terminal sends Ctrl-C to every process of a command, and batch systems send SIGTERM likewise. The
parent alone answers: it finishes what is under way, writes what is whole, and then ends its
children. When the parent is killed, nobody is left to end them, so they end themselves.

Children are plain interpreters that import one function of ours. multiprocessing's spawn would run
the caller's `__main__` again in each, and its fork would copy locks that other threads hold.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import faulthandler
import importlib
import os
import signal
import socket
import subprocess
import sys
import tempfile
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from internav_data.core.machine import END_SIGNALS, WINDOWS
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import FrameType

GRACE_S = 5.0
"""Seconds that a child has to end once its pipe is closed."""
SINGLE_THREADED = dict.fromkeys(
    (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "NUMEXPR_NUM_THREADS",
        "NUMBA_NUM_THREADS",
        "OPENCV_FOR_THREADS_NUM",
    ),
    "1",
)
"""Environment of a child: one thread a process, as processes share the cores already."""
_PR_SET_PDEATHSIG = 1
"""Option of Linux's prctl: signal that a process receives when its parent dies."""
_ORPHANED = 1
"""Exit code of a process whose parent is gone; nobody reads it."""

_child: tuple[int, int] | None = None
"""Process ids of this process and of its parent, if this process is a child."""


class Child:
    """A plain interpreter that runs a function, and the pipe to it.

    Parameters
    ----------
    serve
        Module-level function that the child imports and calls with its end of the pipe; the child
        ends when it returns, or finds the pipe closed.
    quiet
        Whether its stdout is dropped, and its stderr kept for `exit_cause`; else both are this
        process's.
    pass_fds
        File descriptors that it inherits, under the same numbers.

    Raises
    ------
    UsageError
        This is Windows, where no process can inherit its end of a pipe so.
    """

    def __init__(
        self,
        serve: Callable[[Connection[Any, Any]], object],
        *,
        quiet: bool = True,
        pass_fds: Sequence[int] = (),
    ) -> None:
        if WINDOWS:
            raise UsageError(
                "processes of our own cannot be started on Windows: ask for one worker, or use WSL"
            )
        ours, theirs = socket.socketpair()
        self._stderr = tempfile.TemporaryFile() if quiet else None  # noqa: SIM115 - lives as long as the process
        with theirs:
            fd = theirs.fileno()
            # As multiprocessing does, so that -O, -W and -X hold in children too.
            flags = subprocess._args_from_interpreter_flags()  # type: ignore[attr-defined] # noqa: SLF001
            words = [sys.executable, *flags, "-c", _entry(serve, fd)]
            # Signals of the group wait until the child has been set up for them.
            before = signal.pthread_sigmask(signal.SIG_BLOCK, END_SIGNALS)
            try:
                self.process = subprocess.Popen(  # noqa: S603 - our own interpreter and words
                    words,
                    env=os.environ | SINGLE_THREADED,
                    pass_fds=(fd, *pass_fds),
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL if quiet else None,
                    stderr=self._stderr,
                )
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)
        self.pipe: Connection[Any, Any] = Connection(ours.detach())
        self._overdue_s: float | None = None  # grace after which it was killed

    def send(self, message: object) -> None:
        """Send a message; a child that has just died is noticed when its pipe is read."""
        with contextlib.suppress(OSError):
            self.pipe.send(message)

    def exit_cause(self) -> str:
        """Return why a child ended whose pipe is closed: signal or code, last line on stderr."""
        code = self.end(GRACE_S)
        if self._overdue_s is not None:
            return f"did not end within {self._overdue_s:g} s and was killed"
        return _cause(code, self._last_stderr_line())

    def end(self, grace_s: float) -> int:
        """Wait for the child, kill it after some seconds; return its exit code."""
        try:
            return self.process.wait(max(0.0, grace_s))
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        if code == -signal.SIGKILL:  # else it ended by itself just before
            self._overdue_s = max(0.0, grace_s)
        return code

    def close(self) -> None:
        """Close the files of a child that has ended."""
        self.pipe.close()
        if self._stderr is not None:
            self._stderr.close()

    def _last_stderr_line(self) -> str:
        if self._stderr is None:
            return ""
        self._stderr.seek(0)
        lines = self._stderr.read().decode(errors="replace").strip().splitlines()
        return lines[-1].strip() if lines else ""


def _entry(serve: Callable[..., object], fd: int) -> str:
    """Return the program of a child; its modules are those that this process would find."""
    try:
        here = Path.cwd()
    except FileNotFoundError:  # removed under our feet: nothing can be found there
        here = Path()
    paths = [Path(here, path) for path in sys.path]
    found = [str(path) for path in paths if path.is_absolute()]
    return (
        f"import sys; sys.path[:] = {found!r}; from {__name__} import run_child; "
        f"run_child({fd}, {os.getpid()}, {serve.__module__!r}, {serve.__name__!r})"
    )


def _cause(code: int, stderr_line: str) -> str:
    if code < 0:
        name = signal.Signals(-code).name
        hint = "; the system may be short of memory" if name == "SIGKILL" else ""
        return f"was killed by {name}{hint}"
    return f"ended with code {code}" + (f": {stderr_line}" if stderr_line else "")


def run_child(fd: int, parent: int, module: str, name: str) -> None:
    """Be a child of the process `parent`: call a function with the socket `fd` as a pipe."""
    become_child(parent)
    faulthandler.enable()  # a crash in native code leaves its name on stderr
    with Connection(fd) as pipe:
        try:
            getattr(importlib.import_module(module), name)(pipe)
        except (EOFError, BrokenPipeError, ConnectionResetError):
            # The parent is gone or has closed the pipe: nothing is left to do but to tidy up, as
            # `multiprocessing` does. Skipping the interpreter's own shutdown ends the process
            # without waiting for libraries' threads.
            atexit._run_exitfuncs()  # noqa: SLF001 - has no public name
            os._exit(0)


def become_child(parent: int) -> None:
    """Set up this process as a child; called first of all in it, in its main thread.

    SIGINT, SIGTERM and SIGHUP have no effect from here on while the parent lives, and the process
    ends when the parent does: at once on Linux, elsewhere when it next asks `parent_is_gone` or
    uses its pipe.

    Parameters
    ----------
    parent
        Process id of the parent, to notice that it died before this call.

    """
    global _child  # noqa: PLW0603 - a fact about the process
    _child = os.getpid(), parent
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    # Linux also sends the death signal when only the thread ends that started this process, so it
    # must be one that a handler may look into.
    signal.signal(signal.SIGTERM, _end_if_orphaned)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, END_SIGNALS)
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
