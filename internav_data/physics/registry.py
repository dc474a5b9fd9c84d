"""Physics engines by name, connected at first use, one of each a process."""

from __future__ import annotations

from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING

from internav_data.physics.cache import CachedEngine, origin
from internav_data.physics.result_cache import ResultCache, solutions

if TYPE_CHECKING:
    from collections.abc import Iterator

    from internav_data.physics.scene import Engine

_asked_anew = False


@contextmanager
def cache_disabled() -> Iterator[None]:
    """Ask the engine itself for everything: what other processes left on disk is not believed."""
    global _asked_anew  # noqa: PLW0603 - belongs to the process, as the engine does
    before, _asked_anew = _asked_anew, True
    try:
        yield
    finally:
        _asked_anew = before


def engine_of_this_process() -> Engine:
    """Return the physics engine, connected at first use."""
    from internav_data.physics.engines.bullet import bullet  # noqa: PLC0415 - pybullet is imported when used

    engine = bullet()
    return engine if _asked_anew else _remembering(engine, solutions())


@lru_cache(maxsize=1)
def _remembering(engine: Engine, known: ResultCache) -> Engine:
    where = origin(engine.build)
    return engine if where is None else CachedEngine(engine, known, where)
