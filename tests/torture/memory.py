"""Memory over very many environment steps, houses and scenes: its slope in the second half.

A case is what is repeated, and how often: "steps 1000000", "houses 2000", "scenes 400". Each runs
in an interpreter of its own, which cannot be gone on with: a case begins anew.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import psutil
from campaign import Row
from scipy import stats
from strategies import rng
from test_hostile_files import DATASET

MAX_SLOPE_KB = 10.0
"""Growth of a house or an episode in the second half, kB."""
REPORTS = 100
STEPS_AN_EPISODE = 100


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
    """Act at random: an episode every hundred steps."""
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


def measured(name: str, count: int) -> dict[str, float]:
    """Repeat work in this process; return the slope of its memory, its handles and more."""
    process, rows = psutil.Process(), []
    total = count // STEPS_AN_EPISODE if name == "steps" else count

    def report(done):
        if done % max(1, total // REPORTS) == 0:
            shared = next(
                int(line.split()[1])
                for line in Path("/proc/self/status").read_text().splitlines()
                if line.startswith("RssShmem")
            )
            memory = process.memory_info().rss / 1024
            rows.append((done, memory, process.num_fds(), shared, process.num_threads()))

    WORK[name](count, report)
    late = np.array(rows[len(rows) // 2 :], float)
    line = stats.linregress(late[:, 0], late[:, 1])
    half = float(line.stderr * stats.t.ppf(0.975, len(late) - 2))
    return {
        "slope_kb": round(float(line.slope), 3),
        "low_kb": round(float(line.slope) - half, 3),
        "high_kb": round(float(line.slope) + half, 3),
        "mb": round(late[-1, 1] / 1024, 1),
        "handles": [int(late[:, 2].min()), int(late[:, 2].max())],
        "shared_kb": [int(late[:, 3].min()), int(late[:, 3].max())],
        "threads": [int(late[:, 4].min()), int(late[:, 4].max())],
    }


def cases():
    """Yield all; shorter ones measure how caches fill."""
    yield from ("houses 2000", "steps 1000000", "scenes 400")


def run(key: str, folder: Path):
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
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["low_kb"] < MAX_SLOPE_KB, f"memory grows: {found}"
    for constant in ("handles", "shared_kb"):
        low, high = found[constant]
        assert low == high, f"{constant}: {found}"
    return {"runs": int(count), **found}


ROW = Row("memory", cases, run)

if __name__ == "__main__":
    sys.stdout.write(json.dumps(measured(sys.argv[1], int(sys.argv[2]))) + "\n")
