"""The best of some candidates: how much a floor plan is like a home."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from internav_data.houses.access import door_tree, possible_doors
from internav_data.houses.layouts import draw_layout, row_layout
from internav_data.houses.plan import FloorGrid, FloorPlan, clear_size_m
from internav_data.houses.room_types import ROOM_PAIRS, ROOM_TYPES, type_pair
from internav_data.houses.standards import HALF_WALL_CM, MIN_DOOR_CM, WALL_CM
from internav_data.records import OUTSIDE, FloorPlanStream, Purpose, generator
from internav_data.records.errors import QuarantineError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.random import Generator

    from internav_data.houses.config import HouseConfig
    from internav_data.houses.programme import RoomSpec

MAX_TRIES = 8
"""How many times `candidates` may be drawn while none of them keeps the standards."""
JITTERS = (0.6, 2.0, 4.0, 4.0, 4.0)
"""How much chance there is in each of the door trees that a plan is tried with."""
DEPTH_WEIGHT = 10.0
"""What one room more or less on the way than asked for costs."""
THROUGH_BATHROOM = 12.0
"""What each room that is reached only through a bathroom costs."""
SLIVER = 2.9
"""Rooms that are longer than this times their width are corridors."""
MIN_JOG_CM = 50
"""Parallel walls nearer than this, side by side or end to end, are no architecture."""
DAYLIGHT_CM = 130
"""Outer wall that a habitable room wants."""


def clear_area_m2(grid: FloorGrid, room: int) -> float:
    """Area between the wall faces of a room, m²."""
    around = sum(s.length for s in grid.segments if room in {s.before, s.after})
    return (grid.area_cm2(room) - HALF_WALL_CM * around + 4 * HALF_WALL_CM**2) / 1e4


def _room_score(grid: FloorGrid, room: int, spec: RoomSpec, *, lenient: bool) -> float | None:
    """How far one room is from what it should be; None where it breaks its standard."""
    main = grid.main_rectangle(room)
    short, long = clear_size_m(main)
    clear = clear_area_m2(grid, room)
    standard = spec.standard
    if short < standard.width_m or clear < standard.low_m2:
        return None
    odd = clear > standard.high_m2 * 1.3 or (long / short > SLIVER and spec.type != "hall")
    if odd and not lenient:
        return None
    area = grid.area_cm2(room) / 1e4
    score = 3.0 * math.log(area / spec.area_m2) ** 2
    score += 2.0 * max(0.0, long / short - standard.aspect) ** 2
    score += 1.5 * max(0.0, clear / standard.high_m2 - 1.0)
    # Nooks that are neither room nor corridor look wrong.
    score += 1.5 * max(0.0, 0.62 - (main[2] - main[0]) * (main[3] - main[1]) / 1e4 / area)
    if ROOM_TYPES[spec.type].habitable:
        outside = [s.length for s in grid.segments if _between(s.before, s.after, room, OUTSIDE)]
        score += 0.0 if outside and max(outside) >= DAYLIGHT_CM else 3.0
    return score


def _between(before: int, after: int, one: int, other: int) -> bool:
    return (before, after) in {(one, other), (other, one)}


def _through_private(types: Sequence[str], tree: Sequence[tuple[int, int]]) -> float:
    """Count doors that make a private room the way to another."""
    score = 0.0
    for a, b in tree:
        names = (types[a], types[b])
        if all(ROOM_TYPES[name].private for name in names):
            score += 0.3 if set(names) == {"bathroom", "bedroom"} else 3.0
    for room, name in enumerate(types):
        if ROOM_TYPES[name].private:
            doors = sum(
                1 for a, b in tree if room in {a, b} and not ROOM_TYPES[types[a + b - room]].private
            )
            score += 4.0 * max(0, doors - 1)
        if name == "bathroom":
            # A bathroom may hang off a bedroom; nobody should have to walk through one.
            ways = sum(1 for edge in tree if room in edge)
            score += THROUGH_BATHROOM * max(0, ways - 1)
    return score


def _mean_rooms_on_path(grid: FloorGrid, tree: Sequence[tuple[int, int]]) -> float:
    """Mean number of rooms between points in two different rooms, by area, along the tree."""
    count = len(tree) + 1
    joined: list[list[int]] = [[] for _ in range(count)]
    for a, b in tree:
        joined[a].append(b)
        joined[b].append(a)
    areas = [float(grid.area_cm2(room)) for room in range(count)]
    total = weights = 0.0
    for start in range(count):
        seen, ring, steps = {start}, [start], 1
        while ring:
            ring = [n for m in ring for n in joined[m] if n not in seen]
            seen.update(ring)
            steps += 1
            weight = areas[start] * sum(areas[n] for n in ring)
            weights += weight
            total += weight * steps
    return total / weights


def _best_tree(
    grid: FloorGrid,
    types: Sequence[str],
    edges: Sequence[tuple[int, int]],
    rng: Generator,
    rooms_on_path: float | None,
) -> tuple[list[tuple[int, int]], float] | None:
    """Choose doors that reach all rooms: as usual as can be, and as deep as was asked for."""
    best: tuple[list[tuple[int, int]], float] | None = None
    for jitter in (0.6,) if rooms_on_path is None else JITTERS:
        found = door_tree(types, edges, rng, jitter)
        if found is None:
            return None
        tree, cost = found
        score = 0.25 * cost + _through_private(types, tree)
        if rooms_on_path is not None:
            score += DEPTH_WEIGHT * abs(_mean_rooms_on_path(grid, tree) - rooms_on_path)
        if best is None or score < best[1]:
            best = (tree, score)
    return best


def score_floor_plan(
    grid: FloorGrid,
    specs: Sequence[RoomSpec],
    min_door_cm: int,
    rng: Generator,
    rooms_on_path: float | None = None,
    *,
    lenient: bool = False,
) -> FloorPlan | None:
    """Score a plan; None where a room breaks its standard or cannot be reached.

    The lenient judge, who sees last resorts, keeps to least areas and widths alone.
    """
    types = tuple(spec.type for spec in specs)
    if len(grid.cells) != len(specs):
        return None
    score = 0.0
    for room, spec in enumerate(specs):
        room_score = _room_score(grid, room, spec, lenient=lenient)
        if room_score is None:
            return None
        score += room_score
    edges = sorted(possible_doors(grid, min_door_cm))
    if _jogs(grid) or not _drawable(grid, len(specs)):
        return None
    found = _best_tree(grid, types, edges, rng, rooms_on_path)
    if found is None:
        return None
    tree, tree_score = found
    score += tree_score
    width, depth = grid.xs[-1] - grid.xs[0], grid.ys[-1] - grid.ys[0]
    score += 2.0 * max(0.0, max(width, depth) / min(width, depth) - 1.8)
    present = {type_pair(types[a], types[b]) for a, b in edges}
    score += sum(
        pair.shared_wall
        for names, pair in ROOM_PAIRS.items()
        if names[0] in types and names[1] in types and names not in present
    )
    halls = [k for k, name in enumerate(types) if name == "hall"]
    for hall in halls:
        share = grid.area_cm2(hall) / sum(grid.area_cm2(k) for k in range(len(types)))
        score += 12.0 * max(0.0, share - 0.14)
        score += max(0, 3 - sum(1 for door in tree if hall in door))
    return FloorPlan(types, grid, tuple(tree), score)


def _jogs(grid: FloorGrid) -> bool:
    """Whether two walls run beside each other so closely that it looks like a mistake."""
    segments = grid.segments
    for k, one in enumerate(segments):
        for other in segments[k + 1 :]:
            if (
                one.along_x == other.along_x
                and 0 < abs(one.at - other.at) < MIN_JOG_CM
                and one.low - WALL_CM < other.high
                and other.low - WALL_CM < one.high
            ):
                return True
    return False


def _drawable(grid: FloorGrid, rooms: int) -> bool:
    """Whether the outline and every room are simple polygons."""
    return bool(grid.polygon(frozenset(range(rooms)))) and all(
        grid.polygon(frozenset({room})) for room in range(rooms)
    )


def choose_floor_plan(
    seed: int, scene: int, config: HouseConfig, specs: Sequence[RoomSpec], attempt: int
) -> FloorPlan:
    """Draw `config.candidates` floor plans and return the most homelike; a plain row if all fail.

    Raises
    ------
    QuarantineError
        Never for programmes of 1 to 10 rooms; it guards against standards that exclude each other.

    """
    rng = generator(seed, Purpose.FLOOR_PLAN, scene, attempt, draw=FloorPlanStream.CANDIDATES)
    min_door_cm = MIN_DOOR_CM[config.preset]
    best: FloorPlan | None = None
    # Tight programmes get more draws, but only until the first plan that holds.
    for k in range(config.candidates * MAX_TRIES):
        if best is not None and k >= config.candidates:
            break
        layout = draw_layout(specs, rng, config.wings)
        grid = FloorGrid.of([layout[k] for k in range(len(specs))])
        found = score_floor_plan(grid, specs, min_door_cm, rng, config.rooms_on_path(len(specs)))
        if found is not None and (best is None or found.score < best.score):
            best = found
    if best is None:
        layout = row_layout(specs)
        grid = FloorGrid.of([layout[k] for k in range(len(specs))])
        best = score_floor_plan(grid, specs, min_door_cm, rng, lenient=True)
    if best is None:
        raise QuarantineError(
            f"scene {scene}: no floor plan keeps the {config.preset} standards for "
            f"{', '.join(spec.type for spec in specs)}; try another seed or programme"
        )
    return best
