"""Mesh of a house's own surfaces, in the arrays that the camera's kernels read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from internav_data.render.asset_mesh import Model, bounds_of, mesh_of
from internav_data.render.materials import Rooms, look_row
from internav_data.render.wall_quads import PLANE_AXES, house_tiles, room_boxes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from internav_data.records import Door, House
    from internav_data.render.materials import Mesh
    from internav_data.render.wall_quads import Tile


@dataclass(frozen=True, slots=True)
class Structure:
    """House's own surfaces: one model a room, one part for each rectangle seen from it."""

    mesh: Mesh
    """Rectangles; model k is those of room k of the house."""
    rooms: Rooms
    """Instance ids of the rectangles, and the rooms for portal culling."""


def _corners(tile: Tile) -> NDArray[np.float64]:
    """Return the corners of a rectangle, (4, 3), counter-clockwise from the side that is seen."""
    sheet = tile.sheet
    a, b = PLANE_AXES[sheet.axis]
    (u0, v0), (u1, v1) = sheet.low, sheet.high
    out = np.empty((4, 3))
    out[:, sheet.axis] = sheet.at
    out[:, a] = (u0, u1, u1, u0)
    out[:, b] = (v0, v0, v1, v1)
    # x and z span a plane whose normal is -y.
    outwards = sheet.sign if sheet.axis != 1 else -sheet.sign
    return out if outwards > 0 else out[::-1].copy()


def _axes(tile: Tile) -> list[float]:
    """Return a row of `Mesh.axes`: u and v are the plane's own axes, from the tile's origin."""
    a, b = PLANE_AXES[tile.sheet.axis]
    u, v = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    u[a] = v[b] = 1.0
    return [*u, -tile.origin[0], *v, -tile.origin[1]]


def _door_corners(door: Door) -> list[list[float]]:
    """Return the corners of a door's opening on the wall's centre line, 4 x 3, metres."""
    half = door.width_m / 2.0
    dx, dy = (half, 0.0) if door.yaw_deg == 0.0 else (0.0, half)
    low, high = (door.x - dx, door.y - dy), (door.x + dx, door.y + dy)
    return [[*low, 0.0], [*high, 0.0], [*high, door.height_m], [*low, door.height_m]]


def _model(tiles: Sequence[Tile]) -> Model:
    """Return the rectangles seen from one room as a model."""
    planes = np.zeros((len(tiles), 4))
    for row, tile in zip(planes, tiles, strict=True):
        row[tile.sheet.axis] = tile.sheet.sign
        row[3] = tile.sheet.sign * tile.sheet.at
    count = len(tiles)
    vertices = np.array([_corners(t) for t in tiles]).reshape(-1, 3)
    return Model(
        np.full(count, 4),
        np.full(count, 1),
        np.full(count, 4),
        vertices,
        np.tile(np.arange(4), count),
        planes,
        np.array([_axes(t) for t in tiles]).reshape(-1, 8),
        np.array([look_row(t.look) for t in tiles], np.float32).reshape(-1, 7),
        *bounds_of(vertices),
    )


def structure_of(house: House) -> Structure:
    """Build the mesh of a house's own surfaces."""
    tiles = house_tiles(house)
    by_room = [[t for t in tiles if t.room == room.room_id] for room in house.rooms]
    index = {room.room_id: k for k, room in enumerate(house.rooms)}
    boxes = [(box, k) for k, room in enumerate(house.rooms) for box in room_boxes(house, room)]
    doors = [d for d in house.doors if d.open]
    rooms = Rooms(
        np.array([t.label for seen in by_room for t in seen], np.int64),
        np.array([box for box, _ in boxes], np.float64).reshape(-1, 4),
        np.array([k for _, k in boxes], np.int64),
        np.array([_door_corners(d) for d in doors], np.float64).reshape(-1, 4, 3),
        np.array([[index[r] for r in d.rooms] for d in doors], np.int64).reshape(-1, 2),
    )
    return Structure(mesh_of([_model(seen) for seen in by_room]), rooms)
