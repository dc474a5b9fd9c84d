"""What happens: physics as pure functions of plain data, and the world they make up."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.world.actions import ACTION_COUNT, Action, Reason, StepResult
from internav_data.world.engine import engine_of_this_process, solving_anew
from internav_data.world.push import Pushed, PushModel, push
from internav_data.world.setting import (
    Body,
    Column,
    Engine,
    Motion,
    Rest,
    Setting,
    Shove,
    wall_body,
)
from internav_data.world.settle import Settled, settle

if TYPE_CHECKING:
    from internav_data.world.stage import Item, Stage
    from internav_data.world.world import World

__all__ = [
    "ACTION_COUNT",
    "Action",
    "Body",
    "Column",
    "Engine",
    "Item",
    "Motion",
    "PushModel",
    "Pushed",
    "Reason",
    "Rest",
    "Setting",
    "Settled",
    "Shove",
    "Stage",
    "StepResult",
    "World",
    "engine_of_this_process",
    "push",
    "settle",
    "solving_anew",
    "wall_body",
]

_HOMES = {"Item": "stage", "Stage": "stage", "World": "world"}


def __getattr__(name: str) -> object:
    """Import what is asked for: settling alone needs none of the worlds' kernels."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module  # noqa: PLC0415 - as all the rest

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
