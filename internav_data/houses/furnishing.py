"""State of one room while it is furnished: items, keep-out boxes, free nodes, wall faces."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from internav_data.geometry import yaw_quaternion
from internav_data.houses.faces import WallFace, poses_along, wall_faces
from internav_data.houses.fitting import FreeNodes, RoomBoxes, first_fit, mark_blocked, turn_box
from internav_data.houses.pieces import BACK_GAP_M
from internav_data.houses.plan import clear_area_m2, clear_size_m
from internav_data.houses.standards import DOOR_CLEAR_CM, HALF_WALL_CM
from internav_data.records.agent import CLEARANCE_M, SPACING_M

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.random import Generator
    from numpy.typing import NDArray

    from internav_data.core.typing import Floats
    from internav_data.houses.pieces import Group
    from internav_data.houses.plan import FloorGrid, FloorPlan, Opening
    from internav_data.houses.room_types import Placement

CAPACITY = 160
"""Largest number of boxes in one room."""
LARGEST_GROUP = 24
"""Largest number of boxes in one group: a room with less space than that counts as full."""
MIN_FREE = 0.45
"""Share of an empty room's nodes that furniture leaves to the agent."""
JOINED = 0.93
"""Share of the free nodes that are joined to the doors: pockets are small."""
SMALL_NODES = 60
"""Rooms with fewer nodes than this are small, and get the values below: bathrooms, storage."""
MIN_FREE_SMALL, JOINED_SMALL = 0.25, 0.84
WINDOW_DEPTH_M = 0.45
"""Depth before a window in which items must be lower than its sill."""


