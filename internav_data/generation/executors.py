"""Executors: where and how the scenes of a run are made.

`generate` hands an executor a recipe and the scenes to make. It learns which scene ended and how,
and nothing of processes or machines: they may be this machine's or a cluster's.
Results may come in any order; the dataset's bytes do not depend on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol, runtime_checkable

from internav_data.core.machine import available_cores
from internav_data.core.worker_pool import WorkerPool
from internav_data.generation.ray_executor import ray_executor
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Mapping

    from internav_data.core.messages import Done, Failed, Recipe

DEFAULT_EXECUTOR: Final = "processes"


@runtime_checkable
class Executor(Protocol):
    """Runs the tasks of a recipe; see `ProcessExecutor`."""

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
class ProcessExecutor:
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


def _processes(workers: int, address: str | None) -> Executor:
    if address is not None:
        raise UsageError(f"--ray-address {address}: is for --executor ray: ask for it, too")
    return ProcessExecutor(workers)


EXECUTORS: Final[Mapping[str, Callable[[int, str | None], Executor]]] = {
    DEFAULT_EXECUTOR: _processes,
    "ray": ray_executor,
}
"""Executors by name: each takes the number of workers, 0 for its default, and the address of a
cluster."""


def get_executor(name: str, workers: int = 0, address: str | None = None) -> Executor:
    """Return an executor by its name in `EXECUTORS`.

    Raises
    ------
    ModuleNotFoundError
        Its package is not installed.
    UsageError
        There is no such executor, `workers` is negative, or nobody answers at the address.

    """
    if workers < 0:
        raise UsageError(f"workers is {workers}: ask for 1 or more, or 0 for one a core")
    if name not in EXECUTORS:
        raise UsageError(f"executor is '{name}': expected one of {', '.join(EXECUTORS)}")
    return EXECUTORS[name](workers, address)
