"""What things are: an asset is made of convex parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from internav_data.records.physics import Dynamics
from internav_data.records.poses import Quaternion, Vec3

Shape = Literal["box", "cylinder", "sphere", "hull"]
RGB = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Part:
    """One convex piece of an asset: the convex hull of its corner points, everywhere.

    Boxes have 8 corners, cylinders are 16-gon prisms along their own z, spheres are fixed
    polyhedra and hulls bring their own corners (`internav_data.geometry.part_corners`). Physics,
    footprints, meshes and the camera all see this same polyhedron.

    Units: metres, in the asset's frame (origin on the floor under the middle of the asset's
    bounding box, z up).
    """

    shape: Shape
    centre: Vec3
    size: Vec3
    """Full extents along the part's own axes, before `rotation`."""
    rotation: Quaternion
    """Turns the part about its centre: (x, y, z, w), w >= 0."""
    corners: tuple[Vec3, ...]
    """Hulls only: corner points relative to `centre`, before `rotation`; () for other shapes."""
    colour: RGB
    material: str
    """wood, fabric, metal, plastic, ceramic, glass, leather, leaf, food, paper, screen or stone."""


@dataclass(frozen=True, slots=True)
class Asset:
    """One thing that can stand in a house: its parts and what it weighs.

    Frame: the bounding box is centred on x = y = 0, its bottom is z = 0, its front looks along -y.
    """

    asset_id: str
    """Type and number, as `Chair_17`."""
    type: str
    size: Vec3
    """Width (x), depth (y) and height (z) of the bounding box, metres."""
    mass_kg: float
    friction: float
    pushable: bool
    pickable: bool
    spawnable: bool
    """One of the 20 obstacle types (or a user's own): may be spawned on an agent's way."""
    blocks: bool
    """False for what an agent walks over (rugs) or under: it has no footprint."""
    parts: tuple[Part, ...]

    @property
    def dynamics(self) -> Dynamics:
        """Dynamics of an object of this asset, unless the object has its own."""
        return Dynamics(self.mass_kg, self.friction, self.pushable, self.pickable)

    def __hash__(self) -> int:
        """Assets key many caches; their id tells them apart, equality settles the rest."""
        return hash(self.asset_id)