@dataclass(slots=True)
class RoomState:
    """A room while it is furnished; metres."""

    room: int
    type: str
    inner: Floats
    """(4,) float64: x0, y0, x1, y1 of the bounding box between wall faces."""
    area_m2: float
    """Area between the wall faces."""
    short_m: float
    """Shorter side of the largest rectangle in the room, between wall faces."""
    wall_faces: tuple[WallFace, ...]
    nodes: FreeNodes
    solids: Floats = field(default_factory=lambda: np.zeros((CAPACITY, 6)))
    """(CAPACITY, 6) float64, of which `solid_count` are set."""
    keep_out: Floats = field(default_factory=lambda: np.zeros((CAPACITY, 6)))
    """(CAPACITY, 6) float64, of which `keep_out_count` are set."""
    solid_count: int = 0
    keep_out_count: int = 0
    placed: list[tuple[Group, float, float, int]] = field(default_factory=list)
    """Groups in the room with x, y and quarter turns."""

    def add_solid(self, box: Floats) -> None:
        """Let a box (6,) stand in the room."""
        self.solids[self.solid_count] = box
        self.solid_count += 1

    def add_keep_out(self, box: Floats) -> None:
        """Keep a box (6,) clear of items."""
        self.keep_out[self.keep_out_count] = box
        self.keep_out_count += 1

    def place(self, group: Group, poses: Floats) -> bool:
        """Put a group at the first pose where it fits; return whether there is one.

        `poses` is (m, 3) float64: x and y in metres, quarter turns.
        """
        full = CAPACITY - LARGEST_GROUP
        if len(poses) == 0 or self.solid_count > full or self.keep_out_count > full:
            return False
        solids, keep_out = self.solids[: self.solid_count], self.keep_out[: self.keep_out_count]
        boxes = group.kernel_boxes
        m = first_fit(poses, boxes, RoomBoxes(self.inner, solids, keep_out), self.nodes)
        if m < 0:
            return False
        x, y, turn = float(poses[m, 0]), float(poses[m, 1]), int(poses[m, 2])
        box = np.empty(6)
        for k in range(len(boxes.items)):
            turn_box(boxes.items[k], x, y, turn, box)
            self.add_solid(box)
            if boxes.blocking[k]:
                mark_blocked(self.nodes.free, self.nodes.origin, box)
        for front in boxes.fronts:
            turn_box(front, x, y, turn, box)
            self.add_keep_out(box)
        self.placed.append((group, x, y, turn))
        return True

    def along_walls(
        self, group: Group, rng: Generator, placement: Placement, *, step: float = 0.1
    ) -> Floats:
        """Return poses with the group's back to a wall, the preferred one first.

        Parameters
        ----------
        group
            Group in its own frame: the wall is y = 0.
        rng
            Random numbers of the room: preferences are jittered, so that rooms differ.
        placement
            "corner", "centre" (of a wall), "sun" (near windows) or "any".
        step
            Distance between poses, metres.

        Returns
        -------
        ndarray
            (m, 3) float64: x and y in metres, quarter turns.
        """
        poses: list[Floats] = []
        penalties: list[Floats] = []
        # A finger's breadth to the walls on either side, as to the one behind.
        left, right = group.left - BACK_GAP_M, group.right + BACK_GAP_M
        for face in self.wall_faces:
            spare = face.length - (right - left)
            if spare < 0.0:
                continue
            count = max(1, int(spare / step) + 1)
            along: Floats = np.arange(count, dtype=np.float64) * step - left
            along[-1] = face.length - right
            ends = np.minimum(along + left, face.length - along - right)
            # Metres, roughly: a corner 0.2 m nearer outweighs the jitter.
            penalty = 0.6 * rng.random(count)
            if placement == "corner":
                penalty += 3.0 * ends
            elif placement == "centre":
                penalty += (
                    1.2 * np.abs(along + 0.5 * (left + right) - face.length / 2) - 0.15 * spare
                )
            elif placement == "sun":
                penalty += 0.3 * ends - 0.8 * min(face.windows, 1)
            # One draw for the whole wall, so that rooms do not all begin at the same one.
            penalty += 0.8 * float(rng.random())
            poses.append(poses_along(face, along))
            penalties.append(penalty)
        if not poses:
            return np.empty((0, 3))
        order = np.argsort(np.concatenate(penalties), kind="stable")
        found: Floats = np.concatenate(poses)[order]
        return found

    def in_the_open(self, group: Group, rng: Generator) -> Floats:
        """Return poses away from the walls, nearest to the middle of the room first.

        The shape is (m, 3) float64: x and y in metres, quarter turns.
        """
        x0, y0, x1, y1 = (float(v) for v in self.inner)
        xs = np.arange(round(x0 / SPACING_M), round(x1 / SPACING_M) + 1) * SPACING_M
        ys = np.arange(round(y0 / SPACING_M), round(y1 / SPACING_M) + 1) * SPACING_M
        x, y = (a.ravel() for a in np.meshgrid(xs, ys, indexing="ij"))
        first = int(float(rng.random()) * 4)
        grids = []
        for turn in (first, (first + 1) % 4):
            penalty = np.hypot(x - (x0 + x1) / 2, y - (y0 + y1) / 2) + 0.7 * rng.random(len(x))
            # Long groups lie along the room's longer side.
            lengthwise = (turn % 2 == 0) == (x1 - x0 >= y1 - y0)
            penalty += 0.0 if lengthwise == (group.right - group.left >= group.depth) else 0.8
            grids.append(np.column_stack([x, y, np.full(len(x), float(turn)), penalty]))
        every = np.concatenate(grids)
        found: Floats = every[np.argsort(every[:, 3], kind="stable")][:, :3]
        return np.ascontiguousarray(found)


def _box_beside(opening: Opening, side: int, depth_cm: float, bottom: float, top: float) -> Floats:
    """Box (6,) beside an opening, on the side of lower (-1) or higher (+1) coordinates.

    Depth in centimetres, bottom and top in metres.
    """
    face = opening.at + side * HALF_WALL_CM
    near, far = sorted((face, face + side * depth_cm))
    flat = (
        (opening.low, near, opening.high, far)
        if opening.along_x
        else (near, opening.low, far, opening.high)
    )
    return np.array([*(v / 100.0 for v in flat), bottom, top])


def _side_of(grid: FloorGrid, room: int, opening: Opening) -> int:
    """Side of an opening on which a room lies: -1 for lower, +1 for higher coordinates."""
    stops, lines = (grid.xs, grid.ys) if opening.along_x else (grid.ys, grid.xs)
    m = next(k for k in range(len(stops) - 1) if stops[k + 1] > opening.low)
    k = lines.index(opening.at)
    above = grid.at(m, k) if opening.along_x else grid.at(k, m)
    return 1 if above == room else -1


def _door_cell(opening: Opening, side: int, origin: NDArray[np.int64]) -> tuple[int, int]:
    """Return the node of a door's channel that lies furthest in the room."""
    # 25 cm is the lattice's spacing, 20 cm the disc's radius. Across the wall: the last node from
    # which the disc still lies in the clear depth. Along it: the node nearest to the middle.
    along = round((opening.low + opening.high) / 2 / 25)
    if not opening.low + 20 <= along * 25 <= opening.high - 20:
        along += 1 if along * 25 < opening.low + 20 else -1
    reach = (opening.at + side * (HALF_WALL_CM + DOOR_CLEAR_CM - 20)) / 25
    across = int(np.floor(reach + 1e-9)) if side > 0 else int(np.ceil(reach - 1e-9))
    i, j = (along, across) if opening.along_x else (across, along)
    return i - int(origin[0]), j - int(origin[1])


