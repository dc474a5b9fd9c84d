"""Convex polygons into a depth buffer: culling, near clipping, scanlines. Numba, no fastmath.

A pixel belongs to a face when its centre lies in it, left and upper edges included, right and
lower ones not (the top-left rule of OpenGL and Direct3D). The crossing of an edge with a row is
always computed from the edge's upper end, so two faces that share an edge agree to the last bit: no
crack, no pixel twice. The buffer holds 1 / z, which is linear in the picture: float32 resolves a
micrometre at 10 m.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from internav_data.render.portal_culling import NEAR_M

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints32, Singles
    from internav_data.render.materials import Mesh

_NEARER = np.float32(1.000004)
"""Ratio of 1 / z by which a face must be nearer to hide another: of two faces in one plane the
first drawn stays in front, where both would show in stripes."""
_EDGE_ON_M = 1e-9
"""Height (m) of the eye over a face's plane below which the face is seen edge-on or from behind."""
_NOT_YET, _OUTSIDE, _AHEAD, _CUT = -2, -1, 0, 1
"""States of a part: not projected yet; out of the window; beyond the near plane; cut by it."""
_LEFT, _RIGHT, _ABOVE, _BELOW, _BEHIND = 1, 2, 4, 8, 16
"""Bits of an outcode (Cohen and Sutherland): the planes outside of which a vertex lies."""


@njit(cache=True, nogil=True, error_model="numpy")
def _edge(
    x0: float, y0: float, x1: float, y1: float, first: int, last: int, width: int, columns: Ints32
) -> None:
    """Write the first column right of an edge (y0 < y1) for rows [first, last)."""
    slope = (x1 - x0) / (y1 - y0)
    for row in range(first, last):
        x = math.ceil(x0 + (row + 0.5 - y0) * slope - 0.5)
        columns[row] = min(max(x, 0.0), float(width))


@njit(cache=True, nogil=True, error_model="numpy")
def scan(
    count: int, px: Floats, py: Floats, height: int, width: int, lefts: Ints32, rights: Ints32
) -> tuple[int, int]:
    """Write the columns [left, right) of each row of a convex polygon; return rows [top, bottom).

    The corners are px[:count], py[:count] (pixels), counter-clockwise as seen (y points down), so
    that edges down the picture are left ones; `lefts` and `rights` (height,) int32.
    """
    top, bottom = height, 0
    for k in range(count):
        j = k + 1 if k + 1 < count else 0
        down = py[k] < py[j]
        y0, y1 = (py[k], py[j]) if down else (py[j], py[k])
        first = int(max(math.ceil(y0 - 0.5), 0.0))
        last = int(min(math.ceil(y1 - 0.5), float(height)))
        if first >= last:
            continue
        top, bottom = min(top, first), max(bottom, last)
        if down:
            _edge(px[k], py[k], px[j], py[j], first, last, width, lefts)
        else:
            _edge(px[j], py[j], px[k], py[k], first, last, width, rights)
    return top, bottom


@njit(cache=True, nogil=True, error_model="numpy")
def fill(
    count: int,
    px: Floats,
    py: Floats,
    nx: float,
    ny: float,
    nz: float,
    face: int,
    depth: Singles,
    faces: Ints32,
    lefts: Ints32,
    rights: Ints32,
) -> bool:
    """Draw a convex polygon; return whether it covers any pixel, hidden or not.

    Parameters
    ----------
    count, px, py
        Number of corners; their columns and rows, (count or more,) float64, pixels.
    nx, ny, nz
        Plane: 1 / z is nx * x + ny * y + nz at the picture's point (x, y), pixels.
    face
        Number to write where the polygon is nearest.
    depth, faces
        Buffers (h, w): 1 / z float32, number of the face int32.
    lefts, rights
        Work space, (h,) int32.
    """
    height, width = depth.shape
    top, bottom = scan(count, px, py, height, width, lefts, rights)
    covered = False
    step, face32 = np.float32(nx), np.int32(face)
    for row in range(top, bottom):
        a, b = lefts[row], rights[row]
        if a < b:
            covered = True
            # From the span's own start: a float32 then carries no more than the span's range.
            start = np.float32(nx * (a + 0.5) + ny * (row + 0.5) + nz)
            # Both stores are unconditional, so that the loop has no branch and vectorises.
            for x in range(a, b):
                inverse = start + step * np.float32(np.int32(x) - np.int32(a))
                nearer = inverse > depth[row, x] * _NEARER
                depth[row, x] = inverse if nearer else depth[row, x]
                faces[row, x] = face32 if nearer else faces[row, x]
    return covered


