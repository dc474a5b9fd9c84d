"""Access to the solvers by the names of their engines: one of each per process."""

from __future__ import annotations

from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Final

from internav_data.core.locks import ThreadLock
from internav_data.physics.cache import Solver, SolverCounts, origin
from internav_data.physics.engines import DEFAULT_ENGINE, ENGINES
from internav_data.physics.engines.installed import require_engine
from internav_data.physics.result_cache import ResultCache, result_cache

if TYPE_CHECKING:
    from collections.abc import Iterator

    from internav_data.physics.engines.protocol import Engine

_cache_off: ContextVar[bool] = ContextVar("_cache_off", default=False)
"""Of one thread: another one may read the cache meanwhile."""
_MAKING: Final = ThreadLock()
_CACHED: Final[dict[tuple[Engine, ResultCache | None], Solver]] = {}
"""Solvers by engine and result cache: two a process, those that a fork inherits besides."""


@contextmanager
def cache_disabled() -> Iterator[None]:
    """Solve every problem of this thread anew: inside, the result cache is not used."""
    before = _cache_off.set(True)
    try:
        yield
    finally:
        _cache_off.reset(before)


def get_solver(name: str = DEFAULT_ENGINE) -> Solver:
    """Return the solver on a physics engine, which is connected at first use.

    The solver reads and fills the user's result cache, except inside `cache_disabled`.

    Raises
    ------
    UsageError
        No engine has this name.
    MissingEngineError
        The engine's library is not installed.

    """
    try:
        engine = ENGINES[name]()
    except (KeyError, ModuleNotFoundError):
        require_engine(name)
        raise
    known = None if _cache_off.get() else result_cache()
    found = _CACHED.get((engine, known))  # every push asks: no lock where there is an engine
    if found is not None:
        return found
    with _MAKING:
        return _CACHED.setdefault((engine, known), _with_cache(engine, known))


def _with_cache(engine: Engine, known: ResultCache | None) -> Solver:
    where = origin(engine)
    return Solver(engine, known if where else None, where or "")


def solver_counts() -> SolverCounts:
    """Return the counters of this process's pushes, summed over its solvers."""
    return SolverCounts.total(solver.counts for solver in list(_CACHED.values()))
