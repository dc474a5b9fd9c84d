"""Scenes that cost nothing, for tests of what happens around them."""

from __future__ import annotations

import json
import os
import signal
import time
from dataclasses import dataclass
from types import SimpleNamespace

import builders

from internav_data.core.messages import Fatal
from internav_data.core.worker import run_task
from internav_data.dataset import STAGING, stage_scene
from internav_data.records import Physics
from internav_data.records.errors import QuarantineError
from internav_data.records.splits import split_of_scene

ASSET = builders.crate("Box_0", (0.4, 0.4, 0.4), mass_kg=0.3, pushable=False, pickable=True)
CATALOGUE = SimpleNamespace(assets={"Box_0": ASSET}, spawnable=(ASSET,), digest="0" * 64, version=1)


def house(seed, scene):
    square = builders.rectangle(0.0, 0.0, 4.0, 4.0)
    room = builders.room(0, square, 16.0, "living")
    return builders.house([room], square, scene, seed=seed, split=split_of_scene(scene))


def episode(home, index):
    return builders.episode(
        home,
        builders.start(1, 1),
        builders.goal(12, 2),
        [builders.obstacle(ASSET, 1.0, 1.0 + index / 64)],
        index=index,
        shortest_path_m=3.0,
        node_paths=(),
        physics=Physics("stub", "1", 0.1, 0.0),
    )


def stub(payload):
    """Make scenes as `stub.json` beside the dataset says: how long, and what fails."""
    folder = payload.staging.store.root.parent
    path = folder / "stub.json"
    orders = json.loads(path.read_text()) if path.exists() else {}
    journal = folder / "journal"
    with (folder / "workers").open("a") as file:
        file.write(f"{os.getpid()}\n")
    if orders.get("outlives"):  # a worker in native code sees no signal
        signal.signal(signal.SIGTERM, signal.SIG_IGN)

    def make(scene):
        with journal.open("a") as file:
            file.write(f"{scene}\n")
        time.sleep(orders.get("seconds", 0.0))
        if scene in orders.get("linger", ()):
            (folder / f"lingers {scene}").write_text(str(os.getpid()))
            while not (folder / "go").exists():
                time.sleep(0.02)
        if scene in orders.get("kill_always", ()):
            os.kill(os.getpid(), signal.SIGKILL)
        if (
            scene in orders.get("kill_once", ())
            and journal.read_text().split().count(str(scene)) < 2
        ):
            os.kill(os.getpid(), signal.SIGKILL)
        if scene in orders.get("quarantine", ()) or orders.get("hopeless"):
            raise QuarantineError("nothing can be blocked")
        if orders.get("full") == scene:
            raise OSError(28, "No space left on device", payload.staging.store.at(STAGING))
        return staged(payload, scene)

    return make


def staged(payload, scene):
    """Stage a scene and count its episodes."""
    home = house(payload.config.seed, scene)
    count = payload.config.episodes_of(home.split)
    episodes = [episode(home, k) for k in range(count)]
    stage_scene(payload.staging, scene, home, episodes, redraws={"spot": scene % 3})
    return count


def plain(payload):
    """Make scenes in any store, without orders."""
    return lambda scene: staged(payload, scene)


@dataclass
class InProcess:
    """Runs every task in this process, the last one first: what another executor needs at least."""

    slots: int = 1
    closed: bool = False

    def run(self, recipe, tasks, tick):
        work = recipe.setup(recipe.payload)
        try:
            for task in reversed(list(tasks)):
                if not tick():
                    return
                result = run_task(work, task)
                if isinstance(result, Fatal):
                    raise result.error()
                yield result
        finally:
            self.closed = True
