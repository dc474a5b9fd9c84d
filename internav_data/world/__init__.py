"""What happens: physics as pure functions of plain data."""

from internav_data.world.setting import Body, Engine, Rest, Setting, wall_body
from internav_data.world.settle import Settled, engine_of_this_process, settle

__all__ = [
    "Body",
    "Engine",
    "Rest",
    "Setting",
    "Settled",
    "engine_of_this_process",
    "settle",
    "wall_body",
]
