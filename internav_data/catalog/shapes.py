"""A sketch pad for assets: axis-aligned solids and hulls, fitted exactly to a bounding box.

Designs draw in metres, the front towards -y, and need not touch the box they aim at: `fitted`
stretches each axis so that the drawing fills it. Only axis-aligned solids and hulls with
explicit corners are drawn, because those survive a stretch exactly.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

from internav_data.records import RGB, Part, Vec3

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from internav_data.records import Quaternion, Shape, Vec2

Axis = Literal["x", "y", "z"]
Span = tuple[float, float]

GRID_M = 2e-4
"""Ends of parts lie on this grid, so that middles and sizes lie on the stored one of 0.1 mm."""

_UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)
_ROTATION: dict[Axis, Quaternion] = {
    "x": (0.0, 0.707107, 0.0, 0.707107),
    "y": (0.707107, 0.0, 0.0, 0.707107),
    "z": _UPRIGHT,
}


class Paint(NamedTuple):
    """Colour and material of a part's surface."""

    colour: RGB
    material: str

    def shade(self, factor: float) -> Paint:
        """Return a darker (below 1) or lighter paint of the same material."""
        red, green, blue = (min(255, round(c * factor)) for c in self.colour)
        return Paint((red, green, blue), self.material)


class _Mark(NamedTuple):
    """One drawn solid: its box, and for hulls its corners."""

    shape: Shape
    axis: Axis
    low: Vec3
    high: Vec3
    corners: tuple[Vec3, ...]
    paint: Paint


def _bounds(points: Iterable[Vec3]) -> tuple[Vec3, Vec3]:
    xs, ys, zs = zip(*points, strict=True)
    return (min(xs), min(ys), min(zs)), (max(xs), max(ys), max(zs))


def ring(x: float, y: float, z: float, rx: float, ry: float, sides: int = 12) -> list[Vec3]:
    """Return the corners of a level ellipse, first at +x, counter-clockwise; metres."""
    turns = (2.0 * math.pi * k / sides for k in range(sides))
    return [(x + rx * math.cos(t), y + ry * math.sin(t), z) for t in turns]


