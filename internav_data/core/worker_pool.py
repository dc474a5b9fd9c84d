"""Worker processes, each on a pipe: one that dies costs one retry of its task.

A `ProcessPoolExecutor` fails all pending work when one of its processes dies. On Windows, where
`Child` cannot be started, the pool does its tasks in this process.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Any, Self

from internav_data.core.machine import WINDOWS
from internav_data.core.messages import Done, Failed, Fatal, Ready, WorkerExited
from internav_data.core.processes import GRACE_S, Child
from internav_data.core.storage import held_locks
from internav_data.core.worker import run_task, serve
from internav_data.records.errors import InternavError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from types import TracebackType

    from internav_data.core.messages import Message, Recipe

MAX_CRASHES = 3
"""Crashes of its workers after which a task is given up."""
MAX_FALSE_STARTS = 3
"""Workers that die in a row before they are ready, after which none can start."""
FINISH_S = 0.5
"""Seconds that workers have to finish their tasks after an interruption, which a user waits for."""
TICK_S = 0.25
"""Longest time between two calls of `tick`, seconds."""


class CannotStartError(InternavError):
    """Worker processes end before they are ready."""


class _Worker(Child):
    """One process and the task it holds."""

    def __init__(self, recipe: Recipe) -> None:
        # One that outlives us keeps its folder locked.
        super().__init__(serve, pass_fds=held_locks())
        self.ready = False
        self.task: Any = None
        self.busy = False
        self.send(recipe)

    def begin(self, task: object) -> None:
        self.task, self.busy = task, True
        self.send(task)

    def receive(self) -> Message:
        """Return the next message, `WorkerExited` when the process is gone."""
        try:
            message: Message = self.pipe.recv()
        except (EOFError, OSError):  # OSError: killed within a message
            return WorkerExited(f"its worker {self.exit_cause()}")
        return message


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
        """End all workers: kindly when all is well and they wait for a task, else at once."""
        for worker in self._workers:
            worker.pipe.close()  # an idle worker sees this and ends
            if worker.busy or not worker.ready:
                worker.process.kill()
        deadline = time.monotonic() + (GRACE_S if kind is None else 0.0)
        for worker in self._workers:
            worker.end(deadline - time.monotonic())
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
        under way have `FINISH_S` to end, and the iterator ends early.

        Raises
        ------
        InternavError
            A worker's setup failed; `CannotStartError` when workers die before they are ready.
        OSError
            A worker cannot read or write a file, as when the disk is full.

        """
        if WINDOWS:
            yield from self._run_here(tasks, tick)
            return
        todo, crashes = deque(tasks), Counter[Any]()
        while tick():
            self._assign(todo)
            if not any(worker.busy for worker in self._workers) and not todo:
                return
            yield from self._collect(todo, crashes)
        yield from self._drain()

    def _run_here(self, tasks: Iterable[Any], tick: Callable[[], bool]) -> Iterator[Done | Failed]:
        """Do the tasks in this process, one after the other, where it can start no others."""
        work = None
        for task in tasks:
            if not tick():
                return
            work = work or self._recipe.setup(self._recipe.payload)
            result = run_task(work, task)
            if isinstance(result, Fatal):
                raise result.error()
            yield result

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
                yield Failed(worker.task, reason, MAX_CRASHES, died=True)

    def _drain(self) -> Iterator[Done | Failed]:
        """Wait for the tasks under way, so that they need not be done again."""
        deadline = time.monotonic() + FINISH_S
        while any(worker.busy for worker in self._workers) and time.monotonic() < deadline:
            busy = {worker.pipe: worker for worker in self._workers if worker.busy}
            for pipe in wait(list(busy), timeout=TICK_S):
                worker = busy[pipe]  # type: ignore[index] # only connections were given
                message = worker.receive()
                worker.busy = False
                if isinstance(message, Done | Failed):
                    yield message
