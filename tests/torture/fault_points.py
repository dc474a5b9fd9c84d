"""Fault points: calls of this process that change files below a folder, counted; one of them fails.

Python asks its audit hooks before it opens, renames, links or removes anything, and a hook that
raises stops the call. Writes and `fsync` are wrapped. `faults.run` compares what is counted with
the system calls of the same run.
"""

from __future__ import annotations

import builtins
import errno
import io
import os
import signal
import sys
from pathlib import Path

FAULTS = ("EIO", "ENOSPC", "SIGKILL")
_CHANGES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC
_EVENTS = {
    "os.rename": "rename",
    "os.remove": "unlink",
    "os.rmdir": "rmdir",
    "os.mkdir": "mkdir",
    "os.link": "link",
    "os.symlink": "symlink",
    "os.truncate": "truncate",
    "os.chmod": "chmod",
}


def mark_of(folder: str | Path) -> Path:
    """Return the file beside a folder that is there once a fault has happened below it."""
    return Path(f"{folder}.reached")


class FaultPoints:
    """Counts the calls below a folder from the first one on; the call of number `at` fails.

    With `only`, calls of that kind alone count. Before it fails, the file `mark_of(folder)` is
    written, so that a run can be told in which there was no fault.
    """

    def __init__(
        self, folder: Path, at: int | None = None, fault: str = "SIGKILL", only: str = ""
    ) -> None:
        self.folder = os.path.realpath(folder)
        self.at, self.fault, self.only = at, fault, only
        self.log: list[tuple[str, str]] = []

    def install(self) -> None:
        """Watch this process until it ends."""
        sys.addaudithook(self._audit)
        opened, synced = io.open, os.fsync

        def watched(file, mode="r", *args, **kwargs):
            if not set(mode) & set("wax+") or not self._inside(file):
                return opened(file, mode, *args, **kwargs)
            raw = _Raw(file, mode.replace("b", "").replace("t", ""), points=self)
            buffered = io.BufferedWriter(raw)
            return buffered if "b" in mode else io.TextIOWrapper(buffered, *args[1:], **kwargs)

        def fsync(descriptor):
            path = os.path.realpath(f"/proc/self/fd/{descriptor}")
            if self._inside(path):
                self.reach("fsync", path, named=False)
            return synced(descriptor)

        io.open = builtins.open = watched
        os.fsync = fsync

    def reach(self, kind, path, *, named=True, before=lambda: None) -> None:
        """Count a call; let it fail if it is the one. `before` does a part of its work first."""
        if self.only and kind != self.only:
            return
        self.log.append((kind, os.path.relpath(path, self.folder)))
        if len(self.log) - 1 != self.at:
            return
        mark_of(self.folder).touch()
        before()
        if self.fault == "SIGKILL":
            os.kill(os.getpid(), signal.SIGKILL)
        if self.fault == "SIGKILL of the group":
            os.killpg(0, signal.SIGKILL)
        number = getattr(errno, self.fault)
        raise OSError(number, os.strerror(number), *([str(path)] if named else []))

    def _audit(self, event, arguments) -> None:
        if event == "open":
            path, _, flags = arguments
            if flags & _CHANGES and self._inside(path):
                self.reach("open", path)
        elif event in _EVENTS and self._inside(arguments[0]):
            self.reach(_EVENTS[event], arguments[0])

    def _inside(self, path) -> bool:
        return isinstance(path, str | os.PathLike) and os.path.normpath(path).startswith(
            self.folder + os.sep
        )


class _Raw(io.FileIO):
    def __init__(self, file, mode, points) -> None:
        self._points, self._path = points, file
        super().__init__(file, mode)

    def write(self, data):
        half = lambda: super(_Raw, self).write(bytes(data)[: len(data) // 2])  # noqa: E731
        self._points.reach("write", self._path, named=False, before=half)
        return super().write(data)
