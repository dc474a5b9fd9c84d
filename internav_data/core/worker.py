"""Main loop of a worker process: set up once, then one task after the other."""

from __future__ import annotations

import os
import time
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, Any

from internav_data.core.messages import Done, Failed, Fatal, Ready
from internav_data.records.errors import InternavError, QuarantineError

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection

    from internav_data.core.messages import Recipe


def serve(pipe: Connection[Any, Any]) -> None:
    """Do the tasks that come through a pipe until its other end closes."""
    recipe: Recipe = pipe.recv()
    began = time.perf_counter()
    work = set_up(recipe)
    if isinstance(work, Fatal):
        pipe.send(work)
        return
    pipe.send(Ready(time.perf_counter() - began))
    while True:
        pipe.send(run_task(work, pipe.recv()))


def set_up(recipe: Recipe) -> Callable[[Any], Any] | Fatal:
    """Return a recipe's function for every task, or the error that its setup met."""
    try:
        return recipe.setup(recipe.payload)
    except InternavError as error:
        return Fatal(type(error), str(error))
    except Exception as error:  # noqa: BLE001 - any error must reach the parent
        return Fatal(InternavError, f"a worker could not be set up: {_described(error)}")


def run_task(work: Callable[[Any], Any], task: Any) -> Done | Failed | Fatal:  # noqa: ANN401
    """Do a task and return its result; of errors, their messages.

    A process that runs out of memory exits: its executor may try the task in a new one.
    """
    try:
        return Done(task, work(task))
    except QuarantineError as error:
        return Failed(task, str(error), error.attempts)
    except InternavError as error:
        return Fatal(type(error), str(error))
    except OSError as error:
        named = None if error.filename is None else str(error.filename)
        return Fatal(OSError, error.strerror or str(error), error.errno, named)
    except MemoryError:
        os._exit(1)  # a new process may have more luck: the parent tries again
    except Exception as error:  # noqa: BLE001 - any error must reach the parent
        return Failed(task, _described(error), 1)


def _described(error: Exception) -> str:
    """Return an error's class, message, file and line; no folders, as it may be stored in data."""
    frames = traceback.extract_tb(error.__traceback__)
    where = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {error}{where}"
