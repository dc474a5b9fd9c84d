"""Setups of workers in tests; imported by name in their processes."""

from __future__ import annotations

import contextlib
import os
import signal
import stat
import struct
import time
from pathlib import Path

from internav_data.records.errors import NotFiniteError, QuarantineError, UsageError


def square(payload):
    return lambda task: task * task + payload


def troubled(folder):
    """Tasks 3, 5, 7 and 11 each fail in a way of their own; the folder remembers crashes."""

    def work(task):
        with (Path(folder) / f"begun-{task}").open("a") as file:
            file.write(f"{os.getpid()}\n")
        crashes = len((Path(folder) / f"begun-{task}").read_text().split())
        if task == 3 and crashes == 1:
            os.kill(os.getpid(), signal.SIGKILL)
        if task == 5:
            os.kill(os.getpid(), signal.SIGSEGV)
        if task == 7:
            raise QuarantineError("no way can be blocked here")
        if task == 11:
            raise ValueError("a bug")
        return task

    return work


def refusing(payload):
    raise UsageError(f"{payload} is no mesh")


def raising(kind):
    """Return work that raises an error of a class."""

    def work(task):
        raise kind(f"task {task}: nothing to do")

    return work


def refusing_as(kind):
    raise kind("nothing to do")


def not_finite(_payload):
    return raising(NotFiniteError)


def stillborn(_payload):
    os._exit(9)


def deaf(pipe):
    """Serve nothing: close the pipe and stay."""
    pipe.close()
    time.sleep(120)


def full_disk(_payload):
    def work(task):
        raise OSError(28, "No space left on device", f"/data/{task}")

    return work


def noted(folder):
    """Tasks that leave a file each."""

    def work(task):
        (Path(folder) / str(task)).touch()
        time.sleep(0.2)
        return task

    return work


def slow(seconds):
    def work(task):
        time.sleep(seconds)
        return task

    return work


def cut_short(path):
    """Work whose process is killed the first time, when part of a long result is on its way."""

    def work(number):
        if not Path(path).exists():
            Path(path).touch()
            for fd in range(3, 64):
                with contextlib.suppress(OSError):  # it is open
                    if stat.S_ISSOCK(os.fstat(fd).st_mode):
                        os.write(fd, struct.pack("!i", 1000) + b"part")
            os.kill(os.getpid(), signal.SIGKILL)
        return number

    return work
