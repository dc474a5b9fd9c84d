"""Points, quaternions and poses. Metres; right-handed, z up; yaw 0 looks along +x."""

from __future__ import annotations

from dataclasses import dataclass

Vec2 = tuple[float, float]
"""(x, y), metres."""
Vec3 = tuple[float, float, float]
"""(x, y, z), metres."""
Quaternion = tuple[float, float, float, float]
"""(x, y, z, w) with w >= 0, as Bullet orders it."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Position and rotation of an asset's frame in the house's frame."""

    x: float
    """Position, metres."""
    y: float
    """Position, metres."""
    z: float
    """Position, metres above the floor."""
    quaternion: Quaternion
    """Rotation: (x, y, z, w), w >= 0."""
