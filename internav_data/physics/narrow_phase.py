"""Narrow phase: the objects that a moving body comes near, part by part along its path.

The broad phase by 8-DOPs (`kdop`) rules out most of a house at once. It says little among
furniture: a chair that is pulled out from under a table overlaps it in the plane. Here convex parts
are compared as prisms, plan by height interval, at every recorded pose of the path. The test is
conservative: parts whose prisms stay apart do not touch, parts whose prisms meet may still miss
each other. Plans are compared by the separating-axis test (Gottschalk et al. 1996) over the normals
of their sides. The kernels are compiled by numba.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numba import njit

from internav_data.geometry import asset_corners, transform
from internav_data.geometry.footprints import convex_hull
from internav_data.geometry.headings import HEADINGS
from internav_data.physics.sweep import centred_corners

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from internav_data.core.typing import Bools, Floats, Ints
    from internav_data.physics.frames import Frame
    from internav_data.records import Asset, Pose

SIDES: Final = 32
"""Sides of the prism around the agent's collider, which exceeds its radius by 0.5 % at most."""


class ConvexPrisms(NamedTuple):
    """Convex parts of an object at its pose: a plan and a height interval each, metres."""

    vertices: Floats
    """Vertices of all plans, plan after plan, counter-clockwise, (n, 2) float64."""
    starts: Ints
    """Index of each plan's first vertex, and n, (parts + 1,) int64."""
    boxes: Floats
    """Supports of each part along +x, +y, -x, -y, +z and -z, (parts, 6) float64."""


@lru_cache(maxsize=2048)
def prisms_of(asset: Asset, pose: Pose) -> ConvexPrisms:
    """Return the prisms of an object at a pose; cached, read-only."""
    corners, starts = asset_corners(asset)
    placed = transform(corners, pose)
    boxes = np.empty((len(starts), 6))
    _boxes(placed, starts, boxes)
    vertices, firsts = _plans(placed, starts)
    return ConvexPrisms(vertices, firsts, boxes[:-1].copy())


def joined_prisms(objects: Sequence[ConvexPrisms]) -> ConvexPrisms:
    """Return the prisms of several objects as those of one, in order."""
    if not objects:
        return ConvexPrisms(np.empty((0, 2)), np.zeros(1, dtype=np.int64), np.empty((0, 6)))
    sizes = np.concatenate([np.diff(prisms.starts) for prisms in objects])
    return ConvexPrisms(
        np.concatenate([prisms.vertices for prisms in objects]),
        np.concatenate([[0], np.cumsum(sizes)]),
        np.concatenate([prisms.boxes for prisms in objects]),
    )


def prisms_of_collider(x: float, y: float, radius: float, low: float, high: float) -> ConvexPrisms:
    """Return the prism around an upright cylinder, axis at (x, y), metres."""
    # The polygon's sides touch the circle from outside.
    out = radius / math.cos(math.pi / SIDES)
    angles = [2.0 * math.pi * k / SIDES for k in range(SIDES)]
    vertices = [(x + out * math.cos(a), y + out * math.sin(a)) for a in angles]
    box = [x + radius, y + radius, radius - x, radius - y, high, -low]
    return ConvexPrisms(np.array(vertices), np.array([0, SIDES], dtype=np.int64), np.array([box]))


@njit(cache=True)
def _plans(corners: Floats, starts: Ints) -> tuple[Floats, Ints]:
    """Plans of parts, corners (n, 3), as one array of vertices and each plan's first index."""
    vertices = np.empty((len(corners), 2))
    firsts = np.zeros_like(starts)
    count = 0
    for part in range(len(starts) - 1):
        hull = convex_hull(corners[starts[part] : starts[part + 1], :2].copy())
        vertices[count : count + len(hull)] = hull
        count += len(hull)
        firsts[part + 1] = count
    return vertices[:count].copy(), firsts


@njit(cache=True)
def _place(
    pose: Floats,
    corners: Floats,
    turn: tuple[float, float],
    shift: tuple[float, float],
    out: Floats,
) -> None:
    """Write the corners (n, 3) of a body, at a pose (7,) of the own frame, in the house."""
    qx, qy, qz, qw = pose[3], pose[4], pose[5], pose[6]
    s = 2.0 / (qx * qx + qy * qy + qz * qz + qw * qw)
    a, b, c = 1.0 - s * (qy * qy + qz * qz), s * (qx * qy - qz * qw), s * (qx * qz + qy * qw)
    d, e, f = s * (qx * qy + qz * qw), 1.0 - s * (qx * qx + qz * qz), s * (qy * qz - qx * qw)
    g, h, i = s * (qx * qz - qy * qw), s * (qy * qz + qx * qw), 1.0 - s * (qx * qx + qy * qy)
    for k in range(len(corners)):
        u, v, w = corners[k, 0], corners[k, 1], corners[k, 2]
        x, y = a * u + b * v + c * w + pose[0], d * u + e * v + f * w + pose[1]
        out[k, 0] = turn[0] * x - turn[1] * y + shift[0]
        out[k, 1] = turn[1] * x + turn[0] * y + shift[1]
        out[k, 2] = g * u + h * v + i * w + pose[2]


