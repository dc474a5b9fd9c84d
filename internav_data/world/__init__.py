"""A house being acted in: its movable objects, the twelve actions, what the agent can see."""

from internav_data.world.actions import (
    ACTION_COUNT,
    ACTIONS,
    Action,
    Interaction,
    Reason,
    StepResult,
)
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
]
