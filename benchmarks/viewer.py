"""The page of a dataset at a million episodes: first picture, filters, memory of the server.

    python benchmarks/viewer.py --base data/demo                 # a million, in a temporary folder
    python benchmarks/viewer.py --base data/demo --keep big --episodes 100000

The episodes are those of a small dataset (`internav-gen generate --scenes 120`) over and over, each
with an id of its own. Targets: first picture under 2 s from the start of the process, a filter
under 1 s, server under 500 MB.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import psutil
import pyarrow as pa
import pyarrow.compute as pc

from internav_data.core.storage import store_of
from internav_data.dataset.manifest import (
    Counts,
    DataFile,
    MetadataFile,
    read_manifest,
    write_manifest,
)
from internav_data.dataset.parquet import file_info, parquet_bytes
from internav_data.dataset.snapshot import read_shard
from internav_data.dataset.tables import EPISODES, SCENES

if TYPE_CHECKING:
    from internav_data.dataset import Manifest
    from internav_data.dataset.tables import TableSpec

EPISODES_PER_SCENE = 50
SCENES_PER_SHARD = {"episodes": 240, "scenes": 2400}
DISTINCT = 4
"""Shards of episodes that are written; the others are these again: a reader does the same work."""
FILTERS = (
    "mode=blocked",
    "rooms=3,4,5&sealed=yes",
    "types=Chair",
    "types=Chair,Box,SideTable&mode=lengthened&distance=4-9",
    "obstacles=3-6&order=longest",
    "split=train&order=obstacles&offset=500000",
)
TARGETS = {"first_picture_s": 2.0, "filter_s": 1.0, "memory_mb": 500}


class _Replica:
    """Writer of a dataset whose scenes are those of a small one again and again."""

    def __init__(self, base: Path, out: Path, *, link: bool) -> None:
        self._out, self._store = out, store_of(base)
        self._copy = os.link if link else shutil.copyfile
        self._manifest = read_manifest(self._store)
        self._tables = {
            spec.name: pa.concat_tables(
                [read_shard(self._store, f, spec) for f in self._manifest.of(spec.name, "train")]
            ).combine_chunks()
            for spec in (EPISODES, SCENES)
        }
        ids = self._tables["episodes"]["scene_id"].to_numpy(zero_copy_only=False)
        self._rows = [np.flatnonzero(ids == name) for name in dict.fromkeys(ids.tolist())]
        self._files: list[DataFile] = []

    def write(self, episodes: int) -> Manifest:
        scenes = episodes // EPISODES_PER_SCENE
        for spec, per in ((EPISODES, EPISODES_PER_SCENE), (SCENES, 1)):
            size = SCENES_PER_SHARD[spec.name]
            for number, first in enumerate(range(0, scenes, size)):
                stop = min(first + size, scenes)
                if spec is EPISODES and number >= DISTINCT and stop - first == size:
                    self._again(number)
                else:
                    self._shard(spec, number, range(first, stop), per)
        (assets,) = self._manifest.of("assets")
        (self._out / assets.path).parent.mkdir(parents=True, exist_ok=True)
        (self._out / assets.path).write_bytes(self._store.read(assets.path))
        stats = self._store.read("stats.json")
        (self._out / "stats.json").write_bytes(stats)
        counts = {name: Counts(0, 0) for name in self._manifest.counts}
        digest = hashlib.sha256(stats).hexdigest()
        return write_manifest(
            self._out,
            dataclasses.replace(
                self._manifest,
                scenes=scenes,
                counts=counts | {"train": Counts(scenes, episodes)},
                files=(*self._files, assets),
                quarantined=(),
                metadata=(MetadataFile("stats.json", len(stats), digest),),
            ),
        )

    def _again(self, number: int) -> None:
        """Add a shard's bytes under another number: its scenes are those of the other."""
        other = self._files[number % DISTINCT]
        path = re.sub(r"-\d{5}-", f"-{number:05d}-", other.path)
        self._copy(self._out / other.path, self._out / path)
        self._files.append(dataclasses.replace(other, path=path))

    def _shard(self, spec: TableSpec[Any], number: int, scenes: range, per: int) -> None:
        names = np.repeat([f"scene-{scene:06d}" for scene in scenes], per)
        if spec is EPISODES:
            rows = np.concatenate([np.resize(self._rows[k % len(self._rows)], per) for k in scenes])
            index = np.tile(np.arange(per), len(scenes))
            ids = [
                f"{name}/{k:04d}" for name, k in zip(names.tolist(), index.tolist(), strict=True)
            ]
            new = {"scene_id": names, "index": index, "episode_id": ids}
        else:
            rows = np.array([k % len(self._rows) for k in scenes])
            new = {"scene_id": names, "scene": np.array(scenes)}
        table = self._tables[spec.name].take(pa.array(rows))
        for name, values in new.items():
            field = table.schema.field(name)
            place = table.schema.get_field_index(name)
            table = table.set_column(place, field, pc.cast(pa.array(values), field.type))
        data = parquet_bytes(table, spec)
        path = f"data/{spec.name}/train-{number:05d}-{hashlib.sha256(data).hexdigest()[:8]}.parquet"
        (self._out / path).parent.mkdir(parents=True, exist_ok=True)
        (self._out / path).write_bytes(data)
        info = dataclasses.asdict(file_info(path, data, table))
        self._files.append(DataFile(table=spec.name, split="train", **info))


