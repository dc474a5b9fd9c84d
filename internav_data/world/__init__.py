"""A house being acted in: its movable objects, the actions, what the agent can see."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.lazy import lazy_imports
from internav_data.world.actions import (
    ACTION_COUNT,
    ACTIONS,
    Action,
    Interaction,
    Reason,
    StepResult,
)

if TYPE_CHECKING:
    from internav_data.world.config import WorldConfig
    from internav_data.world.house_model import HouseModel, MovableObject
    from internav_data.world.world import World

__all__ = [
    "ACTIONS",
    "ACTION_COUNT",
    "Action",
    "HouseModel",
    "Interaction",
    "MovableObject",
    "Reason",
    "StepResult",
    "World",
    "WorldConfig",
]

# The table of actions needs neither numba nor Bullet.
__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "config": ["WorldConfig"],
        "house_model": ["HouseModel", "MovableObject"],
        "world": ["World"],
    },
)
