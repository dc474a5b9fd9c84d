"""Soft shadows under objects on the floor, which seem to float without them. Numba.

A shadow is the rectangle around an object, grown by a margin over which it fades. It darkens the
floor and all within 3 cm above it, rugs included, and changes neither depth nor ids.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from internav_data.render.portal_culling import NEAR_M
from internav_data.render.rasterise import scan

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints32, Singles

MARGIN_M = 0.12
"""Distance (m) over which a shadow fades: no more than a wall is thick, so that it stays in its
room."""
_STRENGTH = np.float32(0.34)
"""Share of the light that a shadow takes away at its middle."""
_FLOOR_M = np.float32(0.03)
"""Height (m) below which points are darkened."""
_TALL_M = 0.05
"""Least height (m) of an object with a shadow (rugs are lower), and its greatest distance from the
floor."""
_UPRIGHT = 0.98
"""Cosine of the greatest tilt: toppled objects have no shadow."""
_CORNERS = 4


@njit(cache=True, nogil=True, error_model="numpy")
def casts_shadow(pose: Floats, bounds: Floats) -> bool:
    """Return whether an object stands upright on the floor and is tall enough for a shadow.

    `pose` (12,) as in `Props.poses`, `bounds` (5,) as in `Mesh.bounds`.
    """
    return bounds[4] > _TALL_M and pose[8] > _UPRIGHT and abs(pose[11]) < _TALL_M


@njit(cache=True, nogil=True, error_model="numpy")
def _corners(
    frame: Floats, height: float, bounds: Floats, focal: float, middle: float, outline: Floats
) -> int:
    """Write the grown rectangle's corners, cut at the near plane; return their number.

    `frame` (15,) as in `Scratch.frames`; `height` is the floor's in the object's own frame.
    """
    count = 0
    x0, y0 = bounds[0] - MARGIN_M, bounds[1] - MARGIN_M
    x1, y1 = bounds[2] + MARGIN_M, bounds[3] + MARGIN_M
    for k in range(_CORNERS):
        ax, ay = (x1 if k in (1, 2) else x0), (y1 if k > 1 else y0)
        bx, by = (x1 if k in (0, 1) else x0), (y1 if k in (1, 2) else y0)
        z0 = frame[6] * ax + frame[7] * ay + frame[8] * height + frame[11]
        z1 = frame[6] * bx + frame[7] * by + frame[8] * height + frame[11]
        for end in range(2):
            if end == 0:
                if z0 < NEAR_M:
                    continue
                t = 0.0
            else:
                if (z0 < NEAR_M) == (z1 < NEAR_M):
                    continue
                t = (NEAR_M - z0) / (z1 - z0)
            px, py, pz = ax + t * (bx - ax), ay + t * (by - ay), z0 + t * (z1 - z0)
            scale = focal / pz
            right = frame[0] * px + frame[1] * py + frame[2] * height + frame[9]
            down = frame[3] * px + frame[4] * py + frame[5] * height + frame[10]
            outline[0, count] = right * scale + middle
            outline[1, count] = down * scale + middle
            count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def cast_shadow(
    frame: Floats,
    pose: Floats,
    bounds: Floats,
    axes: Floats,
    eye_height: float,
    focal: float,
    middle: float,
    inverse: Singles,
    shadow: Singles,
    outline: Floats,
    spans: Ints32,
) -> None:
    """Write the shadow of an object; where shadows overlap the darkest counts.

    Parameters
    ----------
    frame, pose, bounds
        Object: (15,) as in `Scratch.frames`, (12,) as in `Props.poses`, (5,) as in `Mesh.bounds`.
    axes, eye_height
        Camera's right, down and forward as rows (3, 3); its height, metres.
    focal, middle
        Focal length and centre of the picture, pixels.
    inverse
        Finished buffer of 1 / z, (h, w) float32.
    shadow
        Share of light taken away, (h, w) float32; changed.
    outline, spans
        Work space: (2, 5 or more) float64, (2, h) int32.
    """
    count = _corners(frame, -pose[11], bounds, focal, middle, outline)
    size = inverse.shape[0]
    top, bottom = scan(count, outline[0], outline[1], size, size, spans[0], spans[1])
    along_x, along_y = np.float32(frame[0] / focal), np.float32(frame[1] / focal)
    eye_x, eye_y = np.float32(frame[12]), np.float32(frame[13])
    x_mid, y_mid = np.float32((bounds[0] + bounds[2]) / 2), np.float32((bounds[1] + bounds[3]) / 2)
    x_half = np.float32((bounds[2] - bounds[0]) / 2)
    y_half = np.float32((bounds[3] - bounds[1]) / 2)
    zero, one = np.float32(0.0), np.float32(1.0)
    for row in range(top, bottom):
        below = (row + 0.5 - middle) / focal
        rise = np.float32(axes[2, 2] + axes[1, 2] * below)
        level = np.float32(0.5 - middle)
        x_row = np.float32(frame[6] + frame[3] * below) + along_x * level
        y_row = np.float32(frame[7] + frame[4] * below) + along_y * level
        # Each pixel's point, brought back into the object's own plane: z from the depth buffer.
        for x in range(spans[0, row], spans[1, row]):
            z = one / inverse[row, x]
            if np.float32(eye_height) + z * rise > _FLOOR_M:
                continue
            at = np.float32(np.int32(x))
            out_x = abs(eye_x + z * (x_row + along_x * at) - x_mid) - x_half
            out_y = abs(eye_y + z * (y_row + along_y * at) - y_mid) - y_half
            out_x, out_y = max(out_x, zero), max(out_y, zero)
            far = np.sqrt(out_x * out_x + out_y * out_y) * np.float32(1.0 / MARGIN_M)
            left = max(one - far, zero)
            shadow[row, x] = max(shadow[row, x], _STRENGTH * left * left)
