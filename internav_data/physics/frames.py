"""Frames for pushes: every push along an axis of the house is solved along +x.

Quarter turns swap coordinates and signs and use no trigonometry. A push to the north is therefore,
to the last bit, the push to the east in a house turned by 90 degrees.
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
    """A frame with its origin at a point (x, y) of the house, metres.

    Its +x lies along a heading of the house: 0, 1, 2, 3 for +x, +y, -x, -y.
    """

    x: float
    y: float
    heading: int

    def enter(self, pose: Pose) -> Pose:
        """Return a pose of the house in this frame, rounded like stored poses."""
        x, y = turned(-self.heading, pose.x - self.x, pose.y - self.y)
        turn = multiply(TURNS[-self.heading % 4], pose.quaternion)
        return Pose(round_m(x), round_m(y), pose.z, round_quaternion(turn))

    def leave(self, pose: Pose) -> Pose:
        """Return a pose of this frame in the house, rounded as it will be stored."""
        x, y = turned(self.heading, pose.x, pose.y)
        turn = multiply(TURNS[self.heading], pose.quaternion)
        return Pose(
            round_m(self.x + x), round_m(self.y + y), round_m(pose.z), round_quaternion(turn)
        )

    def enter_point(self, point: Vec2) -> Vec2:
        """Return a point of the house in this frame, metres, rounded."""
        x, y = turned(-self.heading, point[0] - self.x, point[1] - self.y)
        return round_m(x), round_m(y)

    def leave_dop8(self, dop8: Dop8) -> Dop8:
        """Return an 8-DOP of this frame in the house."""
        # A quarter turn moves each support on by two of the eight directions; the shift adds its
        # own support along each of them.
        first = -2 * self.heading
        a, b, c, d, e, f, g, h = (dop8[(first + k) % 8] for k in range(8))
        x, y = self.x, self.y
        return a + x, b + x + y, c + y, d + y - x, e - x, f - x - y, g - y, h + x - y
