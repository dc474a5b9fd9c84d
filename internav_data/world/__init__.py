"""What happens: physics as pure functions of plain data."""

from internav_data.world.setting import Body, Engine, Rest, Setting, wall_body
from internav_data.world.settle import Settled, settle

__all__ = ["Body", "Engine", "Rest", "Setting", "Settled", "settle", "wall_body"]
