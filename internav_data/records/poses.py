"""Points, quaternions and poses. Metres; right-handed, z up; yaw 0 looks along +x."""

from __future__ import annotations

from dataclasses import dataclass

Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
"""(x, y, z, w) with w >= 0, as Bullet orders it."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Where an asset's frame lies in the house's frame."""

    x: float
    y: float
    z: float
    quaternion: Quaternion
