"""A house: rooms, doors, windows, walls and the things in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from internav_data.records.assets import RGB, Asset
from internav_data.records.poses import Pose, Vec2

Split = Literal["train", "val", "test"]
DoorKind = Literal["opening", "doorway", "single", "wide", "double", "entrance"]
HousePreset = Literal["paper", "realistic"]

OUTSIDE = -1
"""Room id of the world outside the house."""


@dataclass(frozen=True, slots=True)
class Room:
    """A rectilinear polygon of wall centre lines; rooms tile the house's outline."""

    room_id: int
    type: str
    polygon: tuple[Vec2, ...]
    """Corners, counter-clockwise, first not repeated, metres."""
    area_m2: float
    """Of the polygon of centre lines."""
    ceiling_m: float
    floor_material: str
    wall_material: str


@dataclass(frozen=True, slots=True)
class Door:
    """An opening in the wall between two rooms; `open` doors can be walked through."""

    door_id: int
    rooms: tuple[int, int]
    """Room ids, ascending; an entrance has (OUTSIDE, room)."""
    kind: DoorKind
    x: float
    """Centre of the opening, on the wall's centre line."""
    y: float
    yaw_deg: float
    """Direction of the wall: 0 along x, 90 along y."""
    width_m: float
    height_m: float
    open: bool


@dataclass(frozen=True, slots=True)
class Window:
    """A pane in an outer wall. Nobody walks through it."""

    window_id: int
    room: int
    x: float
    y: float
    yaw_deg: float
    width_m: float
    height_m: float
    sill_m: float


@dataclass(frozen=True, slots=True)
class Wall:
    """A solid box of wall: axis-aligned, metres. Lintels and window breasts are walls too."""

    x_min: float
    y_min: float
    x_max: float
    y_max: float
    z_min: float
    z_max: float


@dataclass(frozen=True, slots=True)
class SceneObject:
    """A piece of furniture where it stands."""

    object_id: int
    asset_id: str
    type: str
    room: int
    x: float
    y: float
    z: float
    quaternion: tuple[float, float, float, float]
    group: int
    """Things of one group belong together (table and chairs); -1 for none."""
    support: int
    """object_id it stands on, -1 for the floor."""

    @property
    def pose(self) -> Pose:
        """The pose of the asset's frame."""
        return Pose(self.x, self.y, self.z, self.quaternion)


@dataclass(frozen=True, slots=True)
class Material:
    """A named surface for the camera: base colour and pattern."""

    name: str
    colour: RGB
    pattern: str
    """plain, planks, tiles, stripes, carpet or bricks."""


@dataclass(frozen=True, slots=True)
class House:
    """Everything about one house: its interior's bounding box starts at (0, 0), its floor is 0."""

    scene_id: str
    """`scene-000017`."""
    scene: int
    seed: int
    split: Split
    preset: str
    outline: tuple[Vec2, ...]
    """Rectilinear polygon of outer wall centre lines, counter-clockwise."""
    rooms: tuple[Room, ...]
    doors: tuple[Door, ...]
    windows: tuple[Window, ...]
    walls: tuple[Wall, ...]
    objects: tuple[SceneObject, ...]
    materials: tuple[Material, ...]
    room_graph: tuple[tuple[int, int], ...]
    """Pairs of rooms joined by at least one open door, ascending."""
    area_m2: float
    assets: Mapping[str, Asset] = field(compare=False, repr=False)
    """The assets of `things` (at least), by asset_id. Not part of the scene row."""
