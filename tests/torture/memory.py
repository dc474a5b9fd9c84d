"""Memory over very many environment steps, houses and scenes: its slope in the second half.

A case is what is repeated, and how often: "steps 1000000" (in episodes of 100 steps), "houses
2000", "scenes 2400". Each runs in an interpreter of its own, which cannot be gone on with: a case
begins anew. Bounded caches fill in the first half. Of scenes, the last to do so are a solver's two
of pushes, 32 MiB each (`physics/cache.py`): that of several objects is full after 800 scenes, that
of one object after 1,150. Shorter ones measure how they fill:
`python tests/torture/memory.py scenes 400`.
"""

from __future__ import annotations

import ctypes
import gc
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import psutil
from campaign import Row
from scipy import stats
from strategies import rng
from test_hostile_files import DATASET

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

MAX_SLOPE_KB = 10.0
"""Largest growth of a house, a scene or an episode of 100 steps in the second half, kB: bound of
the upper end of its 95 % interval."""
REPORTS = 100
STEPS_AN_EPISODE = 100
CONSTANT = ("handles", "shared_kb", "threads")
"""Figures that do not change in the second half."""


def houses(count, report):
    """Build houses."""
    from internav_data.catalog import catalogue
    from internav_data.houses import HouseConfig, build_house

    config, assets = HouseConfig(), catalogue()
    for scene in range(count):
        build_house(0, scene, config, assets)
        report(scene + 1)


def scenes(count, report):
    """Build houses with two episodes each."""
    from internav_data.catalog import catalogue
    from internav_data.generation import load_config
    from internav_data.generation.scenes import build_scene
    from internav_data.records.errors import QuarantineError

    config, assets = load_config(overrides=["episodes_per_scene=2"]), catalogue()
    for scene in range(count):
        try:
            build_scene(scene, config, assets)
        except QuarantineError:
            continue
        report(scene + 1)


def steps(count, report):
    """Act at random in episodes of 100 steps; reports after each."""
    from internav_data.envs import InterNavEnv

    env, random = InterNavEnv(DATASET, 16, max_steps=10**9), rng(0)
    shares = np.array([8, 2, 2, 0.5, 0.5, 0.4, 0.4, 0.4, 0.4, 1, 1, 0])
    for episode in range(count // STEPS_AN_EPISODE):
        env.reset(seed=0 if episode == 0 else None)
        actions = random.choice(len(shares), size=STEPS_AN_EPISODE, p=shares / shares.sum())
        for action in actions.tolist():
            env.step(action)
        report(episode + 1)


WORK = {"houses": houses, "scenes": scenes, "steps": steps}


def held() -> tuple[float, float, float, float]:
    """Return the memory (kB), file handles, shared memory (kB) and threads of this process.

    What is garbage or was freed is given back first: how much of it an allocator keeps goes up and
    down by more than a leak in a thousand scenes.
    """
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    process = psutil.Process()
    status = Path("/proc/self/status").read_text().splitlines()
    shared = next(int(line.split()[1]) for line in status if line.startswith("RssShmem"))
    memory = process.memory_info().rss / 1024
    return memory, process.num_fds(), shared, process.num_threads()


def measured(name: str, count: int) -> dict[str, Any]:
    """Repeat work in this process; return the slope of its memory, its handles and more."""
    rows: list[tuple[float, ...]] = []
    total = count // STEPS_AN_EPISODE if name == "steps" else count

    def report(done):
        if done % max(1, total // REPORTS) == 0:
            rows.append((done, *held()))

    WORK[name](count, report)
    return figures(rows)


def figures(rows: Sequence[Sequence[float]]) -> dict[str, Any]:
    """Return the slope of memory in the second half with its 95 % interval, and other figures.

    A row is how often work was done by then, followed by `held()`.
    """
    late = np.array(rows[len(rows) // 2 :], float)
    done, memory = late[:, 0] - late[:, 0].mean(), late[:, 1] - late[:, 1].mean()
    slope = done @ memory / (done @ done)  # by hand: scipy has no interval where memory is constant
    variance = np.sum((memory - slope * done) ** 2) / (len(late) - 2)
    width = np.sqrt(variance / (done @ done)) * stats.t.ppf(0.975, len(late) - 2)
    ranges = {
        name: [int(column.min()), int(column.max())]
        for name, column in zip(CONSTANT, late[:, 2:].T, strict=True)
    }
    return {
        "slope_kb": round(float(slope), 3),
        "low_kb": round(float(slope - width), 3),
        "high_kb": round(float(slope + width), 3),
        "mb": round(float(late[-1, 1]) / 1024, 1),
        **ranges,
    }


def check(figure: Mapping[str, Any]) -> None:
    """Check that memory is flat in the second half, and other figures constant."""
    interval = f"{figure['slope_kb']} kB [{figure['low_kb']}, {figure['high_kb']}]"
    assert figure["high_kb"] < MAX_SLOPE_KB, f"memory grows: {interval} of {figure['mb']} MB"
    for name in CONSTANT:
        low, high = figure[name]
        assert low == high, f"{name} from {low} to {high}"


def cases() -> Iterator[str]:
    """Yield all cases."""
    yield from ("houses 2000", "steps 1000000", "scenes 2400")


def run(key: str, folder: Path) -> Mapping[str, Any]:
    """Measure in an interpreter of its own."""
    name, count = key.split()
    env = os.environ | {"INTERNAV_CACHE_DIR": str(folder)}
    done = subprocess.run(
        [sys.executable, __file__, name, count],
        env=env,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-1500:]
    figure = json.loads(done.stdout.splitlines()[-1])
    check(figure)
    return {"runs": int(count), **figure}


ROW = Row("memory", cases, run)

if __name__ == "__main__":
    sys.stdout.write(json.dumps(measured(sys.argv[1], int(sys.argv[2]))) + "\n")
