"""Assets: objects of a catalogue, made of convex parts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, Protocol

from internav_data.records.physics import Affordance, Dynamics
from internav_data.records.poses import Quaternion, Vec3

Shape = Literal["box", "cylinder", "sphere", "hull"]
"""Shapes of a part."""
RGB = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""


@dataclass(frozen=True, slots=True)
class Part:
    """Convex piece of an asset: the convex hull of its corner points.

    Boxes have 8 corners, cylinders are 16-gon prisms along their own z, spheres are fixed
    polyhedra and hulls bring their own corners (`internav_data.geometry.part_corners`). Physics,
    footprints, meshes and the camera all use this same polyhedron.

    Units: metres, in the asset's frame (origin on the floor under the middle of the asset's
    bounding box, z up).
    """

    shape: Shape
    """Shape before scaling to `size`."""
    centre: Vec3
    """Centre of the part, metres."""
    size: Vec3
    """Full extents along the part's own axes, before `rotation`, metres."""
    rotation: Quaternion
    """Rotation of the part about its centre: (x, y, z, w), w >= 0."""
    corners: tuple[Vec3, ...]
    """Hulls only: corner points relative to `centre`, before `rotation`, metres; () otherwise."""
    colour: RGB
    """Base colour."""
    material: str
    """wood, fabric, metal, plastic, ceramic, glass, leather, leaf, food, paper, screen or stone."""


@dataclass(frozen=True, slots=True)
class Asset:
    """Object that can stand in a house: its parts, mass and friction.

    Frame: the bounding box is centred on x = y = 0, its bottom is z = 0, its front looks along -y.
    """

    asset_id: str
    """Type and number, as `Chair_17`."""
    type: str
    """Type of object, as `Chair`."""
    size: Vec3
    """Width (x), depth (y) and height (z) of the bounding box, metres."""
    mass_kg: float
    """Mass, kilograms."""
    friction: float
    """Coefficient of sliding friction; the engine multiplies the coefficients of two bodies."""
    pushable: bool
    """Whether the agent's push can act on it."""
    pickable: bool
    """Whether the agent can pick it up."""
    spawnable: bool
    """Whether it may be spawned as an obstacle: the 20 obstacle types, and a user's own assets."""
    blocks: bool
    """Whether it has a footprint: false for rugs, which are floor. They are bodies of no physics,
    drawn 4 mm high at most."""
    parts: tuple[Part, ...]
    """Convex pieces; the asset is their union."""

    @property
    def dynamics(self) -> Dynamics:
        """Dynamics of an object of this asset, unless the object has its own."""
        return Dynamics(self.mass_kg, self.friction, self.pushable, self.pickable)

    def __hash__(self) -> int:
        """Return the hash of the id: assets key many caches, and hashing all parts is slow."""
        return hash(self.asset_id)


class Handled(Protocol):
    """Facts about an asset that make the affordance of its type."""

    @property
    def type(self) -> str:
        """Type of the asset."""

    @property
    def pushable(self) -> bool:
        """Whether the agent's push can act on it."""

    @property
    def pickable(self) -> bool:
        """Whether the agent can pick it up."""

    @property
    def spawnable(self) -> bool:
        """Whether it may be spawned as an obstacle."""


def type_affordances(assets: Iterable[Handled]) -> dict[str, Affordance]:
    """Return the affordance of each type that can be handled: that of most of its assets.

    Only assets that may be spawned count. A type without an asset that can be pushed or picked up
    is not among the keys; where as many can be pushed as picked up, it is pushed.

    Parameters
    ----------
    assets
        All assets of a catalogue: the affordance is a fact about the type.
    """
    votes: dict[str, int] = {}
    for asset in assets:
        if asset.spawnable and (asset.pushable or asset.pickable):
            votes[asset.type] = votes.get(asset.type, 0) + (1 if asset.pushable else -1)
    return {type_: "push" if vote >= 0 else "pick" for type_, vote in sorted(votes.items())}
