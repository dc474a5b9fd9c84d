"""Scenes that cost nothing, for tests of what happens around them."""

from __future__ import annotations

import json
import os
import signal
import time
from types import SimpleNamespace

from internav_data.dataset import STAGING, stage_scene
from internav_data.records import Asset, Episode, Goal, House, Obstacle, Part, Physics, Room, Start
from internav_data.records.errors import QuarantineError
from internav_data.records.splits import split_of_scene

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
SQUARE = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
BOX = Part("box", (0.0, 0.0, 0.2), (0.4, 0.4, 0.4), UPRIGHT, (), (200, 100, 50), "paper")
ASSET = Asset("Box_0", "Box", (0.4, 0.4, 0.4), 0.3, 0.6, False, True, True, True, (BOX,))
CATALOGUE = SimpleNamespace(assets={"Box_0": ASSET}, spawnable=(ASSET,), digest="0" * 64, version=1)


def house(seed, scene):
    room = Room(0, "living", SQUARE, 16.0, 2.4, "oak", "white")
    return House(
        scene_id=f"scene-{scene:06d}",
        scene=scene,
        seed=seed,
        split=split_of_scene(scene),
        preset="paper",
        outline=SQUARE,
        rooms=(room,),
        doors=(),
        windows=(),
        walls=(),
        objects=(),
        materials=(),
        room_graph=(),
        area_m2=16.0,
        assets={},
    )


def episode(home, index):
    obstacle = Obstacle(
        "Box_0",
        "Box",
        1.0,
        1.0 + index / 64,
        0.0,
        UPRIGHT,
        0.3,
        0.6,
        False,
        True,
        0,
        0.1,
        0.0,
        None,
    )
    return Episode(
        episode_id=f"{home.scene_id}/{index:04d}",
        scene_id=home.scene_id,
        split=home.split,
        index=index,
        seed=home.seed,
        room_count=1,
        mode="blocked",
        sealed=True,
        rooms_on_path=1,
        obstacle_count=1,
        shortest_path_m=3.0,
        shortest_path_steps=12,
        obstructed_path_m=None,
        obstructed_path_steps=None,
        start=Start(1, 1, 0.25, 0.25, 90, 0),
        goal=Goal(12, 2, 3.0, 0.5, 0),
        room_paths=((0,),),
        room_paths_truncated=False,
        node_paths=(),
        node_paths_truncated=False,
        obstacles=(obstacle,),
        expert=None,
        physics=Physics("stub", "1", 0.1, 0.0),
    )


def stub(payload):
    """Make scenes as `stub.json` beside the dataset says: how long, and what fails."""
    folder = payload.store.root.parent
    path = folder / "stub.json"
    orders = json.loads(path.read_text()) if path.exists() else {}
    journal = folder / "journal"

    def make(scene):
        with journal.open("a") as file:
            file.write(f"{scene}\n")
        time.sleep(orders.get("seconds", 0.0))
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
            raise OSError(28, "No space left on device", payload.store.at(STAGING))
        home = house(payload.config.seed, scene)
        count = payload.config.episodes_of(home.split)
        stage_scene(payload.store, scene, home, [episode(home, k) for k in range(count)])
        return count

    return make
