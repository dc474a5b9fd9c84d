"""Worker processes of our own, each on a pipe: one that dies costs one retry of its task.

A `ProcessPoolExecutor` fails all pending work when one of its processes dies, and multiprocessing's
spawn runs the caller's `__main__` again. Workers here are plain interpreters that are told over a
socket what to import; they see the socket close when this process dies, and end.
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
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self

from internav_data.generation.messages import Done, Failed, Fatal, Ready, WorkerExited
from internav_data.records.errors import InternavError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from types import TracebackType

    from internav_data.generation.messages import Message

MAX_DEATHS = 3
"""A task whose worker died this often is given up."""
MAX_STARTS = 3
"""Workers that die this often in a row before they are ready cannot start at all."""
GRACE_S = 5.0
"""After an interruption workers get this long to finish what they do (process control, no data)."""
TICK_S = 0.25
"""The longest a signal waits to be seen."""
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
"""One thread a process: the cores are shared by processes, and idle pools cost memory."""


class CannotStartError(InternavError):
    """Worker processes end before they can do anything."""


class StopFlag(Protocol):
    """Tells whether the run is to end; see `interrupts.Interrupts`."""

    def __call__(self) -> bool:
        """Return True once nothing new is to be begun."""
        ...


@dataclass(frozen=True, slots=True)
class Recipe:
    """What a worker is: `setup(payload)` once, then what it returned for every task.

    `setup` is a module-level function (workers import it by name); payload, tasks and results
    travel pickled.
    """

    setup: Callable[[Any], Callable[[Any], Any]]
    payload: Any


class _Worker:
    """One process, its pipe and the task it holds."""

    def __init__(self, recipe: Recipe) -> None:
        ours, theirs = socket.socketpair()
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        with theirs:
            fd = theirs.fileno()
            entry = f"from internav_data.generation.worker import main; main({fd})"
            self.process = subprocess.Popen(  # noqa: S603 - our own interpreter and words
                [sys.executable, "-c", entry],
                env=_environment(),
                pass_fds=(fd,),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # Bullet greets on stdout
                stderr=self._stderr,
                process_group=0,  # Ctrl-C is for the parent, which ends its workers in order
            )
        self.pipe: Connection[Any, Any] = Connection(ours.detach())
        self.ready = False
        self.task: Any = None
        self.busy = False
        self.send((recipe.setup, recipe.payload))

    def send(self, thing: object) -> None:
        """Send; a worker that has just died is noticed when its pipe is read."""
        try:
            self.pipe.send(thing)
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
            return WorkerExited(self._obituary())
        return message

    def _obituary(self) -> str:
        try:
            code = self.process.wait(timeout=GRACE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        return _cause(code, self.last_words())

    def last_words(self) -> str:
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


def _cause(code: int, words: str) -> str:
    if code < 0:
        name = signal.Signals(-code).name
        hint = "; the system may be short of memory" if name == "SIGKILL" else ""
        return f"its worker was killed by {name}{hint}"
    return f"its worker ended with code {code}" + (f": {words}" if words else "")


class WorkerPool:
    """Some workers that do tasks in any order; use it as a context manager."""

    def __init__(self, size: int, recipe: Recipe, stop: StopFlag = lambda: False) -> None:
        self.size = size
        self._recipe = recipe
        self._stop = stop
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

    def run(self, tasks: Iterable[Any], tick: Callable[[], None] = lambda: None) -> Iterator[Any]:
        """Yield a `Done` or `Failed` for each task, in the order in which they end.

        `tick` is called a few times a second. Once the stop flag is up nothing new begins, what is
        under way is given some seconds to end, and the iterator ends early.

        Raises
        ------
        InternavError
            What a worker's setup or a full disk said; `CannotStartError` when workers die before
            they are ready.

        """
        todo, deaths = deque(tasks), Counter[Any]()
        while not self._stop():
            self._staff(todo)
            if not any(worker.busy for worker in self._workers) and not todo:
                return
            yield from self._listen(todo, deaths)
            tick()
        yield from self._wind_down()

    def _staff(self, todo: deque[Any]) -> None:
        """Give each idle worker a task, and start workers while there are tasks for them."""
        for worker in self._workers:
            if worker.ready and not worker.busy and todo:
                worker.begin(todo.popleft())
        starting = sum(not worker.ready for worker in self._workers)
        for _ in range(min(self.size - len(self._workers), len(todo) - starting)):
            self._workers.append(_Worker(self._recipe))

    def _listen(self, todo: deque[Any], deaths: Counter[Any]) -> Iterator[Any]:
        pipes = {worker.pipe: worker for worker in self._workers}
        for pipe in wait(list(pipes), timeout=TICK_S):
            worker = pipes[pipe]  # type: ignore[index] # only connections were given
            message = worker.receive()
            if isinstance(message, Ready):
                worker.ready, self._false_starts = True, 0
            elif isinstance(message, Fatal):
                raise message.error()
            elif isinstance(message, WorkerExited):
                yield from self._bury(worker, message, todo, deaths)
            else:
                worker.busy = False
                yield message

    def _bury(
        self, worker: _Worker, message: WorkerExited, todo: deque[Any], deaths: Counter[Any]
    ) -> Iterator[Any]:
        """Take a dead worker's task back, or give it up."""
        self._workers.remove(worker)
        worker.close()
        if not worker.ready:
            self._false_starts += 1
            if self._false_starts >= MAX_STARTS:
                raise CannotStartError(
                    f"worker processes cannot start: {message.cause}; "
                    "run `internav-gen doctor` to see what is missing"
                )
        elif worker.busy:
            deaths[worker.task] += 1
            if deaths[worker.task] < MAX_DEATHS:
                todo.appendleft(worker.task)
            else:
                reason = f"{message.cause}, {MAX_DEATHS} times"
                yield Failed(worker.task, reason, MAX_DEATHS)

    def _wind_down(self) -> Iterator[Any]:
        """Wait for what is under way, so that it need not be done again."""
        deadline = time.monotonic() + GRACE_S
        while any(worker.busy for worker in self._workers) and time.monotonic() < deadline:
            busy = {worker.pipe: worker for worker in self._workers if worker.busy}
            for pipe in wait(list(busy), timeout=TICK_S):
                worker = busy[pipe]  # type: ignore[index] # only connections were given
                message = worker.receive()
                worker.busy = False
                if isinstance(message, Done | Failed):
                    yield message
