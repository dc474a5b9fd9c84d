"""From a seed to a house: programme, floor plan, doors and windows, furniture, materials."""

from internav_data.houses.build import build_house
from internav_data.houses.config import HouseConfig
from internav_data.houses.plan_file import load_floor_plan
from internav_data.houses.quota import room_count
from internav_data.houses.splits import split_of_scene

__all__ = ["HouseConfig", "build_house", "load_floor_plan", "room_count", "split_of_scene"]
