"""Map of the house around the agent: the observation without pictures.

A raster of the house has a cell of 0.125 m for every quarter of a lattice cell, so that the agent
always stands on a corner of four cells and looks along their sides: a map is a crop of the raster
and a quarter turn of it, exact. The raster is kept from step to step, and changed where a thing
moved. The kernels are compiled by numba.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np
from numba import njit

from internav_data.catalog.asset_types import ASSET_TYPES
from internav_data.geometry import Polygons, footprint, round_m, wall_footprints
from internav_data.navigation import SPACING_M
from internav_data.physics.sweep import extent_of
from internav_data.world.visibility import CAMERA_M

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from internav_data.core.typing import Floats, Ints
    from internav_data.records import Affordance, Asset, Dynamics
    from internav_data.world import HouseModel, StepResult
    from internav_data.world.house_model import MovableObject

    Raster = NDArray[np.uint8]
    Area = tuple[int, int, int, int]

Privilege = Literal["mass", "movable"]
"""Hidden attribute that a map can show to an oracle."""
CELL_M: Final = SPACING_M / 2
"""Side of a cell, metres."""
MAP_SIZE: Final = 52
"""Cells a side of a map: 6.5 m."""
HEIGHT_M: Final = 0.02
"""Unit of heights."""
_PAD: Final = MAP_SIZE // 2
_FULL: Final = 255
_OVERLAP_M: Final = 1e-6
"""Overlap along every axis beyond which a footprint covers a cell: sides that touch do not."""
WALL, FURNITURE, PUSH, PICK, UNSEEN = 1, 2, 3, 4, 5
"""Values of the channel `kind`; 0 where nothing stands."""
OWN_TYPE, WALL_TYPE = 254, 255
"""Values of the channel `type` of a user's own types and of walls; 0 where nothing stands, and a
type of the catalogue has its number there plus 1."""
PICK_FAILED, NOTHING_HERE = 16, 32
"""Bits of the channel `tried` beside those of the four pushes."""
_HEIGHT, _KIND, _TYPE, _TRIED, _MASS, _MOVABLE = range(6)
LAYERS: Final[dict[Privilege, int]] = {"mass": _MASS, "movable": _MOVABLE}
"""Layers of the raster that only oracles are shown, by name."""
_OPAQUE: Final = math.ceil(CAMERA_M / HEIGHT_M)
"""Height, in units of `HEIGHT_M`, from which a thing hides what is behind it."""
_GOAL: Final = 3
CHANNELS: Final = 5
"""Number of channels of a map that shows nothing hidden: height, kind, type, goal, tried."""


def map_layers(privileged: Sequence[Privilege]) -> Ints:
    """Return the layer of the raster that each channel shows, (channels,) int64.

    The channel `goal` shows none of them.
    """
    shown = [_HEIGHT, _KIND, _TYPE, _HEIGHT, _TRIED, *(LAYERS[name] for name in privileged)]
    return np.array(shown)


class MapMoment(NamedTuple):
    """State of a run after an action, as a map needs it."""

    i: int
    j: int
    quarter: int
    items: tuple[MovableObject, ...]
    result: StepResult | None
    """Result of the action; None at the start."""


@njit(cache=True)
def _overlaps(vertices: Floats, first: int, last: int, x: float, y: float) -> bool:
    """Return whether no side of a convex polygon separates it from the cell with corner (x, y)."""
    for k in range(first, last):
        after = first if k + 1 == last else k + 1
        dx, dy = vertices[after, 0] - vertices[k, 0], vertices[after, 1] - vertices[k, 1]
        # The cell's corner that lies farthest to the left of the side, which is the inner one.
        across = x - vertices[k, 0] + (CELL_M if dy < 0.0 else 0.0)
        along = y - vertices[k, 1] + (CELL_M if dx > 0.0 else 0.0)
        if dx * along - dy * across <= _OVERLAP_M * math.hypot(dx, dy):
            return False
    return True


@njit(cache=True)
def _stamp(raster: Raster, area: Area, vertices: Floats, offsets: Ints, values: Raster) -> None:
    """Write a thing's layers, `values`, into those cells of an area that show it.

    Of several things in a cell that one is shown whose type can be handled, else the highest.
    """
    score = values[_HEIGHT] + (256 if values[_KIND] >= PUSH else 0)
    for polygon in range(len(offsets) - 1):
        first, last = offsets[polygon], offsets[polygon + 1]
        own = vertices[first:last]
        a_low = max(area[0], math.floor((own[:, 0].min() + _OVERLAP_M) / CELL_M) + _PAD)
        a_high = min(area[1], math.floor((own[:, 0].max() - _OVERLAP_M) / CELL_M) + _PAD + 1)
        b_low = max(area[2], math.floor((own[:, 1].min() + _OVERLAP_M) / CELL_M) + _PAD)
        b_high = min(area[3], math.floor((own[:, 1].max() - _OVERLAP_M) / CELL_M) + _PAD + 1)
        for a in range(a_low, a_high):
            for b in range(b_low, b_high):
                there = raster[_HEIGHT, a, b] + (256 if raster[_KIND, a, b] >= PUSH else 0)
                if there <= score and _overlaps(
                    vertices, first, last, CELL_M * (a - _PAD), CELL_M * (b - _PAD)
                ):
                    raster[:, a, b] = values


@njit(cache=True)
def _crop(
    raster: Raster, a: int, b: int, ahead: tuple[int, int], goal: tuple[int, int],
    layers: Ints, out: Raster,
) -> None:  # fmt: skip
    """Write the map of an agent on the corner (a, b) of cells that looks along (ahead)."""
    left = (-ahead[1], ahead[0])
    quarter = (1 - ahead[0]) if ahead[1] == 0 else (2 - ahead[1])
    # Cells are named by their lower corner: towards -x or -y the first one is one back.
    a -= int(ahead[0] < 0 or left[0] < 0)
    b -= int(ahead[1] < 0 or left[1] < 0)
    for channel in range(len(layers)):
        layer = layers[channel]
        for row in range(MAP_SIZE):
            u = _PAD - 1 - row
            for column in range(MAP_SIZE):
                v = _PAD - 1 - column
                value = raster[
                    layer, a + u * ahead[0] + v * left[0], b + u * ahead[1] + v * left[1]
                ]
                if layer == _TRIED and value:
                    turned = ((value & 15) >> quarter) | ((value & 15) << (4 - quarter))
                    value = (value & 240) | (turned & 15)
                out[channel, row, column] = value
    out[_GOAL] = 0
    for da in range(-1, 1):
        for db in range(-1, 1):
            east, north = goal[0] + da - a, goal[1] + db - b
            row = _PAD - 1 - (east * ahead[0] + north * ahead[1])
            column = _PAD - 1 - (east * left[0] + north * left[1])
            if 0 <= row < MAP_SIZE and 0 <= column < MAP_SIZE:
                out[_GOAL, row, column] = 1


@njit(cache=True)
def _in_sight(raster: Raster, a: int, b: int, east: int, north: int) -> bool:
    """Return whether nothing opaque lies between the corner (a, b) and the middle of a cell.

    `east` and `north` are odd: the way there in halves of a cell. Cells that the segment passes at
    a corner alone hide nothing (traversal of Amanatides and Woo 1987, in whole numbers).
    """
    dx, dy = abs(east), abs(north)
    p, q = 0, 0
    while 2 * p + 1 < dx or 2 * q + 1 < dy:
        cell_a, cell_b = (a + p if east > 0 else a - 1 - p), (b + q if north > 0 else b - 1 - q)
        if raster[_HEIGHT, cell_a, cell_b] >= _OPAQUE:
            return False
        to_x, to_y = (p + 1) * dy, (q + 1) * dx
        p, q = p + int(to_x <= to_y), q + int(to_y <= to_x)
    return True


@njit(cache=True)
def _look(raster: Raster, seen: Raster, a: int, b: int, ahead: tuple[int, int]) -> None:
    """Copy what the agent sees, 90 degrees wide, and what is within 0.25 m, into `seen`."""
    for cell_a in range(_PAD - 2, raster.shape[1] - _PAD + 2):
        for cell_b in range(_PAD - 2, raster.shape[2] - _PAD + 2):
            east, north = 2 * (cell_a - a) + 1, 2 * (cell_b - b) + 1
            level = east * ahead[0] + north * ahead[1]
            side = abs(north * ahead[0] - east * ahead[1])
            near = abs(east) <= 3 and abs(north) <= 3  # noqa: PLR2004 - two cells, in halves
            if near or (side <= level and _in_sight(raster, a, b, east, north)):
                seen[:, cell_a, cell_b] = raster[:, cell_a, cell_b]


def _values(
    asset: Asset,
    high_m: float,
    dynamics: Dynamics,
    affordances: Mapping[str, Affordance],
    tried: int = 0,
) -> Raster:
    """Return the layers of a thing, (6,) uint8."""
    known = ASSET_TYPES.get(asset.type)
    kind = {None: FURNITURE, "push": PUSH, "pick": PICK}[affordances.get(asset.type)]
    number = OWN_TYPE if known is None else known.number + 1
    mass = min(_FULL, max(1, round(dynamics.mass_kg)))
    movable = dynamics.pushable + 2 * dynamics.pickable
    return np.array([_height(high_m), kind, number, tried, mass, movable], np.uint8)


def _height(high_m: float) -> int:
    return min(_FULL, max(1, round(round_m(high_m) / HEIGHT_M)))


def house_raster(model: HouseModel, affordances: Mapping[str, Affordance]) -> Raster:
    """Return the raster of a house without what can move, (6, a, b) uint8.

    Parameters
    ----------
    model
        Model of the house.
    affordances
        Affordance of each type that can be handled.
    """
    shape = (2 * size + MAP_SIZE for size in model.lattice.shape)
    raster = np.zeros((6, *shape), np.uint8)
    area = (0, raster.shape[1], 0, raster.shape[2])
    for wall in model.house.walls:
        plan = wall_footprints([wall])
        values = np.array([_height(wall.z_max), WALL, WALL_TYPE, 0, _FULL, 0], np.uint8)
        _stamp(raster, area, plan.vertices, plan.offsets, values)
    for body in model.fixed[len(model.house.walls) :]:
        plan, extent = footprint(body.asset, body.pose), extent_of(body.asset, body.pose)
        values = _values(body.asset, extent.high_m, body.dynamics, affordances)
        _stamp(raster, area, plan.vertices, plan.offsets, values)
    return raster


class HouseMap:
    """Raster of a house in one episode, which follows its run, and the maps that it shows.

    Parameters
    ----------
    raster
        Raster of the house without what can move; it stays as it is.
    affordances
        Affordance of each type that can be handled.
    goal
        Lattice node of the goal.
    start
        First moment of the run.
    occlusion
        Whether maps show only what has been seen so far.
    """

    __slots__ = (
        "_affordances",
        "_empty",
        "_followed",
        "_goal",
        "_here",
        "_items",
        "_moment",
        "_raster",
        "_seen",
        "_tried",
    )

    def __init__(
        self,
        raster: Raster,
        affordances: Mapping[str, Affordance],
        goal: tuple[int, int],
        start: MapMoment,
        *,
        occlusion: bool,
    ) -> None:
        self._empty, self._affordances = raster, affordances
        self._goal = _corner(*goal)
        self._items, self._moment, self._followed = start.items, start, 0
        self._tried = [0] * len(start.items)
        self._here: set[tuple[int, int]] = set()
        self._raster = raster.copy()
        area = (0, raster.shape[1], 0, raster.shape[2])
        for k in range(len(self._items)):
            self._draw(k, area)
        self._seen: Raster | None = None
        if occlusion:
            self._seen = np.zeros_like(raster)
            self._seen[_KIND] = UNSEEN

    def follow(self, moments: Sequence[MapMoment]) -> None:
        """Take in the moments of the run that came since the last call; all of them are given."""
        for moment in moments[self._followed :]:
            self._moment = moment
            if moment.items is not self._items:
                self._move(moment.items)
            if moment.result is not None and not moment.result.success:
                self._note(moment, moment.result)
            if self._seen is not None:
                a, b = _corner(moment.i, moment.j)
                _look(self._raster, self._seen, a, b, _AHEAD[moment.quarter])
        self._followed = len(moments)

    def write(self, out: Raster, layers: Ints) -> None:
        """Write the map (channels, 52, 52) uint8 of the latest moment, of some layers."""
        now = self._moment
        raster = self._raster if self._seen is None else self._seen
        _crop(raster, *_corner(now.i, now.j), _AHEAD[now.quarter], self._goal, layers, out)

    def _move(self, items: tuple[MovableObject, ...]) -> None:
        """Bring the raster in line with things that lie elsewhere now."""
        before, self._items = self._items, items
        areas = [_around(*node) for node in self._here]
        self._here.clear()
        for k, (old, new) in enumerate(zip(before, items, strict=True)):
            if old is not new:
                self._tried[k] = 0
                areas += [_area_of(each.footprint) for each in (old, new) if each.pose is not None]
        for area in areas:
            self._refresh(area)

    def _refresh(self, area: Area) -> None:
        """Draw an area anew."""
        a_low, a_high, b_low, b_high = area
        self._raster[:, a_low:a_high, b_low:b_high] = self._empty[:, a_low:a_high, b_low:b_high]
        for k in range(len(self._items)):
            self._draw(k, area)
        for node in self._here:
            self._mark(*node)

    def _draw(self, k: int, area: Area) -> None:
        item = self._items[k]
        if item.pose is not None:
            values = _values(
                item.asset, item.high_m, item.dynamics, self._affordances, self._tried[k]
            )
            _stamp(self._raster, area, item.footprint.vertices, item.footprint.offsets, values)

    def _mark(self, i: int, j: int) -> None:
        a_low, a_high, b_low, b_high = _around(i, j)
        self._raster[_TRIED, a_low:a_high, b_low:b_high] |= NOTHING_HERE

    def _note(self, moment: MapMoment, result: StepResult) -> None:
        """Mark what failed."""
        kind, target = result.action.kind, result.target
        if kind not in {"push", "pick", "drop"}:
            return
        if target < 0 or kind == "drop":
            self._here.add((moment.i, moment.j))
            self._mark(moment.i, moment.j)
            return
        heading = (moment.quarter + result.action.quarter_turns) % 4
        self._tried[target] |= 1 << heading if kind == "push" else PICK_FAILED
        self._refresh(_area_of(self._items[target].footprint))


_AHEAD: Final = ((1, 0), (0, 1), (-1, 0), (0, -1))


def _corner(i: int, j: int) -> tuple[int, int]:
    """Return the upper right one of the four cells round a node."""
    return 2 * i + _PAD, 2 * j + _PAD


def _around(i: int, j: int) -> Area:
    """Return the four cells round a node: a_low, a_high, b_low, b_high."""
    a, b = _corner(i, j)
    return a - 1, a + 1, b - 1, b + 1


def _area_of(plan: Polygons) -> Area:
    """Return the bounds of all cells that a footprint can cover: a_low, a_high, b_low, b_high."""
    if not len(plan.vertices):
        return 0, 0, 0, 0
    low = np.floor(plan.vertices.min(0) / CELL_M).astype(int) + _PAD
    high = np.floor(plan.vertices.max(0) / CELL_M).astype(int) + _PAD + 1
    return int(low[0]), int(high[0]), int(low[1]), int(high[1])
