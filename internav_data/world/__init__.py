"""What happens: physics as pure functions of plain data, and the world they make up."""

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
from internav_data.world.settle import Settled, engine_of_this_process, settle

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
    "wall_body",
]
