"""A small dataset written by hand: three houses alike, twelve episodes each."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import builders
import pytest

from internav_data.dataset import Identity, assemble, open_staging, stage_scene
from internav_data.records import Episode, Expert, MovedObject, Outcome, Pose
from internav_data.viewer import ViewedDataset

if TYPE_CHECKING:
    from pathlib import Path

    from internav_data.records import House

AHEAD, RIGHT, PUSH, DONE = 0, 2, 5, 11
# From (3, 1) looking north: to the door's height, up to the chair in the door, away with it.
TO_THE_DOOR = [*[AHEAD] * 4, RIGHT, *[AHEAD] * 4, PUSH]
PUSHED = Pose(6.2, 2.0, 0.0, builders.yaw(30.0))
TAKEN_ALONG = Pose(6.9, 1.5, 0.0, builders.UPRIGHT)
ASIDE = Pose(1.6, 2.6, 0.0, builders.UPRIGHT)


def outcome(action: str, **changes: object) -> Outcome:
    made = Outcome(
        action, False, 0.0, None, None, False, 0.0, "not pushable", moved=(), at_rest=True
    )
    return replace(made, **changes)


def chair_outcomes() -> tuple[Outcome, ...]:
    """Outcomes of the chair: east opens the way and takes the apple and a chair along."""
    moved = (MovedObject(1, None, TAKEN_ALONG), MovedObject(None, 2, ASIDE))
    east = outcome(
        "push_east", success=True, reason="", displacement_m=1.2, path_steps_after=24,
        path_m_after=5.4, opened=True, pose=PUSHED, moved=moved, seconds=1.5,
    )  # fmt: skip
    west = outcome(
        "push_west", success=True, reason="", displacement_m=0.4,
        pose=Pose(4.6, 2.0, 0.0, builders.UPRIGHT),
    )  # fmt: skip
    others = (outcome(name) for name in ("push_north", "push_south"))
    return (east, *others, west, outcome("pick", reason="not pickable"))


def apple_outcomes() -> tuple[Outcome, ...]:
    pushes = (outcome(f"push_{name}") for name in ("east", "north", "west", "south"))
    return (*pushes, outcome("pick", success=True, reason="", seconds=0.0))


def full_episode(hand_episode: Episode) -> Episode:
    """The chair in the door with its outcomes, and an expert that pushes it."""
    chair, apple = hand_episode.obstacles
    obstacles = (
        replace(chair, outcomes=chair_outcomes(), affordance="push", mass_kg=71.5, pushable=False),
        replace(apple, outcomes=apple_outcomes()),
    )
    actions = (*TO_THE_DOOR, DONE)
    expert = Expert(actions, len(actions), 1, 0, 2.0)
    return replace(hand_episode, index=0, obstacles=obstacles, expert=expert)


def varied(episode: Episode, house: House, index: int) -> Episode:
    """An episode that differs from its neighbours in every column that is filtered by."""
    number = house.scene * 12 + index
    # Never the chair alone: its outcomes move the apple.
    kept = episode.obstacles if number % 2 else episode.obstacles[1:]
    mode = "blocked" if number % 3 else "lengthened"
    return replace(
        episode,
        episode_id=f"{house.scene_id}/{index:04d}",
        scene_id=house.scene_id,
        split=house.split,
        index=index,
        mode=mode,
        sealed=mode == "blocked" and number % 4 == 1,
        obstacles=kept,
        obstacle_count=len(kept),
        shortest_path_m=round(2.0 + 0.37 * number, 4),
        obstructed_path_m=None if mode == "blocked" else 30.0,
        obstructed_path_steps=None if mode == "blocked" else 99,
    )


@pytest.fixture(scope="session")
def folder(
    tmp_path_factory: pytest.TempPathFactory, hand_house: House, hand_episode: Episode
) -> Path:
    out = tmp_path_factory.mktemp("viewer") / "small"
    identity = Identity("synthetic", "1", 0, 1, "0" * 64, {"catalog": {"attributes": "hidden"}})
    staging = open_staging(out, identity)
    full = full_episode(hand_episode)
    for scene in range(3):
        split = ("val", "test", "train")[scene]
        house = replace(hand_house, scene=scene, scene_id=f"scene-{scene:06d}", split=split)
        rows = [varied(full, house, index) for index in range(12)]
        stage_scene(staging, scene, house, rows)
    assemble(out, identity, tuple(hand_house.assets.values()), 3)
    return out


@pytest.fixture(scope="session")
def viewed(folder: Path) -> ViewedDataset:
    return ViewedDataset(folder)
