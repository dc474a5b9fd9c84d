"""Walls as solid boxes that share no volume: pieces, lintels, window breasts, closed entrances."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.geometry import round_m
from internav_data.houses.standards import HALF_WALL_CM
from internav_data.records import Wall

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from internav_data.houses.plan import FloorGrid, Opening

_Run = tuple[int, int, int]
"""Line, low end, high end: centimetres."""


def _runs(grid: FloorGrid, *, along_x: bool) -> list[_Run]:
    """Return the longest straight walls, whatever rooms lie beside them."""
    out: list[_Run] = []
    for segment in grid.segments:
        if segment.along_x != along_x:
            continue
        if out and out[-1][0] == segment.at and out[-1][2] == segment.low:
            out[-1] = (segment.at, out[-1][1], segment.high)
        else:
            out.append((segment.at, segment.low, segment.high))
    return out


def _cut(run: _Run, across: Sequence[_Run]) -> list[_Run]:
    """Return a run without the thickness of the walls that cross it."""
    line, low, high = run
    stops = sorted(at for at, a, b in across if a <= line <= b and low <= at <= high)
    out: list[_Run] = []
    start = low
    for at in stops:
        if at - HALF_WALL_CM > start:
            out.append((line, start, at - HALF_WALL_CM))
        start = at + HALF_WALL_CM
    if start < high:
        out.append((line, start, high))
    return out


def _box(run: _Run, low_z: int, high_z: int, *, along_x: bool) -> Wall:
    line, low, high = run
    near, far = line - HALF_WALL_CM, line + HALF_WALL_CM
    x0, y0, x1, y1 = (low, near, high, far) if along_x else (near, low, far, high)
    values = (round_m(v / 100.0) for v in (x0, y0, x1, y1, low_z, high_z))
    return Wall(*values)


def _pieces(
    run: _Run, openings: Iterable[Opening], ceiling_cm: int, *, along_x: bool
) -> list[Wall]:
    line, low, high = run
    out: list[Wall] = []
    start = low
    inside = [
        o
        for o in openings
        if o.along_x == along_x and o.at == line and low <= o.low and o.high <= high
    ]
    for opening in sorted(inside, key=lambda o: o.low):
        if opening.low > start:
            out.append(_box((line, start, opening.low), 0, ceiling_cm, along_x=along_x))
        gap = (line, opening.low, opening.high)
        # A closed entrance is solid up to the door's height.
        solid = opening.top if opening.kind == "entrance" else opening.bottom
        if solid > 0:
            out.append(_box(gap, 0, solid, along_x=along_x))
        if opening.top < ceiling_cm:
            out.append(_box(gap, opening.top, ceiling_cm, along_x=along_x))
        start = opening.high
    if high > start:
        out.append(_box((line, start, high), 0, ceiling_cm, along_x=along_x))
    return out


def build_walls(grid: FloorGrid, openings: Sequence[Opening], ceiling_cm: int) -> tuple[Wall, ...]:
    """Return the boxes of all walls, with holes for doors and windows."""
    # Walls along x reach over the corners; walls along y are cut there, so that none overlap.
    along_x = _runs(grid, along_x=True)
    out: list[Wall] = []
    for line, low, high in along_x:
        run = (line, low - HALF_WALL_CM, high + HALF_WALL_CM)
        out += _pieces(run, openings, ceiling_cm, along_x=True)
    for run in _runs(grid, along_x=False):
        for piece in _cut(run, along_x):
            out += _pieces(piece, openings, ceiling_cm, along_x=False)
    return tuple(out)
