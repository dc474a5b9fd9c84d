"""A house written by hand, so that rooms' tests need no generator."""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from typing import TYPE_CHECKING

import builders
import engines  # noqa: F401 - chooses the default one
import pytest
from hypothesis import HealthCheck, settings

from internav_data.records import OUTSIDE, Door, NodePath, Window

if TYPE_CHECKING:
    from internav_data.records import Episode, House, Wall

# How long an example takes says how busy the machine is, and whether numba is compiling.
settings.register_profile(
    "any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")

# A background job of a plain shell ignores Ctrl-C, one under nohup a hang-up, and so would all of
# its children: tests of signals send both.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)

# Commands that tests start in folders of their own import the same code as the tests.
if os.environ.get("PYTHONPATH"):
    places = os.environ["PYTHONPATH"].split(os.pathsep)
    os.environ["PYTHONPATH"] = os.pathsep.join(os.path.realpath(place) for place in places)

# Tests ask the engine itself: an answer from disk would be right even if the engine no longer were.
os.environ["INTERNAV_CACHE_DIR"] = ""


def walls() -> tuple[Wall, ...]:
    """Outer walls of 9 x 4 m, one wall at x = 5 with a door of 1 m at y = 2, a window's breast."""
    half, wall = builders.WALL_HALF_M, builders.wall
    return (
        wall(-half, -half, 9 + half, half),
        wall(-half, half, half, 4 - half),
        wall(9 - half, half, 9 + half, 4 - half),
        wall(-half, 4 - half, 1.5, 4 + half),
        wall(2.9, 4 - half, 9 + half, 4 + half),
        wall(1.5, 4 - half, 2.9, 4 + half, 0.0, 0.9),
        wall(1.5, 4 - half, 2.9, 4 + half, 2.1),
        wall(5 - half, half, 5 + half, 1.5),
        wall(5 - half, 2.5, 5 + half, 4 - half),
        builders.lintel(5 - half, 1.5, 5 + half, 2.5),
    )


@pytest.fixture(scope="session")
def hand_house() -> House:
    """Two rooms, 5 x 4 and 4 x 4 m, joined by one door; a table with chairs, a bed, a rug."""
    rooms = (
        builders.room(0, builders.rectangle(0.0, 0.0, 5.0, 4.0), 20.0),
        replace(
            builders.room(1, builders.rectangle(5.0, 0.0, 9.0, 4.0), 16.0, "bedroom"),
            floor_material="wool",
        ),
    )
    return builders.house(
        rooms,
        builders.rectangle(0.0, 0.0, 9.0, 4.0),
        scene=3,
        doors=(
            builders.door(0, (0, 1), 5.0, 2.0),
            Door(1, (OUTSIDE, 0), "entrance", 4.0, 0.0, 0.0, 1.0, 2.1, False),
        ),
        windows=(Window(0, 0, 2.2, 4.0, 0.0, 1.4, 1.2, 0.9),),
        walls=walls(),
        objects=(
            builders.scene_object(0, "Rug_0", 0, 1.6, 1.6),
            builders.scene_object(1, "DiningTable_0", 0, 1.6, 1.6),
            builders.scene_object(2, "Chair_0", 0, 1.6, 2.2),
            builders.scene_object(3, "Bed_0", 1, 8.2, 2.9),
        ),
        room_graph=((0, 1),),
        assets=builders.by_id(
            builders.table(), builders.chair(), builders.bed(), builders.apple(), builders.rug()
        ),
    )


@pytest.fixture(scope="session")
def hand_episode(hand_house: House) -> Episode:
    """A chair in the door of `hand_house` and an apple beyond it."""
    return builders.episode(
        hand_house,
        builders.start(12, 4),
        builders.goal(28, 4, 1),
        (
            builders.obstacle(builders.chair(), 5.0, 2.0),
            builders.obstacle(builders.apple(), 6.0, 1.5),
        ),
        rooms_on_path=2,
        shortest_path_m=5.1,
        shortest_path_steps=22,
        room_paths=((0, 1),),
        node_paths=(NodePath((0,), ((3.0, 1.0), (5.0, 2.0), (7.0, 1.0))),),
    )
