"""Doors and windows: kinds, widths and positions of the openings in the walls of a plan."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.houses.access import JAMB_CM, WallSpan, loop_doors, spans
from internav_data.houses.plan import Opening
from internav_data.houses.room_types import ROOM_PAIRS, ROOM_TYPES, type_pair
from internav_data.houses.standards import MIN_DOOR_CM
from internav_data.records import OUTSIDE, Purpose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.random import Generator

    from internav_data.houses.config import HouseConfig
    from internav_data.houses.plan import FloorGrid, FloorPlan, WallSegment
    from internav_data.records import DoorKind, SceneKey

MIN_WINDOW_CM = 60
"""Width of the narrowest window."""
BESIDE_DOOR_CM = 20
"""Smallest distance of a window from a door in the same wall."""


def _kind(types: tuple[str, str], config: HouseConfig, rng: Generator) -> tuple[DoorKind, int]:
    """Choose a door's kind and width, centimetres, from the types of its two rooms."""
    draw, size = float(rng.random()), float(rng.random())
    first, second = (ROOM_TYPES[name] for name in types)
    public = not (first.private or second.private)
    open_kind: DoorKind = "doorway" if public and draw > 0.7 else "single"  # noqa: PLR2004
    if config.preset == "realistic":
        if first.small or second.small:
            return "single", 78 + 2 * int(size * 3)
        return open_kind, 80 + 2 * int(size * 9)
    if not public or draw >= config.wide_openings:
        return open_kind, 100
    pair = ROOM_PAIRS.get(type_pair(*types))
    if pair is not None and pair.open_plan and size < 0.5:  # noqa: PLR2004 - half of them are open
        return "opening", 240
    return ("wide", 150) if size < 0.8 else ("double", 200)  # noqa: PLR2004


def _placed(span: WallSpan, width: int, rng: Generator) -> int:
    """Draw the low end of an opening: near an end of the wall, so that furniture has its length."""
    spare = span.length - width
    # Both numbers are drawn whatever the case: later draws do not depend on this one's outcome.
    draw, where = float(rng.random()), float(rng.random())
    offset = min(spare, 5 + int(20 * where))
    if draw < 0.4:  # noqa: PLR2004 - near the low end
        return span.low + offset
    if draw < 0.8:  # noqa: PLR2004 - near the high end
        return span.high - width - offset
    return span.low + int(spare * where)


