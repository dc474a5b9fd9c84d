"""Main loop of a worker process: set up once, then one task after the other."""

from __future__ import annotations

import atexit
import faulthandler
import os
import time
import traceback
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from internav_data.core.processes import become_child
from internav_data.generation.messages import Done, Failed, Fatal, Ready
from internav_data.generation.scenes import ATTEMPTS
from internav_data.records.errors import InternavError, QuarantineError

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.generation.messages import Recipe


def main(fd: int, parent: int) -> None:
    """Serve the socket `fd` of a process until its other end closes."""
    become_child(parent)
    faulthandler.enable()  # a crash in native code leaves its name on stderr
    with Connection(fd) as pipe:
        try:
            _serve(pipe)
        except (EOFError, BrokenPipeError, ConnectionResetError):
            # The parent is gone or has closed the pipe: nothing is left to do but to tidy up, as
            # `multiprocessing` does. Skipping the interpreter's own shutdown ends the process
            # without waiting for libraries' threads.
            atexit._run_exitfuncs()  # noqa: SLF001 - has no public name
            os._exit(0)


def _serve(pipe: Connection[Any, Any]) -> None:
    recipe: Recipe = pipe.recv()
    began = time.perf_counter()
    try:
        work = recipe.setup(recipe.payload)
    except InternavError as error:
        pipe.send(Fatal(type(error).__name__, str(error)))
        return
    except Exception as error:  # noqa: BLE001 - any error must reach the parent
        pipe.send(Fatal("InternavError", f"a worker could not be set up: {_described(error)}"))
        return
    pipe.send(Ready(time.perf_counter() - began))
    while True:
        pipe.send(run_task(work, pipe.recv()))


def run_task(work: Callable[[Any], Any], task: Any) -> Done | Failed | Fatal:  # noqa: ANN401
    """Do a task and return its result; of errors, their messages.

    A process that runs out of memory exits: its executor may try the task in a new one.
    """
    try:
        return Done(task, work(task))
    except QuarantineError as error:
        return Failed(task, str(error), ATTEMPTS)
    except InternavError as error:
        return Fatal(type(error).__name__, str(error))
    except OSError as error:
        where = f" ({error.filename})" if error.filename else ""
        return Fatal(
            "InternavError",
            f"cannot write: {error.strerror or error}{where}; make room for the dataset, then "
            "run the same command again: finished scenes are kept",
        )
    except MemoryError:
        os._exit(1)  # a new process may have more luck: the parent tries again
    except Exception as error:  # noqa: BLE001 - any error must reach the parent
        return Failed(task, _described(error), 1)


def _described(error: Exception) -> str:
    """Return an error's class, message, file and line; no folders, as it may be stored in data."""
    frames = traceback.extract_tb(error.__traceback__)
    where = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {error}{where}"
