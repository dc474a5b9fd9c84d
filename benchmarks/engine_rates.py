"""Rates of generation with each engine, scene by scene in turn: JSON on stdout.

    python benchmarks/engine_rates.py --scenes 40 --episodes-per-scene 10

One process makes each scene with one engine, then with the other, from an empty result cache: what
else runs on the machine slows both alike. Times are processor time. `first` and `later` are the two
halves of the scenes: from cold, and with what the first half left in the cache. The error of a
ratio is that of the mean over scenes. With `--known` the scenes are made once before, and what was
solved with several objects is forgotten: all problems of one object are known, as they nearly are
after hundreds of scenes.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

ENGINES = ("bullet", "mujoco")
SOLVERS = ("solve_push", "solve_settle")


class Clock:
    """Processor time and number of calls, by what is timed."""

    def __init__(self) -> None:
        self.seconds: Counter[str] = Counter()
        self.calls: Counter[str] = Counter()

    def timed(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function, its calls timed under a name and that of the engine."""

        def call(engine: Any, *arguments: Any) -> Any:  # noqa: ANN401 - a solver's, whatever it is
            began = time.process_time()
            result = function(engine, *arguments)
            self.seconds[f"{engine.name} {name}"] += time.process_time() - began
            self.calls[f"{engine.name} {name}"] += 1
            return result

        return call


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=40)
    parser.add_argument("--episodes-per-scene", type=int, default=10)
    parser.add_argument("--seed", type=int, default=101)
    parser.add_argument("--set", action="append", default=[], help="a config value, as a.b=c")
    parser.add_argument("--known", action="store_true", help="problems of one object are known")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="internav-rates-") as folder:
        os.environ["INTERNAV_CACHE_DIR"] = folder
        result = measured(args)
    text = json.dumps(result, indent=1)
    if args.out:
        args.out.write_text(text + "\n", encoding="utf-8")
    sys.stdout.write(text + "\n")


def measured(args: argparse.Namespace) -> dict[str, Any]:
    """Make the scenes; return the figures of each half."""
    from internav_data.catalog import catalogue
    from internav_data.generation import load_config
    from internav_data.generation.scenes import build_scene
    from internav_data.physics import cache, get_solver

    configs = {
        engine: load_config(None, [*args.set, f"seed={args.seed}", f"physics.engine={engine}"])
        for engine in ENGINES
    }
    for config in configs.values():  # numba's code and the engines are loaded once
        build_scene(args.scenes, config, catalogue(), 1)
    for scene in range(args.scenes) if args.known else ():
        for config in configs.values():
            build_scene(scene, config, catalogue(), args.episodes_per_scene)
    for engine in ENGINES:
        get_solver(engine).forget(lone=False)
    clock, rows = Clock(), []
    for name in SOLVERS:
        setattr(cache, name, clock.timed(name, getattr(cache, name)))
    for scene in range(args.scenes):
        # Who goes first takes turns: the second finds the processor's caches warm.
        for engine in ENGINES if scene % 2 else ENGINES[::-1]:
            before, calls = Counter(clock.seconds), Counter(clock.calls)
            began = time.process_time()
            made = build_scene(scene, configs[engine], catalogue(), args.episodes_per_scene)
            used = time.process_time() - began
            row = {"engine": engine, "scene": scene, "seconds": used, "made": len(made.episodes)}
            for name in SOLVERS:
                key = f"{engine} {name}"
                row[f"{name}_s"] = clock.seconds[key] - before[key]
                row[f"{name}_calls"] = clock.calls[key] - calls[key]
            rows.append(row)
    half = args.scenes // 2
    return {
        "scenes": args.scenes,
        "first": summary([row for row in rows if row["scene"] < half]),
        "later": summary([row for row in rows if row["scene"] >= half]),
        "all": summary(rows),
    }


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return rates and where the time goes, by engine, and MuJoCo's rate by Bullet's."""
    found: dict[str, Any] = {}
    for engine in ENGINES:
        own = [row for row in rows if row["engine"] == engine]
        total, made = (sum(row[name] for row in own) for name in ("seconds", "made"))
        found[engine] = {
            "episodes": made,
            "episodes_per_cpu_s": round(made / total, 2),
            "ms_per_episode": round(1e3 * total / made, 2),
            **{
                f"{name}_ms_per_episode": round(1e3 * sum(r[f"{name}_s"] for r in own) / made, 2)
                for name in SOLVERS
            },
            **{
                f"{name}_per_episode": round(sum(r[f"{name}_calls"] for r in own) / made, 2)
                for name in SOLVERS
            },
        }
    times = [[r["seconds"] / r["made"] for r in rows if r["engine"] == name] for name in ENGINES]
    differences = np.subtract(times[0], times[1])
    mean = float(np.mean(times[1]))
    found["mujoco_rate_by_bullets"] = round(float(np.mean(times[0])) / mean, 3)
    found["error"] = round(float(np.std(differences, ddof=1)) / len(differences) ** 0.5 / mean, 3)
    return found


if __name__ == "__main__":
    main()
