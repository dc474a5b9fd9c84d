"""Physics engines by name, connected at first use, one of each a process."""

from __future__ import annotations

from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING

from internav_data.physics.cache import CachedEngine, origin
from internav_data.physics.result_cache import ResultCache, result_cache

if TYPE_CHECKING:
    from collections.abc import Iterator

    from internav_data.physics.scene import Engine

_cache_off = False


@contextmanager
def cache_disabled() -> Iterator[None]:
    """Ask the engine itself for everything: what other processes left on disk is not believed."""
    global _cache_off  # noqa: PLW0603 - belongs to the process, as the engine does
    before, _cache_off = _cache_off, True
    try:
        yield
    finally:
        _cache_off = before


def engine_of_this_process() -> Engine:
    """Return the physics engine, connected at first use."""
    from internav_data.physics.engines.bullet import bullet  # noqa: PLC0415 - pybullet is imported when used

    engine = bullet()
    return engine if _cache_off else _cached(engine, result_cache())


@lru_cache(maxsize=1)
def _cached(engine: Engine, known: ResultCache) -> Engine:
    where = origin(engine.build)
    return engine if where is None else CachedEngine(engine, known, where)
