"""The wall faces of a room, which furniture stands against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from internav_data.core.arithmetic import plain_sum
from internav_data.houses.standards import HALF_WALL_CM

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.core.typing import Floats
    from internav_data.houses.plan import Opening


@dataclass(frozen=True, slots=True)
class WallFace:
    """A wall face seen from inside a room: it runs along local x, the room lies at local y > 0."""

    x: float
    y: float
    turn: int
    """Quarter turns that carry local x onto the wall's direction."""
    length: float
    """Length, metres."""
    windows: int
    """Number of windows in the face."""


def poses_along(face: WallFace, along: Floats) -> Floats:
    """Return poses at distances along a wall face.

    Parameters
    ----------
    face
        Wall face of a room.
    along
        (n,) float64: distances from the face's start, metres.

    Returns
    -------
    ndarray
        (n, 3) float64: x and y in metres, quarter turns.
    """
    dx, dy = ((1, 0), (0, 1), (-1, 0), (0, -1))[face.turn]
    poses = np.empty((len(along), 3))
    # numpy rounds by an exact multiplication and division, so all machines agree.
    poses[:, 0] = np.round(face.x + dx * along, 4)
    poses[:, 1] = np.round(face.y + dy * along, 4)
    poses[:, 2] = face.turn
    return poses


def wall_faces(
    corners: Sequence[tuple[int, int]], openings: Sequence[Opening]
) -> tuple[WallFace, ...]:
    """Return the wall faces of a room: its polygon, moved inwards by half a wall.

    Corners are centimetres, counter-clockwise; faces are metres.
    """
    count = len(corners)
    directions = []
    for k in range(count):
        (ax, ay), (bx, by) = corners[k], corners[(k + 1) % count]
        directions.append(((bx > ax) - (bx < ax), (by > ay) - (by < ay)))
    # The inward normal of an edge is its direction turned left; a corner moves along both.
    inner = []
    for k in range(count):
        (ux, uy), (vx, vy) = directions[k - 1], directions[k]
        x, y = corners[k]
        inner.append((x + HALF_WALL_CM * (-uy - vy), y + HALF_WALL_CM * (ux + vx)))
    out: list[WallFace] = []
    for k in range(count):
        (ax, ay), (bx, by) = inner[k], inner[(k + 1) % count]
        (dx, dy), line = directions[k], corners[k]
        windows = plain_sum(
            1
            for o in openings
            if o.kind is None
            and o.along_x == (dy == 0)
            and o.at == (line[1] if o.along_x else line[0])
            and o.low <= (max(ax, bx) if o.along_x else max(ay, by))
            and o.high >= (min(ax, bx) if o.along_x else min(ay, by))
        )
        turn = ((1, 0), (0, 1), (-1, 0), (0, -1)).index((dx, dy))
        length = (abs(bx - ax) + abs(by - ay)) / 100.0
        if length > 0.0:
            out.append(WallFace(ax / 100.0, ay / 100.0, turn, length, windows))
    return tuple(out)
