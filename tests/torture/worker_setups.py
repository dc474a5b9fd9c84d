"""Setups of workers that make plain scenes: a module of few imports, as every worker loads it."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

from fault_points import FaultPoints
from scene_stubs import plain

POINT = "INTERNAV_TORTURE_POINT"
"""Environment variable with folder, number and fault for workers, as JSON."""
_WATCHED: list[FaultPoints] = []


def recording_workers(payload):
    """Make plain scenes; the process's number goes into the file `workers` beside the dataset."""
    with (payload.staging.store.root.parent / "workers").open("a") as file:
        file.write(f"{os.getpid()}\n")
    work = plain(payload)

    def make(scene):
        time.sleep(0.01 * (scene % 3))
        return work(scene)

    return make


def with_fault_points(payload):
    """Make plain scenes in a worker whose calls are fault points, as the environment says."""
    if POINT in os.environ:
        folder, at, fault = json.loads(os.environ[POINT])
        # A worker that takes the place of a killed one is well.
        with Path(folder, "workers").open("a") as file:
            file.write("one\n")
        if len(Path(folder, "workers").read_text().split()) == 1:
            points = FaultPoints(Path(folder, "d"), at, fault)
            points.install()
            _WATCHED.append(points)
    work = plain(payload)

    def make(scene):
        count = work(scene)
        for points in _WATCHED:  # `faults.calls` reads how many there were
            with Path(points.folder).with_name("log").open("w") as file:
                json.dump(points.log, file)
        return count

    return make