def replicated(base: Path, out: Path, episodes: int, *, link: bool = False) -> Manifest:
    """Write a dataset of many episodes, those of a small one again and again.

    With `link`, files of the same bytes are links to one, which saves the disk.
    """
    return _Replica(base, out, link=link).write(episodes)


_WITHOUT_PANDAS = """
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "pandas":
            raise ModuleNotFoundError(name=name)
sys.meta_path.insert(0, Absent())
from internav_cli.main import main
main()
"""
"""`internav-gen` as `internav-data[generate]` installs it: pyarrow imports pandas where it is."""


class _Server:
    """Server of a dataset in a process of its own."""

    def __init__(self, dataset: Path) -> None:
        self.began = time.perf_counter()
        command = [sys.executable, "-c", _WITHOUT_PANDAS, "view", str(dataset)]
        command += ["--port", "0", "--no-browser"]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        assert self.process.stderr is not None
        for line in self.process.stderr:
            if found := re.search(r"http://[\d.]+:\d+/", line):
                self.url = found[0].rstrip("/")
                return
        raise SystemExit("the server did not start")

    def get(self, path: str) -> bytes:
        with urllib.request.urlopen(self.url + path, timeout=600) as response:  # noqa: S310
            content: bytes = response.read()
            return content

    def json(self, path: str) -> Any:  # noqa: ANN401 - JSON
        return json.loads(self.get(path))

    def seconds(self, path: str) -> float:
        began = time.perf_counter()
        self.get(path)
        return time.perf_counter() - began

    def cpu_s(self) -> float:
        times = psutil.Process(self.process.pid).cpu_times()
        return times.user + times.system

    def memory_mb(self) -> float:
        return psutil.Process(self.process.pid).memory_info().rss / 1e6


def measure(dataset: Path) -> dict[str, Any]:
    """Return every figure of one dataset."""
    server = _Server(dataset)
    try:
        server.get("/")
        server.get("/api/dataset")
        first = server.json("/api/episodes")["episodes"]
        server.get(_episode(first[0]) + "/thumbnail")
        picture_s, picture_cpu_s = time.perf_counter() - server.began, server.cpu_s()
        server.get("/api/episodes?mode=blocked")
        columns_s = time.perf_counter() - server.began
        start_mb = server.memory_mb()
        times = [server.seconds(f"/api/episodes?{query}") for query in FILTERS for _ in range(3)]
        rng = np.random.default_rng(0)
        total = server.json("/api/episodes?limit=1")["total"]
        pages = []
        for place in rng.integers(0, total - 24, 12).tolist():
            began = time.perf_counter()
            page = server.json(f"/api/episodes?offset={place}")["episodes"]
            for episode in page:
                server.get(_episode(episode) + "/thumbnail")
            pages.append(time.perf_counter() - began)
            base = _episode(page[0])
            for name in ("", "/floor", "/play", "/play/0", "/play/3", "/neighbours"):
                server.get(base + name)
            server.get(base.replace("/api", "/view3d"))
        server.get("/api/statistics")
        return {
            "episodes": total,
            "first_picture_s": round(picture_s, 2),
            "first_picture_cpu_s": round(picture_cpu_s, 2),
            "columns_read_s": round(columns_s, 2),
            "filter_s": round(max(times), 3),
            "filter_median_s": round(statistics.median(times), 3),
            "page_of_24_pictures_s": round(statistics.median(pages), 2),
            "memory_after_columns_mb": round(start_mb),
            "memory_mb": round(server.memory_mb()),
            "targets": TARGETS,
        }
    finally:
        server.process.terminate()
        server.process.wait()


def _episode(row: dict[str, Any]) -> str:
    return f"/api/episode/{row['scene_id']}/{row['index']}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--base", type=Path, help="small dataset to replicate")
    parser.add_argument("--dataset", type=Path, help="measure this one as it is")
    parser.add_argument("--keep", type=Path, help="folder to write to, and to measure again")
    parser.add_argument("--episodes", type=int, default=1_000_000)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = asked.dataset or asked.keep or Path(folder) / "dataset"
        if asked.dataset is None and not (path / "manifest.json").exists():
            if asked.base is None:
                parser.error("--base or --dataset is needed")
            replicated(asked.base, path, asked.episodes)
        print(json.dumps(measure(path), indent=1))


if __name__ == "__main__":
    main()
