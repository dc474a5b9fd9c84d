"""Worker processes, each on a pipe: one that dies costs one retry of its task.

A `ProcessPoolExecutor` fails all pending work when one of its processes dies, and multiprocessing's
spawn runs the caller's `__main__` again. Workers here are plain interpreters that receive the
function to import over a socket; they see the socket close when this process dies, and end.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter, deque
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from internav_data.core.storage import held_locks
from internav_data.generation.messages import Done, Failed, Fatal, Ready, WorkerExited
from internav_data.records.errors import InternavError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from types import TracebackType

    from internav_data.generation.messages import Message, Recipe

MAX_CRASHES = 3
"""Crashes of its workers after which a task is given up."""
MAX_FALSE_STARTS = 3
"""Workers that die in a row before they are ready, after which none can start."""
GRACE_S = 5.0
"""Seconds that workers have to finish their tasks after an interruption."""
TICK_S = 0.25
"""Longest time between two calls of `tick`, seconds."""
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
"""Environment of a worker: one thread a process, as processes share the cores already."""


class CannotStartError(InternavError):
    """Worker processes end before they are ready."""


class _Worker:
    """One process, its pipe and the task it holds."""

    def __init__(self, recipe: Recipe) -> None:
        ours, theirs = socket.socketpair()
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        with theirs:
            fd = theirs.fileno()
            entry = f"from internav_data.generation.worker import main; main({fd}, {os.getpid()})"
            self.process = subprocess.Popen(  # noqa: S603 - our own interpreter and words
                [sys.executable, "-c", entry],
                env=_environment(),
                pass_fds=(fd, *held_locks()),  # one that outlives us keeps its folder locked
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # Bullet greets on stdout
                stderr=self._stderr,
                process_group=0,  # Ctrl-C is for the parent, which ends its workers in order
            )
        self.pipe: Connection[Any, Any] = Connection(ours.detach())
        self.ready = False
        self.task: Any = None
        self.busy = False
        self.send(recipe)

    def send(self, message: object) -> None:
        """Send a recipe or a task; a worker that has just died is noticed when its pipe is read."""
        try:
            self.pipe.send(message)
        except (BrokenPipeError, ConnectionResetError):
            return

    def begin(self, task: object) -> None:
        self.task, self.busy = task, True
        self.send(task)

    def receive(self) -> Message:
        """Return the next message, `WorkerExited` when the process is gone."""
        try:
            message: Message = self.pipe.recv()
        except (EOFError, ConnectionResetError):
            return WorkerExited(self._exit_cause())
        return message

    def _exit_cause(self) -> str:
        try:
            code = self.process.wait(timeout=GRACE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        return _cause(code, self.last_stderr_line())

    def last_stderr_line(self) -> str:
        """Return the last line that the process wrote to stderr."""
        self._stderr.seek(0)
        lines = self._stderr.read().decode(errors="replace").strip().splitlines()
        return lines[-1].strip() if lines else ""

    def close(self) -> None:
        self.pipe.close()
        self._stderr.close()


def _environment() -> dict[str, str]:
    path = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
    return os.environ | SINGLE_THREADED | {"PYTHONPATH": path}


def _cause(code: int, stderr_line: str) -> str:
    if code < 0:
        name = signal.Signals(-code).name
        hint = "; the system may be short of memory" if name == "SIGKILL" else ""
        return f"its worker was killed by {name}{hint}"
    return f"its worker ended with code {code}" + (f": {stderr_line}" if stderr_line else "")


class WorkerPool:
    """Processes that do tasks in any order; use it as a context manager.

    Parameters
    ----------
    size
        Maximum number of processes; none starts before there is a task for it.
    recipe
        Work of the processes.
    """

    def __init__(self, size: int, recipe: Recipe) -> None:
        self.size = size
        self._recipe = recipe
        self._workers: list[_Worker] = []
        self._false_starts = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End all workers: kindly when all is well, at once after an error."""
        for worker in self._workers:
            worker.pipe.close()  # an idle worker sees this and ends
        deadline = time.monotonic() + (GRACE_S if kind is None else 0.0)
        for worker in self._workers:
            try:
                worker.process.wait(timeout=max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                worker.process.kill()
                worker.process.wait()
            worker.close()
        self._workers.clear()

    @property
    def processes(self) -> tuple[int, ...]:
        """Process ids of the workers alive."""
        return tuple(worker.process.pid for worker in self._workers)

    def run(
        self, tasks: Iterable[Any], tick: Callable[[], bool] = lambda: True
    ) -> Iterator[Done | Failed]:
        """Yield the result of each task, in the order in which they end.

        `tick` is called a few times a second. Once it returns False no further task begins, those
        under way have `GRACE_S` to end, and the iterator ends early.

        Raises
        ------
        InternavError
            A worker's setup failed, or the disk is full; `CannotStartError` when workers die
            before they are ready.

        """
        todo, crashes = deque(tasks), Counter[Any]()
        while tick():
            self._assign(todo)
            if not any(worker.busy for worker in self._workers) and not todo:
                return
            yield from self._collect(todo, crashes)
        yield from self._drain()

    def _assign(self, todo: deque[Any]) -> None:
        """Give each idle worker a task, and start workers while there are tasks for them."""
        for worker in self._workers:
            if worker.ready and not worker.busy and todo:
                worker.begin(todo.popleft())
        starting = sum(not worker.ready for worker in self._workers)
        for _ in range(min(self.size - len(self._workers), len(todo) - starting)):
            self._workers.append(_Worker(self._recipe))

    def _collect(self, todo: deque[Any], crashes: Counter[Any]) -> Iterator[Done | Failed]:
        pipes = {worker.pipe: worker for worker in self._workers}
        for pipe in wait(list(pipes), timeout=TICK_S):
            worker = pipes[pipe]  # type: ignore[index] # only connections were given
            message = worker.receive()
            if isinstance(message, Ready):
                worker.ready, self._false_starts = True, 0
            elif isinstance(message, Fatal):
                raise message.error()
            elif isinstance(message, WorkerExited):
                yield from self._handle_crash(worker, message, todo, crashes)
            else:
                worker.busy = False
                yield message

    def _handle_crash(
        self, worker: _Worker, message: WorkerExited, todo: deque[Any], crashes: Counter[Any]
    ) -> Iterator[Failed]:
        """Hand a dead worker's task out again, or give it up."""
        self._workers.remove(worker)
        worker.close()
        if not worker.ready:
            self._false_starts += 1
            if self._false_starts >= MAX_FALSE_STARTS:
                raise CannotStartError(
                    f"worker processes cannot start: {message.cause}; "
                    "run `internav-gen doctor` to see what is missing"
                )
        elif worker.busy:
            crashes[worker.task] += 1
            if crashes[worker.task] < MAX_CRASHES:
                todo.appendleft(worker.task)
            else:
                reason = f"{message.cause}, {MAX_CRASHES} times"
                yield Failed(worker.task, reason, MAX_CRASHES)

    def _drain(self) -> Iterator[Done | Failed]:
        """Wait for the tasks under way, so that they need not be done again."""
        deadline = time.monotonic() + GRACE_S
        while any(worker.busy for worker in self._workers) and time.monotonic() < deadline:
            busy = {worker.pipe: worker for worker in self._workers if worker.busy}
            for pipe in wait(list(busy), timeout=TICK_S):
                worker = busy[pipe]  # type: ignore[index] # only connections were given
                message = worker.receive()
                worker.busy = False
                if isinstance(message, Done | Failed):
                    yield message
