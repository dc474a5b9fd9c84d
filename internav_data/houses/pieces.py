"""Pieces of furniture and the groups they form, in a frame of their own.

A group's frame: the wall is y = 0 and runs along x, the room lies at y > 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from internav_data.geometry import asset_corners
from internav_data.geometry.footprints import convex_hull
from internav_data.houses.fitting import GroupBoxes, any_overlap, turn_box

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.random import Generator

    from internav_data.catalog import Catalogue
    from internav_data.core.typing import Floats
    from internav_data.records import Asset

BACK_GAP_M = 0.01
"""Furniture stands this far from the wall."""
FACING_ROOM, FACING_WALL, FACING_RIGHT, FACING_LEFT = 2, 0, 1, 3
"""Quarter turns of an asset (its front looks along -y) in a group's frame."""

EDGE_M = 5e-4
"""Depth by which a thing may stick out over the edge of the top that carries it: rounding."""

_BOXES: dict[tuple[str, str], Floats] = {}
"""Boxes around the parts of assets by (catalogue digest, asset id): a cache, never cleared."""
_PLANS: dict[tuple[str, str], tuple[Floats, ...]] = {}
"""Plan of an asset, then tops of its parts: corners of convex polygons (n, 2), counter-clockwise.
A cache by (catalogue digest, asset id), never cleared."""


@dataclass(frozen=True, slots=True)
class PlacedAsset:
    """An asset in a group's frame."""

    asset: Asset
    x: float
    y: float
    turn: int
    z: float = 0.0
    support: int = -1
    """Index in the group of the item it stands on; -1 for the floor or a wall."""

    @property
    def half(self) -> tuple[float, float]:
        """Half extents along the group's x and y."""
        w, d = self.asset.size[0] / 2.0, self.asset.size[1] / 2.0
        return (w, d) if self.turn % 2 == 0 else (d, w)


@dataclass(frozen=True)
class Group:
    """Items that belong together, and the rectangles in front of them that stay clear."""

    items: tuple[PlacedAsset, ...]
    clear: tuple[tuple[float, float, float, float], ...] = ()
    """Rectangles x0, y0, x1, y1 in metres."""

    @cached_property
    def boxes(self) -> Floats:
        """Bounding boxes of the items, (n, 6) float64: x0, y0, x1, y1, z0, z1 in metres."""
        out = np.empty((len(self.items), 6))
        for k, item in enumerate(self.items):
            hx, hy = item.half
            top = item.z + item.asset.size[2]
            out[k] = (item.x - hx, item.y - hy, item.x + hx, item.y + hy, item.z, top)
        return out

    @cached_property
    def kernel_boxes(self) -> GroupBoxes:
        """Boxes of the group as the kernels take them."""
        blocking = np.array([item.asset.blocks for item in self.items])
        # From a rug's thickness to the agent's height.
        fronts = np.array([(*c, 0.03, 1.8) for c in self.clear]).reshape(-1, 6)
        return GroupBoxes(self.boxes, blocking, fronts)

    @property
    def left(self) -> float:
        """Smallest x, metres."""
        return float(self.boxes[:, 0].min())

    @property
    def right(self) -> float:
        """Largest x, metres."""
        return float(self.boxes[:, 2].max())

    @property
    def depth(self) -> float:
        """Extent along y, metres."""
        return float(self.boxes[:, 3].max() - self.boxes[:, 1].min())

    def with_items(self, *items: PlacedAsset) -> Group:
        """Return the group with further items."""
        return Group((*self.items, *items), self.clear)

    def with_clearance(self, *clear: tuple[float, float, float, float]) -> Group:
        """Return the group with further boxes (x0, y0, x1, y1) to keep clear."""
        return Group(self.items, (*self.clear, *clear))


def against(asset: Asset, x: float = 0.0, z: float = 0.0) -> PlacedAsset:
    """Stand an asset with its back to the wall."""
    return PlacedAsset(asset, x, BACK_GAP_M + asset.size[1] / 2.0, FACING_ROOM, z)


def in_front(
    item: PlacedAsset, depth: float, share: float = 1.0
) -> tuple[float, float, float, float]:
    """Return the rectangle of a depth (m) before an item that faces the room.

    `share` is the rectangle's share of the item's width.
    """
    hx, hy = item.half
    return (item.x - hx * share, item.y + hy, item.x + hx * share, item.y + hy + depth)


