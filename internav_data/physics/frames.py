"""Quarter turns without trigonometry: pushes along the house's axes are solved along +x.

Turning by quarters only swaps coordinates and signs, so that a push to the north is, to the last
bit, the push to the east of a house turned by 90 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from internav_data.geometry import multiply, round_m, round_quaternion
from internav_data.geometry.headings import TURNS, turned
from internav_data.records import Pose

if TYPE_CHECKING:
    from internav_data.physics.kdop import Dop8
    from internav_data.records import Vec2


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame at a point of the house, its +x along one of the four headings."""

    x: float
    y: float
    heading: int

    def enter(self, pose: Pose) -> Pose:
        """Pose in this frame, rounded as stored ones are."""
        x, y = turned(-self.heading, pose.x - self.x, pose.y - self.y)
        turn = multiply(TURNS[-self.heading % 4], pose.quaternion)
        return Pose(round_m(x), round_m(y), pose.z, round_quaternion(turn))

    def leave(self, pose: Pose) -> Pose:
        """Pose in the house, rounded as it will be stored."""
        x, y = turned(self.heading, pose.x, pose.y)
        turn = multiply(TURNS[self.heading], pose.quaternion)
        return Pose(
            round_m(self.x + x), round_m(self.y + y), round_m(pose.z), round_quaternion(turn)
        )

    def enter_point(self, point: Vec2) -> Vec2:
        """Point in this frame, rounded."""
        x, y = turned(-self.heading, point[0] - self.x, point[1] - self.y)
        return round_m(x), round_m(y)

    def leave_dop8(self, dop8: Dop8) -> Dop8:
        """Octagon in the house."""
        first = -2 * self.heading
        a, b, c, d, e, f, g, h = (dop8[(first + k) % 8] for k in range(8))
        x, y = self.x, self.y
        return a + x, b + x + y, c + y, d + y - x, e - x, f - x - y, g - y, h + x - y
