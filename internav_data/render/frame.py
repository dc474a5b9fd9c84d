"""One picture: cull, draw, shade. Numba."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

from internav_data.render.portal_culling import ball_in_rooms, room_windows
from internav_data.render.rasterise import draw_parts
from internav_data.render.shading import FAR_M, shade
from internav_data.render.shadows import MARGIN_M, cast_shadow, casts_shadow

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Image, Ints, Ints32, Singles
    from internav_data.render.materials import Mesh, Rooms


class Scratch(NamedTuple):
    """Buffers of one camera, used again for every picture."""

    inverse: Singles
    """(h, w): 1 / z."""
    faces: Ints32
    """(h, w): number of the drawn face, -1 for none."""
    drawn: Ints32
    """(most, 2)"""
    made: Image
    """(most,)"""
    records: Singles
    """(most, RECORD)"""
    frames: Floats
    """(instances + 1, 15)"""
    points: Floats
    """(vertices of a part, 5)"""
    outline: Floats
    """(2, corners + 1 of a face)"""
    spans: Ints32
    """(2, h)"""
    seen: Ints32
    """(instances + 1,): how many instances may show, then which."""
    shadow: Singles
    """(h, w): share of light taken away."""


@njit(cache=True, nogil=True, error_model="numpy")
def _frame(axes: Floats, eye: Floats, pose: Floats, out: Floats) -> None:
    """Compose camera and pose (12,: rotation by rows, position) to a frame of `draw_parts`."""
    dx, dy, dz = pose[9] - eye[0], pose[10] - eye[1], pose[11] - eye[2]
    for r in range(3):
        a, b, c = axes[r, 0], axes[r, 1], axes[r, 2]
        for k in range(3):
            out[3 * r + k] = a * pose[k] + b * pose[3 + k] + c * pose[6 + k]
        out[9 + r] = a * dx + b * dy + c * dz
    for k in range(3):
        out[12 + k] = -(pose[k] * dx + pose[3 + k] * dy + pose[6 + k] * dz)


@njit(cache=True, nogil=True, error_model="numpy")
def _house(
    mesh: Mesh,
    windows: Floats,
    axes: Floats,
    eye: Floats,
    focal: float,
    middle: float,
    scratch: Scratch,
) -> int:
    """Draw the house's own surfaces, each within the window of its room."""
    frame = scratch.frames[0]
    pose = np.zeros(12)
    pose[0] = pose[4] = pose[8] = 1.0
    _frame(axes, eye, pose, frame)
    count = 0
    for room in range(windows.shape[0]):
        window = windows[room]
        if window[0] < window[2] and window[1] < window[3]:
            count = draw_parts(
                mesh, mesh.first_part[room], mesh.first_part[room + 1], frame, 0, focal, middle,
                window, scratch.inverse, scratch.faces, scratch.drawn, count,
                scratch.points, scratch.outline, scratch.spans,
            )  # fmt: skip
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _things(
    mesh: Mesh,
    models: Ints,
    poses: Floats,
    present: Image,
    rooms: Rooms,
    windows: Floats,
    axes: Floats,
    eye: Floats,
    focal: float,
    middle: float,
    scratch: Scratch,
    count: int,
) -> int:
    """Draw everything that stands in the house."""
    limit = middle / focal
    whole = np.array([-limit, -limit, limit, limit])
    centre, local = np.empty(3), np.empty(3)
    scratch.seen[0] = 0
    for k in range(models.shape[0]):
        if present[k] == 0:
            continue
        frame, pose, model = scratch.frames[k + 1], poses[k], models[k]
        x, y, z = mesh.spheres[model, 0], mesh.spheres[model, 1], mesh.spheres[model, 2]
        radius = mesh.spheres[model, 3]
        for r in range(3):
            centre[r] = pose[3 * r] * x + pose[3 * r + 1] * y + pose[3 * r + 2] * z + pose[9 + r]
        dx, dy, dz = centre[0] - eye[0], centre[1] - eye[1], centre[2] - eye[2]
        for r in range(3):
            local[r] = axes[r, 0] * dx + axes[r, 1] * dy + axes[r, 2] * dz
        # Its shadow may show where it does not.
        radius += MARGIN_M
        if not ball_in_rooms(centre, local, radius, rooms.boxes, rooms.box_rooms, windows):
            continue
        _frame(axes, eye, pose, frame)
        scratch.seen[0] += 1
        scratch.seen[scratch.seen[0]] = k
        count = draw_parts(
            mesh, mesh.first_part[model], mesh.first_part[model + 1], frame, k + 1, focal, middle,
            whole, scratch.inverse, scratch.faces, scratch.drawn, count,
            scratch.points, scratch.outline, scratch.spans,
        )  # fmt: skip
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _shadows(
    mesh: Mesh,
    models: Ints,
    poses: Floats,
    axes: Floats,
    eye: Floats,
    focal: float,
    middle: float,
    scratch: Scratch,
) -> None:
    """Let all things drawn darken the floor."""
    scratch.shadow[:, :] = 0.0
    for n in range(1, scratch.seen[0] + 1):
        k = scratch.seen[n]
        pose, bounds = poses[k], mesh.bounds[models[k]]
        if casts_shadow(pose, bounds):
            cast_shadow(
                scratch.frames[k + 1], pose, bounds, axes, eye[2], focal, middle, scratch.inverse,
                scratch.shadow, scratch.outline, scratch.spans,
            )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def picture(
    structure: Mesh,
    rooms: Rooms,
    library: Mesh,
    models: Ints,
    poses: Floats,
    present: Image,
    axes: Floats,
    eye: Floats,
    portals: bool,
    scratch: Scratch,
    rgb: Image,
    depth: Singles,
    ids: Ints32,
) -> int:
    """Draw one picture of field of view 90 degrees; return how many faces were drawn.

    Parameters
    ----------
    axes, eye
        Right, down and forward as rows (3, 3); position (3,), metres: the house's frame.
    portals
        Whether rooms that no door shows are left out: the same picture, sooner.

    """
    focal = middle = scratch.inverse.shape[1] / 2.0
    scratch.inverse[:, :] = 1.0 / FAR_M
    scratch.faces[:, :] = -1
    windows = np.empty((structure.first_part.shape[0] - 1, 4))
    if portals:
        room_windows(
            eye, axes, 1.0, rooms.boxes, rooms.box_rooms, rooms.doors, rooms.door_rooms,
            windows,
        )  # fmt: skip
    else:
        windows[:, :2] = -1.0
        windows[:, 2:] = 1.0
    count = _house(structure, windows, axes, eye, focal, middle, scratch)
    count = _things(
        library, models, poses, present, rooms, windows, axes, eye, focal, middle, scratch, count
    )
    _shadows(library, models, poses, axes, eye, focal, middle, scratch)
    scratch.made[:count] = 0
    shade(
        structure, rooms.labels, library, scratch.frames, axes, eye[2], focal, middle,
        scratch.inverse, scratch.shadow, scratch.faces, scratch.drawn, scratch.made,
        scratch.records, rgb, depth, ids,
    )  # fmt: skip
    return count