@njit(cache=True)
def _boxes(corners: Floats, starts: Ints, out: Floats) -> None:
    """Write the boxes of parts, then that of all together, (parts + 1, 6)."""
    parts = len(starts) - 1
    out[:] = -math.inf
    for part in range(parts):
        for k in range(starts[part], starts[part + 1]):
            x, y, z = corners[k, 0], corners[k, 1], corners[k, 2]
            out[part, 0], out[part, 2] = max(out[part, 0], x), max(out[part, 2], -x)
            out[part, 1], out[part, 3] = max(out[part, 1], y), max(out[part, 3], -y)
            out[part, 4], out[part, 5] = max(out[part, 4], z), max(out[part, 5], -z)
        for d in range(6):
            out[parts, d] = max(out[parts, d], out[part, d])


@njit(cache=True)
def _apart(box: Floats, other: Floats, margin: float) -> bool:
    """Return whether two boxes keep more than a margin."""
    for d in range(4):
        if box[d] + other[(d + 2) % 4] < -margin:
            return True
    return box[4] + other[5] < -margin or box[5] + other[4] < -margin


@njit(cache=True)
def _sided(hull: Floats, other: Floats, margin: float) -> bool:
    """Return whether a side of a convex polygon keeps more than a margin from another polygon.

    One half of the separating-axis test in the plane; the other half swaps the polygons.
    """
    count = len(hull)
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        # The normal points outwards, to the right of a counter-clockwise side. It is not
        # normalised: the margin is scaled instead.
        nx, ny = hull[following, 1] - hull[k, 1], hull[k, 0] - hull[following, 0]
        bound = nx * hull[k, 0] + ny * hull[k, 1] + margin * math.hypot(nx, ny)
        beyond = True
        for v in range(len(other)):
            if nx * other[v, 0] + ny * other[v, 1] <= bound:
                beyond = False
                break
        if beyond:
            return True
    return False


@njit(cache=True)
def _meets(
    corners: Floats, starts: Ints, boxes: Floats, plan: Floats, box: Floats, margin: float
) -> bool:
    """Return whether a placed body comes within a margin of one part of another."""
    parts = len(starts) - 1
    if _apart(boxes[parts], box, margin):
        return False
    for part in range(parts):
        if _apart(boxes[part], box, margin):
            continue
        own = corners[starts[part] : starts[part + 1], :2]
        if not _sided(plan, own, margin) and not _sided(convex_hull(own.copy()), plan, margin):
            return True
    return False


@njit(cache=True)
def _met(
    path: NDArray[np.float32],
    corners: Floats,
    starts: Ints,
    turn: tuple[float, float],
    shift: tuple[float, float],
    vertices: Floats,
    firsts: Ints,
    others: Floats,
    owners: Ints,
    margin: float,
) -> Bools:
    """For each object, whether a body on a path (poses, 7) comes within a margin of it."""
    met = np.zeros(owners[-1] + 1, dtype=np.bool_)
    placed, boxes = np.empty_like(corners), np.empty((len(starts), 6))
    for k in range(len(path)):
        _place(path[k].astype(np.float64), corners, turn, shift, placed)
        _boxes(placed, starts, boxes)
        for part in range(len(owners)):
            if not met[owners[part]]:
                plan = vertices[firsts[part] : firsts[part + 1]]
                met[owners[part]] = _meets(placed, starts, boxes, plan, others[part], margin)
    return met


def met_on_path(
    asset: Asset, path: bytes, frame: Frame, others: Sequence[ConvexPrisms], margin: float
) -> list[bool]:
    """Return, for each of some objects, whether a moving body comes within a margin of it.

    Parameters
    ----------
    asset
        Geometry of the moving body.
    path
        Poses of the body's centre of mass (`PushSolution.paths`).
    frame
        Frame of the path.
    others
        Prisms of the objects, in the house's frame.
    margin
        Distance, metres.

    """
    if not others:
        return []
    joined = joined_prisms(others)
    owners = np.repeat(np.arange(len(others)), [len(other.boxes) for other in others])
    _, starts = asset_corners(asset)
    met: list[bool] = _met(
        np.frombuffer(path, dtype=np.float32).reshape(-1, 7),
        centred_corners(asset),
        starts,
        HEADINGS[frame.heading],
        (frame.x, frame.y),
        joined.vertices,
        joined.starts,
        joined.boxes,
        owners,
        margin,
    ).tolist()
    return met
