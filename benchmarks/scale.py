"""A dataset of a million episodes: manifest, opening, access, shuffling, validating, merging.

    python benchmarks/scale.py --base data/demo                      # in a temporary folder
    python benchmarks/scale.py --base data/demo --keep big --episodes 100000

The episodes are those of a small dataset again and again, as in `benchmarks/viewer.py`; most
shards are links to others, so the files come from memory, not from the disk. Each figure is of a
process of its own: CPU seconds, since a shared machine's wall clock says little, and the most
memory that it held.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from viewer import replicated

from internav_data.dataset import compute_stats, load_dataset, merge, read_manifest

if TYPE_CHECKING:
    from collections.abc import Callable

RANDOM_READS = 300
STREAMED = 5_000


def nothing(path: Path) -> dict[str, Any]:
    """Import the loader: what every other figure includes."""
    return {"folder": path.name}


def manifest(path: Path) -> dict[str, Any]:
    found = read_manifest(path)
    size = (path / "manifest.json").stat().st_size
    data = sum(file.bytes for file in found.files)
    return {"bytes": size, "files": len(found.files), "data_gb": round(data / 1e9, 2)}


def opening(path: Path) -> dict[str, Any]:
    return {"episodes": len(load_dataset(path))}


def random_access(path: Path) -> dict[str, Any]:
    dataset = load_dataset(path)
    numbers = np.random.default_rng(0).integers(0, len(dataset), RANDOM_READS).tolist()
    began = time.process_time()
    for number in numbers:
        dataset[number]
    return {"ms_each": round(1e3 * (time.process_time() - began) / RANDOM_READS, 2)}


def order(path: Path) -> dict[str, Any]:
    """Draw the order of an epoch and read its first episode."""
    return {"first": next(iter(load_dataset(path).iterable(seed=1))).episode_id}


def stream(path: Path) -> dict[str, Any]:
    episodes = iter(load_dataset(path).iterable(seed=1))
    next(episodes)
    began = time.process_time()
    for _ in range(STREAMED):
        next(episodes)
    return {"episodes_per_cpu_s": round(STREAMED / (time.process_time() - began))}


def columns(path: Path) -> dict[str, Any]:
    table = load_dataset(path).to_table(["room_count", "obstacle_count", "shortest_path_m"])
    return {"rows": table.num_rows}


def statistics(path: Path) -> dict[str, Any]:
    """Compute the statistics that each commit writes."""
    return {"episodes": compute_stats(path)["episodes"]}


def validate_files(path: Path) -> dict[str, Any]:
    from internav_data.verification import validate

    found = validate(path, level="files")
    # Links hold other scenes than the manifest's counts say, which the level does not look at.
    return {"rows": found.checked["rows"], "findings": sum(found.by_predicate.values())}


def merging(path: Path) -> dict[str, Any]:
    """Write all rows anew, as a merge does."""
    with tempfile.TemporaryDirectory(dir=path.parent) as out:
        return {"scenes": merge([path], Path(out) / "merged").scenes}


LARGE = (nothing, manifest, opening, random_access, order, stream, columns, statistics)
FIGURES = {each.__name__: each for each in (*LARGE, validate_files, merging)}


def measured(name: str, path: Path) -> dict[str, Any]:
    """Run a figure in a process of its own.

    Raises
    ------
    SystemExit
        It fails.

    """
    command = [sys.executable, __file__, "--figure", name, "--keep", str(path)]
    began = time.perf_counter()
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{name}: {done.stderr}")
    return json.loads(done.stdout) | {"wall_s": round(time.perf_counter() - began, 2)}


def one(figure: Callable[[Path], dict[str, Any]], path: Path) -> dict[str, Any]:
    found = figure(path)
    used = {"cpu_s": round(time.process_time(), 2)}
    # Not ru_maxrss, which begins with that of the parent.
    held = re.search(r"VmHWM:\s+(\d+)", Path("/proc/self/status").read_text())
    return found | used | {"peak_mb": round(int(held[1]) / 1e3) if held else None}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--base", type=Path, help="small dataset to replicate")
    parser.add_argument("--keep", type=Path, help="folder to write to, and to measure again")
    parser.add_argument("--episodes", type=int, default=1_000_000)
    parser.add_argument("--merged", type=int, default=36_000, help="episodes that are merged")
    parser.add_argument("--figure", choices=FIGURES, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.figure:
        print(json.dumps(one(FIGURES[asked.figure], asked.keep)))
        return
    os.environ["INTERNAV_CACHE_DIR"] = ""
    with tempfile.TemporaryDirectory() as folder:
        large, small = (asked.keep or Path(folder) / "large"), Path(folder) / "small"
        if not (large / "manifest.json").exists():
            if asked.base is None:
                parser.error("--base is needed")
            replicated(asked.base, large, asked.episodes, link=True)
        results = {each.__name__: measured(each.__name__, large) for each in LARGE}
        results["validate_files"] = measured("validate_files", large)
        if asked.base is not None:
            replicated(asked.base, small, asked.merged)
            results["merging"] = measured("merging", small)
        print(json.dumps({"episodes": read_manifest(large).counts["train"].episodes} | results))


if __name__ == "__main__":
    main()