@dataclass(frozen=True, slots=True)
class Picker:
    """Random choice of assets by type and size."""

    catalogue: Catalogue
    rng: Generator

    def chance(self, share: float) -> bool:
        """Return True in that share of draws."""
        return float(self.rng.random()) < share

    def one(
        self, kind: str, fits: Callable[[Asset], bool] | None = None, *, any_size: bool = False
    ) -> Asset | None:
        """Return an asset of a type; None where the catalogue has none (of that size)."""
        found: Sequence[Asset] = self.catalogue.of_type(kind)
        if fits is not None:
            fitting = [asset for asset in found if fits(asset)]
            found = fitting if fitting or not any_size else found
        draw = float(self.rng.random())
        return found[int(draw * len(found))] if found else None

    def smallest(self, kind: str) -> Asset | None:
        """Return the asset of a type with the smallest plan; None where there is none."""
        found = self.catalogue.of_type(kind)
        return min(found, key=lambda a: (a.size[0] * a.size[1], a.asset_id), default=None)

    def parts(self, item: PlacedAsset) -> Floats:
        """Return boxes around an item's parts, (n, 6) float64, in the group's frame, metres."""
        key = (self.catalogue.digest, item.asset.asset_id)
        if key not in _BOXES:
            corners, starts = asset_corners(item.asset)
            low = np.minimum.reduceat(corners, starts[:-1])
            high = np.maximum.reduceat(corners, starts[:-1])
            _BOXES[key] = np.column_stack([low[:, :2], high[:, :2], low[:, 2], high[:, 2]])
        local = _BOXES[key]
        out = np.empty_like(local)
        for k in range(len(local)):
            turn_box(local[k], item.x, item.y, item.turn % 4, out[k])
        out[:, 4:] += item.z
        return out

    def resting(
        self,
        below: PlacedAsset,
        index: int,
        asset: Asset,
        dx: float,
        dy: float,
        turn: int = FACING_ROOM,
    ) -> PlacedAsset | None:
        """Stand an asset on an item, (dx, dy) from its middle; None where it finds no flat top.

        All of its plan lies within the top of the highest part below it: nothing stands on a
        chair's back or over a table's edge.
        """
        item = PlacedAsset(asset, below.x + dx, below.y + dy, turn, support=index)
        hx, hy = item.half
        parts = self.parts(below)
        over = (
            (parts[:, 0] < item.x + hx)
            & (parts[:, 2] > item.x - hx)
            & (parts[:, 1] < item.y + hy)
            & (parts[:, 3] > item.y - hy)
        )
        if not over.any():
            return None
        top = float(parts[over, 5].max())
        plan = _turned(self._plans(asset)[0], item.turn, item.x, item.y)
        tops = self._plans(below.asset)[1:]
        carried = any(
            _holds(_turned(tops[k], below.turn, below.x, below.y), plan)
            for k in np.flatnonzero(over & (parts[:, 5] > top - 1e-3))
        )
        return replace(item, z=top) if carried else None

    def _plans(self, asset: Asset) -> tuple[Floats, ...]:
        """Return the plan of an asset, then the tops of its parts, in its own frame."""
        key = (self.catalogue.digest, asset.asset_id)
        if key not in _PLANS:
            corners, starts = asset_corners(asset)
            parts = [corners[a:b] for a, b in pairwise(starts)]
            tops = [part[part[:, 2] > part[:, 2].max() - 1e-3, :2] for part in parts]
            _PLANS[key] = tuple(
                convex_hull(np.ascontiguousarray(p)) for p in (corners[:, :2], *tops)
            )
        return _PLANS[key]

    def tucked(self, table: PlacedAsset, chair: Asset, side: int, along: float) -> PlacedAsset:
        """Push a chair under a table from a side (quarter turns from +y) as far as it goes.

        `along` is the offset from the table's middle along that side.
        """
        hx, hy = table.half
        dx, dy = ((0, 1), (-1, 0), (0, -1), (1, 0))[side]
        turn = side % 4
        reach = (hy if dx == 0 else hx) + chair.size[1] / 2.0 + 0.03
        solid = self.parts(table)
        best = PlacedAsset(chair, 0.0, 0.0, turn)
        # In steps of 4 cm, but the back of the chair stays outside.
        deepest = max(0.0, min(0.28, chair.size[1] - 0.22))
        for step in range(1 + int(deepest / 0.04)):
            offset = reach - 0.04 * step
            x = table.x + dx * offset + (along if dx == 0 else 0.0)
            y = table.y + dy * offset + (along if dy == 0 else 0.0)
            trial = PlacedAsset(chair, x, y, turn)
            if step > 0 and overlap(self.parts(trial), solid):
                break
            best = trial
        return best


def _turned(corners: Floats, turn: int, x: float, y: float) -> Floats:
    """Return corners (n, 2) turned by quarter turns about the origin, then moved."""
    u, v = corners[:, 0], corners[:, 1]
    moved = ((u, v), (-v, u), (-u, -v), (v, -u))[turn % 4]
    return np.column_stack([moved[0] + x, moved[1] + y])


def _holds(outer: Floats, inner: Floats) -> bool:
    """Return whether a convex polygon (n, 2), counter-clockwise, holds points, up to `EDGE_M`."""
    if len(outer) < 3:  # noqa: PLR2004 - a part with a point or an edge on top
        return False
    sides = np.roll(outer, -1, axis=0) - outer
    away = inner[:, None, :] - outer[None, :, :]
    left = sides[None, :, 0] * away[:, :, 1] - sides[None, :, 1] * away[:, :, 0]
    return bool((left >= -EDGE_M * np.hypot(sides[:, 0], sides[:, 1])).all())


def overlap(first: Floats, second: Floats, gap: float = 0.005) -> bool:
    """Return whether boxes (n, 6) of one item come nearer than a gap (m) to those of another."""
    return bool(any_overlap(first, second, gap))


def consistent(picker: Picker, group: Group) -> bool:
    """Return whether no two items of a group share volume: a chair may stand under a table.

    Rugs are floor: what stands on one stands on the floor that it covers.
    """
    boxes = group.boxes
    count = len(boxes)
    for a in range(count):
        for b in range(a + 1, count):
            if (
                group.items[a].asset.blocks
                and group.items[b].asset.blocks
                and overlap(boxes[a : a + 1], boxes[b : b + 1], 0.0)
                and overlap(picker.parts(group.items[a]), picker.parts(group.items[b]), 0.0005)
            ):
                return False
    return True
