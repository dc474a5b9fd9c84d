"""Deferred shading: every pixel is shaded once, for the nearest face. Numba."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numba import njit

from internav_data.render.materials import BRICKS, PANE, PLAIN, SCREEN
from internav_data.render.textures import F, paint, tone_at

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Image, Ints, Ints32, Singles
    from internav_data.render.materials import Mesh

FAR_M = 100.0
"""Depth (m) of pixels that show nothing."""
RECORD = 18
"""Length of a face's record: u (0-3), v (4-7), light (8), pixel width (9), red, green, blue, a, b
(10-14), skirting (15), pattern (16), whether upright (17)."""
_UPRIGHT = 0.3
"""Vertical component of a normal below which its face counts as upright, like a wall."""
SKIRTING_M = F(0.085)
"""Height (m) of a skirting board."""


@njit(cache=True, nogil=True, error_model="numpy")
def light_of(nx: float, ny: float, nz: float) -> float:
    """Return the brightness of a surface by its unit normal, brightest from above.

    The terms in nx and ny make the four walls of a room differ, so that corners show.
    """
    above, below = max(0.0, nz), max(0.0, -nz)
    return 0.83 + 0.19 * above + 0.15 * below + 0.09 * nx * nx + 0.03 * (nx + ny)


@njit(cache=True, nogil=True, error_model="numpy")
def prepare(
    mesh: Mesh, face: int, frame: Floats, axes: Floats, focal: float, middle: float, out: Singles
) -> None:
    """Write the record (RECORD,) of a face.

    u is record[0] + z * (record[1] * column + record[2] * row + record[3]), v the same from
    record[4]: texture axes are linear in the camera's frame, where a pixel's point is z * ((column
    + 0.5 - middle) / focal, (row + 0.5 - middle) / focal, 1).

    `frame` (15,) as in `Scratch.frames`; `axes` (3, 3): the camera's right, down and forward as
    rows.
    """
    for t in range(2):
        a0, a1 = mesh.axes[face, 4 * t], mesh.axes[face, 4 * t + 1]
        a2, shift = mesh.axes[face, 4 * t + 2], mesh.axes[face, 4 * t + 3]
        cx = frame[0] * a0 + frame[1] * a1 + frame[2] * a2
        cy = frame[3] * a0 + frame[4] * a1 + frame[5] * a2
        cz = frame[6] * a0 + frame[7] * a1 + frame[8] * a2
        out[4 * t] = a0 * frame[12] + a1 * frame[13] + a2 * frame[14] + shift
        out[4 * t + 1] = cx / focal
        out[4 * t + 2] = cy / focal
        out[4 * t + 3] = cz + (cx + cy) * (0.5 - middle) / focal
    a0, a1 = mesh.planes[face, 0], mesh.planes[face, 1]
    a2, offset = mesh.planes[face, 2], mesh.planes[face, 3]
    cx = frame[0] * a0 + frame[1] * a1 + frame[2] * a2
    cy = frame[3] * a0 + frame[4] * a1 + frame[5] * a2
    cz = frame[6] * a0 + frame[7] * a1 + frame[8] * a2
    nx = axes[0, 0] * cx + axes[1, 0] * cy + axes[2, 0] * cz
    ny = axes[0, 1] * cx + axes[1, 1] * cy + axes[2, 1] * cz
    nz = axes[0, 2] * cx + axes[1, 2] * cy + axes[2, 2] * cz
    # (nx, ny, nz) is the normal in the house's frame, where light falls from above.
    out[8] = light_of(nx, ny, nz)
    above = a0 * frame[12] + a1 * frame[13] + a2 * frame[14] - offset
    # Width of a pixel on the face: z / focal, over the cosine of the angle above / z.
    out[9] = 1.0 / (focal * max(above, 1e-3))
    for k in range(3):
        out[10 + k] = mesh.looks[face, k]
    out[13], out[14] = mesh.looks[face, 4], mesh.looks[face, 5]
    out[15], out[16] = mesh.looks[face, 6], mesh.looks[face, 3]
    out[17] = 1.0 if abs(nz) < _UPRIGHT else 0.0


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _byte(value: float) -> Any:  # noqa: ANN401 - numba reads types, not annotations
    return np.uint8(np.int32(min(value, F(255.0))))


@njit(cache=True, nogil=True, error_model="numpy")
def _shade_span(
    record: Singles,
    row: int,
    begin: int,
    end: int,
    high: float,
    rise: float,
    per_pixel: float,
    inverse: Singles,
    shadow: Singles,
    rgb: Image,
    depth: Singles,
) -> None:
    """Shade the columns [begin, end) of a row, all of one face.

    `high` is the eye's height (m), `rise` the rise of the row's rays for a metre along the optical
    axis, `per_pixel` the width of a pixel one metre away.
    """
    y = F(row)
    u_start, u_step, u_row = record[0], record[1], record[2] * y + record[3]
    v_start, v_step, v_row = record[4], record[5], record[6] * y + record[7]
    base, width, a, b = record[8], record[9], record[13], record[14]
    pattern = np.int32(record[16])
    upright, skirting = record[17] > F(0.5), record[15] > F(0.5)
    colourful = pattern >= SCREEN or pattern == BRICKS
    for x in range(begin, end):
        nearness = inverse[row, x]
        z = F(1.0) / nearness
        depth[row, x] = z
        red, green, blue = record[10], record[11], record[12]
        light = base * (F(0.84) + F(0.20) * min(nearness, F(0.8)))
        level = F(1.0)
        if upright:
            # Less light reaches the foot of a wall.
            level = high + z * rise
            light *= F(0.86) + F(0.14) * min(F(1.0), max(level, F(0.0)) * F(2.2))
        else:
            light *= F(1.0) - shadow[row, x]
        if skirting and level < SKIRTING_M:
            red, green, blue = F(232.0), F(229.0), F(222.0)
            light *= F(0.78) if level > SKIRTING_M - F(0.006) else F(1.0)
        elif pattern != PLAIN:
            u = u_start + z * (u_step * F(x) + u_row)
            v = v_start + z * (v_step * F(x) + v_row)
            pixel = max(z * z * width, z * per_pixel)
            if colourful:
                red, green, blue = paint(pattern, u, v, red, green, blue, a, b, pixel)
                light = F(1.0) if pattern == PANE else light
            else:
                light *= tone_at(pattern, u, v, a, b, pixel)
        rgb[row, x, 0] = _byte(red * light)
        rgb[row, x, 1] = _byte(green * light)
        rgb[row, x, 2] = _byte(blue * light)


@njit(cache=True, nogil=True, error_model="numpy")
def shade(
    structure: Mesh,
    labels: Ints,
    library: Mesh,
    frames: Floats,
    axes: Floats,
    eye_height: float,
    focal: float,
    middle: float,
    inverse: Singles,
    shadow: Singles,
    faces: Ints32,
    drawn: Ints32,
    prepared: Image,
    records: Singles,
    rgb: Image,
    depth: Singles,
    ids: Ints32,
) -> None:
    """Shade a picture; a face's record is prepared at its first pixel.

    Parameters
    ----------
    structure, labels, library
        Mesh of the house, instance ids of its faces (faces,), mesh of the assets.
    frames
        Transforms, (instances + 1, 15): row 0 of the house, row 1 + k of instance k.
    axes, eye_height
        Camera's right, down and forward as rows (3, 3); its height, metres.
    focal, middle
        Focal length and centre of the picture, pixels.
    inverse, shadow, faces
        Finished buffers (h, w): 1 / z, share of light taken away, number of the drawn face.
    drawn
        Face and frame of each drawn face, (most, 2) int32.
    prepared, records
        Whether a drawn face has its record, (most,) uint8, 0 at first; records (most, RECORD).
    rgb, depth, ids
        Picture to write: (h, w, 3) uint8, (h, w) float32 metres, (h, w) int32.
    """
    height, width = inverse.shape
    per_pixel = F(1.0 / focal)
    for row in range(height):
        # A point at depth z lies eye_height + z * rise above the floor: no picture is ever rolled.
        rise = F(axes[2, 2] + axes[1, 2] * (row + 0.5 - middle) / focal)
        begin = 0
        while begin < width:
            number = faces[row, begin]
            end = begin + 1
            while end < width and faces[row, end] == number:
                end += 1
            if number < 0:
                for x in range(begin, end):
                    rgb[row, x, 0] = rgb[row, x, 1] = rgb[row, x, 2] = 0
                    depth[row, x] = FAR_M
                    ids[row, x] = 0
            else:
                face, frame = drawn[number, 0], drawn[number, 1]
                record = records[number]
                if prepared[number] == 0:
                    prepared[number] = 1
                    mesh = structure if frame == 0 else library
                    prepare(mesh, face, frames[frame], axes, focal, middle, record)
                label = np.int32(labels[face] if frame == 0 else frame)
                for x in range(begin, end):
                    ids[row, x] = label
                _shade_span(
                    record, row, begin, end, F(eye_height), rise, per_pixel, inverse, shadow,
                    rgb, depth,
                )  # fmt: skip
            begin = end
