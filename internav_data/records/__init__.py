"""The shared words: frozen dataclasses that every other package speaks in."""

from internav_data.records.assets import RGB, Asset, Part, Shape
from internav_data.records.episodes import (
    Episode,
    Expert,
    Goal,
    Mode,
    NodePath,
    Obstacle,
    Outcome,
    Physics,
    Redraw,
    Start,
)
from internav_data.records.errors import InternavError
from internav_data.records.houses import (
    OUTSIDE,
    Door,
    DoorKind,
    House,
    HousePreset,
    Material,
    Room,
    SceneObject,
    Split,
    Wall,
    Window,
)
from internav_data.records.poses import Pose, Quaternion, Vec2, Vec3
from internav_data.records.seeds import Purpose, generator

__all__ = [
    "OUTSIDE",
    "RGB",
    "Asset",
    "Door",
    "DoorKind",
    "Episode",
    "Expert",
    "Goal",
    "House",
    "HousePreset",
    "InternavError",
    "Material",
    "Mode",
    "NodePath",
    "Obstacle",
    "Outcome",
    "Part",
    "Physics",
    "Pose",
    "Purpose",
    "Quaternion",
    "Redraw",
    "Room",
    "SceneObject",
    "Shape",
    "Split",
    "Start",
    "Vec2",
    "Vec3",
    "Wall",
    "Window",
    "generator",
]
