"""Portal culling: the rooms that can be seen through open doors, and in which window. Numba.

After Luebke and Georges ("Portals and mirrors: simple, fast evaluation of potentially visible
sets", 1995). A window here is a rectangle of slopes (x / z and y / z in the camera's frame): left,
top, right, bottom. It is empty where left >= right. Culling never changes a picture, only its cost.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints

NEAR_M = 0.05
"""Distance (m) of the near plane, before which nothing is drawn. The agent's disc keeps objects
0.2 m away: 0.115 m along the optical axis at a corner of the picture."""
_THICK_M = 0.0601
"""Half a wall (m): a camera in a doorway is in both its rooms."""
_MAX_ROUNDS = 256
"""Maximum number of doors in a row to look through: a bound far above any house's need."""


@njit(cache=True, nogil=True, error_model="numpy")
def door_window(door: Floats, eye: Floats, axes: Floats, window: Floats) -> None:
    """Write the window (4,) of a door's rectangle (4, 3), cut at the near plane; empty if behind.

    `eye` (3,) and `axes` (3, 3) as for `room_windows`, metres.
    """
    window[0] = window[1] = 1e9
    window[2] = window[3] = -1e9
    for k in range(4):
        j = (k + 1) % 4
        ax, ay, az = door[k, 0] - eye[0], door[k, 1] - eye[1], door[k, 2] - eye[2]
        bx, by, bz = door[j, 0] - eye[0], door[j, 1] - eye[1], door[j, 2] - eye[2]
        z0 = axes[2, 0] * ax + axes[2, 1] * ay + axes[2, 2] * az
        z1 = axes[2, 0] * bx + axes[2, 1] * by + axes[2, 2] * bz
        # Cut at half the near distance: no more is lost than lies before every drawn face.
        near = NEAR_M * 0.5
        # Up to two points of an edge: its first end if in front, and where it pierces the plane.
        for end in range(2):
            if end == 0:
                if z0 < near:
                    continue
                t = 0.0
            else:
                if (z0 < near) == (z1 < near):
                    continue
                t = (near - z0) / (z1 - z0)
            px, py, pz = ax + t * (bx - ax), ay + t * (by - ay), az + t * (bz - az)
            z = axes[2, 0] * px + axes[2, 1] * py + axes[2, 2] * pz
            x = (axes[0, 0] * px + axes[0, 1] * py + axes[0, 2] * pz) / z
            y = (axes[1, 0] * px + axes[1, 1] * py + axes[1, 2] * pz) / z
            # Rounding must not make a window smaller than the door.
            window[0] = min(window[0], x - 1e-6)
            window[1] = min(window[1], y - 1e-6)
            window[2] = max(window[2], x + 1e-6)
            window[3] = max(window[3], y + 1e-6)


@njit(cache=True, nogil=True, error_model="numpy")
def _open_own_rooms(
    eye: Floats, reach: float, boxes: Floats, box_rooms: Ints, windows: Floats, limit: float
) -> int:
    """Give the entire picture to the rooms that hold the eye, or to all where none does.

    Returns the number of boxes that hold the eye.
    """
    found = 0
    for b in range(boxes.shape[0]):
        if (
            boxes[b, 0] - reach < eye[0] < boxes[b, 2] + reach
            and boxes[b, 1] - reach < eye[1] < boxes[b, 3] + reach
        ):
            found += 1
            room = box_rooms[b]
            windows[room, 0] = windows[room, 1] = -limit
            windows[room, 2] = windows[room, 3] = limit
    if found == 0:
        windows[:, :2] = -limit
        windows[:, 2:] = limit
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def room_windows(
    eye: Floats,
    axes: Floats,
    limit: float,
    boxes: Floats,
    box_rooms: Ints,
    doors: Floats,
    door_rooms: Ints,
    windows: Floats,
) -> None:
    """Find the window in which each room can be seen.

    Parameters
    ----------
    eye, axes
        Camera: position (3,), metres; right, down and forward as rows (3, 3).
    limit
        Slope at the picture's edge.
    boxes, box_rooms, doors, door_rooms
        Rooms: (boxes, 4), (boxes,), (doors, 4, 3), (doors, 2), as in `Rooms`.
    windows
        Windows to write, (rooms, 4) float64; empty for rooms that cannot be seen.
    """
    windows[:, :2] = 1e9
    windows[:, 2:] = -1e9
    if _open_own_rooms(eye, _THICK_M, boxes, box_rooms, windows, limit) == 0:
        return
    through = np.empty((doors.shape[0], 4))
    for d in range(doors.shape[0]):
        door_window(doors[d], eye, axes, through[d])
    # A room shows in the bounding box of its doors' windows, each cut to the window of the room
    # before. Windows only grow, so the rounds end once none does.
    grown = True
    rounds = 0
    while grown and rounds < _MAX_ROUNDS:
        grown = False
        rounds += 1
        for d in range(doors.shape[0]):
            for side in range(2):
                here, there = door_rooms[d, side], door_rooms[d, 1 - side]
                left = max(windows[here, 0], through[d, 0])
                top = max(windows[here, 1], through[d, 1])
                right = min(windows[here, 2], through[d, 2])
                bottom = min(windows[here, 3], through[d, 3])
                if left >= right or top >= bottom:
                    continue
                if left < windows[there, 0] or top < windows[there, 1]:
                    grown = True
                if right > windows[there, 2] or bottom > windows[there, 3]:
                    grown = True
                windows[there, 0] = min(windows[there, 0], left)
                windows[there, 1] = min(windows[there, 1], top)
                windows[there, 2] = max(windows[there, 2], right)
                windows[there, 3] = max(windows[there, 3], bottom)


@njit(cache=True, nogil=True, error_model="numpy")
def ball_in_window(x: float, y: float, z: float, radius: float, window: Floats) -> bool:
    """Return whether a ball (camera's frame, metres) may show in a window (4,)."""
    if window[0] >= window[2] or z + radius <= NEAR_M:
        return False
    # The planes through the eye and the window's sides: signed distance against the radius.
    for k in range(2):
        at = x if k == 0 else y
        low, high = window[k], window[k + 2]
        if at - low * z < -radius * math.sqrt(1.0 + low * low):
            return False
        if at - high * z > radius * math.sqrt(1.0 + high * high):
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def ball_in_rooms(
    centre: Floats,
    local: Floats,
    radius: float,
    boxes: Floats,
    box_rooms: Ints,
    windows: Floats,
) -> bool:
    """Return whether a ball may show in the window of any room that it reaches into.

    `centre` (3,) in the house's frame and `local` (3,) in the camera's, metres; `boxes` (boxes, 4),
    `box_rooms` (boxes,), `windows` (rooms, 4). A ball outside all rooms may always show.
    """
    reached = False
    for b in range(boxes.shape[0]):
        dx = max(boxes[b, 0] - centre[0], centre[0] - boxes[b, 2], 0.0)
        dy = max(boxes[b, 1] - centre[1], centre[1] - boxes[b, 3], 0.0)
        if dx * dx + dy * dy > radius * radius:
            continue
        reached = True
        if ball_in_window(local[0], local[1], local[2], radius, windows[box_rooms[b]]):
            return True
    return not reached
