"""Layouts of floor plans: sliced blocks, halls as spines, notches, L-shapes, and plain rows.

Layouts are rectangles by room, centimetres, centre line to centre line. Blocks are slicing
floorplans (Otten 1982): a rectangle is cut in two until every room has its own.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from internav_data.core.arithmetic import plain_sum
from internav_data.houses.room_types import ROOM_TYPES
from internav_data.houses.slicing import (
    GRID_CM,
    Layout,
    at_origin,
    carve,
    min_width_cm,
    mirrored,
    slice_rooms,
    snapped,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.random import Generator

    from internav_data.houses.plan import Rect
    from internav_data.houses.programme import RoomSpec


def _position(spec: RoomSpec) -> int:
    return ROOM_TYPES[spec.type].position


def _uniform(rng: Generator, low: float, high: float) -> float:
    return low + (high - low) * float(rng.random())


def _shuffled(rng: Generator, items: Sequence[int]) -> list[int]:
    keys = rng.random(len(items))
    return [items[int(k)] for k in keys.argsort(kind="stable")]


def _min_depth(specs: Sequence[RoomSpec], rooms: Sequence[int]) -> int:
    """Depth that some rooms side by side need, centimetres."""
    return max(min_width_cm(specs[k]) for k in rooms)


def sliced_layout(specs: Sequence[RoomSpec], rng: Generator) -> Layout:
    """Draw one block, cut by a slicing tree."""
    guests = _guests(specs, rng)
    order = sorted(set(range(len(specs))) - guests.keys(), key=lambda k: (_position(specs[k]), k))
    if float(rng.random()) < 0.35:  # noqa: PLR2004 - other orders now and then
        order = _shuffled(rng, order)
    area = plain_sum(spec.area_m2 for spec in specs) * 1e4
    aspect = _uniform(rng, 1.0, 1.6 if len(specs) == 1 else 1.75)
    side = _min_depth(specs, order)
    # Whole centimetres, not the grid of the inner walls: houses of few rooms would repeat.
    width = max(round(math.sqrt(area * aspect)), side)
    height = max(round(area / width), side)
    joined = list(specs)
    for guest, host in guests.items():
        together = joined[host].area_m2 + specs[guest].area_m2
        joined[host] = replace(joined[host], area_m2=together)
    layout: Layout = {}
    slice_rooms((0, 0, width, height), joined, order, rng, layout)
    for guest, host in guests.items():
        _tuck(layout, guest, host, specs[guest], rng)
    return layout


def _guests(specs: Sequence[RoomSpec], rng: Generator) -> dict[int, int]:
    """Choose small rooms that a large one wraps around: hosts by guest, one guest a host."""
    found: dict[int, int] = {}
    for k, spec in enumerate(specs):
        draw, which = float(rng.random()), float(rng.random())
        hosts = [
            m
            for m, other in enumerate(specs)
            if ROOM_TYPES[other.type].host
            and m not in found.values()
            and other.area_m2 > 2.0 * spec.area_m2
        ]
        if ROOM_TYPES[spec.type].small and hosts and draw < 0.6:  # noqa: PLR2004 - mostly wrapped
            found[k] = hosts[int(which * len(hosts))]
    return found


def _tuck(layout: Layout, guest: int, host: int, spec: RoomSpec, rng: Generator) -> None:
    """Cut a small room out of a corner of its host's rectangle."""
    x0, y0, x1, y1 = layout[host][0]
    area, side = spec.area_m2 * 1e4, min_width_cm(spec)
    width = max(side, snapped(math.sqrt(area) * _uniform(rng, 0.8, 1.25)))
    depth = max(side, snapped(area / width))
    left, low = (float(rng.random()) < 0.5 for _ in range(2))  # noqa: PLR2004 - fair coins
    gx0, gx1 = (x0, min(x1, x0 + width)) if left else (max(x0, x1 - width), x1)
    gy0, gy1 = (y0, min(y1, y0 + depth)) if low else (max(y0, y1 - depth), y1)
    layout[guest] = [(gx0, gy0, gx1, gy1)]
    layout[host] = carve(layout[host], (gx0, gy0, gx1, gy1))


def _split_bands(
    specs: Sequence[RoomSpec], rooms: Sequence[int], rng: Generator
) -> tuple[list[int], list[int]]:
    """Deal rooms to the two sides of a hall, about equally by area."""
    sides: tuple[list[int], list[int]] = ([], [])
    load = [0.0, _uniform(rng, -6.0, 6.0)]
    # The largest first, then whichever side has less.
    for k in sorted(_shuffled(rng, rooms), key=lambda k: -specs[k].area_m2):
        side = 0 if load[0] <= load[1] else 1
        sides[side].append(k)
        load[side] += specs[k].area_m2
    return _shuffled(rng, sides[0]), _shuffled(rng, sides[1])


