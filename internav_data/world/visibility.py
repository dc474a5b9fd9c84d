"""Visibility: whether the agent sees an object within its reach.

An object is visible if one of its visibility points is within reach, inside the camera's view, and
no convex part of any object near by cuts the segment from the eye to that point. Segments are
clipped against half-spaces (Cyrus and Beck 1978). The kernels are compiled by numba.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numba import njit

from internav_data.geometry.planar import point_polygon_distance
from internav_data.records.agent import AGENT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.core.typing import Floats, Ints
    from internav_data.geometry import Polygons
    from internav_data.world.occlusion import OcclusionShape

REACH_M: Final = AGENT.reach_m
"""Maximum distance in the plane from the agent's axis to a visibility point, metres."""
CAMERA_M: Final = AGENT.camera_height_m
"""Height of the camera on the agent's axis, metres."""
SLACK: Final = 1e-9
"""Share of a segment that must lie inside a part for the part to hide what is behind it."""


@njit(cache=True)
def is_hidden(eye: Floats, point: Floats, planes: Floats, starts: Ints, skip: int) -> bool:
    """Return whether a convex part cuts the segment from the eye to a point.

    Parameters
    ----------
    eye, point : (3,) float64
        Ends of the segment, metres.
    planes, starts
        Half-spaces of the parts, as in `OcclusionShape`.
    skip
        Index of a part to leave out; -1 for none.

    """
    dx, dy, dz = point[0] - eye[0], point[1] - eye[1], point[2] - eye[2]
    for part in range(len(starts) - 1):
        if part == skip:
            continue
        # The segment's parameters inside all half-spaces so far.
        enter, leave = 0.0, 1.0
        for k in range(starts[part], starts[part + 1]):
            a, b, c = planes[k, 0], planes[k, 1], planes[k, 2]
            slope = a * dx + b * dy + c * dz
            height = planes[k, 3] - (a * eye[0] + b * eye[1] + c * eye[2])
            if slope > 0.0:
                leave = min(leave, height / slope)
            elif slope < 0.0:
                enter = max(enter, height / slope)
            elif height < 0.0:
                leave = -1.0
            if enter + SLACK >= leave:
                break
        if enter + SLACK < leave:
            return True
    return False


@njit(cache=True)
def _in_view(
    eye: Floats, point: Floats, ahead_x: float, ahead_y: float, cos_down: float, sin_down: float
) -> bool:
    """Return whether a point lies in the camera's view, 90° wide and high, and within reach."""
    dx, dy, dz = point[0] - eye[0], point[1] - eye[1], point[2] - eye[2]
    if dx * dx + dy * dy > REACH_M * REACH_M:
        return False
    # The camera's axes: level ahead and to the right, then both turned down by the horizon.
    level = dx * ahead_x + dy * ahead_y
    side = dx * ahead_y - dy * ahead_x
    depth = level * cos_down - dz * sin_down
    up = level * sin_down + dz * cos_down
    return depth > 0.0 and abs(side) <= depth and abs(up) <= depth


@njit(cache=True)
def _seen(
    eye: Floats,
    view: tuple[float, float, float, float],
    points: Floats,
    owners: Ints,
    first: int,
    planes: Floats,
    starts: Ints,
) -> bool:
    """Return whether a point is in view and not hidden; the object's parts begin at `first`."""
    for k in range(len(points)):
        if _in_view(eye, points[k], *view) and not is_hidden(
            eye, points[k], planes, starts, first + owners[k]
        ):
            return True
    return False


@njit(cache=True)
def _axis_distance(x: float, y: float, vertices: Floats, offsets: Ints) -> float:
    best = math.inf
    for k in range(len(offsets) - 1):
        best = min(best, point_polygon_distance(x, y, vertices, offsets[k], offsets[k + 1]))
    return best


def axis_distance(x: float, y: float, polygons: Polygons) -> float:
    """Return the distance in metres from a point of the floor to the nearest of some polygons.

    Inf without any polygon.
    """
    return float(_axis_distance(x, y, polygons.vertices, polygons.offsets))


class CameraPose(NamedTuple):
    """Position and direction of the agent's camera."""

    eye: Floats
    """Position of the eye, (3,) float64, metres."""
    ahead_x: float
    ahead_y: float
    """With `ahead_x`, unit vector of the agent's heading in the plane."""
    cos_down: float
    sin_down: float
    """With `cos_down`, cosine and sine of the angle below the horizontal."""


_DOWN: Final = {
    # Written out: thirds of a right angle have simple sines, equal on every machine.
    -30: (math.sqrt(0.75), -0.5),
    0: (1.0, 0.0),
    30: (math.sqrt(0.75), 0.5),
    60: (0.5, math.sqrt(0.75)),
}


def camera_pose(x: float, y: float, ahead: tuple[float, float], horizon_deg: int) -> CameraPose:
    """Return the camera pose of an agent at (x, y), metres.

    Parameters
    ----------
    x, y
        Position of the agent's axis, metres.
    ahead
        Unit vector of the heading.
    horizon_deg
        Angle below the horizontal: -30, 0, 30 or 60 degrees.

    """
    return CameraPose(np.array([x, y, CAMERA_M]), *ahead, *_DOWN[horizon_deg])


class Occluders:
    """All shapes near the agent that can hide a visibility point, joined for several queries."""

    def __init__(self, shapes: Sequence[OcclusionShape]) -> None:
        self._shapes = shapes
        planes = [shape.planes for shape in shapes]
        counts = [0]
        # All shapes' planes in one array: index of each shape's first part, and where parts begin.
        self._first = []
        height = 0
        for shape in shapes:
            self._first.append(len(counts) - 1)
            counts += (shape.starts[1:] + height).tolist()
            height += len(shape.planes)
        self._planes: Floats = np.concatenate(planes) if planes else np.empty((0, 4))
        self._starts: Ints = np.array(counts, dtype=np.int64)

    def seen(self, view: CameraPose, index: int) -> bool:
        """Return whether the object of one of the shapes, by index, is seen and within reach."""
        shape = self._shapes[index]
        return bool(
            _seen(
                view.eye,
                (view.ahead_x, view.ahead_y, view.cos_down, view.sin_down),
                shape.points,
                shape.owners,
                self._first[index],
                self._planes,
                self._starts,
            )
        )