@njit(cache=True, nogil=True, error_model="numpy")
def _project_part(
    mesh: Mesh,
    part: int,
    frame: Floats,
    focal: float,
    middle: float,
    window: Floats,
    points: Floats,
) -> int:
    """Write a part's vertices into `points` as `Scratch.points` has them.

    Returns _OUTSIDE where all lie beyond one side of the window (4, slopes) or before the near
    plane, _CUT where some lie before it, else _AHEAD.
    """
    outside, state = 31, _AHEAD
    base = mesh.first_vertex[part]
    for k in range(mesh.first_vertex[part + 1] - base):
        i = base + k
        vx, vy, vz = mesh.vertices[i, 0], mesh.vertices[i, 1], mesh.vertices[i, 2]
        x = frame[0] * vx + frame[1] * vy + frame[2] * vz + frame[9]
        y = frame[3] * vx + frame[4] * vy + frame[5] * vz + frame[10]
        z = frame[6] * vx + frame[7] * vy + frame[8] * vz + frame[11]
        points[k, 0], points[k, 1], points[k, 2] = x, y, z
        code = 0
        if z < NEAR_M:
            state = _CUT
            code = _BEHIND
        else:
            inverse = focal / z
            points[k, 3], points[k, 4] = x * inverse + middle, y * inverse + middle
        code |= _LEFT if x < window[0] * z else 0
        code |= _ABOVE if y < window[1] * z else 0
        code |= _RIGHT if x > window[2] * z else 0
        code |= _BELOW if y > window[3] * z else 0
        outside &= code
    return _OUTSIDE if outside != 0 else state


@njit(cache=True, nogil=True, error_model="numpy")
def _clip(
    mesh: Mesh, face: int, points: Floats, focal: float, middle: float, px: Floats, py: Floats
) -> int:
    """Cut a face at the near plane into px, py; return the number of corners.

    After Sutherland and Hodgman (1974). A shared edge is cut from its far end by both its faces, so
    that they agree to the last bit.
    """
    count = 0
    begin, end = mesh.first_corner[face], mesh.first_corner[face + 1]
    for c in range(begin, end):
        i = mesh.corners[c]
        j = mesh.corners[c + 1 if c + 1 < end else begin]
        here, there = points[i, 2] >= NEAR_M, points[j, 2] >= NEAR_M
        if here:
            px[count], py[count] = points[i, 3], points[i, 4]
            count += 1
        if here != there:
            far, near = (i, j) if here else (j, i)
            t = (NEAR_M - points[far, 2]) / (points[near, 2] - points[far, 2])
            x = points[far, 0] + t * (points[near, 0] - points[far, 0])
            y = points[far, 1] + t * (points[near, 1] - points[far, 1])
            px[count] = x * (focal / NEAR_M) + middle
            py[count] = y * (focal / NEAR_M) + middle
            count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def draw_parts(
    mesh: Mesh,
    begin: int,
    end: int,
    frame: Floats,
    frame_index: int,
    focal: float,
    middle: float,
    window: Floats,
    depth: Singles,
    faces: Ints32,
    drawn: Ints32,
    drawn_count: int,
    points: Floats,
    outline: Floats,
    spans: Ints32,
) -> int:
    """Draw the front faces of parts [begin, end); return the number of drawn faces so far.

    Parameters
    ----------
    frame, frame_index
        Row of `Scratch.frames`, (15,), and its number.
    focal, middle
        Focal length and centre of the picture, pixels.
    window
        Rectangle of slopes outside of which nothing needs to be drawn, (4,).
    depth, faces
        Buffers (h, w) float32 and int32.
    drawn, drawn_count
        Face and frame of each drawn face, (most, 2) int32; the number of those before.
    points, outline, spans
        Work space, as in `Scratch`: (vertices, 5), (2, corners + 1), (2, h).
    """
    px, py, lefts, rights = outline[0], outline[1], spans[0], spans[1]
    for part in range(begin, end):
        placed = _NOT_YET
        for face in range(mesh.first_face[part], mesh.first_face[part + 1]):
            ax, ay, az = mesh.planes[face, 0], mesh.planes[face, 1], mesh.planes[face, 2]
            # Back-face culling in the object's own frame: most faces cost no projection.
            above = ax * frame[12] + ay * frame[13] + az * frame[14] - mesh.planes[face, 3]
            if above <= _EDGE_ON_M:
                continue
            if placed == _NOT_YET:
                placed = _project_part(mesh, part, frame, focal, middle, window, points)
            if placed == _OUTSIDE:
                break
            if placed == _AHEAD:
                first = mesh.first_corner[face]
                count = mesh.first_corner[face + 1] - first
                for k in range(count):
                    i = mesh.corners[first + k]
                    px[k], py[k] = points[i, 3], points[i, 4]
            else:
                count = _clip(mesh, face, points, focal, middle, px, py)
            # The plane n . p = -above of the camera's frame, with p = z * ((x - middle) / focal,
            # (y - middle) / focal, 1), solved for 1 / z: linear in the pixel (x, y).
            scale = -1.0 / above
            nx = (frame[0] * ax + frame[1] * ay + frame[2] * az) * scale / focal
            ny = (frame[3] * ax + frame[4] * ay + frame[5] * az) * scale / focal
            nz = (frame[6] * ax + frame[7] * ay + frame[8] * az) * scale - (nx + ny) * middle
            if fill(count, px, py, nx, ny, nz, drawn_count, depth, faces, lefts, rights):
                drawn[drawn_count, 0] = face
                drawn[drawn_count, 1] = frame_index
                drawn_count += 1
    return drawn_count
