"""An episode as the page shows it: figures, polygons of its objects, outcomes in words.

All of it is read from the dataset: outcomes lie where the stored poses say, and no engine is asked.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

from internav_data.records.agent import AGENT
from internav_data.viewer.shapes import plans, shown_kind
from internav_data.views.episodes import obstacle_kind
from internav_data.views.plan import map_corners

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.records import (
        Asset,
        Episode,
        House,
        MovedObject,
        Obstacle,
        Outcome,
        Pose,
    )

PICK: Final = "pick"
"""Action of the outcome of a pickup."""
DIRECTIONS: Final[Mapping[str, tuple[float, float]]] = {
    "push_east": (1.0, 0.0),
    "push_north": (0.0, 1.0),
    "push_west": (-1.0, 0.0),
    "push_south": (0.0, -1.0),
}
"""World directions of the pushes whose outcomes are stored."""


def episode_facts(house: House, episode: Episode, assets: Mapping[str, Asset]) -> dict[str, Any]:
    """Return all that the page of an episode shows before anything is played."""
    low, high = map_corners(house)
    names = {room.room_id: room.type.replace("_", " ") for room in house.rooms}
    return {
        "episode_id": episode.episode_id,
        "scene_id": episode.scene_id,
        "index": episode.index,
        "split": episode.split,
        "mode": episode.mode,
        "sealed": episode.sealed,
        "box": [*low, *high],
        "agent_radius_m": AGENT.radius_m,
        "house": {
            "rooms": len(house.rooms),
            "area_m2": round(house.area_m2, 1),
            "objects": len(house.objects),
            "preset": house.preset,
        },
        "distances": {
            name: getattr(episode, name)
            for name in (
                "shortest_path_m",
                "shortest_path_steps",
                "obstructed_path_m",
                "obstructed_path_steps",
            )
        },
        "room_path": [names[room] for room in episode.room_paths[0]] if episode.room_paths else [],
        "node_path": [list(p) for p in episode.node_paths[0].points] if episode.node_paths else [],
        "start": asdict(episode.start) | {"room_name": names.get(episode.start.room, "")},
        "goal": asdict(episode.goal) | {"room_name": names.get(episode.goal.room, "")},
        "obstacles": [
            _obstacle(house, episode, number, assets) for number in range(len(episode.obstacles))
        ],
        "expert": _expert(episode),
        "engine": episode.physics.build,
    }


def _expert(episode: Episode) -> dict[str, Any] | None:
    expert = episode.expert
    if expert is None:
        return None
    return {name: getattr(expert, name) for name in ("steps", "pushes", "picks", "path_m")}


def _obstacle(
    house: House, episode: Episode, number: int, assets: Mapping[str, Asset]
) -> dict[str, Any]:
    obstacle = episode.obstacles[number]
    return {
        "number": number + 1,
        "type": obstacle.type,
        "asset_id": obstacle.asset_id,
        "kind": shown_kind(obstacle),
        "at": [obstacle.x, obstacle.y],
        "parts": plans(assets[obstacle.asset_id], obstacle.pose),
        "privileged": {
            "kind": obstacle_kind(obstacle),
            "mass_kg": obstacle.mass_kg,
            "friction": obstacle.friction,
            "pushable": obstacle.pushable,
            "pickable": obstacle.pickable,
            "movable": obstacle.movable,
            "relevant": obstacle.relevant,
        },
        "outcomes": None
        if obstacle.outcomes is None
        else [_outcome(house, episode, obstacle, one, assets) for one in obstacle.outcomes],
    }


def _outcome(
    house: House,
    episode: Episode,
    obstacle: Obstacle,
    outcome: Outcome,
    assets: Mapping[str, Asset],
) -> dict[str, Any]:
    after = resting_pose(obstacle, outcome)
    return {
        "action": outcome.action,
        "success": outcome.success,
        "opened": outcome.opened,
        "reason": outcome.reason,
        "displacement_m": outcome.displacement_m,
        "steps_after": outcome.path_steps_after,
        "path_m_after": outcome.path_m_after,
        "seconds": outcome.seconds,
        "at_rest": outcome.at_rest,
        "text": outcome_text(episode, outcome),
        "parts": None if after is None else plans(assets[obstacle.asset_id], after),
        "at": None if after is None else [after.x, after.y],
        "moved": [_moved(house, episode, other, assets) for other in outcome.moved or ()],
        "video": has_video(outcome),
    }


def has_video(outcome: Outcome) -> bool:
    """Return whether the stored poses say where the obstacle goes."""
    return outcome.success and (outcome.action == PICK or outcome.pose is not None)


def resting_pose(obstacle: Obstacle, outcome: Outcome) -> Pose | None:
    """Return the pose of an obstacle after an outcome; None in the agent's hand."""
    if outcome.success and outcome.action == PICK:
        return None
    return outcome.pose or obstacle.pose


def moved_thing(
    house: House, episode: Episode, other: MovedObject, assets: Mapping[str, Asset]
) -> tuple[str, Asset, Pose]:
    """Return the name, asset and first pose of an object that an outcome takes along."""
    if other.obstacle is not None:
        obstacle = episode.obstacles[other.obstacle]
        return f"{obstacle.type} {other.obstacle + 1}", assets[obstacle.asset_id], obstacle.pose
    placed = house.objects[other.object_id or 0]
    return placed.type, house.assets[placed.asset_id], placed.pose


def _moved(
    house: House, episode: Episode, other: MovedObject, assets: Mapping[str, Asset]
) -> dict[str, Any]:
    name, asset, before = moved_thing(house, episode, other, assets)
    return {
        "name": name,
        "obstacle": None if other.obstacle is None else other.obstacle + 1,
        "from": [before.x, before.y],
        "at": [other.pose.x, other.pose.y],
        "before": plans(asset, before),
        "parts": plans(asset, other.pose),
    }


def outcome_text(episode: Episode, outcome: Outcome) -> str:
    """Return an outcome in words: what moves, what becomes of the path, and who disagrees."""
    differs = f"; {episode.physics.other_engine} disagrees" if outcome.agrees is False else ""
    return f"{_moved_text(episode, outcome)}{differs}"


def _moved_text(episode: Episode, outcome: Outcome) -> str:
    words = outcome.action.replace("_", " ")
    if not outcome.success:
        return f"{words}: {outcome.reason or 'nothing moves'}"
    if outcome.action == PICK:
        text = "pick: in the agent's hand"
    else:
        text = f"{words}: slides {outcome.displacement_m:.2f} m"
    others = len(outcome.moved or ())
    if others:
        text += f", takes {others} other object{'s' if others > 1 else ''} along"
    if outcome.at_rest is False:
        text += ", still moving when time ran out"
    return f"{text}; {_path_text(episode, outcome)}"


def _path_text(episode: Episode, outcome: Outcome) -> str:
    before, after = episode.obstructed_path_steps, outcome.path_steps_after
    if after is None:
        return "the path stays cut off" if before is None else "the path is cut off"
    metres = "" if outcome.path_m_after is None else f", {outcome.path_m_after:.2f} m"
    length = f"{after} steps{metres} to the goal"
    if before is None:
        return f"the path is open: {length}"
    if after == before:
        return f"the path stays: {length}"
    change = after - before
    return f"{length}: {abs(change)} {'fewer' if change < 0 else 'more'} than before"
