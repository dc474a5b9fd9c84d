"""A hand-made house for arithmetic, and a small generated dataset for everything else."""

from __future__ import annotations

from dataclasses import replace

import builders
import pytest
from builders import WALL_HALF_M as HALF

from internav_data.envs.episode import EpisodeRun, TaskConfig
from internav_data.envs.source import LoadedHouse
from internav_data.generation import generate, load_config


def crate(*, pickable):
    """A box of 0.6 x 0.6 x 0.5 m and 5 kg."""
    name = "Box_9" if pickable else "Stool_9"
    return builders.crate(
        name, (0.6, 0.6, 0.5), mass_kg=5.0, pushable=not pickable, pickable=pickable
    )


ASSETS = builders.by_id(crate(pickable=True), crate(pickable=False))


def hand_house(*, divided):
    """One room of 6 x 3 m, or two with a door of 1 m between them, in the middle of x = 3."""
    if not divided:
        return builders.one_room(6.0, 3.0)
    walls = (
        *builders.outer_walls(6.0, 3.0),
        builders.wall(3 - HALF, HALF, 3 + HALF, 1.0),
        builders.wall(3 - HALF, 2.0, 3 + HALF, 3 - HALF),
        builders.lintel(3 - HALF, 1.0, 3 + HALF, 2.0),
    )
    rooms = [
        builders.room(k, builders.rectangle(3.0 * k, 0.0, 3.0 * (k + 1), 3.0), 9.0)
        for k in range(2)
    ]
    return builders.house(
        rooms,
        builders.rectangle(0.0, 0.0, 6.0, 3.0),
        walls=walls,
        doors=(builders.door(0, (0, 1), 3.0, 1.5),),
        room_graph=((0, 1),),
    )


@pytest.fixture(scope="session")
def hand_run():
    """Make a run along +x: a crate in a door (divided) or in the middle of a room."""
    houses = {d: LoadedHouse.of(hand_house(divided=d)) for d in (False, True)}

    def make(*, divided, pickable=True, mass_kg=5.0, start_i=None, **config):
        x, start_i = (3.0, start_i or 8) if divided else (2.0, start_i or 4)
        obstacle = builders.obstacle(crate(pickable=pickable), x, 1.5)
        episode = builders.episode(
            houses[divided].model.house,
            builders.start(start_i, 6, 0),
            builders.goal(20, 6),
            [replace(obstacle, mass_kg=mass_kg)],
        )
        return EpisodeRun(episode, houses[divided], ASSETS, TaskConfig(**config))

    return make


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """A generated dataset: four houses of one and two rooms, three episodes each (one in test)."""
    out = tmp_path_factory.mktemp("envs") / "d"
    config = load_config(overrides=["episodes_per_scene=3", "house.rooms=1-2"])
    generate(out, config, 4, workers=1)
    return out


@pytest.fixture(scope="session")
def scenes(tmp_path_factory):
    """Six houses of a single room, four of them to train on."""
    out = tmp_path_factory.mktemp("train") / "d"
    generate(out, load_config(overrides=["episodes_per_scene=4", "house.rooms=1"]), 6, workers=1)
    return out
