"""Houses: rooms, doors, windows, walls and furniture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from internav_data.records.assets import RGB, Asset
from internav_data.records.display import displayed
from internav_data.records.physics import Affordance, Dynamics
from internav_data.records.poses import Pose, Vec2

Split = Literal["train", "val", "test"]
"""Parts of a dataset."""
DoorKind = Literal["opening", "doorway", "single", "wide", "double", "entrance"]
"""Kinds of openings between rooms; an entrance leads outside."""
HousePreset = Literal["paper", "realistic"]
"""Generous rooms calibrated to the paper's Table 2, or areas and doors of real homes."""

OUTSIDE = -1
"""Room id of the world outside the house."""


@dataclass(frozen=True, slots=True)
class Room:
    """Rectilinear polygon of wall centre lines; rooms tile the house's outline."""

    room_id: int
    """Number of the room, from 0."""
    type: str
    """Type of room, as `kitchen`."""
    polygon: tuple[Vec2, ...]
    """Corners, counter-clockwise, first not repeated, metres."""
    area_m2: float
    """Area of the polygon of centre lines, square metres."""
    ceiling_m: float
    """Height of the ceiling above the floor, metres."""
    floor_material: str
    """Name of a material."""
    wall_material: str
    """Name of a material."""


@dataclass(frozen=True, slots=True)
class Door:
    """Opening in the wall between two rooms."""

    door_id: int
    """Number of the door, from 0."""
    rooms: tuple[int, int]
    """Room ids, ascending; an entrance has (OUTSIDE, room)."""
    kind: DoorKind
    """Kind of opening."""
    x: float
    """Centre of the opening, on the wall's centre line, metres."""
    y: float
    """Centre of the opening, on the wall's centre line, metres."""
    yaw_deg: float
    """Direction of the wall: 0 along x, 90 along y."""
    width_m: float
    """Clear width, metres."""
    height_m: float
    """Clear height, metres."""
    open: bool
    """Whether an agent can walk through."""


@dataclass(frozen=True, slots=True)
class Window:
    """Pane in an outer wall, closed to agents."""

    window_id: int
    """Number of the window, from 0."""
    room: int
    """Id of the room behind it."""
    x: float
    """Centre of the pane, on the wall's centre line, metres."""
    y: float
    """Centre of the pane, on the wall's centre line, metres."""
    yaw_deg: float
    """Direction of the wall: 0 along x, 90 along y."""
    width_m: float
    """Width of the pane, metres."""
    height_m: float
    """Height of the pane, metres."""
    sill_m: float
    """Height of the pane's lower edge above the floor, metres."""


@dataclass(frozen=True, slots=True)
class Wall:
    """Solid, axis-aligned box of wall. Lintels and window breasts are walls too."""

    x_min: float
    """Lower bound, metres."""
    y_min: float
    """Lower bound, metres."""
    x_max: float
    """Upper bound, metres."""
    y_max: float
    """Upper bound, metres."""
    z_min: float
    """Lower bound, metres above the floor."""
    z_max: float
    """Upper bound, metres above the floor."""


@dataclass(frozen=True, slots=True)
class SceneObject:
    """Piece of furniture: an asset at its pose in a house."""

    object_id: int
    """Number of the object, from 0: its index in `House.objects`."""
    asset_id: str
    """Asset, as `Chair_17`."""
    type: str
    """Type of the asset, as `Chair`."""
    room: int
    """Id of the room."""
    x: float
    """Position of the asset's frame, metres."""
    y: float
    """Position of the asset's frame, metres."""
    z: float
    """Position of the asset's frame, metres above the floor."""
    quaternion: tuple[float, float, float, float]
    """Rotation of the asset's frame: (x, y, z, w), w >= 0."""
    group: int
    """Furniture group: objects of one group belong together (table and chairs); -1 for none."""
    support: int
    """object_id of the object on which it stands, -1 for the floor."""
    dynamics: Dynamics | None = None
    """Dynamics of this object, where attributes are hidden; null where its asset's hold."""
    affordance: Affordance | None = None
    """Interaction of which it can be the target whatever comes of it: that of its type, where
    attributes are hidden; null where its asset's `pushable` and `pickable` decide."""

    @property
    def pose(self) -> Pose:
        """Pose of the asset's frame."""
        return Pose(self.x, self.y, self.z, self.quaternion)


@dataclass(frozen=True, slots=True)
class Material:
    """Named surface for the camera: base colour and pattern."""

    name: str
    """Name by which rooms refer to it."""
    colour: RGB
    """Base colour."""
    pattern: str
    """plain, planks, tiles, stripes, carpet or bricks."""


@dataclass(frozen=True, slots=True)
class House:
    """Furnished house. Its interior's bounding box begins at (0, 0), its floor is z = 0."""

    scene_id: str
    """Name of the scene, as `scene-000017`."""
    scene: int
    """Number of the scene, from 0."""
    seed: int
    """Seed of the dataset."""
    split: Split
    """Split of the scene."""
    preset: str
    """Preset of the generator, or the name of a user's own plan."""
    outline: tuple[Vec2, ...]
    """Rectilinear polygon of outer wall centre lines, counter-clockwise, metres."""
    rooms: tuple[Room, ...]
    """Rooms, by room_id."""
    doors: tuple[Door, ...]
    """Doors, by door_id."""
    windows: tuple[Window, ...]
    """Windows, by window_id."""
    walls: tuple[Wall, ...]
    """Walls, lintels and window breasts."""
    objects: tuple[SceneObject, ...]
    """Furniture, by object_id."""
    materials: tuple[Material, ...]
    """Materials of the rooms' floors and walls."""
    room_graph: tuple[tuple[int, int], ...]
    """Pairs of rooms joined by at least one open door, ascending."""
    area_m2: float
    """Area of all rooms, square metres."""
    assets: Mapping[str, Asset] = field(compare=False, repr=False)
    """Assets by asset_id: at least those of `objects`. Not part of the scene row."""

    def __repr__(self) -> str:
        types = ", ".join(room.type for room in self.rooms)
        return (
            f"House {self.scene_id} ({self.split}, seed {self.seed}, {self.preset}): "
            f"{len(self.rooms)} rooms ({types}), {self.area_m2:g} m2, {len(self.doors)} doors, "
            f"{len(self.objects)} objects"
        )

    def _repr_png_(self) -> bytes | None:
        """Return a picture from above for a notebook."""
        shown: bytes | None = displayed(self, "png")
        return shown
