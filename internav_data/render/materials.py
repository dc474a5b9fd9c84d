"""What surfaces look like: patterns by formula, and how parts and materials choose theirs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from internav_data.core.typing import Floats, Ints
    from internav_data.records import RGB, Material

PLAIN: Final = 0
SPECKLE: Final = 1
"""Noise in squares: `a` squares a metre, `b` how strong."""
GRAIN: Final = 2
"""Wood: u runs along the grain."""
PLANKS: Final = 3
TILES: Final = 4
"""`a` side of a tile, `b` width of the joint, metres."""
BRICKS: Final = 5
STRIPES: Final = 6
METAL: Final = 7
SCREEN: Final = 8
PANE: Final = 9
"""A window, `a` wide and `b` high, metres; u and v from its lower corner."""
DOOR_LEAF: Final = 10
"""A door, `a` wide and `b` high, metres; u and v from its lower corner."""


class Look(NamedTuple):
    """How one face is coloured."""

    colour: RGB
    pattern: int
    a: float = 0.0
    b: float = 0.0
    skirting: bool = False
    """Whether a skirting board runs along the floor: walls only."""


class Mesh(NamedTuple):
    """Convex polygons in flat arrays, as the kernels read them.

    A model has parts, a part has vertices and faces, a face has corners, counter-clockwise from
    outside. Every `first_*` array has one entry more than there are owners.
    """

    first_part: Ints
    """(models + 1,)"""
    spheres: Floats
    """(models, 4): centre and radius of a ball that holds the model, its own frame, metres."""
    bounds: Floats
    """(models, 5): x_min, y_min, x_max, y_max, z_max, its own frame, metres."""
    first_vertex: Ints
    """(parts + 1,)"""
    first_face: Ints
    """(parts + 1,)"""
    vertices: Floats
    """(vertices, 3), metres."""
    first_corner: Ints
    """(faces + 1,)"""
    corners: Ints
    """(corners,): a vertex, counted from its part's first."""
    planes: Floats
    """(faces, 4): unit normal outwards, distance from the origin."""
    axes: Floats
    """(faces, 8): u = axes[0:3] . p + axes[3], v = axes[4:7] . p + axes[7], metres."""
    looks: NDArray[np.float32]
    """(faces, 7): red, green, blue, pattern, a, b, skirting."""


class Rooms(NamedTuple):
    """What a house adds to its mesh: what its rectangles are, and how rooms are joined."""

    labels: Ints
    """(parts,): instance id of each rectangle. Part and face have the same number."""
    boxes: Floats
    """(boxes, 4): x_min, y_min, x_max, y_max of rooms' boxes, up to the walls' centre lines."""
    box_rooms: Ints
    """(boxes,): index of the room."""
    doors: Floats
    """(doors, 4, 3): corners of each open door's rectangle, on the wall's centre line."""
    door_rooms: Ints
    """(doors, 2): indices of the rooms it joins."""


_PART_LOOKS: Mapping[str, tuple[int, float, float]] = {
    "wood": (GRAIN, 0.0, 0.0),
    "fabric": (SPECKLE, 70.0, 0.16),
    "leather": (SPECKLE, 25.0, 0.06),
    "metal": (METAL, 0.0, 0.0),
    "leaf": (SPECKLE, 30.0, 0.30),
    "food": (SPECKLE, 60.0, 0.14),
    "stone": (SPECKLE, 45.0, 0.12),
    "screen": (SCREEN, 0.0, 0.0),
}
_HOUSE_PATTERNS: Mapping[str, tuple[int, float, float]] = {
    "planks": (PLANKS, 0.0, 0.0),
    "carpet": (SPECKLE, 40.0, 0.14),
    "bricks": (BRICKS, 0.0, 0.0),
    "stripes": (STRIPES, 0.24, 0.0),
}


_PAINTED = 185
"""Wood whose channels are all at least this bright is painted: no grain."""


def part_look(material: str, colour: RGB) -> Look:
    """Return how a part of an asset is coloured."""
    if material == "wood" and min(colour) >= _PAINTED:
        return Look(colour, PLAIN)
    return Look(colour, *_PART_LOOKS.get(material, (PLAIN, 0.0, 0.0)))


def floor_look(material: Material) -> Look:
    """Return how a floor is coloured."""
    tiles = (TILES, 0.45, 0.010)
    known = {**_HOUSE_PATTERNS, "tiles": tiles}
    return Look(material.colour, *known.get(material.pattern, (SPECKLE, 12.0, 0.03)))


def wall_look(material: Material) -> Look:
    """Return how a wall is coloured: smaller tiles, and a skirting board."""
    tiles = (TILES, 0.18, 0.007)
    known = {**_HOUSE_PATTERNS, "tiles": tiles}
    pattern, a, b = known.get(material.pattern, (PLAIN, 0.0, 0.0))
    return Look(material.colour, pattern, a, b, material.pattern != "tiles")


def look_row(look: Look) -> list[float]:
    """Return a row of `Mesh.looks`."""
    red, green, blue = look.colour
    return [red, green, blue, look.pattern, look.a, look.b, float(look.skirting)]