def draw_doors(key: SceneKey, config: HouseConfig, floor_plan: FloorPlan) -> list[Opening]:
    """Draw the doors of the tree and of the loops, and the entrance, in order of their rooms."""
    rng = key.generator(Purpose.DOORS)
    grid, types = floor_plan.grid, floor_plan.types
    loops = loop_doors(types, sorted(floor_plan.spans), floor_plan.tree, config.loops, rng)
    out: list[Opening] = []
    for a, b in sorted([*floor_plan.tree, *loops]):
        kind, width = _kind((types[a], types[b]), config, rng)
        span = floor_plan.spans[a, b][0]
        if span.length < width:
            kind, width = _fitting(span.length, config)
        width = min(width, span.length // 2 * 2)
        low = _placed(span, width, rng)
        out.append(Opening(span.along_x, span.at, low, low + width, (a, b), kind))
    entrance = _entrance(grid, types, config, rng)
    return [entrance, *out] if entrance is not None else out


def _fitting(length: int, config: HouseConfig) -> tuple[DoorKind, int]:
    wide = 150
    if config.preset == "paper" and length >= wide:
        return "wide", wide
    return "single", MIN_DOOR_CM[config.preset]


def _entrance(
    grid: FloorGrid, types: Sequence[str], config: HouseConfig, rng: Generator
) -> Opening | None:
    """Draw one closed door to the outside: at a hall's end if there is one."""
    width = 100 if config.preset == "paper" else 92
    best: tuple[float, WallSpan, int] | None = None
    for segment in grid.segments:
        if OUTSIDE not in {segment.before, segment.after}:
            continue
        room = max(segment.before, segment.after)
        rank = ROOM_TYPES[types[room]].entrance
        for span in spans(grid, segment):
            if span.length < width:
                continue
            # A hall is entered at its end: the shorter the wall, the better.
            end = span.length / 1000.0 if types[room] == "hall" else float(rng.random())
            if best is None or rank + 0.9 * min(1.0, end) < best[0]:
                best = (rank + 0.9 * min(1.0, end), span, room)
    if best is None:
        return None
    _, span, room = best
    low = _placed(span, width, rng)
    return Opening(span.along_x, span.at, low, low + width, (OUTSIDE, room), "entrance")


def draw_windows(
    key: SceneKey, floor_plan: FloorPlan, doors: Sequence[Opening], ceiling_cm: int
) -> list[Opening]:
    """Draw windows in the outer walls, more of them in habitable rooms, of which each has one."""
    rng = key.generator(Purpose.WINDOWS)
    out: list[Opening] = []
    for segment in floor_plan.grid.segments:
        if OUTSIDE not in {segment.before, segment.after}:
            continue
        room = max(segment.before, segment.after)
        name = floor_plan.types[room]
        width, sill, top = _window_size(floor_plan.types, room, ceiling_cm)
        # Windows of equal pitch, 1.1 m apart or more; a short wall has one where its jambs fit.
        room_for = (segment.length - 2 * JAMB_CM) // (width + 110)
        if room_for == 0 and segment.length >= width + 6 * JAMB_CM:
            room_for = 1
        habitable = ROOM_TYPES[name].habitable
        max_count = room_for if habitable else min(1, room_for)
        pitch = segment.length / max(1, max_count)
        for k in range(max_count):
            centre = segment.low + round((k + 0.5) * pitch + 10.0 * (float(rng.random()) - 0.5))
            low, high = centre - width // 2, centre + width - width // 2
            if float(rng.random()) < (0.85 if habitable else 0.6) and not any(
                d.along_x == segment.along_x
                and d.at == segment.at
                and low < d.high + BESIDE_DOOR_CM
                and d.low - BESIDE_DOOR_CM < high
                for d in doors
            ):
                out.append(
                    Opening(
                        segment.along_x, segment.at, low, high, (OUTSIDE, room), None, sill, top
                    )
                )
    lit = {window.rooms[1] for window in out}
    dark = [k for k, name in enumerate(floor_plan.types) if ROOM_TYPES[name].habitable]
    return out + [
        window
        for room in dark
        if room not in lit
        for window in _only_window(floor_plan, room, doors, ceiling_cm)
    ]


def _window_size(types: Sequence[str], room: int, ceiling_cm: int) -> tuple[int, int, int]:
    """Return width, sill and top of a room's windows, centimetres."""
    cooking = types[room] == "living" and "kitchen" not in types
    width, sill, height = ROOM_TYPES["studio" if cooking else types[room]].window
    return width, sill, min(sill + height, ceiling_cm - 15)


def _only_window(
    floor_plan: FloorPlan, room: int, doors: Sequence[Opening], ceiling_cm: int
) -> list[Opening]:
    """Return a window in the middle of a room's longest free piece of outer wall, if it has one."""
    width, sill, top = _window_size(floor_plan.types, room, ceiling_cm)
    best: tuple[int, WallSegment, int] | None = None
    for segment in floor_plan.grid.segments:
        if {segment.before, segment.after} != {OUTSIDE, room}:
            continue
        taken = sorted(
            (d.low - BESIDE_DOOR_CM, d.high + BESIDE_DOOR_CM)
            for d in doors
            if d.along_x == segment.along_x and d.at == segment.at
        )
        # The free pieces lie between doors, and between them and the wall's ends.
        starts = [segment.low + 2 * JAMB_CM, *(high for _, high in taken)]
        ends = [*(low for low, _ in taken), segment.high - 2 * JAMB_CM]
        for start, end in zip(starts, ends, strict=True):
            free = min(end, segment.high) - max(start, segment.low)
            if free >= MIN_WINDOW_CM and (best is None or free > best[0]):
                best = (free, segment, (start + end) // 2)
    if best is None:
        return []
    free, segment, middle = best
    half = min(width, free) // 2
    span = (middle - half, middle + half)
    return [Opening(segment.along_x, segment.at, *span, (OUTSIDE, room), None, sill, top)]
