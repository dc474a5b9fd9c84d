"""Appearance of surfaces: patterns by formula, and the choice of one by material."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from internav_data.core.typing import Floats, Ints
    from internav_data.records import RGB, Material

PLAIN: Final = 0
"""Pattern of one colour."""
SPECKLE: Final = 1
"""Pattern of noise in squares: `a` squares a metre, strength `b`."""
GRAIN: Final = 2
"""Pattern of wood: u runs along the grain."""
PLANKS: Final = 3
"""Pattern of floor boards along u."""
TILES: Final = 4
"""Pattern of tiles of side `a` with joints of width `b`, metres."""
BRICKS: Final = 5
"""Pattern of bricks in mortar."""
STRIPES: Final = 6
"""Pattern of stripes along v, one light and one dark in `a` metres."""
METAL: Final = 7
"""Pattern of brushed metal."""
SCREEN: Final = 8
"""Pattern of a screen with a gleam."""
PANE: Final = 9
"""Pattern of a window, `a` wide and `b` high, metres; u and v from its lower corner."""
DOOR_LEAF: Final = 10
"""Pattern of a door, `a` wide and `b` high, metres; u and v from its lower corner."""


class Look(NamedTuple):
    """Colour and pattern of a face."""

    colour: RGB
    """Base colour."""
    pattern: int
    """Number of a pattern, as `PLANKS`."""
    a: float = 0.0
    """First parameter of the pattern, 0 for patterns without one."""
    b: float = 0.0
    """Second parameter of the pattern, 0 for patterns without one."""
    skirting: bool = False
    """Whether a skirting board runs along the floor: walls only."""


class Mesh(NamedTuple):
    """Convex polygons in flat arrays, as the kernels read them.

    A model has parts, a part has vertices and faces, a face has corners, counter-clockwise from
    outside. Every `first_*` array has one entry more than there are owners.
    """

    first_part: Ints
    """First part of each model, (models + 1,) int64."""
    spheres: Floats
    """Centre and radius of a ball around each model, (models, 4), own frame, metres."""
    bounds: Floats
    """x_min, y_min, x_max, y_max, z_max of each model, (models, 5), own frame, metres."""
    first_vertex: Ints
    """First vertex of each part, (parts + 1,) int64."""
    first_face: Ints
    """First face of each part, (parts + 1,) int64."""
    vertices: Floats
    """Vertices in the model's own frame, (vertices, 3), metres."""
    first_corner: Ints
    """First corner of each face, (faces + 1,) int64."""
    corners: Ints
    """Vertex of each corner, counted from its part's first, (corners,) int64."""
    planes: Floats
    """Unit normal outwards and distance from the origin (m) of each face, (faces, 4)."""
    axes: Floats
    """Texture axes of each face, (faces, 8): u = axes[0:3] . p + axes[3] and
    v = axes[4:7] . p + axes[7] at point p, metres."""
    looks: NDArray[np.float32]
    """Red, green, blue, pattern, a, b, skirting of each face, (faces, 7): see `Look`."""


class Rooms(NamedTuple):
    """Instance ids of a house's rectangles, and its rooms joined by doors, for portal culling."""

    labels: Ints
    """Instance id of each rectangle, (parts,) int64; part and face have the same number."""
    boxes: Floats
    """x_min, y_min, x_max, y_max (m) of boxes that tile the rooms, up to the walls' centre lines,
    (boxes, 4)."""
    box_rooms: Ints
    """Index of the room of each box, (boxes,) int64."""
    doors: Floats
    """Corners (m) of each open door's rectangle, on the wall's centre line, (doors, 4, 3)."""
    door_rooms: Ints
    """Indices of the two rooms of each open door, (doors, 2) int64."""


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
"""Least brightness of all channels of painted wood, which shows no grain."""


def part_look(material: str, colour: RGB) -> Look:
    """Return the look of a part of an asset."""
    if material == "wood" and min(colour) >= _PAINTED:
        return Look(colour, PLAIN)
    return Look(colour, *_PART_LOOKS.get(material, (PLAIN, 0.0, 0.0)))


def floor_look(material: Material) -> Look:
    """Return the look of a floor."""
    tiles = (TILES, 0.45, 0.010)
    known = {**_HOUSE_PATTERNS, "tiles": tiles}
    return Look(material.colour, *known.get(material.pattern, (SPECKLE, 12.0, 0.03)))


def wall_look(material: Material) -> Look:
    """Return the look of a wall: smaller tiles than a floor's, and a skirting board."""
    tiles = (TILES, 0.18, 0.007)
    known = {**_HOUSE_PATTERNS, "tiles": tiles}
    pattern, a, b = known.get(material.pattern, (PLAIN, 0.0, 0.0))
    return Look(material.colour, pattern, a, b, material.pattern != "tiles")


def look_row(look: Look) -> list[float]:
    """Return a row of `Mesh.looks`."""
    red, green, blue = look.colour
    return [red, green, blue, look.pattern, look.a, look.b, float(look.skirting)]
