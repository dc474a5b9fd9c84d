"""Videos of outcomes: the stored poses and those between, from above and by a camera nearby.

What lies between the first and the last pose is interpolated: the dataset stores where things come
to rest, and no engine is asked for the way there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from internav_data.records.agent import AGENT
from internav_data.records.errors import UsageError
from internav_data.render.camera import Camera, CameraView, Props, StaticScene
from internav_data.viewer.episode_facts import (
    DIRECTIONS,
    PICK,
    has_video,
    moved_thing,
)
from internav_data.viewer.pictures import CAMERA_QUALITY, webp
from internav_data.viewer.shapes import plans, walls_at
from internav_data.views.motion import eased, interpolated
from internav_data.views.replay_painters import highlight, visible_shares

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.core.typing import Image
    from internav_data.records import Asset, Episode, House, Outcome, Pose, Vec2

FRAMES: Final = 9
"""Pictures of a video, its first and last included."""
CAMERA_PX: Final = 320
"""Pixels a side of the camera's pictures."""
_DISTANCES_M: Final = (1.7, 1.3, 1.0)
"""Distances from which the camera looks at an obstacle, the first that is free."""
_EYE_M: Final = AGENT.camera_height_m


@dataclass(frozen=True, slots=True, eq=False)
class _Mover:
    """Object that moves in a video."""

    name: str
    instance: int
    """Number among the house's objects, then the obstacles."""
    asset: Asset
    begin: Pose
    end: Pose | None
    """None: it is picked up."""

    def pose(self, share: float) -> Pose | None:
        if self.end is None:
            return self.begin if share < 1.0 else None
        return interpolated(self.begin, self.end, eased(share))


class OutcomeVideo:
    """Video of one outcome of one obstacle.

    Raises
    ------
    UsageError
        There is no such outcome, or no pose is stored with it.
    """

    def __init__(
        self,
        house: House,
        episode: Episode,
        assets: Mapping[str, Asset],
        number: int,
        action: str,
    ) -> None:
        outcome = _outcome(episode, number, action)
        self._house, self._episode, self._assets = house, episode, assets
        self._movers = self._list(number, outcome)
        obstacle = episode.obstacles[number]
        self._eye = _viewpoint(house, (obstacle.x, obstacle.y), DIRECTIONS.get(action))
        self._look_at = _middle(self._movers)

    @cached_property
    def _scene(self) -> StaticScene:
        return StaticScene.of(self._house)

    @cached_property
    def _camera(self) -> Camera:
        return Camera(CAMERA_PX)

    def _list(self, number: int, outcome: Outcome) -> list[_Mover]:
        house, episode, assets = self._house, self._episode, self._assets
        first, obstacle = len(house.objects), episode.obstacles[number]
        end = None if outcome.action == PICK else outcome.pose or obstacle.pose
        asset = assets[obstacle.asset_id]
        movers = [
            _Mover(f"{obstacle.type} {number + 1}", first + number, asset, obstacle.pose, end)
        ]
        for other in outcome.moved or ():
            name, asset, begin = moved_thing(house, episode, other, assets)
            place = other.object_id or 0 if other.obstacle is None else first + other.obstacle
            movers.append(_Mover(name, place, asset, begin, other.pose))
        return movers

    def keyframes(self) -> dict[str, Any]:
        """Return the polygons of the moving objects, for each of `FRAMES` pictures."""
        first = len(self._house.objects)
        return {
            "objects": [
                {"name": m.name, "obstacle": max(0, m.instance - first + 1) or None}
                for m in self._movers
            ],
            "frames": [
                [None if pose is None else plans(m.asset, pose) for m, pose in self._poses(k)]
                for k in range(FRAMES)
            ],
        }

    def _poses(self, frame: int) -> list[tuple[_Mover, Pose | None]]:
        return [(mover, mover.pose(frame / (FRAMES - 1))) for mover in self._movers]

    def picture(self, frame: int) -> bytes:
        """Return the camera's picture of a frame, WebP.

        Raises
        ------
        UsageError
            There are fewer frames.
        """
        if not 0 <= frame < FRAMES:
            raise UsageError(f"a video's frame: expected 0 to {FRAMES - 1}, got {frame}")
        scene = self._scene
        obstacles = [(self._assets[o.asset_id], o.pose) for o in self._episode.obstacles]
        props: Props = scene.props(obstacles)
        for mover, pose in self._poses(frame):
            if pose is None:
                props.hide(mover.instance)
            else:
                props.move(mover.instance, pose)
        (x, y), (to_x, to_y, to_z) = self._eye, self._look_at
        far = math.hypot(to_x - x, to_y - y)
        yaw = math.degrees(math.atan2(to_y - y, to_x - x))
        horizon = math.degrees(math.atan2(_EYE_M - to_z, far))
        view = CameraView(scene, props, x, y, yaw, horizon)
        drawn = self._camera.render([view])
        picture: Image = drawn.rgb[0]
        highlight(picture, drawn.ids[0] == 1 + self._movers[0].instance)
        return webp(picture, CAMERA_QUALITY)


def _outcome(episode: Episode, number: int, action: str) -> Outcome:
    if not 0 <= number < len(episode.obstacles):
        raise UsageError(
            f"{episode.episode_id}: no obstacle {number + 1}, it has {len(episode.obstacles)}"
        )
    for outcome in episode.obstacles[number].outcomes or ():
        if outcome.action == action and has_video(outcome):
            return outcome
    raise UsageError(
        f"{episode.episode_id}: obstacle {number + 1}: no pose is stored for {action!r} (it fails, "
        "or the dataset is of an earlier release)"
    )


def _middle(movers: list[_Mover]) -> tuple[float, float, float]:
    """Return the middle of the obstacle's path, at half its height."""
    obstacle = movers[0]
    end = obstacle.end or obstacle.begin
    x, y = (obstacle.begin.x + end.x) / 2.0, (obstacle.begin.y + end.y) / 2.0
    return x, y, obstacle.begin.z + obstacle.asset.size[2] / 2.0


def _viewpoint(house: House, at: Vec2, push: Vec2 | None) -> Vec2:
    """Return a point with a free view on an obstacle: behind the push if it can be."""
    walls = walls_at(house, _EYE_M)
    first = math.atan2(-push[1], -push[0]) if push is not None else 0.0
    turns = [first + math.radians(turn) for turn in (0, 35, -35, 70, -70, 110, -110, 150, -150)]
    eye = np.array(at)
    best, longest = at, 0.0
    for far in _DISTANCES_M:
        ends = np.array([(at[0] + far * math.cos(t), at[1] + far * math.sin(t)) for t in turns])
        shares = visible_shares(eye, ends, walls)
        for end, share in zip(ends, shares, strict=True):
            reach = float(share) * far - 0.1
            if share >= 1.0:
                return float(end[0]), float(end[1])
            if reach > longest:
                spot = eye + (end - eye) * (reach / far)
                best, longest = (float(spot[0]), float(spot[1])), reach
    return best
