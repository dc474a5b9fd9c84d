"""Which rooms can be seen, and through how much of the picture: doors as portals, numba.

A window here is a rectangle of slopes (x / z and y / z in the camera's frame): left, top, right,
bottom. It is empty where left >= right. Culling never changes a picture, only its price.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from internav_data.core.typing import Floats, Ints

NEAR_M = 0.05
"""Nothing nearer is drawn. The agent's disc keeps things 0.2 m away: 0.115 m at a corner."""
_THICK_M = 0.0601
"""Half a wall: who stands in a doorway is in both its rooms."""
_ROUNDS = 256
"""Doors looked through at most: far more than any house needs, and a bound."""


@njit(cache=True, nogil=True, error_model="numpy")
def door_window(door: Floats, eye: Floats, axes: Floats, window: Floats) -> None:
    """Bound a door's rectangle (4, 3), cut off behind the near plane; empty where behind it."""
    window[0] = window[1] = 1e9
    window[2] = window[3] = -1e9
    for k in range(4):
        j = (k + 1) % 4
        ax, ay, az = door[k, 0] - eye[0], door[k, 1] - eye[1], door[k, 2] - eye[2]
        bx, by, bz = door[j, 0] - eye[0], door[j, 1] - eye[1], door[j, 2] - eye[2]
        z0 = axes[2, 0] * ax + axes[2, 1] * ay + axes[2, 2] * az
        z1 = axes[2, 0] * bx + axes[2, 1] * by + axes[2, 2] * bz
        # A sliver nearer than anything drawn may be cut off: so far and no further.
        near = NEAR_M * 0.5
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
            window[0] = min(window[0], x - 1e-6)
            window[1] = min(window[1], y - 1e-6)
            window[2] = max(window[2], x + 1e-6)
            window[3] = max(window[3], y + 1e-6)


@njit(cache=True, nogil=True, error_model="numpy")
def _start(
    eye: Floats, reach: float, boxes: Floats, box_rooms: Ints, windows: Floats, limit: float
) -> int:
    """Open the whole picture to the rooms the eye is in; to all where it is in none."""
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
    """Find the window through which each room can be seen.

    Parameters
    ----------
    eye, axes
        Position (3,), metres; right, down and forward (3, 3) as rows.
    limit
        Slope at the picture's edge.
    boxes, box_rooms, doors, door_rooms
        See `Structure`.
    windows
        Written, (rooms, 4).

    """
    windows[:, :2] = 1e9
    windows[:, 2:] = -1e9
    if _start(eye, _THICK_M, boxes, box_rooms, windows, limit) == 0:
        return
    through = np.empty((doors.shape[0], 4))
    for d in range(doors.shape[0]):
        door_window(doors[d], eye, axes, through[d])
    grown = True
    rounds = 0
    while grown and rounds < _ROUNDS:
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
    """Whether a ball (camera's frame) may show in a window."""
    if window[0] >= window[2] or z + radius <= NEAR_M:
        return False
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
    """Whether a ball shows in the window of any room it reaches into.

    `centre` is the house's frame, `local` the camera's; a ball outside all rooms always shows.
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
