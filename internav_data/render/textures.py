"""Brightness and colour of a surface at (u, v): planks, tiles, panes… by formula. Numba.

`u` and `v` are metres on the surface, `pixel` the width of a pixel there: detail finer than a pixel
fades out, where it would flicker. All numbers are float32.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from internav_data.render.materials import (
    BRICKS,
    DOOR_LEAF,
    GRAIN,
    METAL,
    PANE,
    PLANKS,
    SCREEN,
    SPECKLE,
    STRIPES,
    TILES,
)

F: Any = np.float32
"""Constructor of constants: one double among them would make the results doubles too."""


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def noise(i: float, j: float) -> float:
    """Return a number in [0, 1) hashed from two whole numbers."""
    n = (np.int64(i) * 374761393 + np.int64(j) * 668265263) & 0x7FFFFFFF
    n = ((n ^ (n >> 13)) * 1274126177) & 0x7FFFFFFF
    return F(n & 0xFFFF) * F(1.0 / 65536.0)


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _fade(period: float, pixel: float) -> float:
    """Return the share of a pattern that is left: 1 from 2.5 pixels a period, 0 below one."""
    return min(max((period / pixel - F(1.0)) * F(0.66), F(0.0)), F(1.0))


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _line(into: float, width: float, pixel: float) -> float:
    """Return the share of a pixel, `into` metres past a line's start, that the line covers."""
    # A thin line is drawn up to four times wider and that much paler: its mean stays.
    thick = max(width, min(pixel, F(4.0) * width))
    return width / thick if into < thick else F(0.0)


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _grain(u: float, v: float, pixel: float) -> float:
    """Return the brightness of wood: year rings bent along u, and fine streaks close by."""
    along = u * F(1.3)
    wave = along - np.floor(along) - F(0.5)
    rings = v * F(16.0) + F(1.6) * wave * wave
    ring = rings - np.floor(rings)
    tone = F(1.0) + F(0.22) * (abs(ring - F(0.5)) - F(0.25)) * _fade(F(0.06), pixel)
    if pixel < F(0.00625):
        streak = noise(np.floor(v * F(160.0)), np.floor(u * F(3.0))) - F(0.5)
        tone += F(0.10) * streak * _fade(F(0.00625), pixel)
    return tone


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _planks(u: float, v: float, pixel: float) -> float:
    """Return the brightness of floor boards 1/7 m wide, shifted row by row, each of a tone."""
    row = np.floor(v * F(7.0))
    shift = noise(row, F(7.0))
    along = u * F(0.75) + shift * F(3.0)
    column = np.floor(along)
    into_v = v - row * F(1.0 / 7.0)
    into_u = (along - column) * F(1.0 / 0.75)
    tone = F(0.86) + F(0.24) * noise(row, column)
    seam = max(_line(into_v, F(0.006), pixel), _line(into_u, F(0.005), pixel))
    return tone * _grain(u + shift * F(9.0), v + shift, pixel) * (F(1.0) - F(0.42) * seam)


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _tiles(u: float, v: float, side: float, joint: float, pixel: float) -> float:
    """Return the brightness of square tiles, each of a tone, with darker joints."""
    column, row = np.floor(u / side), np.floor(v / side)
    seam = max(_line(u - column * side, joint, pixel), _line(v - row * side, joint, pixel))
    tone = F(0.94) + F(0.10) * noise(column, row)
    return tone * (F(1.0) - F(0.34) * seam)


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _speckle(u: float, v: float, per_m: float, strength: float, pixel: float) -> float:
    """Return the brightness of noise of two scales, the broad one six times coarser."""
    broad_m = per_m * F(0.17)
    broad = noise(np.floor(u * broad_m), np.floor(v * broad_m)) - F(0.5)
    tone = F(0.25) * broad * _fade(F(1.0) / broad_m, pixel)
    if pixel * per_m < F(1.0):
        fine = noise(np.floor(u * per_m), np.floor(v * per_m)) - F(0.5)
        tone += F(0.75) * fine * _fade(F(1.0) / per_m, pixel)
    return F(1.0) + strength * tone


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def tone_at(  # noqa: PLR0911 - one for each pattern
    pattern: int, u: float, v: float, a: float, b: float, pixel: float
) -> float:
    """Return the factor of brightness of a pattern of one colour; `a` and `b` as in `Look`."""
    if pattern == SPECKLE:
        return _speckle(u, v, a, b, pixel)
    if pattern == GRAIN:
        return _grain(u, v, pixel)
    if pattern == PLANKS:
        return _planks(u, v, pixel)
    if pattern == TILES:
        return _tiles(u, v, a, b, pixel)
    if pattern == STRIPES:
        share = u / a - np.floor(u / a)
        return F(1.0) + (F(0.035) if share < F(0.5) else F(-0.035)) * _fade(a, pixel)
    if pattern == METAL and pixel < F(0.0045):
        streak = noise(np.floor(v * F(220.0)), F(3.0)) - F(0.5)
        return F(1.0) + F(0.06) * streak * _fade(F(0.0045), pixel)
    return F(1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _leaf(u: float, v: float, width: float, height: float) -> float:
    """Return the brightness of a door: a frame, two raised panels, a gap around."""
    across = abs(u / width - F(0.5))
    high = v / height
    tone = _grain(v, u, F(0.01))
    lower, upper = F(0.12) < high < F(0.42), F(0.50) < high < F(0.92)
    if across < F(0.34) and (lower or upper):
        tone *= F(0.88) if across > F(0.31) else F(1.06)
    return tone * F(0.55) if across > F(0.488) else tone


@njit(cache=True, nogil=True, error_model="numpy")
def _bricks(
    u: float, v: float, red: float, green: float, blue: float, pixel: float
) -> tuple[float, float, float]:
    """Return the colour of bricks of 24 x 8 cm, every other row shifted by half, in mortar."""
    row = np.floor(v * F(12.5))
    shifted = u + (F(0.12) if np.int64(row) & 1 else F(0.0))
    column = np.floor(shifted * F(1.0 / 0.24))
    mortar = max(
        _line(v - row * F(0.08), F(0.012), pixel),
        _line(shifted - column * F(0.24), F(0.012), pixel),
    )
    tone = (F(0.82) + F(0.32) * noise(row, column)) * (F(1.0) - mortar)
    return (
        red * tone + F(196.0) * mortar,
        green * tone + F(188.0) * mortar,
        blue * tone + F(176.0) * mortar,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _pane(
    u: float, v: float, red: float, green: float, blue: float, width: float, height: float
) -> tuple[float, float, float]:
    """Return the colour of a window: sky over a hedge, a frame and a mullion."""
    border = min(u, width - u, v, height - v)
    if border < F(0.05) or abs(u - width * F(0.5)) < F(0.022):
        return F(240.0), F(240.0), F(238.0)
    high = v / height
    if high < F(0.24) + F(0.05) * noise(np.floor(u * F(9.0)), F(5.0)):
        return F(142.0), F(172.0), F(120.0)
    pale = F(1.0) - high
    return (
        red + (F(236.0) - red) * pale,
        green + (F(242.0) - green) * pale,
        blue + (F(248.0) - blue) * pale,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def paint(
    pattern: int,
    u: float,
    v: float,
    red: float,
    green: float,
    blue: float,
    a: float,
    b: float,
    pixel: float,
) -> tuple[float, float, float]:
    """Return red, green and blue (0 to 255) of a pattern of several colours."""
    if pattern == BRICKS:
        return _bricks(u, v, red, green, blue, pixel)
    if pattern == PANE:
        return _pane(u, v, red, green, blue, a, b)
    if pattern == SCREEN:
        slope = u * F(0.8) + v
        gleam = F(12.0) if F(0.0) < slope < F(0.22) else F(0.0)
        return red + gleam, green + gleam, blue + gleam * F(1.3)
    if pattern == DOOR_LEAF:
        if abs(u / a - F(0.9)) < F(0.05) and abs(v - F(1.02)) < F(0.015):
            return F(214.0), F(206.0), F(186.0)
        tone = _leaf(u, v, a, b)
        return red * tone, green * tone, blue * tone
    return red, green, blue
