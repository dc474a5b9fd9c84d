"""Memory of a worker that makes scene after scene: one line of JSON a scene, to a file or stdout.

    python benchmarks/worker_memory.py [--scenes 40] [--episodes-per-scene 50] [--out FILE]

A row has resident memory, the bytes that the known solutions of physics take by their own count,
and the entries of each cache. The last line gives, for each cache, its hits, what an entry takes on
average and so what a full one would take. The user's result cache is read and filled; with
INTERNAV_CACHE_DIR set to an empty folder, the worker begins cold.
"""

from __future__ import annotations

import argparse
import functools
import gc
import json
import sys
import time
from importlib import import_module
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np
import psutil

from internav_data.catalog import catalogue
from internav_data.generation import GenerationConfig
from internav_data.generation.scenes import build_scene
from internav_data.physics import get_solver

if TYPE_CHECKING:
    from collections.abc import Iterator

MODULES = (
    "episodes.spawn",
    "geometry.solids",
    "physics.cache",
    "physics.narrow_phase",
    "physics.sweep",
    "planner.problem",
    "world.drop",
    "world.occlusion",
)
"""Modules of the generator that cache results of their functions."""
ATOMS = (str, bytes, int, float, bool, type(None), type)


def caches() -> Iterator[tuple[str, Any]]:
    """Yield the bounded caches of functions by module and name."""
    for module in MODULES:
        home = import_module(f"internav_data.{module}")
        for name, found in vars(home).items():
            cached = isinstance(found, functools._lru_cache_wrapper)
            if cached and found.__module__ == home.__name__:
                yield f"{module}.{name}", found


def size(thing: object, seen: set[int]) -> int:
    """Return the bytes of an object and of all that it holds and `seen` has not, which it joins."""
    if id(thing) in seen:
        return 0
    seen.add(id(thing))
    total = sys.getsizeof(thing)
    if isinstance(thing, np.ndarray):
        return total + (0 if thing.base is None else size(thing.base, seen))
    if isinstance(thing, ATOMS):
        return total
    inside = (one for one in gc.get_referents(thing) if not isinstance(one, type))
    return total + sum(size(one, seen) for one in inside)


def filled(shared: set[int]) -> dict[str, dict[str, float]]:
    """Return what each cache holds and what it would take when full, MB."""
    out = {}
    for name, cache in caches():
        known, seen = cache.cache_info(), set(shared)
        # Of a cache the collector tells keys and values, its function and its attributes.
        held = [o for o in gc.get_referents(cache) if not callable(o) and not isinstance(o, dict)]
        each = sum(size(o, seen) for o in held) / max(1, known.currsize)
        out[name] = {
            "entries": known.currsize,
            "max_entries": known.maxsize,
            "hits": known.hits,
            "misses": known.misses,
            "bytes_each": round(each),
            "mb_when_full": round(each * known.maxsize / 1e6, 1),
        }
    return out


def campaign(scenes: int, episodes: int, out: TextIO) -> None:
    assets = catalogue()
    config, me, begin = GenerationConfig(), psutil.Process(), time.process_time()
    shared: set[int] = set()
    size(assets, shared)
    gc.freeze()  # as in a worker
    for scene in range(scenes):
        build_scene(scene, config, assets, episodes)
        row = {
            "scene": scene,
            "cpu_s": round(time.process_time() - begin, 1),
            "mb": round(me.memory_info().rss / 1e6, 1),
            "solutions_mb": round(get_solver().bytes_in_memory / 1e6, 1),
            **{name: cache.cache_info().currsize for name, cache in caches()},
        }
        out.write(json.dumps(row) + "\n")
        out.flush()
    out.write(json.dumps({"caches": filled(shared)}) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=40)
    parser.add_argument("--episodes-per-scene", type=int, default=50)
    parser.add_argument("--out", type=argparse.FileType("w"), default=sys.stdout)
    args = parser.parse_args()
    campaign(args.scenes, args.episodes_per_scene, args.out)


if __name__ == "__main__":
    main()
