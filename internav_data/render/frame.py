"""One picture: cull rooms, draw faces, cast shadows, shade pixels. Numba.

Frames: the camera looks along its z axis, x points right and y down. A pixel (column, row) has its
centre at (column + 0.5, row + 0.5); a point (x, y, z) of the camera's frame lies in the picture at
focal * (x, y) / z + middle, where focal = middle = half the picture's width (90 degrees).
"""

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
    """Buffers of one camera, used again for every picture; most = largest number of drawn faces."""

    inverse: Singles
    """Depth buffer: 1 / z, (h, w) float32, 1 / m."""
    faces: Ints32
    """Number of the drawn face that each pixel shows, (h, w) int32; -1 for none."""
    drawn: Ints32
    """Face of the mesh and frame of each drawn face, (most, 2) int32."""
    prepared: Image
    """Whether a drawn face has its record, (most,) uint8."""
    records: Singles
    """Shading parameters of each drawn face, (most, RECORD) float32: see `prepare`."""
    frames: Floats
    """Transform of the house (row 0) and of instance k (row 1 + k), (instances + 1, 15) float64:
    rotation into the camera's frame by rows (9), translation (3), the eye in the object's own
    frame (3)."""
    points: Floats
    """Vertices of the part being drawn, (vertices, 5) float64: x, y, z in the camera's frame,
    metres; x, y in the picture, pixels."""
    outline: Floats
    """Corners of the face being drawn, x and y in pixels, (2, corners + 1) float64."""
    spans: Ints32
    """First column and end of each row of the face being drawn, (2, h) int32."""
    seen: Ints32
    """Number of instances that may show, then their numbers, (instances + 1,) int32."""
    shadow: Singles
    """Share of the light that shadows take away, (h, w) float32."""


@njit(cache=True, nogil=True, error_model="numpy")
def _compose(axes: Floats, eye: Floats, pose: Floats, out: Floats) -> None:
    """Write a row of `Scratch.frames`: camera and pose (12,: rotation by rows, position) composed.

    `axes` (3, 3) and `eye` (3,) as for `picture`.
    """
    dx, dy, dz = pose[9] - eye[0], pose[10] - eye[1], pose[11] - eye[2]
    for r in range(3):
        a, b, c = axes[r, 0], axes[r, 1], axes[r, 2]
        for k in range(3):
            out[3 * r + k] = a * pose[k] + b * pose[3 + k] + c * pose[6 + k]
        out[9 + r] = a * dx + b * dy + c * dz
    for k in range(3):
        out[12 + k] = -(pose[k] * dx + pose[3 + k] * dy + pose[6 + k] * dz)


@njit(cache=True, nogil=True, error_model="numpy")
def _draw_structure(
    mesh: Mesh,
    windows: Floats,
    axes: Floats,
    eye: Floats,
    focal: float,
    middle: float,
    scratch: Scratch,
) -> int:
    """Draw the house's own surfaces, room by room; return the number of drawn faces.

    `windows` (rooms, 4) as `room_windows` writes them: rooms with an empty one are skipped.
    """
    frame = scratch.frames[0]
    pose = np.zeros(12)
    pose[0] = pose[4] = pose[8] = 1.0
    _compose(axes, eye, pose, frame)
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
def _draw_objects(
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
    """Draw the instances that may show; return the number of drawn faces so far.

    `models` (n,), `poses` (n, 12), `present` (n,) as in `Props`; `windows` (rooms, 4).
    """
    # An instance may reach into several rooms, so it is clipped to the picture, not to a window.
    limit = middle / focal
    entire = np.array([-limit, -limit, limit, limit])
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
        # The shadow reaches further than the object, and may show alone.
        radius += MARGIN_M
        if not ball_in_rooms(centre, local, radius, rooms.boxes, rooms.box_rooms, windows):
            continue
        _compose(axes, eye, pose, frame)
        scratch.seen[0] += 1
        scratch.seen[scratch.seen[0]] = k
        count = draw_parts(
            mesh, mesh.first_part[model], mesh.first_part[model + 1], frame, k + 1, focal, middle,
            entire, scratch.inverse, scratch.faces, scratch.drawn, count,
            scratch.points, scratch.outline, scratch.spans,
        )  # fmt: skip
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _draw_shadows(
    mesh: Mesh,
    models: Ints,
    poses: Floats,
    axes: Floats,
    eye: Floats,
    focal: float,
    middle: float,
    scratch: Scratch,
) -> None:
    """Write the shadows of all drawn instances on the floor."""
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
    """Draw one picture of field of view 90 degrees; return the number of drawn faces.

    Parameters
    ----------
    structure, rooms
        Surfaces of the house, and its rooms for culling.
    library
        Models of assets.
    models, poses, present
        Instances, as in `Props`: (n,) int64, (n, 12) float64, (n,) uint8.
    axes, eye
        Camera: right, down and forward as rows (3, 3); position (3,), metres, house's frame.
    portals
        Whether rooms that no open door shows are skipped: the same picture, sooner.
    scratch
        Buffers, changed.
    rgb, depth, ids
        Picture to write: (h, w, 3) uint8, (h, w) float32 metres, (h, w) int32.
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
    count = _draw_structure(structure, windows, axes, eye, focal, middle, scratch)
    count = _draw_objects(
        library, models, poses, present, rooms, windows, axes, eye, focal, middle, scratch, count
    )
    _draw_shadows(library, models, poses, axes, eye, focal, middle, scratch)
    # Deferred shading: only faces that still show when all are drawn cost a record.
    scratch.prepared[:count] = 0
    shade(
        structure, rooms.labels, library, scratch.frames, axes, eye[2], focal, middle,
        scratch.inverse, scratch.shadow, scratch.faces, scratch.drawn, scratch.prepared,
        scratch.records, rgb, depth, ids,
    )  # fmt: skip
    return count
