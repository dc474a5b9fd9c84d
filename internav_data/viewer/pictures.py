"""Pictures of the page as WebP: episodes from above for the gallery, floors below the map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from internav_data.core.lru import LRUCache
from internav_data.records.errors import InternavError
from internav_data.viewer.shapes import shown_kind
from internav_data.views.episodes import paint_goal, paint_obstacle, paint_start
from internav_data.views.plan import PAPER, house_canvas, paint_house, paint_labels
from internav_data.views.silhouettes import silhouettes

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.core.typing import Image
    from internav_data.records import RGB, Asset, Episode, House

THUMBNAIL_PX: Final = 480
"""Longer side of a gallery's picture: 240 to 300 px on a page, sharp on dense displays."""
FLOOR_PX: Final = 1000
"""Longer side of the picture below a map."""
_LETTER_PX: Final = 13.0
"""Height of letters on a map, which a page shows at about two thirds of its size."""
CAMERA_QUALITY: Final = 74
"""WebP's quality of pictures of a camera, of which there are many."""
_QUALITY: Final = 82
_PATH: Final[RGB] = (150, 70, 150)


def webp(image: Image, quality: int = _QUALITY) -> bytes:
    """Return a picture (h, w, 3) uint8 RGB as WebP.

    Raises
    ------
    InternavError
        OpenCV cannot encode it.
    """
    bgr = cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    good, data = cv2.imencode(".webp", bgr, [cv2.IMWRITE_WEBP_QUALITY, quality])
    if not good:
        raise InternavError(f"a picture of shape {image.shape} cannot be written as WebP")
    return data.tobytes()


class ThumbnailPainter:
    """Painter of episodes from above; the house below them is painted once."""

    def __init__(self) -> None:
        self._houses: LRUCache[str, Image] = LRUCache(4)

    def draw(self, house: House, episode: Episode, assets: Mapping[str, Asset]) -> bytes:
        """Return an episode's picture without words: `THUMBNAIL_PX` wide or high, WebP."""
        canvas = house_canvas(house, THUMBNAIL_PX)
        canvas.image[:] = self._houses.get(house.scene_id, lambda: _painted(house))
        on_path = episode.room_paths[0] if episode.room_paths else ()
        others = [room.polygon for room in house.rooms if room.room_id not in on_path]
        if others:
            canvas.blend(canvas.mask(others), PAPER, 0.5)
        if episode.node_paths:
            canvas.dashes(episode.node_paths[0].points, _PATH, 2.0, 0.2)
        for obstacle in episode.obstacles:
            parts = silhouettes(assets[obstacle.asset_id], obstacle.pose)
            paint_obstacle(canvas, shown_kind(obstacle), parts)
        paint_start(canvas, episode)
        paint_goal(canvas, episode)
        return webp(canvas.finished())


def _painted(house: House) -> Image:
    canvas = house_canvas(house, THUMBNAIL_PX)
    paint_house(canvas, house)
    return canvas.image


def draw_floor(house: House, episode: Episode, assets: Mapping[str, Asset]) -> bytes:
    """Return the house below an episode's map, WebP: rooms off the path are pale.

    Names of rooms keep clear of the obstacles, the start and the goal, which the page draws.
    """
    canvas = house_canvas(house, FLOOR_PX)
    on_path = episode.room_paths[0] if episode.room_paths else ()
    paint_house(canvas, house, on_path, letter_px=_LETTER_PX)
    shapes = [
        part.plan
        for obstacle in episode.obstacles
        for part in silhouettes(assets[obstacle.asset_id], obstacle.pose)
    ]
    ends = ((episode.start.x, episode.start.y), (episode.goal.x, episode.goal.y))
    shapes += [canvas.arc(end, 0.45, 0.0, 360.0) for end in ends]
    paint_labels(canvas, house, shapes, letter_px=_LETTER_PX)
    return webp(np.ascontiguousarray(canvas.finished()), 86)