def _cells(specs: Sequence[RoomSpec], band: list[int], rng: Generator) -> list[tuple[int, ...]]:
    """Group a band's rooms: a small room shares the cell of a large one that wraps around it."""
    small = [k for k in band if ROOM_TYPES[specs[k].type].small]
    large = [k for k in band if not ROOM_TYPES[specs[k].type].small]
    cells: list[tuple[int, ...]] = [(k,) for k in large]
    for k in small:
        hosts = [
            m
            for m, cell in enumerate(cells)
            if len(cell) == 1
            and ROOM_TYPES[specs[cell[0]].type].host
            and specs[cell[0]].area_m2 > 1.5 * specs[k].area_m2
        ]
        if hosts and float(rng.random()) < 0.7:  # noqa: PLR2004 - mostly wrapped
            m = hosts[int(float(rng.random()) * len(hosts))]
            cells[m] = (cells[m][0], k)
        else:
            cells.insert(int(float(rng.random()) * (len(cells) + 1)), (k,))
    return cells


def _wrap(
    rect: Rect,
    specs: Sequence[RoomSpec],
    cell: tuple[int, ...],
    *,
    hall_above: bool,
    rng: Generator,
) -> Layout:
    """Put a small room into a corner of a large one's cell: beside the hall, or at its far end."""
    x0, y0, x1, y1 = rect
    host, guest = cell
    area = specs[guest].area_m2 * 1e4
    min_width = min_width_cm(specs[guest])
    if float(rng.random()) < 0.3:  # noqa: PLR2004 - ensuite: all of the far end
        depth = max(min_width, snapped(area / (x1 - x0)))
        far: Rect = (x0, y0, x1, y0 + depth) if hall_above else (x0, y1 - depth, x1, y1)
        return {host: carve([rect], far), guest: [far]}
    depth = max(min_width, snapped(math.sqrt(area) * _uniform(rng, 0.9, 1.25)))
    depth = min(depth, y1 - y0)
    width = max(min_width, snapped(area / depth))
    left = float(rng.random()) < 0.5  # noqa: PLR2004 - a fair coin
    gx0, gx1 = (x0, x0 + width) if left else (x1 - width, x1)
    near: Rect = (gx0, y1 - depth, gx1, y1) if hall_above else (gx0, y0, gx1, y0 + depth)
    return {host: carve([rect], near), guest: [near]}


def _fill_band(
    specs: Sequence[RoomSpec],
    cells: list[tuple[int, ...]],
    rect: Rect,
    *,
    hall_above: bool,
    rng: Generator,
) -> Layout:
    x0, y0, x1, y1 = rect
    areas = [plain_sum(specs[k].area_m2 for k in cell) for cell in cells]
    min_widths = [max(min_width_cm(specs[k]) for k in cell) for cell in cells]
    spare = max(0.0, (x1 - x0) - plain_sum(min_widths))
    # Widths follow areas, but never under the minimum.
    wanted = [
        max(0.0, a / plain_sum(areas) * (x1 - x0) - w)
        for a, w in zip(areas, min_widths, strict=True)
    ]
    factor = spare / plain_sum(wanted) if plain_sum(wanted) > 0.0 else 0.0
    layout: Layout = {}
    left = x0
    reach = float(x0)
    for k, cell in enumerate(cells):
        reach += min_widths[k] + factor * wanted[k]
        right = x1 if k == len(cells) - 1 else max(left + GRID_CM, snapped(reach))
        piece: Rect = (left, y0, right, y1)
        if len(cell) == 1:
            layout[cell[0]] = [piece]
        else:
            layout.update(_wrap(piece, specs, cell, hall_above=hall_above, rng=rng))
        left = right
    return layout


def _end_zone(
    specs: Sequence[RoomSpec], rest: Sequence[int], wings: float, rng: Generator
) -> list[int]:
    """Choose the rooms at the hall's end: living rooms, and in wings the rooms they lead to."""
    draw, reach = float(rng.random()), 1 + int(float(rng.random()) * 3)
    if len(rest) <= 3 or draw > 0.85:  # noqa: PLR2004 - four rooms have an end to spare
        return []
    # Living rooms in the order of the table, whatever the programme's.
    ranks = {k: ROOM_TYPES[specs[k].type].hall_end for k in rest}
    fitting = [(rank, k) for k, rank in ranks.items() if rank is not None]
    living = [k for _, k in sorted(fitting, key=lambda pair: pair[0])]
    end = living[:reach]
    others = [k for k in _shuffled(rng, rest) if ROOM_TYPES[specs[k].type].wing]
    if end and float(rng.random()) < wings:
        end = living
        further = 1 + int(float(rng.random()) * max(1, len(rest) - len(end) - 2))
        end = end[:1] + others[:further] + end[1:]
    return end if len(rest) - len(end) >= 2 else []  # noqa: PLR2004 - a hall serves two at least


