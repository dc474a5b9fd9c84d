"""Executors: where and how the scenes of a run are made.

`generate` hands an executor a recipe and the scenes to make. It learns which scene ended and how,
and nothing of processes or machines: another executor may submit the same recipe to a cluster.
Results may come in any order; the dataset's bytes do not depend on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol, runtime_checkable

from internav_data.core.machine import available_cores
from internav_data.core.worker_pool import WorkerPool
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Mapping

    from internav_data.core.messages import Done, Failed, Recipe

DEFAULT_EXECUTOR: Final = "local"


@runtime_checkable
class Executor(Protocol):
    """Runs the tasks of a recipe; see `LocalExecutor`."""

    @property
    def slots(self) -> int:
        """Number of tasks that run at the same time."""
        ...

    def run(
        self, recipe: Recipe, tasks: Iterable[Any], tick: Callable[[], bool]
    ) -> Generator[Done | Failed, None, None]:
        """Run every task and yield its result, in any order.

        Closing the generator gives up the tasks under way.

        Parameters
        ----------
        recipe
            Work to do; it travels pickled, as tasks and results do.
        tasks
            Tasks, each of them hashable; begun in this order.
        tick
            Called a few times a second. Once it returns False no further task begins, those under
            way may end within some seconds, and the generator ends early.

        Raises
        ------
        InternavError
            Nothing can be done any more: setup failed.
        OSError
            The same: a disk is full or read-only.

        """
        ...


@dataclass(frozen=True, slots=True)
class LocalExecutor:
    """Worker processes on this machine."""

    workers: int = 0
    """Number of processes; 0 for one a core."""

    @property
    def slots(self) -> int:
        """Number of processes."""
        return self.workers or available_cores()

    def run(
        self, recipe: Recipe, tasks: Iterable[Any], tick: Callable[[], bool]
    ) -> Generator[Done | Failed, None, None]:
        """Run tasks in processes that end with the generator; see `Executor.run`."""
        with WorkerPool(self.slots, recipe) as pool:
            yield from pool.run(tasks, tick)


EXECUTORS: Final[Mapping[str, Callable[[int], Executor]]] = {DEFAULT_EXECUTOR: LocalExecutor}
"""Executors by name: each takes the number of workers, 0 for its default."""


def get_executor(name: str, workers: int = 0) -> Executor:
    """Return an executor by its name in `EXECUTORS`.

    Raises
    ------
    UsageError
        There is no such executor, or `workers` is negative.

    """
    if workers < 0:
        raise UsageError(f"workers is {workers}: ask for 1 or more, or 0 for one a core")
    if name not in EXECUTORS:
        raise UsageError(f"executor is '{name}': expected one of {', '.join(EXECUTORS)}")
    return EXECUTORS[name](workers)