def room_state(
    plan: FloorPlan, room: int, openings: Sequence[Opening], ceiling_m: float
) -> RoomState:
    """Return an empty room, with keep-out boxes before its doors and windows."""
    grid = plan.grid
    inner = _inner_box(grid, room)
    mine = [(o, _side_of(grid, room, o)) for o in openings if room in o.rooms]
    doors = [(o, side) for o, side in mine if o.kind is not None]
    origin = np.floor(inner[:2] / SPACING_M).astype(np.int64)
    free = _free_nodes(inner, origin)
    solids = _other_rooms(grid, room, ceiling_m)
    for box in solids:
        mark_blocked(free, origin, box)
    count = int(free.sum())
    small = count < SMALL_NODES
    cells = [_door_cell(o, side, origin) for o, side in doors]
    nodes = FreeNodes(
        free,
        origin,
        np.array(cells, dtype=np.int64).reshape(-1, 2),
        int((MIN_FREE_SMALL if small else MIN_FREE) * count),
        JOINED_SMALL if small else JOINED,
    )
    state = RoomState(
        room,
        plan.types[room],
        inner,
        clear_area_m2(grid, room),
        clear_size_m(grid.main_rectangle(room))[0],
        wall_faces(grid.polygon(frozenset({room})), [o for o, _ in mine]),
        nodes,
    )
    for box in solids:
        state.add_solid(box)
    for o, side in doors:
        state.add_keep_out(_box_beside(o, side, DOOR_CLEAR_CM, 0.0, o.top / 100.0))
    for o, side in mine:
        if o.kind is None:
            depth = WINDOW_DEPTH_M * 100.0
            state.add_keep_out(_box_beside(o, side, depth, o.bottom / 100.0, o.top / 100.0))
    return state


def _inner_box(grid: FloorGrid, room: int) -> Floats:
    """Bounding box (4,) of a room between its wall faces: x0, y0, x1, y1 in metres."""
    columns, rows = zip(*grid.cells[room], strict=True)
    half = HALF_WALL_CM / 100.0
    return np.array(
        [
            grid.xs[min(columns)] / 100.0 + half,
            grid.ys[min(rows)] / 100.0 + half,
            grid.xs[max(columns) + 1] / 100.0 - half,
            grid.ys[max(rows) + 1] / 100.0 - half,
        ]
    )


def _free_nodes(inner: Floats, origin: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Lattice nodes (nx, ny), from `origin` on, on which the disc is clear of the outer walls."""
    shape = np.ceil(inner[2:] / SPACING_M).astype(np.int64) - origin + 1
    xs = (origin[0] + np.arange(shape[0])) * SPACING_M
    ys = (origin[1] + np.arange(shape[1])) * SPACING_M
    in_x = (xs >= inner[0] + CLEARANCE_M) & (xs <= inner[2] - CLEARANCE_M)
    in_y = (ys >= inner[1] + CLEARANCE_M) & (ys <= inner[3] - CLEARANCE_M)
    return np.ascontiguousarray(in_x[:, None] & in_y[None, :])


def _other_rooms(grid: FloorGrid, room: int, ceiling_m: float) -> list[Floats]:
    """Boxes (6,) of the cells in a room's bounding box that are not its own, walls included.

    An L-shaped room is a rectangle in which the missing corner is solid.
    """
    columns, rows = zip(*grid.cells[room], strict=True)
    half = HALF_WALL_CM / 100.0
    out: list[Floats] = []
    for i in range(min(columns), max(columns) + 1):
        for j in range(min(rows), max(rows) + 1):
            if grid.owner[i][j] != room:
                x0, x1 = grid.xs[i] / 100.0 - half, grid.xs[i + 1] / 100.0 + half
                y0, y1 = grid.ys[j] / 100.0 - half, grid.ys[j + 1] / 100.0 + half
                out.append(np.array([x0, y0, x1, y1, 0.0, ceiling_m]))
    return out


def quarter_quaternion(turn: int) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of a number of quarter turns about z."""
    return yaw_quaternion(90.0 * (turn % 4))
