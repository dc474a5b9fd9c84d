"""Physics as pure functions of plain data: settle, push, the engines behind them, their cache."""

from internav_data.physics.push import Pushed, PushModel, push
from internav_data.physics.registry import engine_of_this_process, solving_anew
from internav_data.physics.scene import (
    Body,
    Column,
    Engine,
    Motion,
    Rest,
    Setting,
    Shove,
    wall_body,
)
from internav_data.physics.settle import Settled, settle

__all__ = [
    "Body",
    "Column",
    "Engine",
    "Motion",
    "PushModel",
    "Pushed",
    "Rest",
    "Setting",
    "Settled",
    "Shove",
    "engine_of_this_process",
    "push",
    "settle",
    "solving_anew",
    "wall_body",
]
