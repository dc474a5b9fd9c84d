"""Ray's side of a run: a process that hands scenes to a cluster, and the tasks that make them.

Ray catches signals, writes on stdout, waits for minutes where nobody answers, and ends its process
when it loses its cluster. So it has a process of its own, which `RayExecutor` starts and ends.

A task makes one scene. Its file travels to the run, which alone writes: nodes need neither the
dataset's folder nor the right to write there, and one that is lost leaves nothing behind.
"""

from __future__ import annotations

import os
import platform
import signal
import time
from collections import Counter, deque
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any, Final

import ray
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from internav_data.core.extras import DISTRIBUTIONS
from internav_data.core.messages import Failed, Fatal, Recipe
from internav_data.core.processes import SINGLE_THREADED
from internav_data.core.worker import run_task, set_up
from internav_data.core.worker_pool import MAX_CRASHES, TICK_S
from internav_data.generation.rules import source_digest
from internav_data.physics.engines import MODULES
from internav_data.records.errors import InternavError, UsageError
from internav_data.records.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from multiprocessing.connection import Connection

    from internav_data.generation.ray_executor import RayOrder, Result
    from internav_data.generation.scenes import ScenePayload

MAX_LOST_NODES: Final = 10
"""Nodes that are lost under a scene after which it is given up: it may be what ends them."""
NODE_S: Final = 120.0
"""Seconds that a node has to say what is installed there, its first imports included."""
ALONE_S: Final = 60.0
"""Seconds without a node after which the run ends; new ones may be on their way."""
AHEAD: Final = 2
"""Tasks for each core of the cluster: the next one waits on its node, and new nodes find some."""
_LIBRARIES: Final = ("networkx", "numba", "numpy", "scipy", "shapely")
"""Libraries whose versions may show in the last bit of a scene."""
_LOST: Final = (ray.exceptions.NodeDiedError, ray.exceptions.ObjectLostError)
_CRASHED: Final = (ray.exceptions.WorkerCrashedError, ray.exceptions.OutOfMemoryError)


def serve_cluster(pipe: Connection[Any, Any]) -> None:
    """Connect to the cluster whose address comes first, then carry out an order.

    Sends the number of cores or `Fatal`, and then a `Result` for each task. Whoever only asks for
    the cores closes the pipe, which ends the process.
    """
    found = _connected(pipe.recv())
    pipe.send(found)
    if isinstance(found, int):
        order: RayOrder = pipe.recv()
        for result in _results(order, pipe):
            pipe.send(result)


def _connected(address: str) -> int | Fatal:
    before = signal.getsignal(signal.SIGTERM)
    try:
        ray.init(address, log_to_driver=False, configure_logging=False, logging_level="ERROR")
    except ConnectionError as error:
        if address != "auto":
            return Fatal(UsageError, f"the Ray cluster at {address}: {_last_line(error)}")
        return Fatal(
            UsageError,
            "no Ray cluster runs on this machine: start one with `ray start --head`, or name one "
            "of which it is a node by --ray-address HOST:PORT",
        )
    except Exception as error:  # noqa: BLE001 - Ray has no base class for what it raises here
        return Fatal(UsageError, f"the Ray cluster at {address}: {_last_line(error)}")
    finally:
        signal.signal(signal.SIGTERM, before)  # only the run answers signals
    return _cores()


def _results(order: RayOrder, pipe: Connection[Any, Any]) -> Iterator[Result]:
    """Yield the result of each task, in the order in which they end."""
    engine = order.recipe.payload.config.physics
    names = tuple(filter(None, (engine.engine, engine.other_engine)))
    if unfit := _unfit_node(names):
        yield unfit, {}
        return
    shared = (ray.put((order.recipe, _installed(names), names)),)
    todo, under_way = deque(order.tasks), dict[ray.ObjectRef, Any]()
    fates, seen = Counter[tuple[Any, str]](), time.monotonic()
    while todo or under_way:
        if pipe.poll():
            pipe.recv()  # nothing comes: the run has closed its end
        cores = _cores()
        seen = time.monotonic() if cores else seen
        if time.monotonic() > seen + ALONE_S:
            yield Fatal(InternavError, _ended("no node of the Ray cluster is left")), {}
            return
        while todo and len(under_way) < (order.workers or AHEAD * cores):
            task = todo.popleft()
            under_way[_make.remote(shared, task)] = task
        ended, _ = ray.wait(list(under_way), timeout=TICK_S) if under_way else ([], [])
        if ended:  # and all others that have by now
            ended, _ = ray.wait(list(under_way), num_returns=len(under_way), timeout=0)
        for ref in ended:
            result = _result(ref, under_way.pop(ref), fates)
            if isinstance(result, tuple):
                yield result
            else:
                todo.appendleft(result.task)
        if not under_way and not cores:
            time.sleep(TICK_S)


