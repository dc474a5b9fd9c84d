"""Lower bounds of ways through a house: straight lines from door to door, furniture left out.

Whoever wants to get from one room to another crosses doors. The shortest chain of straight lines
between doors is never longer than a real way, and unlike the straight line to the goal it knows
the rooms: the search for the real way looks at far fewer corners.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import Polygon

from internav_data.verification.houses import opening

if TYPE_CHECKING:
    from internav_data.core.typing import Bools, Floats
    from internav_data.records import House

ON_BORDER_M = 1e-6
"""Points in a door belong to both rooms."""


@dataclass(frozen=True, slots=True, eq=False)
class Spots:
    """Points as the bounds see them: (n, 2), rooms that hold them (n, rooms), doors (n, doors)."""

    points: Floats
    rooms: Bools
    reach: Floats
    """Distance to each door, inf where no room holds both, metres."""


class Portals:
    """Doors and rooms of a house, and the least lengths between doors."""

    def __init__(self, house: House) -> None:
        rooms = [Polygon(room.polygon) for room in house.rooms]
        numbers = {room.room_id: k for k, room in enumerate(house.rooms)}
        doors = [door for door in house.doors if door.open and set(door.rooms) <= set(numbers)]
        self._rooms = np.array([room.buffer(ON_BORDER_M) for room in rooms], dtype=object)
        self._doors = np.array([opening(door) for door in doors], dtype=object)
        shapely.prepare(self._rooms)
        self._of_room = np.zeros((len(rooms), len(doors)), dtype=np.bool_)
        for d, door in enumerate(doors):
            self._of_room[[numbers[room] for room in door.rooms], d] = True
        beside = self._of_room.T.astype(int) @ self._of_room.astype(int) > 0
        gaps = shapely.distance(self._doors[:, None], self._doors[None, :])
        self._between = np.where(beside, gaps, np.inf).reshape(len(doors), len(doors))
        for k in range(len(doors)):
            around = self._between[:, k : k + 1] + self._between[k : k + 1, :]
            self._between = np.minimum(self._between, around)

    def spots(self, points: Floats) -> Spots:
        """Return points (n, 2) with the rooms and doors they see."""
        places = np.asarray(shapely.points(points))
        rooms = np.asarray(shapely.intersects(self._rooms[None, :], places[:, None]))
        reach = np.asarray(shapely.distance(self._doors[None, :], places[:, None]))
        shared = rooms.astype(int) @ self._of_room.astype(int) > 0
        shape = (len(points), len(self._doors))
        return Spots(points, rooms, np.where(shared, reach.reshape(shape), np.inf))

    def least(self, spots: Spots, target: Floats) -> Floats:
        """Lower bound of the way from each spot to a point (2,), metres, shape (n,)."""
        straight: Floats = np.asarray(np.hypot(*(spots.points - target).T))
        end = self.spots(target[None, :])
        same = (spots.rooms & end.rooms).any(axis=1)
        lost = ~spots.rooms.any(axis=1) | ~end.rooms.any()
        if len(self._doors) == 0:
            return np.asarray(np.where(same | lost, straight, np.inf))
        ahead = np.min(self._between + end.reach, axis=1)
        through = np.min(spots.reach + ahead, axis=1)
        return np.asarray(np.where(same | lost, straight, np.maximum(straight, through)))
