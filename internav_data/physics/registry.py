"""Access to the physics engines by name: connected at first use, one of each per process."""

from __future__ import annotations

from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING

from internav_data.physics.cache import CachedEngine, origin
from internav_data.physics.engines import DEFAULT_ENGINE, ENGINES
from internav_data.physics.result_cache import ResultCache, result_cache
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from internav_data.physics.scene import Engine

_cache_off = False


@contextmanager
def cache_disabled() -> Iterator[None]:
    """Solve every problem anew: inside, the result cache is neither read nor filled."""
    global _cache_off  # noqa: PLW0603 - belongs to the process, as the engines do
    before, _cache_off = _cache_off, True
    try:
        yield
    finally:
        _cache_off = before


def get_engine(name: str = DEFAULT_ENGINE) -> Engine:
    """Return a physics engine, connected at first use.

    The engine reads and fills the user's result cache, except inside `cache_disabled`.

    Raises
    ------
    UsageError
        No engine has this name.

    """
    if name not in ENGINES:
        raise UsageError(f"no physics engine is called {name!r}; known are {', '.join(ENGINES)}")
    engine = ENGINES[name]()
    return engine if _cache_off else _cached(engine, result_cache())


@lru_cache(maxsize=8)
def _cached(engine: Engine, known: ResultCache) -> Engine:
    where = origin(engine)
    return engine if where is None else CachedEngine(engine, known, where)
