"""Rates of reading a dataset: JSON on stdout.

    python benchmarks/loader.py                 # a synthetic dataset, generated first
    python benchmarks/loader.py --dataset DIR   # your own

Targets: a million episodes/s scanning columns, 5,000 records/s as dataclasses, a random record in
5 ms cold and 0.5 ms from a cached row group, under 800 bytes an episode on disk.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow.parquet as pq
from synthetic import write_synthetic

from internav_data.dataset import load_dataset, locate

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.dataset import Dataset

_SCAN = ("room_count", "mode", "shortest_path_m", "obstacle_count")
_TARGETS = {
    "scan_episodes_per_s": 1_000_000,
    "records_per_s": 5_000,
    "stream_records_per_s": 5_000,
    "random_cold_ms": 5.0,
    "random_cached_ms": 0.5,
    "bytes_per_episode": 800,
}


def seconds(work: Callable[[], Any], repeats: int = 3) -> float:
    """Return the median time of a few calls."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def drain(items: Any) -> None:  # noqa: ANN401 - anything to iterate over
    for _ in items:
        pass


def bytes_by_column(ds: Dataset[Any]) -> dict[str, float]:
    """Return compressed bytes an episode by leaf column, largest first."""
    total: Counter[str] = Counter()
    for file in ds.manifest.of("episodes"):
        metadata = pq.ParquetFile(locate(ds.path, file)).metadata
        total["(footer)"] += metadata.serialized_size
        for group in range(metadata.num_row_groups):
            for k in range(metadata.num_columns):
                column = metadata.row_group(group).column(k)
                total[column.path_in_schema] += column.total_compressed_size
    return {name: round(size / len(ds), 2) for name, size in total.most_common(20)}


def measure(ds: Dataset[Any], records: int) -> dict[str, Any]:
    """Return every figure of one dataset."""
    rng = np.random.default_rng(0)
    rows = rng.integers(0, len(ds), 60).tolist()
    ds[0]  # opens the first file

    def cold(row: int) -> None:
        ds.row_group_cache.clear()
        _ = ds[row]

    for row in rows:
        ds[row]  # files stay open: what is cold is the row group
    part = range(min(records, len(ds)))
    stream = ds.iterable(seed=0)
    files = {table: ds.manifest.of(table) for table in ("episodes", "scenes")}
    return {
        "episodes": len(ds),
        "scan_episodes_per_s": len(ds) / seconds(lambda: ds.to_table(_SCAN)),
        "records_per_s": len(part) / seconds(lambda: drain(ds[: len(part)]), 1),
        "iteration_records_per_s": len(ds) / seconds(lambda: drain(ds), 1),
        "stream_records_per_s": len(stream) / seconds(lambda: drain(stream), 1),
        "random_cold_ms": 1e3 * statistics.median(seconds(lambda r=r: cold(r), 1) for r in rows),
        "random_cached_ms": 1e3 * seconds(lambda: ds[rows[0]], 200),
        "scene_ms": 1e3
        * statistics.median(seconds(lambda s=s: ds.scene(s), 1) for s in ds.scene_ids[:50]),
        "open_ms": 1e3 * seconds(lambda: load_dataset(ds.path)),
        "bytes_per_episode": sum(f.bytes for f in files["episodes"]) / len(ds),
        "bytes_per_scene": sum(f.bytes for f in files["scenes"])
        / sum(f.rows for f in files["scenes"]),
        "bytes_by_column": bytes_by_column(ds),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dataset", type=Path)
    parser.add_argument("--scenes", type=int, default=480)
    parser.add_argument("--episodes", type=int, default=50)
    parser.add_argument("--records", type=int, default=5_000)
    parser.add_argument("--full", action="store_true", help="with outcomes and an expert")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = asked.dataset or Path(folder) / "dataset"
        if asked.dataset is None:
            write_synthetic(path, asked.scenes, asked.episodes, full=asked.full)
        figures = measure(load_dataset(path), asked.records)
    print(json.dumps(figures | {"targets": _TARGETS}, indent=1))


if __name__ == "__main__":
    main()
