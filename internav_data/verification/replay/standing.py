"""Objects as they stand in a house that is built to be checked, whatever engine builds it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np
from scipy.spatial import ConvexHull

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.core.typing import Floats
    from internav_data.records import Pose, Quaternion
    from internav_data.verification.shapes import Solid

SOLID: Final = "floor or wall"
"""Name of what an object is inside that is no object."""


@dataclass(frozen=True, slots=True)
class Standing:
    """An object as it is built: where it stands, and whether it can move."""

    name: str
    asset_id: str
    pose: Pose
    mass_kg: float
    friction: float
    moves: bool


class BuiltHouse(Protocol):
    """Floor and walls of a house, and objects that are put there and taken away again."""

    def put(self, objects: Sequence[Standing]) -> None:
        """Put objects where they stand, after those that are there."""

    def remove(self, count: int) -> None:
        """Take the last objects away."""

    def contacts(self) -> list[tuple[Standing, str, float]]:
        """Return contacts now: an object that can move, the other's name, the depth in metres."""

    def drifts(self, seconds: float) -> list[tuple[Standing, float, float]]:
        """Let time pass; return how far each object that can move went, metres and degrees."""


def obj_of(solids: Sequence[Solid]) -> str:
    """Return convex solids as Wavefront OBJ text, a group each, in metres."""
    lines, before = [], 1
    for number, solid in enumerate(solids):
        lines.append(f"g solid{number}")
        lines += [f"v {x:.12g} {y:.12g} {z:.12g}" for x, y, z in solid.corners.tolist()]
        triangles = ConvexHull(solid.corners).simplices + before
        lines += [f"f {a} {b} {c}" for a, b, c in triangles.tolist()]
        before += len(solid.corners)
    return "\n".join(lines) + "\n"


def centre_of(solids: Sequence[Solid]) -> Floats:
    """Return the centre of mass of convex solids of equal density, (3,) metres."""
    moment, total = np.zeros(3), 0.0
    for solid in solids:
        # A hull is the pyramids from a point inside to its triangles.
        inside = solid.corners.mean(axis=0)
        triangles = solid.corners[ConvexHull(solid.corners).simplices] - inside
        volumes = np.abs(np.linalg.det(triangles)) / 6.0
        moment += volumes @ (inside + triangles.sum(axis=1) / 4.0)
        total += float(volumes.sum())
    return np.asarray(moment / total, dtype=np.float64)


def turned_deg(first: Quaternion, second: Quaternion) -> float:
    """Return the angle between two orientations, degrees."""
    along = abs(float(np.dot(first, second))) / math.hypot(*first) / math.hypot(*second)
    return math.degrees(2.0 * math.acos(min(1.0, along)))
