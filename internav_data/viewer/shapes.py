"""Objects from above as polygons that the page draws, in metres."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from internav_data.views.episodes import ObstacleKind, obstacle_kind
from internav_data.views.silhouettes import silhouettes

if TYPE_CHECKING:
    from internav_data.core.typing import Floats
    from internav_data.records import Asset, House, Obstacle, Pose

_DIGITS: Final = 3
"""Decimals of coordinates: millimetres."""


def shown_kind(obstacle: Obstacle) -> ObstacleKind:
    """Return what an obstacle looks as if one could do with it: nothing hidden decides it."""
    return obstacle_kind(obstacle) if obstacle.affordance is None else obstacle.affordance


def plans(asset: Asset, pose: Pose) -> list[dict[str, Any]]:
    """Return the parts of an asset at a pose from above, the lowest first.

    Each has `points`, the corners x, y, x, y in metres; `shade`, the brightness of its largest
    face, 1 for a level one; and `colour`, its own.
    """
    parts = sorted(silhouettes(asset, pose), key=lambda part: part.top_m)
    return [
        {
            "points": [round(float(value), _DIGITS) for value in part.plan.ravel()],
            "shade": round(float(part.shades.max()), 3) if len(part.shades) else 1.0,
            "colour": "#{:02x}{:02x}{:02x}".format(*part.colour),
        }
        for part in parts
    ]


def walls_at(house: House, height_m: float) -> Floats:
    """Return x_min, y_min, x_max, y_max of the walls at a height, metres: (n, 4)."""
    return np.array(
        [(w.x_min, w.y_min, w.x_max, w.y_max) for w in house.walls if w.z_min < height_m < w.z_max]
    ).reshape(-1, 4)