def hall_layout(specs: Sequence[RoomSpec], rng: Generator, wings: float = 0.0) -> Layout:
    """Line a hall with rooms on both sides; the living rooms often fill its end."""
    hall = next(k for k, spec in enumerate(specs) if spec.type == "hall")
    rest = [k for k in range(len(specs)) if k != hall]
    end = _end_zone(specs, rest, wings, rng)
    rest = [k for k in rest if k not in end]
    top, bottom = _split_bands(specs, rest, rng)
    hall_width = snapped(min_width_cm(specs[hall]) * _uniform(rng, 1.0, 1.35))
    depth = 100 * math.sqrt(plain_sum(specs[k].area_m2 for k in rest) / len(rest))
    area = plain_sum(specs[k].area_m2 for k in rest) * 1e4
    sides = (1 if top else 0) + (1 if bottom else 0)
    length = snapped(area / (sides * depth * _uniform(rng, 0.85, 1.2)))
    layout: Layout = {hall: [(0, 0, length, hall_width)]}
    heights = []
    # One side may end a good step earlier, so that the entrance has a porch.
    porch = int(float(rng.random()) * 5)
    for band, above in ((top, True), (bottom, False)):
        if not band:
            heights.append(0)
            continue
        side = length
        if sides == 2 and porch == int(above):  # noqa: PLR2004 - both sides of the hall
            side = length - max(120, snapped(length * _uniform(rng, 0.12, 0.25)))
        band_area = plain_sum(specs[k].area_m2 for k in band) * 1e4
        deep = max(snapped(band_area / side), _min_depth(specs, band))
        heights.append(deep)
        y0, y1 = (hall_width, hall_width + deep) if above else (-deep, 0)
        cells = _cells(specs, band, rng)
        layout.update(_fill_band(specs, cells, (0, y0, side, y1), hall_above=not above, rng=rng))
    if end:
        height = heights[0] + heights[1] + hall_width
        width = snapped(plain_sum(specs[k].area_m2 for k in end) * 1e4 / height)
        width = max(width, _min_depth(specs, end))
        order = end if len(end) < 4 else _shuffled(rng, end)  # noqa: PLR2004 - few keep their order
        rect = (-width, -heights[1], 0, heights[0] + hall_width)
        slice_rooms(rect, specs, order, rng, layout)
    return layout


def row_layout(specs: Sequence[RoomSpec]) -> Layout:
    """Lay rooms in a row, along a hall where there is one: plain, possible for any programme."""
    halls = [k for k, spec in enumerate(specs) if spec.type == "hall"]
    along = halls[0] if halls and len(specs) > 2 else None  # noqa: PLR2004 - two need no hall
    # Public rooms in the middle, so that fewer private ones are passed through.
    rest = sorted((k for k in range(len(specs)) if k != along), key=lambda k: _position(specs[k]))
    deepest = max(300, _min_depth(specs, rest))
    largest = max(specs[k].area_m2 for k in rest) * 1e4
    # Not deeper than wide for the largest: the smallest would become slivers.
    depth = max(deepest, snapped(0.75 * math.sqrt(largest)))
    layout: Layout = {}
    left = 0
    for k in rest:
        width = max(min_width_cm(specs[k]), snapped(specs[k].area_m2 * 1e4 / depth + GRID_CM))
        layout[k] = [(left, 0, left + width, depth)]
        left += width
    if along is not None:
        layout[along] = [(0, depth, left, depth + min_width_cm(specs[along]))]
    return at_origin(layout)


def notch(layout: Layout, specs: Sequence[RoomSpec], rng: Generator) -> None:
    """Cut a corner off the house where a large room has it."""
    x0 = min(r[0] for rects in layout.values() for r in rects)
    x1 = max(r[2] for rects in layout.values() for r in rects)
    y0 = min(r[1] for rects in layout.values() for r in rects)
    y1 = max(r[3] for rects in layout.values() for r in rects)
    for room, rects in layout.items():
        if len(rects) != 1 or ROOM_TYPES[specs[room].type].small or specs[room].type == "hall":
            continue
        rx0, ry0, rx1, ry1 = rects[0]
        if not ((rx0 == x0 or rx1 == x1) and (ry0 == y0 or ry1 == y1)):
            continue
        width, height = rx1 - rx0, ry1 - ry0
        dx = snapped(width * _uniform(rng, 0.2, 0.42))
        dy = snapped(height * _uniform(rng, 0.2, 0.42))
        cx = (rx0, rx0 + dx) if rx0 == x0 else (rx1 - dx, rx1)
        cy = (ry0, ry0 + dy) if ry0 == y0 else (ry1 - dy, ry1)
        layout[room] = carve(rects, (cx[0], cy[0], cx[1], cy[1]))
        return


def draw_layout(specs: Sequence[RoomSpec], rng: Generator, wings: float = 0.0) -> Layout:
    """Draw one candidate for a floor plan."""
    has_hall = any(spec.type == "hall" for spec in specs)
    few = 3
    layout = (
        hall_layout(specs, rng, wings)
        if has_hall and len(specs) >= few
        else sliced_layout(specs, rng)
    )
    if float(rng.random()) < 0.35:  # noqa: PLR2004 - other orders now and then
        notch(layout, specs, rng)
    return mirrored(layout, rng)
