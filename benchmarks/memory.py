"""Growth of memory with episodes and steps, pushes among them. JSON out.

    python benchmarks/memory.py DATASET [--resets 10000] [--steps 1000000] [--out FILE]

One environment of 16x16 pixels, all actions but Done in a walker's shares. Caches fill up
first: `grown_mib` is the growth in the second half. Target: 64 MiB at most, whatever the counts.
`--clear` empties the caches of geometry and visibility at the end and prints their sizes.
"""

from __future__ import annotations

import argparse
import gc
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from internav_data.envs import InterNavEnv
from internav_data.physics.narrow_phase import prisms_of
from internav_data.physics.sweep import centred_corners
from internav_data.planner.problem import _blocked_indices
from internav_data.world.drop import _standing
from internav_data.world.occlusion import occlusion_shape, placed_occlusion_shape

TARGET_MIB = 64.0
SHARES = np.array([8, 2, 2, 0.5, 0.5, 0.4, 0.4, 0.4, 0.4, 1, 1, 0], np.float64)
REPORTS = 20
CACHES = {
    "shells of assets": occlusion_shape,
    "shells in place": placed_occlusion_shape,
    "outlines in place": prisms_of,
    "footprints to drop": _standing,
    "corners": centred_corners,
    "marks": _blocked_indices,
}


def resident() -> float:
    """Resident memory of this process, MiB."""
    return float(psutil.Process().memory_info().rss) / 2**20


def campaign(dataset: Path, resets: int, steps: int) -> list[dict[str, float]]:
    """Play, and tell memory at even distances."""
    env = InterNavEnv(dataset, 16, max_steps=10**9)
    rng = np.random.default_rng(0)
    each, rows = max(1, steps // resets), []
    for k in range(resets):
        env.reset(seed=0 if k == 0 else None)
        for action in rng.choice(len(SHARES), size=each, p=SHARES / SHARES.sum()).tolist():
            env.step(action)
        if (k + 1) % max(1, resets // REPORTS) == 0:
            row = {"resets": k + 1, "steps": (k + 1) * each, "mib": round(resident(), 1)}
            sys.stderr.write(json.dumps(row) + "\n")
            rows.append(row)
    return rows


def held() -> dict[str, dict[str, float]]:
    """Empty the caches one by one: entries, hits, and what memory came back."""
    out = {}
    for name, cache in CACHES.items():
        known, before = cache.cache_info(), resident()
        cache.cache_clear()
        gc.collect()
        out[name] = {
            "entries": known.currsize,
            "most": known.maxsize or 0,
            "hits": known.hits,
            "misses": known.misses,
            "freed_mib": round(before - resident(), 1),
        }
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--resets", type=int, default=10_000)
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--clear", action="store_true", help="tell what caches held")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    begin, start = time.process_time(), resident()
    rows = campaign(args.dataset, args.resets, args.steps)
    middle = rows[len(rows) // 2]["mib"]
    result: dict[str, Any] = {
        "target_mib": TARGET_MIB,
        "start_mib": round(start, 1),
        "middle_mib": middle,
        "end_mib": rows[-1]["mib"],
        "grown_mib": round(rows[-1]["mib"] - middle, 1),
        "steps_per_cpu_s": round(args.steps / (time.process_time() - begin)),
        "rows": rows,
    }
    if args.clear:
        result["caches"] = held()
    text = json.dumps(result, indent=1)
    if args.out:
        args.out.write_text(text + "\n", encoding="utf-8")
    sys.stdout.write(text + "\n")


if __name__ == "__main__":
    main()
