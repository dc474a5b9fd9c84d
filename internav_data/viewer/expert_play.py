"""An episode's expert, action by action: what the map shows, and the agent's camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from internav_data.records.agent import AGENT
from internav_data.records.errors import UsageError
from internav_data.viewer.pictures import CAMERA_QUALITY, webp
from internav_data.viewer.shapes import plans, walls_at
from internav_data.views.replay_painters import CameraPainter, visible_shares
from internav_data.views.replay_story import Shot, describe, play
from internav_data.world import Action, HouseModel
from internav_data.world.actions import INTERACTION_KINDS
from internav_data.world.visibility import REACH_M

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.records import Asset, Episode, House, Vec2
    from internav_data.views.replay_story import Moment
    from internav_data.world.config import WorldConfig

CAMERA_PX: Final = 384
"""Pixels a side of the camera's pictures."""


class ExpertPlay:
    """Played expert of an episode: its moments, and the camera's picture of each.

    Pushes and drops are solved again by the physics engine.

    Raises
    ------
    UsageError
        The episode has no expert.
    MissingEngineError
        An action needs the physics engine, which is not installed.
    """

    def __init__(
        self,
        house: House,
        episode: Episode,
        assets: Mapping[str, Asset],
        config: WorldConfig,
    ) -> None:
        if episode.expert is None:
            raise UsageError(
                f"{episode.episode_id}: no expert is stored (none was found, or the dataset was "
                "made without)"
            )
        self._story = play(HouseModel.of(house), episode, assets, config=config)
        self._camera: CameraPainter | None = None
        self._walls = walls_at(house, AGENT.camera_height_m)

    def __len__(self) -> int:
        return len(self._story.moments)

    def moments(self) -> dict[str, Any]:
        """Return the state after each action; polygons only of what has moved since the start."""
        story = self._story
        first = len(story.model.items)
        items = sorted({*story.moved, *story.moments[0].world.obstacles})
        moments = story.moments
        return {
            "success": story.success,
            "objects": {
                str(k): {"name": story.name(k), "obstacle": max(0, k - first + 1) or None}
                for k in items
            },
            "moments": [self._facts(k, items) for k in range(len(moments))],
        }

    def _facts(self, step: int, items: list[int]) -> dict[str, Any]:
        story = self._story
        moment = story.moments[step]
        world, result = moment.world, moment.result
        following = self._next(moment)
        moved = {}
        for item in items:
            pose = moment.pose(item)
            if pose != story.moments[0].pose(item):
                asset = world.items[item].asset
                moved[str(item)] = None if pose is None else plans(asset, pose)
        return {
            "text": describe(story, moment),
            "action": None if result is None else result.action.label,
            "kind": None if result is None else result.action.kind,
            "success": result is None or result.success,
            "next": None if following is None else following.action.words,
            "target": -1 if following is None else self._target(moment),
            "x": round(world.position[0], 4),
            "y": round(world.position[1], 4),
            "yaw_deg": 90 * world.quarter,
            "horizon_deg": world.horizon_deg,
            "cone": self._cone(world.position, 90.0 * world.quarter),
            "path_steps": moment.path_steps,
            "moved": moved,
        }

    def _cone(self, at: Vec2, yaw_deg: float) -> list[float]:
        """Return the corners of the camera's field of view up to the agent's reach: x, y, x, y."""
        half = AGENT.field_of_view_deg / 2.0
        turns = np.radians(np.linspace(yaw_deg - half, yaw_deg + half, 13))
        ends = np.array(at) + REACH_M * np.column_stack([np.cos(turns), np.sin(turns)])
        shares = visible_shares(np.array(at), ends, self._walls)
        seen = np.array(at) + (ends - np.array(at)) * shares[:, None]
        return [*at, *(round(float(value), 2) for value in seen.ravel())]

    def _next(self, moment: Moment) -> Any:  # noqa: ANN401 - a `StepResult` or None
        moments = self._story.moments
        return moments[moment.step + 1].result if moment.step + 1 < len(moments) else None

    def _target(self, moment: Moment) -> int:
        """Return the item that the next action acts on, or -1."""
        following = self._next(moment)
        if following is None or following.action.kind not in INTERACTION_KINDS:
            return -1
        return -1 if following.action == Action.DROP else int(following.target)

    def picture(self, step: int) -> bytes:
        """Return the camera's picture after some actions, WebP; the next target is outlined.

        Raises
        ------
        UsageError
            There are fewer actions.
        """
        moments = self._story.moments
        if not 0 <= step < len(moments):
            raise UsageError(f"a step of the expert: expected 0 to {len(moments) - 1}, got {step}")
        if self._camera is None:
            self._camera = CameraPainter(self._story, CAMERA_PX)
        moment = moments[step]
        world = moment.world
        shot = Shot(
            frames=1,
            moment=moment,
            x=world.position[0],
            y=world.position[1],
            yaw_deg=90.0 * world.quarter,
            horizon_deg=float(world.horizon_deg),
            poses={k: moment.pose(k) for k in (*self._story.moved, *world.obstacles)},
            trail=(),
            text="",
            mood="plain",
            target=self._target(moment),
            path_steps=moment.path_steps,
        )
        return webp(self._camera.draw(shot), CAMERA_QUALITY)
