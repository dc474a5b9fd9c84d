"""Environment steps/s on one core; JSON out.

    python benchmarks/envs.py DATASET [--image-size 64] [--num-envs 16] [--seconds 6] [--out FILE]

`navigation`: MoveAhead, rotations and looks as an agent walks (in the shares 12:3:3:1:1);
`uniform`: all actions, so that Done ends an episode soon; `uniform_no_done`: all but Done;
`uniform_again`: the same steps once more, as in a later epoch. Models and houses are loaded before
the clock starts, distance fields of new goals are not, and the result cache is cold. Targets:
3,000 navigation steps/s with 64x64 RGB-D, 1,500 under uniform actions.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from internav_data.envs import InterNavEnv, InterNavVectorEnv
from internav_data.physics.result_cache import FOLDER_VARIABLE
from internav_data.render.asset_mesh import LIBRARY
from internav_data.world.actions import ACTIONS

TARGETS = {"navigation_steps_per_s": 3000, "uniform_steps_per_s": 1500}
KINDS = {action.kind for action in ACTIONS}
SHARES = {
    "navigation": {"move": 12, "turn": 3, "look": 1},
    "uniform": dict.fromkeys(KINDS, 1),
    "uniform_no_done": dict.fromkeys(KINDS - {"done"}, 1),
}
"""Shares of the actions by kind."""


def weights(name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    shares = np.array([SHARES[name].get(action.kind, 0) for action in ACTIONS], np.float64)
    return shares / shares.sum()


def warm(env: InterNavVectorEnv) -> float:
    """Prepare every model and house once, and compile; returns milliseconds a house."""
    source = env.slots[0].source
    for asset in source.dataset.assets.values():
        LIBRARY.number(asset)
    begin = time.process_time()
    for number in source.bounds[:-1].tolist():
        episode = source.episode(number)
        house = source.loaded_house(episode)
        house.distance_field((episode.goal.i, episode.goal.j)).at(episode.start.i, episode.start.j)
    return 1e3 * (time.process_time() - begin) / (len(source.bounds) - 1)


def rate(
    env: InterNavVectorEnv, name: str, seconds: float, max_steps: float = math.inf
) -> dict[str, float]:
    """Count steps a second of processor time, `max_steps` of them, episodes begun included."""
    rng = np.random.default_rng(0)
    plan = rng.choice(len(ACTIONS), size=(4096, env.num_envs), p=weights(name))
    env.reset(seed=0)
    for row in plan[:8]:
        env.step(row)
    begin, wall, steps, ends = time.process_time(), time.perf_counter(), 0, 0
    while time.perf_counter() - wall < seconds and steps < max_steps:
        *_, terminated, truncated, _ = env.step(plan[steps // env.num_envs % len(plan)])
        steps += env.num_envs
        ends += int((terminated | truncated).sum())
    spent = time.process_time() - begin
    return {
        "steps": steps,
        "steps_per_s": round(steps / spent),
        "wall_steps_per_s": round(steps / (time.perf_counter() - wall)),
        "episodes": ends,
    }


def resets(dataset: Path, size: int, seconds: float) -> float:
    """Milliseconds of a reset among known houses."""
    env = InterNavEnv(dataset, size, house_cache_size=10_000)
    env.reset(seed=0)
    begin, count = time.process_time(), 0
    while time.process_time() - begin < seconds:
        env.reset()
        count += 1
    return round(1e3 * (time.process_time() - begin) / count, 3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--image-size", type=int, default=64)
    parser.add_argument("--num-envs", type=int, default=16)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    os.environ[FOLDER_VARIABLE] = ""  # what earlier runs have kept on disk does not count
    env = InterNavVectorEnv(
        args.num_envs, args.dataset, args.image_size, copy=False, house_cache_size=10_000
    )
    warm(env)  # compiles
    result: dict[str, Any] = {
        "targets": TARGETS,
        "image_size": args.image_size,
        "num_envs": args.num_envs,
    }
    for name in SHARES:
        result[name] = rate(env, name, args.seconds)
    max_steps = result["uniform"]["steps"]
    result["uniform_again"] = rate(env, "uniform", args.seconds, max_steps)
    result["reset_ms"] = resets(args.dataset, args.image_size, min(2.0, args.seconds))
    text = json.dumps(result, indent=2)
    if args.out:
        args.out.write_text(text + "\n", encoding="utf-8")
    sys.stdout.write(text + "\n")


if __name__ == "__main__":
    main()
