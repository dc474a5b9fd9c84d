"""A hand-made house for arithmetic, and a small generated dataset for everything else."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import pytest

from internav_data.envs.episode import EpisodeRun, TaskConfig
from internav_data.envs.source import LoadedHouse
from internav_data.generation import generate, load_config
from internav_data.records import (
    Asset,
    Door,
    Episode,
    Goal,
    House,
    Material,
    NodePath,
    Obstacle,
    Part,
    Physics,
    Room,
    Start,
    Wall,
)

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
THICK = 0.06


def crate(*, pickable):
    """A box of 0.6 x 0.6 x 0.5 m and 5 kg."""
    part = Part("box", (0.0, 0.0, 0.25), (0.6, 0.6, 0.5), UPRIGHT, (), (150, 110, 70), "wood")
    return Asset(
        "Box_9" if pickable else "Stool_9",
        "Box" if pickable else "Stool",
        (0.6, 0.6, 0.5),
        5.0,
        0.6,
        not pickable,
        pickable,
        True,
        True,
        (part,),
    )


ASSETS = {a.asset_id: a for a in (crate(pickable=True), crate(pickable=False))}


def hand_house(*, divided):
    """One room of 6 x 3 m, or two with a door of 1 m between them, in the middle of x = 3."""
    high = 2.6
    walls = [
        Wall(-THICK, -THICK, 6 + THICK, THICK, 0.0, high),
        Wall(-THICK, 3 - THICK, 6 + THICK, 3 + THICK, 0.0, high),
        Wall(-THICK, THICK, THICK, 3 - THICK, 0.0, high),
        Wall(6 - THICK, THICK, 6 + THICK, 3 - THICK, 0.0, high),
    ]
    outline = ((0.0, 0.0), (6.0, 0.0), (6.0, 3.0), (0.0, 3.0))
    parts, doors, graph = [outline], (), ()
    if divided:
        walls += [
            Wall(3 - THICK, THICK, 3 + THICK, 1.0, 0.0, high),
            Wall(3 - THICK, 2.0, 3 + THICK, 3 - THICK, 0.0, high),
            Wall(3 - THICK, 1.0, 3 + THICK, 2.0, 2.1, high),
        ]
        parts = [
            ((0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0)),
            ((3.0, 0.0), (6.0, 0.0), (6.0, 3.0), (3.0, 3.0)),
        ]
        doors = (Door(0, (0, 1), "single", 3.0, 1.5, 90.0, 1.0, 2.1, True),)
        graph = ((0, 1),)
    rooms = [
        Room(k, "living_room", part, 18.0 / len(parts), high, "oak", "white")
        for k, part in enumerate(parts)
    ]
    return House(
        scene_id="scene-000003", scene=3, seed=0, split="train", preset="paper", outline=outline,
        rooms=tuple(rooms), doors=doors, windows=(), walls=tuple(walls), objects=(),
        materials=(
            Material("oak", (190, 150, 105), "planks"),
            Material("white", (240, 240, 236), "plain"),
        ),
        room_graph=graph, area_m2=18.0, assets=MappingProxyType({}),
    )  # fmt: skip


def hand_episode(x, start_i, goal_i, *, pickable, shortest_path_m, goal_j=6):
    """A crate at (x, 1.5) and an agent at (start_i, 6) that looks along +x."""
    kind = "Box" if pickable else "Stool"
    obstacle = Obstacle(
        f"{kind}_9", kind, x, 1.5, 0.0, UPRIGHT, 5.0, 0.6, not pickable, pickable, 0, 0.1, 0.0,
        None,
    )  # fmt: skip
    goal = (0.25 * goal_i, 0.25 * goal_j)
    return Episode(
        episode_id="scene-000003/0001", scene_id="scene-000003", split="train", index=1, seed=0,
        room_count=1, mode="blocked", sealed=True, rooms_on_path=1, obstacle_count=1,
        shortest_path_m=shortest_path_m, shortest_path_steps=goal_i - start_i,
        obstructed_path_m=None, obstructed_path_steps=None,
        start=Start(start_i, 6, 0.25 * start_i, 1.5, 0, 0), goal=Goal(goal_i, goal_j, *goal, 0),
        room_paths=((0,),), room_paths_truncated=False,
        node_paths=(NodePath((), ((0.25 * start_i, 1.5), goal)),), node_paths_truncated=False,
        obstacles=(obstacle,), expert=None, physics=Physics("bullet", "3.2.7", 0.1, 0.0),
    )  # fmt: skip


@pytest.fixture(scope="session")
def hand_run():
    """Make a run: a crate in a door (divided) or in the middle of a room."""
    houses = {d: LoadedHouse.of(hand_house(divided=d)) for d in (False, True)}

    def make(*, divided, pickable=True, mass_kg=5.0, **config):
        if divided:
            episode = hand_episode(3.0, 8, 20, pickable=pickable, shortest_path_m=3.0)
        else:
            episode = hand_episode(2.0, 4, 20, pickable=pickable, shortest_path_m=4.0)
        obstacles = tuple(replace(o, mass_kg=mass_kg) for o in episode.obstacles)
        episode = replace(episode, obstacles=obstacles)
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