@dataclass(frozen=True, slots=True)
class _Again:
    task: Any


def _result(ref: ray.ObjectRef, task: object, fates: Counter[tuple[Any, str]]) -> Result | _Again:
    """Return the result of a task that ended, or that it has to be done again."""
    try:
        result: Result = ray.get(ref)
    except (*_LOST, *_CRASHED) as error:
        kind, limit = (
            ("node", MAX_LOST_NODES) if isinstance(error, _LOST) else ("worker", MAX_CRASHES)
        )
        fates[task, kind] += 1
        if fates[task, kind] < limit:
            return _Again(task)
        return Failed(task, f"its {kind} died, {limit} times", limit, died=True), {}
    except ray.exceptions.RayError as error:
        return Fatal(InternavError, _ended(f"Ray: {_last_line(error)}")), {}
    return result


def _unfit_node(engines: Sequence[str]) -> Fatal | None:
    """Return why a node of the cluster cannot make the scenes that this machine would make."""
    asked = {
        node["NodeManagerAddress"]: _look.options(
            scheduling_strategy=NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)
        ).remote(engines)
        for node in ray.nodes()
        if node["Alive"] and node["Resources"].get("CPU")
    }
    deadline, ours = time.monotonic() + NODE_S, _installed(engines)
    for place, ref in asked.items():
        try:
            theirs = ray.get(ref, timeout=max(0.0, deadline - time.monotonic()))
        except (*_LOST, ray.exceptions.TaskUnschedulableError):
            continue  # it has left
        except ray.exceptions.GetTimeoutError:
            return Fatal(UsageError, f"Ray's node {place}: no answer within {NODE_S:.0f} s")
        except ray.exceptions.RayError as error:
            return Fatal(
                UsageError,
                f"Ray's node {place}: this package cannot be imported there "
                f"({_last_line(error)}): install internav-data {__version__} on each node",
            )
        if found := _difference(ours, theirs):
            return Fatal(UsageError, f"Ray's node {place}: {found}")
    return None


def _difference(ours: dict[str, str], theirs: dict[str, str]) -> str:
    """Return the first thing that is installed here in another version than there."""
    for name, wanted in ours.items():
        if theirs.get(name) != wanted:
            return (
                f"{name} is {theirs.get(name)} there and {wanted} here, so its scenes may differ: "
                "install the same version on each node"
            )
    return ""


def _installed(engines: Sequence[str]) -> dict[str, str]:
    """Return the versions of all that decides a scene, by name."""
    python = ".".join(platform.python_version_tuple()[:2])
    named = {f"engine {name}": MODULES[name] for name in engines}
    libraries = named | {name: name for name in _LIBRARIES}
    return {
        "internav-data": __version__,
        "the code of internav-data": source_digest()[:12],
        "Python": f"{platform.python_implementation()} {python}",
    } | {name: _version(module) for name, module in libraries.items()}


def _version(module: str) -> str:
    try:
        return version(DISTRIBUTIONS.get(module, module))
    except PackageNotFoundError:
        return "missing"


@ray.remote(num_cpus=0, max_retries=0)
def _look(engines: Sequence[str]) -> dict[str, str]:
    return _installed(engines)


@ray.remote(num_cpus=1, max_retries=0)
def _make(shared: tuple[ray.ObjectRef], task: Any) -> Result:  # noqa: ANN401 - any task
    """Make a scene in a process of a node."""
    prepared = _prepared(shared[0])
    if isinstance(prepared, Fatal):
        return prepared, {}
    work, outbox = prepared
    outbox.clear()
    return run_task(work, task), dict(outbox)


@lru_cache(maxsize=1)
def _prepared(ref: ray.ObjectRef) -> tuple[Callable[[Any], Any], dict[str, bytes]] | Fatal:
    """Set this process up for an order: its function for every task, and what that stages."""
    os.environ.update(SINGLE_THREADED)
    recipe, wanted, engines = ray.get(ref)
    if found := _difference(wanted, _installed(engines)):  # a node that came later
        return Fatal(UsageError, f"Ray's node {ray.util.get_node_ip_address()}: {found}")
    payload: ScenePayload = recipe.payload
    outbox: dict[str, bytes] = {}
    work = set_up(
        Recipe(recipe.setup, replace(payload, staging=replace(payload.staging, outbox=outbox)))
    )
    return work if isinstance(work, Fatal) else (work, outbox)


def _cores() -> int:
    return int(ray.cluster_resources().get("CPU", 0))


def _ended(what: str) -> str:
    return f"{what}: finished scenes are kept, run the same command again"


def _last_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1][:200] if lines else type(error).__name__
