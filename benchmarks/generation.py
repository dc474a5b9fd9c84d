"""Rate, memory and size of generated datasets: JSON on stdout.

    python benchmarks/generation.py --scenes 40 --episodes-per-scene 50 --practice 240

One worker and two make the same dataset in one run, so that the ratio is fair on any machine.
Each episode is settled, labelled with outcomes and solved by an expert. Every run begins with the
same result cache: `practice` generates other scenes from a cold one, so that it holds most free
pushes and no push of the runs' own scenes. Fewer episodes a scene are slower: a house takes 20 ms
to build and more to prepare, for all its episodes. Targets: 40 episodes/s on two cores (167 later),
two workers 1.8 times one, under 1 GB a worker and constant, under 1 kB an episode.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Self

import psutil

from internav_data.generation import generate, load_config
from internav_data.physics.result_cache import FOLDER_VARIABLE

PAPER_EPISODES = 595_500
"""12,000 scenes: 11,900 with 50 episodes and 100 with 5."""
PRACTICE_SEED = 987_654


class Memory:
    """Resident memory of the workers, sampled in a thread while they work."""

    def __init__(self) -> None:
        self.samples: list[tuple[float, float]] = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _watch(self) -> None:
        began = time.monotonic()
        while not self._stop.wait(0.5):
            sizes = []
            for child in psutil.Process().children(recursive=True):
                try:
                    sizes.append(child.memory_info().rss / 1e6)
                except psutil.Error:
                    continue
            if sizes:
                self.samples.append((time.monotonic() - began, max(sizes)))

    def summary(self) -> dict[str, float]:
        """Largest worker, and how it was in the second and in the last quarter of the run."""
        sizes = [size for _, size in self.samples]
        quarter = max(1, len(sizes) // 4)
        second, last = sizes[quarter : 2 * quarter], sizes[-quarter:]
        return {
            "peak_mb": max(sizes, default=0.0),
            "second_quarter_mb": sum(second) / max(1, len(second)),
            "last_quarter_mb": sum(last) / max(1, len(last)),
        }


def workers_cpu_s() -> float:
    """Processor time of all ended child processes: other work on the machine cannot stretch it."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def timed(
    scenes: int, workers: int, overrides: list[str], known: Path | None = None
) -> dict[str, object]:
    """Make a dataset and say how long it took and how large it is.

    Parameters
    ----------
    known
        Folder with the pushes that are known at first; left as it is.
    """
    with tempfile.TemporaryDirectory(prefix="internav-bench-") as folder:
        out, cache = Path(folder) / "dataset", Path(folder) / "cache"
        if known is not None:
            shutil.copytree(known, cache)
        os.environ[FOLDER_VARIABLE] = str(cache)
        before = workers_cpu_s()
        with Memory() as memory:
            report = generate(out, load_config(None, overrides), scenes, workers)
        cpu_s = workers_cpu_s() - before
        sizes = [p.stat().st_size for p in (out / "data" / "episodes").glob("*.parquet")]
        everything = sum(p.stat().st_size for p in out.rglob("*") if p.is_file())
    return {
        "workers": workers,
        "scenes": scenes,
        "episodes": report.episodes,
        "quarantined": len(report.quarantined),
        "refused_by_the_expert": report.refused_share,
        "seconds": report.seconds,
        "episodes_per_s": report.episodes / report.seconds,
        "cpu_s": cpu_s,
        "episodes_per_cpu_s": report.episodes / cpu_s,
        "cores_kept_busy": cpu_s / report.seconds,
        "bytes_per_episode": sum(sizes) / report.episodes,
        "bytes_per_episode_with_scenes_and_assets": everything / report.episodes,
        "memory": memory.summary(),
    }


def practised(scenes: int, workers: int, overrides: list[str], folder: Path) -> dict[str, float]:
    """Make scenes of another seed with nothing known; what they leave lies in `folder`/cache."""
    cache = folder / "cache"
    cache.mkdir()
    os.environ[FOLDER_VARIABLE] = str(cache)
    config = load_config(None, [*overrides, f"seed={PRACTICE_SEED}", "episodes_per_scene=20"])
    report = generate(folder / "dataset", config, scenes, workers)
    return {
        "episodes": report.episodes,
        "episodes_per_s": report.episodes / report.seconds,
        "kept_mb": sum(p.stat().st_size for p in cache.iterdir()) / 1e6,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=40)
    parser.add_argument("--episodes-per-scene", type=int, default=50)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--practice", type=int, default=240, help="scenes x 20 made first")
    parser.add_argument("--set", action="append", default=[], help="a config value, as a.b=c")
    args = parser.parse_args()
    overrides = [*args.set, f"episodes_per_scene={args.episodes_per_scene}"]
    timed(2, 1, overrides)  # numba's cache, once
    runs = []
    with tempfile.TemporaryDirectory(prefix="internav-bench-") as folder:
        practice = practised(args.practice, max(args.workers), args.set, Path(folder))
        for workers in args.workers:
            runs.append(timed(args.scenes, workers, overrides, Path(folder) / "cache"))
            print(runs[-1], file=sys.stderr)
    rates = {run["workers"]: run["episodes_per_s"] for run in runs}
    most = max(rates)
    result = {
        "practice": practice,
        "runs": runs,
        "two_workers_to_one": rates[2] / rates[1] if {1, 2} <= rates.keys() else None,
        "hours_for_the_papers_dataset_at_this_rate": PAPER_EPISODES / rates[most] / 3600.0,
    }
    json.dump(result, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
