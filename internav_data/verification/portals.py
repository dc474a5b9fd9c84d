"""Lower bounds of path lengths: straight lines from door to door, furniture left out.

A path from one room to another crosses doors. The shortest chain of straight lines between doors
is never longer than a real path, and unlike the straight line to the goal it respects the rooms:
as the heuristic of A* it leaves far fewer corners to search.
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
class LocatedPoints:
    """Points with the rooms that contain them and their distances to doors."""

    points: Floats
    """Positions, shape (n, 2), metres."""
    rooms: Bools
    """Mask of the rooms that contain each point, shape (n, rooms)."""
    door_distance_m: Floats
    """Distance to each door, inf if no room contains both, shape (n, doors), metres."""


class Portals:
    """Doors and rooms of a house with the minimum lengths between doors."""

    def __init__(self, house: House) -> None:
        rooms = [Polygon(room.polygon) for room in house.rooms]
        numbers = {room.room_id: k for k, room in enumerate(house.rooms)}
        doors = [door for door in house.doors if door.open and set(door.rooms) <= set(numbers)]
        self._rooms = np.array([room.buffer(ON_BORDER_M) for room in rooms], dtype=object)
        self._doors = np.array([opening(door) for door in doors], dtype=object)
        shapely.prepare(self._rooms)
        self._doors_of_room = np.zeros((len(rooms), len(doors)), dtype=np.bool_)
        for d, door in enumerate(doors):
            self._doors_of_room[[numbers[room] for room in door.rooms], d] = True
        # Doors that share a room are joined by a straight line, whatever stands in between.
        beside = self._doors_of_room.T.astype(int) @ self._doors_of_room.astype(int) > 0
        gaps = shapely.distance(self._doors[:, None], self._doors[None, :])
        self._door_to_door_m = np.where(beside, gaps, np.inf).reshape(len(doors), len(doors))
        # Floyd (1962) and Warshall (1962): all shortest chains, allowing door after door as a stop.
        for k in range(len(doors)):
            around = self._door_to_door_m[:, k : k + 1] + self._door_to_door_m[k : k + 1, :]
            self._door_to_door_m = np.minimum(self._door_to_door_m, around)

    def located(self, points: Floats) -> LocatedPoints:
        """Return points (n, 2) with their rooms and distances to doors."""
        sites = np.asarray(shapely.points(points))
        rooms = np.asarray(shapely.intersects(self._rooms[None, :], sites[:, None]))
        door_distance_m = np.asarray(shapely.distance(self._doors[None, :], sites[:, None]))
        shared = rooms.astype(int) @ self._doors_of_room.astype(int) > 0
        shape = (len(points), len(self._doors))
        return LocatedPoints(
            points, rooms, np.where(shared, door_distance_m.reshape(shape), np.inf)
        )

    def lower_bound(self, located: LocatedPoints, target: Floats) -> Floats:
        """Return lower bounds of the paths from points to a target (2,), metres, shape (n,)."""
        straight: Floats = np.asarray(np.hypot(*(located.points - target).T))
        end = self.located(target[None, :])
        same = (located.rooms & end.rooms).any(axis=1)
        lost = ~located.rooms.any(axis=1) | ~end.rooms.any()
        if len(self._doors) == 0:
            return np.asarray(np.where(same | lost, straight, np.inf))
        ahead = np.min(self._door_to_door_m + end.door_distance_m, axis=1)
        through = np.min(located.door_distance_m + ahead, axis=1)
        return np.asarray(np.where(same | lost, straight, np.maximum(straight, through)))
