"""Floors from above: planks, tiles, carpets, each a formula of a pixel's position."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from internav_data.core.typing import Floats
    from internav_data.records import RGB, House, Room
    from internav_data.views.canvas import Canvas

    Pattern = Callable[[Floats, Floats], Floats]

_PAPER = np.array([255.0, 253.0, 249.0])
_FADED = 0.45
"""Share of white in a floor's colour: furniture must stand out from it."""
_DEFAULT: RGB = (205, 190, 170)


def _speckle(a: NDArray[np.int64], b: NDArray[np.int64]) -> Floats:
    """Noise in [-1, 1], a pure function of two integers (broadcast)."""
    mixed = (a * 73856093) ^ (b * 19349663)
    mixed = (mixed ^ (mixed >> 13)) * 1274126177
    return ((mixed >> 7) & 1023).astype(np.float64) / 511.5 - 1.0


def _cells(values: Floats, size: float) -> tuple[NDArray[np.int64], Floats]:
    """Return the index of the cell with each coordinate, and the depth inside it, metres."""
    index = np.floor(values / size)
    return index.astype(np.int64), values - index * size


def _planks(x: Floats, y: Floats) -> Floats:
    row, depth = _cells(y, 0.16)
    column, along = _cells(x + 0.55 * (row % 3) + 0.2 * (row % 7), 1.5)
    seam = (depth < 0.012) | (along < 0.012)
    return np.where(seam, -0.10, 0.035 * _speckle(column, row))


def _tiles(x: Floats, y: Floats) -> Floats:
    column, along = _cells(x, 0.45)
    row, depth = _cells(y, 0.45)
    grout = (along < 0.016) | (depth < 0.016)
    return np.where(grout, -0.09, 0.018 * _speckle(column, row))


def _bricks(x: Floats, y: Floats) -> Floats:
    row, depth = _cells(y, 0.12)
    column, along = _cells(x + 0.12 * (row % 2), 0.24)
    seam = (depth < 0.012) | (along < 0.012)
    return np.where(seam, -0.09, 0.05 * _speckle(column, row))


def _carpet(x: Floats, y: Floats) -> Floats:
    column, _ = _cells(x, 0.03)
    row, _ = _cells(y, 0.03)
    return 0.03 * _speckle(column, row)


def _stripes(x: Floats, y: Floats) -> Floats:
    _, depth = _cells(x + 0.0 * y, 0.2)
    return np.where(depth < 0.1, -0.03, 0.03)


def _plain(x: Floats, y: Floats) -> Floats:
    return np.zeros(np.broadcast_shapes(x.shape, y.shape))


_PATTERNS: dict[str, Pattern] = {
    "planks": _planks,
    "tiles": _tiles,
    "bricks": _bricks,
    "carpet": _carpet,
    "stripes": _stripes,
    "plain": _plain,
}


def paint_floor(canvas: Canvas, house: House, room: Room) -> None:
    """Paint one room's floor in its material's colour and pattern."""
    surfaces = {m.name: m for m in house.materials}
    material = surfaces.get(room.floor_material)
    pattern = _PATTERNS.get(material.pattern, _plain) if material else _plain
    colour = np.array(material.colour if material else _DEFAULT, dtype=np.float64)
    faded = colour + (_PAPER - colour) * _FADED
    xs, ys = [p[0] for p in room.polygon], [p[1] for p in room.polygon]
    window = canvas.window((min(xs), min(ys)), (max(xs), max(ys)))
    x, y = canvas.metres(window)
    light = pattern(x[None, :], y[:, None])
    floor = np.clip(faded * (1.0 + light[..., None]), 0.0, 255.0)
    inside = canvas.mask([room.polygon])[window]
    weight = inside[..., None] / 255.0
    canvas.image[window] = (canvas.image[window] * (1.0 - weight) + floor * weight).astype(np.uint8)
