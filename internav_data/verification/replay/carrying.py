"""Check of carrying: what an expert holds is in nothing, by its solids and those around it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import shapely

from internav_data.records import Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.verification.replay.checked_scene import CheckedScene
    from internav_data.world import MovableObject

CARRY_LOW_M = 0.8
"""Height of a held object's lowest point."""
CARRY_FROM_M = 0.25
"""Distance of its nearest point from the agent's axis, straight ahead."""
TOUCH_M = 1e-3
"""Depth up to which two solids count as touching, metres."""


def what_is_in_the_way(
    scene: CheckedScene,
    items: Sequence[MovableObject],
    held: int,
    position: tuple[float, float],
    quarter: int,
) -> str:
    """Return the first thing that an object carried at a pose would be in; "" for none.

    Parameters
    ----------
    scene
        Scene of the episode.
    items
        Items of the world.
    held
        Index of the object that is held.
    position, quarter
        The agent's position, metres, and quarter turns.

    """
    asset_id, shapes = items[held].asset.asset_id, scene.layout.shapes
    upright = shapes.slabs(asset_id, Pose(0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 1.0)))
    ahead_m = CARRY_FROM_M - min(float(slab.corners[:, 0].min()) for slab in upright)
    angle = quarter * math.pi / 2.0
    x, y = position[0] + ahead_m * math.cos(angle), position[1] + ahead_m * math.sin(angle)
    turn = (0.0, 0.0, math.sin(angle / 2.0), math.cos(angle / 2.0))
    own = shapes.slabs(asset_id, Pose(x, y, CARRY_LOW_M, turn))
    movable = set(scene.model.object_ids)
    around = [(f"object {k}", s) for k, s in scene.layout.object_slabs.items() if k not in movable]
    around += [("a wall", scene.layout.wall_slabs)]
    around += [
        (f"item {k}", shapes.slabs(item.asset.asset_id, item.pose))
        for k, item in enumerate(items)
        if item.pose is not None and k != held
    ]
    for name, slabs in around:
        for other in slabs:
            for slab in own:
                high = min(slab.high, other.high) - max(slab.low, other.low)
                if high > TOUCH_M and shapely.intersection(slab.plan, other.plan).area > TOUCH_M**2:
                    return name
    return ""
