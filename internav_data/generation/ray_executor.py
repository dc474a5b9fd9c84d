"""Executor of scenes on a Ray cluster: see `ray_driver` for what runs there."""

from __future__ import annotations

import os
import re
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from internav_data.core.extras import require
from internav_data.core.messages import Done, Failed, Fatal, Recipe
from internav_data.core.processes import GRACE_S, Child
from internav_data.core.worker_pool import FINISH_S, TICK_S
from internav_data.dataset.staging import Staging, put_staged
from internav_data.records.errors import InternavError, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator
    from multiprocessing.connection import Connection

CONNECT_S: Final = 60.0
"""Seconds that a cluster has to answer, the import of Ray included."""
THREADS: Final = 16
"""Files that are put at the same time: one takes 0.1 s where the dataset is in a bucket."""
_ADDRESS: Final = re.compile(r"auto|[\w.-]+:\d+|\[[0-9a-fA-F:]+\]:\d+")
_VARIABLE: Final = "RAY_ADDRESS"
_LOST: Final = "finished scenes are kept, run the same command again"


Result = tuple[Done | Failed | Fatal, dict[str, bytes]]
"""Result of a task, and the files that it staged by name."""


@dataclass(frozen=True, slots=True)
class RayOrder:
    """Scenes that a cluster is to make."""

    recipe: Recipe
    tasks: tuple[Any, ...]
    workers: int
    """Number of tasks under way at most; 0 for as many as the cluster has cores for."""


@dataclass(frozen=True, slots=True)
class RayExecutor:
    """Tasks on a Ray cluster of which this machine is a node; made by `ray_executor`."""

    address: str
    slots: int
    """Number of scenes made at the same time, as the cluster was when it was asked."""
    workers: int = 0
    """Number that was asked for; 0 for as many as the cluster has cores, later ones too."""

    def run(
        self, recipe: Recipe, tasks: Iterable[Any], tick: Callable[[], bool]
    ) -> Generator[Done | Failed, None, None]:
        """Run tasks on the cluster and stage what they made; see `Executor.run`."""
        todo = tuple(tasks)
        staging: Staging = recipe.payload.staging
        left, end = len(todo), None
        if not todo:
            return
        with _driver(self.address) as (child, _), ThreadPoolExecutor(THREADS) as threads:
            child.send(RayOrder(recipe, todo, self.workers))
            while left and (end is None or time.monotonic() < end):
                for result in threads.map(partial(_staged, staging), _received(child, left)):
                    left -= 1
                    yield result
                if end is None and not tick():
                    end = time.monotonic() + FINISH_S


def ray_executor(workers: int = 0, address: str | None = None) -> RayExecutor:
    """Return an executor on a cluster, which is asked how many cores it has.

    Parameters
    ----------
    workers
        Number of scenes made at the same time; 0 for as many as the cluster has cores.
    address
        `host:port` of its head, or `auto` for the cluster that runs on this machine; None for what
        `RAY_ADDRESS` names, else `auto`.

    Raises
    ------
    ModuleNotFoundError
        Ray is not installed.
    UsageError
        The address is none, nobody answers there, or no node of the cluster has a core.

    """
    require("ray")
    place = address or os.environ.get(_VARIABLE) or "auto"
    if not _ADDRESS.fullmatch(place):
        raise UsageError(f"--ray-address {place}: expected host:port of a cluster's head, or auto")
    with _driver(place) as (_, cores):
        if not cores:
            raise UsageError(
                f"the Ray cluster at {place}: none of its nodes has a core: start one with "
                "`ray start --address HOST:PORT --num-cpus N`"
            )
    return RayExecutor(place, workers or cores, workers)


def serve_ray(pipe: Connection[Any, Any]) -> None:
    """Serve a run in a process of its own, which alone imports Ray."""
    from internav_data.generation.ray_driver import serve_cluster  # noqa: PLC0415 - imports Ray

    serve_cluster(pipe)


@contextmanager
def _driver(address: str) -> Iterator[tuple[Child, int]]:
    """Start a process that is connected to a cluster; yield it and the cluster's cores."""
    child = Child(serve_ray)
    try:
        child.send(address)
        if not child.pipe.poll(CONNECT_S):
            child.process.kill()
            raise UsageError(
                f"the Ray cluster at {address}: no answer within {CONNECT_S:.0f} s: see by "
                "`ray status` that it runs and that this machine is a node of it, or name another "
                "by --ray-address"
            )
        found = _next(child)
        if isinstance(found, Fatal):
            raise found.error()
        yield child, found
    finally:
        child.pipe.close()  # which it notices
        child.end(GRACE_S)
        child.close()


def _next(child: Child) -> Any:  # noqa: ANN401 - what the other side sends
    try:
        return child.pipe.recv()
    except (EOFError, OSError):  # OSError: it was killed within a message
        cause = child.exit_cause()
        return Fatal(
            InternavError, f"the connection to the Ray cluster was lost ({cause}): {_LOST}"
        )


def _received(child: Child, left: int) -> Iterator[Result]:
    """Yield results that have come, of so many that are left; wait a little for the first one."""
    wait = TICK_S
    for _ in range(min(THREADS, left)):
        if not child.pipe.poll(wait):
            return
        message = _next(child)
        if isinstance(message, Fatal):
            yield message, {}
            return
        yield message
        wait = 0.0


def _staged(staging: Staging, result: Result) -> Done | Failed:
    """Stage what a task made and return its result; errors that end the run are raised."""
    outcome, files = result
    if isinstance(outcome, Fatal):
        raise outcome.error()
    for name, data in files.items():
        put_staged(staging, name, data)
    return outcome
