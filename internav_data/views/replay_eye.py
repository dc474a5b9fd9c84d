"""What the agent sees in a replay: its camera, with what it is about to touch pointed out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from internav_data.views.asset_sheet import draw_assets
from internav_data.views.canvas import Canvas
from internav_data.world.camera import Camera, Scenery, View

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.records import RGB, Asset
    from internav_data.views.replay_shots import Shot
    from internav_data.views.replay_story import Story

    Image = NDArray[np.uint8]

_TARGET: Final[RGB] = (255, 214, 40)
_RIM: Final[RGB] = (60, 44, 8)
_BAD: Final[RGB] = (214, 44, 32)
_PAPER: Final[RGB] = (250, 249, 246)
_INK: Final[RGB] = (52, 54, 62)


class EyePainter:
    """Draws what the agent sees in a story, `size` pixels a side."""

    def __init__(self, story: Story, size: int) -> None:
        self._story, self._size = story, size
        house, first = story.stage.house, story.moments[0]
        world = first.world
        self._scenery = Scenery.of(house)
        things = [(world.items[k].asset, world.items[k].pose) for k in world.obstacles]
        self._props = self._scenery.props([(a, p) for a, p in things if p is not None])
        rows = {thing.thing_id: row for row, thing in enumerate(house.things)}
        self._instances = [rows[t] for t in story.stage.thing_ids]
        self._instances += [len(house.things) + k for k in range(len(things))]
        self._camera = Camera(size)
        self._icons: dict[int, Image] = {}

    def draw(self, shot: Shot) -> Image:
        """Return the picture at a shot, (size, size, 3) uint8 RGB."""
        held = -1
        for item, pose in shot.poses.items():
            if pose is None:
                self._props.hide(self._instances[item])
                held = item
            else:
                self._props.move(self._instances[item], pose)
                self._props.show(self._instances[item])
        view = View(self._scenery, self._props, shot.x, shot.y, shot.yaw_deg, shot.horizon_deg)
        frames = self._camera.render([view])
        picture: Image = frames.rgb[0]
        if shot.target >= 0:
            self._point_out(picture, frames.ids[0] == 1 + self._instances[shot.target])
        if held >= 0:
            self._in_hand(picture, held)
        if shot.mood == "bad":
            wide = max(2, self._size // 80)
            cv2.rectangle(picture, (0, 0), (self._size - 1, self._size - 1), _BAD, 2 * wide)
        return picture

    def _point_out(self, picture: Image, mask: NDArray[np.bool_]) -> None:
        """Draw a line around what is seen of a thing."""
        thick = max(1, self._size // 200)
        inside = mask.astype(np.uint8)
        for reach, colour in ((2 * thick + 1, _RIM), (thick + 1, _TARGET)):
            kernel = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
            picture[(cv2.dilate(inside, kernel) > 0) & ~mask] = colour

    def _in_hand(self, picture: Image, item: int) -> None:
        """Show what is held in a corner."""
        side, gap = self._size // 4, self._size // 50
        icon = self._icons.get(item)
        if icon is None:
            asset = self._story.moments[0].world.items[item].asset
            icon = self._icons[item] = _icon(asset, side)
        picture[-side - gap : -gap, -side - gap : -gap] = icon


def _icon(asset: Asset, side: int) -> Image:
    """Return a thing's picture with a label above it, (side, side, 3)."""
    label = side // 6
    canvas = Canvas((0.0, 0.0), (float(side), float(side)), side, _PAPER)
    canvas.text((side / 2.0, side - 0.58 * label), "in hand", 0.42 * label, _INK)
    icon = canvas.finished()
    icon[label:] = draw_assets([asset], side, side - label)
    edge = max(1, side // 40)
    icon[:edge] = icon[-edge:] = _TARGET
    icon[:, :edge] = icon[:, -edge:] = _TARGET
    return icon