class Sketch:
    """Sketch of an asset: the solids drawn so far. All lengths in metres."""

    def __init__(self) -> None:
        self._marks: list[_Mark] = []

    def box(self, x: Span, y: Span, z: Span, paint: Paint) -> None:
        """Draw a box between the two ends of each axis."""
        low, high = (x[0], y[0], z[0]), (x[1], y[1], z[1])
        self._marks.append(_Mark("box", "z", low, high, (), paint))

    def cylinder(self, x: Span, y: Span, z: Span, paint: Paint, axis: Axis = "z") -> None:
        """Draw the (elliptic) cylinder along an axis that fills a box."""
        low, high = (x[0], y[0], z[0]), (x[1], y[1], z[1])
        self._marks.append(_Mark("cylinder", axis, low, high, (), paint))

    def rod(self, at: Vec2, z: Span, radius: float, paint: Paint) -> None:
        """Draw an upright round bar."""
        x, y = at
        self.cylinder((x - radius, x + radius), (y - radius, y + radius), z, paint)

    def ball(self, x: Span, y: Span, z: Span, paint: Paint) -> None:
        """Draw the ellipsoid that fills a box."""
        low, high = (x[0], y[0], z[0]), (x[1], y[1], z[1])
        self._marks.append(_Mark("sphere", "z", low, high, (), paint))

    def hull(self, corners: Sequence[Vec3], paint: Paint) -> None:
        """Draw the convex hull of some points."""
        low, high = _bounds(corners)
        self._marks.append(_Mark("hull", "z", low, high, tuple(corners), paint))

    def taper(
        self, low: tuple[Span, Span, float], high: tuple[Span, Span, float], paint: Paint
    ) -> None:
        """Draw the hull of two level rectangles, each (x, y, z)."""
        corners = [(x, y, z) for xs, ys, z in (low, high) for x in xs for y in ys]
        self.hull(corners, paint)

    def layers(self, rings: Sequence[Sequence[Vec3]], paint: Paint) -> None:
        """Draw the hull of some rings of corners."""
        self.hull([corner for one in rings for corner in one], paint)

    def cone(self, at: Vec2, z: Span, radii: Span, paint: Paint, sides: int = 12) -> None:
        """Draw a round frustum, radii at its foot and its top."""
        x, y = at
        foot, top = (ring(x, y, h, r, r, sides) for h, r in zip(z, radii, strict=True))
        self.layers((foot, top), paint)

    def cushion(self, x: Span, y: Span, z: Span, paint: Paint, soft: float = 0.25) -> None:
        """Draw a box with bevelled edges, `soft` the share of its thickness that is round."""
        bevel = soft * min(x[1] - x[0], y[1] - y[0], z[1] - z[0])
        inner_x, inner_y = (x[0] + bevel, x[1] - bevel), (y[0] + bevel, y[1] - bevel)
        inner_z = (z[0] + bevel, z[1] - bevel)
        corners = [(a, b, c) for a in inner_x for b in inner_y for c in z]
        corners += [(a, b, c) for a in x for b in inner_y for c in inner_z]
        corners += [(a, b, c) for a in inner_x for b in y for c in inner_z]
        self.hull(corners, paint)

    def prism(self, axis: Axis, outline: Sequence[Vec2], span: Span, paint: Paint) -> None:
        """Extrude a convex outline along an axis; it lies in the other two axes, in order."""
        axes: dict[Axis, Callable[[float, float, float], Vec3]] = {
            "x": lambda a, b, t: (t, a, b),
            "y": lambda a, b, t: (a, t, b),
            "z": lambda a, b, t: (a, b, t),
        }
        put = axes[axis]
        self.hull([put(a, b, t) for t in span for a, b in outline], paint)

    def slab(self, x: Span, foot: Span, top: Span, z: Span, paint: Paint) -> None:
        """Draw a board across x that leans: its depth (y) at the foot and at the top."""
        self.taper((x, foot, z[0]), (x, top, z[1]), paint)

    def strut(self, start: Vec3, end: Vec3, radius: float, paint: Paint) -> None:
        """Draw a square bar between two points at different heights, cut off level."""
        corners = [
            (x + a * radius, y + b * radius, z)
            for x, y, z in (start, end)
            for a in (-1.0, 1.0)
            for b in (-1.0, 1.0)
        ]
        self.hull(corners, paint)

    def legs(
        self, x: Span, y: Span, z: Span, radius: float, paint: Paint, *, round_: bool = False
    ) -> None:
        """Draw four legs whose outer faces stand on a rectangle."""
        for cx in (x[0] + radius, x[1] - radius):
            for cy in (y[0] + radius, y[1] - radius):
                if round_:
                    self.rod((cx, cy), z, radius, paint)
                else:
                    span_x, span_y = (cx - radius, cx + radius), (cy - radius, cy + radius)
                    self.box(span_x, span_y, z, paint)

    def fitted(self, size: Vec3) -> tuple[Part, ...]:
        """Stretch what was drawn to a box on the floor around x = y = 0, in stored numbers.

        Parameters
        ----------
        size
            Width, depth and height, metres, multiples of 2 `GRID_M`.
        """
        low, _ = _bounds(mark.low for mark in self._marks)
        _, high = _bounds(mark.high for mark in self._marks)
        starts = (-size[0] / 2.0, -size[1] / 2.0, 0.0)
        scales = [size[k] / (high[k] - low[k]) for k in range(3)]

        # Ends are snapped, not middles and sizes: parts that touch in the drawing still touch.
        def snapped(point: Vec3) -> tuple[int, int, int]:
            a, b, c = (
                round((starts[k] + (point[k] - low[k]) * scales[k]) / GRID_M) for k in range(3)
            )
            return a, b, c

        return tuple(_part(mark, snapped) for mark in self._marks)


def _part(mark: _Mark, snapped: Callable[[Vec3], tuple[int, int, int]]) -> Part:
    """Turn one solid into a part; grid steps of 0.2 mm become 0.1 mm middles and sizes."""
    corners = [snapped(corner) for corner in mark.corners]
    low, high = snapped(mark.low), snapped(mark.high)
    middle = (low[0] + high[0], low[1] + high[1], low[2] + high[2])
    # At least one grid step thick: a stretch may squeeze a thin sheet.
    extent = [2 * max(1, high[k] - low[k]) for k in range(3)]
    if mark.axis == "x":
        extent = [extent[2], extent[1], extent[0]]
    elif mark.axis == "y":
        extent = [extent[0], extent[2], extent[1]]
    local = tuple(
        (
            _metres(2 * x - middle[0]),
            _metres(2 * y - middle[1]),
            _metres(2 * z - middle[2]),
        )
        for x, y, z in dict.fromkeys(corners)
    )
    return Part(
        shape=mark.shape,
        centre=(_metres(middle[0]), _metres(middle[1]), _metres(middle[2])),
        size=(_metres(extent[0]), _metres(extent[1]), _metres(extent[2])),
        rotation=_ROTATION[mark.axis],
        corners=local,
        colour=mark.paint.colour,
        material=mark.paint.material,
    )


def _metres(steps: int) -> float:
    """Turn steps of 0.1 mm into metres: the float that reads as that many."""
    return steps / 10_000
