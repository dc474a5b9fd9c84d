"""Makers of kitchen groups: runs of counters with stove, sink and fridge, and islands."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.arithmetic import plain_sum
from internav_data.houses.groups import narrow
from internav_data.houses.pieces import FACING_WALL, Group, Picker, PlacedAsset, against, in_front

if TYPE_CHECKING:
    from internav_data.houses.groups import RoomContext
    from internav_data.records import Asset

SEAM_M = 0.008
"""Gap between the pieces of a run."""
SMALL_COUNTER_M = 0.8
"""Length along the wall for a small counter."""
SHORT_RUN_M = 2.2
"""Length along the wall for a stove, a sink and a small counter."""
WORKING_M = 0.75
"""Clear depth before a run."""
_FOODS = ("Microwave", "Bread", "Apple", "Lettuce", "Tomato", "Pot")


def _run(p: Picker, kinds: tuple[str, ...], longest: float) -> Group | None:
    """Make pieces side by side along a wall; counters as long as the wall allows."""
    fixed: list[Asset | None] = [p.one(kind) if kind != "CounterTop" else None for kind in kinds]
    counters = kinds.count("CounterTop")
    spare = longest - plain_sum(a.size[0] + SEAM_M for a in fixed if a is not None)
    items: list[PlacedAsset] = []
    x = 0.0
    for kind, asset in zip(kinds, fixed, strict=True):
        piece = asset
        if kind == "CounterTop":
            limit = spare / counters - SEAM_M
            piece = p.one(kind, narrow(limit))
            if piece is None:
                return None
        if piece is None:
            continue
        items.append(against(piece, x + piece.size[0] / 2.0))
        x += piece.size[0] + SEAM_M
    if not items or x > longest:
        return None
    return Group(tuple(items), tuple(in_front(item, WORKING_M) for item in items))


def _laid(p: Picker, group: Group) -> Group:
    """Put food and pots on the counters."""
    out = group
    for k, item in enumerate(group.items):
        if item.asset.type == "Stove" and p.chance(0.6):
            pot = p.one("Pot")
            resting = p.resting(item, k, pot, -0.12, 0.05) if pot else None
            out = out.with_items(resting) if resting is not None else out
        if item.asset.type != "CounterTop":
            continue
        half = item.half[0]
        for dx in (-half + 0.4, half - 0.4) if half > 0.8 else (0.0,):  # noqa: PLR2004 - room for two
            kind = _FOODS[int(float(p.rng.random()) * len(_FOODS))]
            small = p.one(kind) if p.chance(0.65) else None
            resting = p.resting(item, k, small, dx, 0.0) if small else None
            out = out.with_items(resting) if resting is not None else out
    return out


_RUNS: tuple[tuple[str, ...], ...] = (
    ("Fridge", "CounterTop", "Stove", "CounterTop", "Sink", "Dishwasher"),
    ("Fridge", "CounterTop", "Stove", "CounterTop", "Sink"),
    ("Fridge", "CounterTop", "Stove", "Sink"),
    ("Fridge", "Stove", "CounterTop", "Sink"),
)
_SHORT_RUNS: tuple[tuple[str, ...], ...] = (
    ("CounterTop", "Stove", "Sink"),
    ("Stove", "Sink"),
    ("Stove",),
)


def kitchen_run(p: Picker, room: RoomContext) -> list[Group]:
    """Make a run with fridge, stove, counters and sink along one wall: the fullest first."""
    start = 0 if room.area_m2 > 12 else 1  # noqa: PLR2004 - m², a roomy kitchen
    kinds = list(_RUNS[start:])
    if p.chance(0.5):
        kinds = [k[::-1] for k in kinds]
    runs = [_run(p, k, length) for k in kinds for length in (room.long_m, room.short_m)]
    return [_laid(p, run) for run in runs if run is not None]


def short_run(p: Picker, room: RoomContext) -> list[Group]:
    """Make stove, sink and a small counter, for rooms in which no run fits."""
    lengths = (0.7 * room.long_m, 0.7 * room.short_m, SHORT_RUN_M)
    runs = [_run(p, k, length) for k in _SHORT_RUNS for length in lengths]
    return [_laid(p, run) for run in runs if run is not None]


def counter(p: Picker, room: RoomContext) -> list[Group]:
    """Make another counter, a small one where there is little room."""
    runs = [_run(p, ("CounterTop",), length) for length in (0.6 * room.long_m, SMALL_COUNTER_M)]
    return [_laid(p, run) for run in runs if run is not None]


def sink_alone(p: Picker, room: RoomContext) -> list[Group]:
    """Make a sink by itself."""
    del room
    asset = p.one("Sink")
    if asset is None:
        return []
    item = against(asset)
    return [Group((item,), (in_front(item, 0.6),))]


def island(p: Picker, room: RoomContext) -> list[Group]:
    """Make a free-standing counter with stools."""
    asset = p.one("KitchenIsland", lambda a: a.size[0] < 0.45 * room.long_m)
    if asset is None:
        return []
    block = PlacedAsset(asset, 0.0, 0.0, FACING_WALL)
    hx, hy = block.half
    around = (-hx - 0.8, -hy - 0.8, hx + 0.8, hy + 0.8)
    group = Group((block,), ())
    stool = p.one("Stool")
    if stool is not None:
        seats = [p.tucked(block, stool, 0, a) for a in (-hx / 2.0, hx / 2.0)]
        group = group.with_items(*seats)
    # Room to walk on the working side.
    return [_laid(p, group.with_clearance((around[0] + 0.8, around[1], around[2] - 0.8, -hy)))]
