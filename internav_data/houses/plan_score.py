"""Score of a floor plan: a list of named, weighted penalties; the lowest sum is most like a home.

`score_terms(candidate, tree)` gives the weighted penalties by name, ready to be printed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from internav_data.core.arithmetic import plain_sum
from internav_data.houses.access import door_cost
from internav_data.houses.plan import clear_area_m2, clear_size_m
from internav_data.houses.room_types import ROOM_PAIRS, ROOM_TYPES, type_pair
from internav_data.houses.standards import WALL_CM
from internav_data.records import OUTSIDE

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from internav_data.houses.access import WallSpan
    from internav_data.houses.plan import FloorGrid, RoomEdge
    from internav_data.houses.programme import RoomSpec

SLIVER = 2.9
"""Rooms whose longer side is more than this times the shorter one are corridors."""
LONG_BEDROOM = 2.2
"""Ratio of a bedroom's sides from which on it looks like a corridor."""
DAYLIGHT_CM = 130
"""Length of outer wall that a habitable room wants."""
SLENDER_HOUSE = 1.8
"""Ratio of a house's sides from which on it counts as long."""
NOOK_SHARE = 0.62
"""Share of a room that its largest rectangle should fill: the rest is nooks."""
HALL_SHARE = 0.14
"""Share of a house that a hall may take."""
HALL_DOORS = 3
"""Number of rooms that a hall should lead to."""


@dataclass(frozen=True, slots=True)
class MeasuredRoom:
    """A room of a candidate plan with its measures."""

    spec: RoomSpec
    area_m2: float
    """Area between the centre lines of the walls."""
    clear_m2: float
    """Area between the wall faces."""
    main_m2: float
    """Area of the largest rectangle in the room, between centre lines."""
    short_m: float
    """Shorter side of that rectangle, between wall faces."""
    long_m: float
    """Longer side of that rectangle, between wall faces."""
    outer_wall_cm: int
    """Length of the room's longest outer wall; 0 for an inner room."""


@dataclass(frozen=True, slots=True)
class PlanCandidate:
    """Rooms on a grid with all doors that are possible between them."""

    grid: FloorGrid
    rooms: tuple[MeasuredRoom, ...]
    types: tuple[str, ...]
    spans: Mapping[RoomEdge, Sequence[WallSpan]]
    """Stretches of wall for a door, by pair of rooms, longest first."""
    rooms_on_path: float | None
    """Aim for the mean number of rooms on a path; None for any."""


def measured_room(
    grid: FloorGrid, room: int, spec: RoomSpec, *, lenient: bool = False
) -> MeasuredRoom | None:
    """Measure one room; None where it breaks its standard.

    `lenient` accepts rooms that are too large or too slender, never ones that are too small.
    """
    main = grid.main_rectangle(room)
    short, long = clear_size_m(main)
    clear = clear_area_m2(grid, room)
    standard = spec.standard
    if short < standard.width_m or clear < standard.low_m2:
        return None
    odd = clear > standard.high_m2 * 1.3 or (long / short > SLIVER and spec.type != "hall")
    if odd and not lenient:
        return None
    outer = [s.length for s in grid.segments if {s.before, s.after} == {room, OUTSIDE}]
    return MeasuredRoom(
        spec,
        area_m2=grid.area_cm2(room) / 1e4,
        clear_m2=clear,
        main_m2=(main[2] - main[0]) * (main[3] - main[1]) / 1e4,
        short_m=short,
        long_m=long,
        outer_wall_cm=max(outer, default=0),
    )


def _area_error(plan: PlanCandidate, _: Sequence[RoomEdge]) -> float:
    return plain_sum(math.log(room.area_m2 / room.spec.area_m2) ** 2 for room in plan.rooms)


def _slender_rooms(plan: PlanCandidate, _: Sequence[RoomEdge]) -> float:
    return plain_sum(
        max(0.0, room.long_m / room.short_m - room.spec.standard.aspect) ** 2 for room in plan.rooms
    )


def _long_bedrooms(plan: PlanCandidate, _: Sequence[RoomEdge]) -> float:
    """Count the bedrooms that are longer than a bed and a passage at its foot need."""
    return float(
        plain_sum(
            room.spec.type == "bedroom" and _bounds_ratio(plan.grid, k) > LONG_BEDROOM
            for k, room in enumerate(plan.rooms)
        )
    )


def _bounds_ratio(grid: FloorGrid, room: int) -> float:
    """Return the longer side of a room's bounding box over the shorter one, between wall faces."""
    columns, rows = zip(*grid.cells[room], strict=True)
    width = grid.xs[max(columns) + 1] - grid.xs[min(columns)] - WALL_CM
    depth = grid.ys[max(rows) + 1] - grid.ys[min(rows)] - WALL_CM
    ratio: float = max(width, depth) / min(width, depth)
    return ratio


def _large_rooms(plan: PlanCandidate, _: Sequence[RoomEdge]) -> float:
    return plain_sum(max(0.0, r.clear_m2 / r.spec.standard.high_m2 - 1.0) for r in plan.rooms)


def _nooks(plan: PlanCandidate, _: Sequence[RoomEdge]) -> float:
    # Nooks that are neither room nor corridor look wrong.
    return plain_sum(max(0.0, NOOK_SHARE - room.main_m2 / room.area_m2) for room in plan.rooms)


def _dark_rooms(plan: PlanCandidate, _: Sequence[RoomEdge]) -> float:
    return float(
        plain_sum(
            ROOM_TYPES[room.spec.type].habitable and room.outer_wall_cm < DAYLIGHT_CM
            for room in plan.rooms
        )
    )


def _long_house(plan: PlanCandidate, _: Sequence[RoomEdge]) -> float:
    xs, ys = plan.grid.xs, plan.grid.ys
    short, long = sorted((xs[-1] - xs[0], ys[-1] - ys[0]))
    return max(0.0, long / short - SLENDER_HOUSE)


def _missing_neighbours(plan: PlanCandidate, _: Sequence[RoomEdge]) -> float:
    types = plan.types
    present = {type_pair(types[a], types[b]) for a, b in plan.spans}
    return plain_sum(
        pair.shared_wall
        for names, pair in ROOM_PAIRS.items()
        if names[0] in types and names[1] in types and names not in present
    )


def _halls(plan: PlanCandidate) -> list[int]:
    return [k for k, room in enumerate(plan.rooms) if room.spec.type == "hall"]


def _large_halls(plan: PlanCandidate, _: Sequence[RoomEdge]) -> float:
    house = plain_sum(room.area_m2 for room in plan.rooms)
    return plain_sum(max(0.0, plan.rooms[k].area_m2 / house - HALL_SHARE) for k in _halls(plan))


def _idle_halls(plan: PlanCandidate, tree: Sequence[RoomEdge]) -> float:
    return plain_sum(
        max(0.0, HALL_DOORS - plain_sum(k in door for door in tree)) for k in _halls(plan)
    )


def _door_costs(plan: PlanCandidate, tree: Sequence[RoomEdge]) -> float:
    types = plan.types
    return plain_sum(door_cost(types[a], types[b]) for a, b in tree)


def _private_doors(plan: PlanCandidate, tree: Sequence[RoomEdge]) -> float:
    """Count the doors between two private rooms; one from a bedroom to its bathroom is usual."""
    types = plan.types
    pairs = [(types[a], types[b]) for a, b in tree]
    private = [pair for pair in pairs if all(ROOM_TYPES[name].private for name in pair)]
    return plain_sum(0.1 if set(pair) == {"bathroom", "bedroom"} else 1.0 for pair in private)


def _private_passages(plan: PlanCandidate, tree: Sequence[RoomEdge]) -> float:
    """Count the doors to public rooms that private rooms have beyond one."""
    private = [ROOM_TYPES[name].private for name in plan.types]
    return plain_sum(
        max(0.0, plain_sum(room in {a, b} and not private[a + b - room] for a, b in tree) - 1)
        for room in range(len(private))
        if private[room]
    )


def _through_bathroom(plan: PlanCandidate, tree: Sequence[RoomEdge]) -> float:
    """Count the doors that bathrooms have beyond one: nobody should have to walk through one."""
    return plain_sum(
        max(0.0, plain_sum(room in edge for edge in tree) - 1)
        for room, name in enumerate(plan.types)
        if name == "bathroom"
    )


def _reaches_all(plan: PlanCandidate, tree: Sequence[RoomEdge], bath: int, avoid: str) -> bool:
    """Return whether a bathroom is joined to a public room without passing some rooms.

    These are kitchens (`avoid` "kitchen") or private rooms ("private"); the public rooms in
    question are not kitchens. Where a house has none, nothing can be missed.
    """
    types = plan.types
    kitchens = [name == "kitchen" for name in types]
    private = [ROOM_TYPES[name].private for name in types]
    goals = {k for k in range(len(types)) if not (private[k] or kitchens[k])}
    closed = kitchens if avoid == "kitchen" else private
    seen, stack = {bath}, [bath]
    while stack:
        here = stack.pop()
        for a, b in tree:
            if here in (a, b) and (a + b - here) not in seen and not closed[a + b - here]:
                seen.add(a + b - here)
                stack.append(a + b - here)
    return not goals or bool(goals & seen)


def _public_apart(plan: PlanCandidate, tree: Sequence[RoomEdge]) -> float:
    """Count the groups of public rooms that only private rooms join to the others."""
    public = {k for k, name in enumerate(plan.types) if not ROOM_TYPES[name].private}
    # Within a tree, joined rooms are one group fewer for each door between them.
    doors = plain_sum(a in public and b in public for a, b in tree)
    return float(max(0, len(public) - doors - 1))


def _bathrooms(plan: PlanCandidate) -> list[int]:
    return [k for k, name in enumerate(plan.types) if name == "bathroom"]


def _behind_kitchen(plan: PlanCandidate, tree: Sequence[RoomEdge]) -> float:
    """Count the bathrooms that are reached through a kitchen alone."""
    return float(plain_sum(not _reaches_all(plan, tree, k, "kitchen") for k in _bathrooms(plan)))


def _none_for_all(plan: PlanCandidate, tree: Sequence[RoomEdge]) -> float:
    """Return 1 where every bathroom lies behind a bedroom or another private room."""
    baths = _bathrooms(plan)
    return float(bool(baths) and not any(_reaches_all(plan, tree, k, "private") for k in baths))


def _depth_error(plan: PlanCandidate, tree: Sequence[RoomEdge]) -> float:
    if plan.rooms_on_path is None:
        return 0.0
    return abs(mean_rooms_on_path(plan.grid, tree) - plan.rooms_on_path)


def mean_rooms_on_path(grid: FloorGrid, tree: Sequence[RoomEdge]) -> float:
    """Return the mean number of rooms on the path between points in two different rooms.

    Paths run along the door tree; each pair of rooms weighs as the product of its areas, as it
    does for two points drawn uniformly over the floor.
    """
    count = len(tree) + 1
    joined: list[list[int]] = [[] for _ in range(count)]
    for a, b in tree:
        joined[a].append(b)
        joined[b].append(a)
    areas = [float(grid.area_cm2(room)) for room in range(count)]
    total = weights = 0.0
    for start in range(count):
        # Breadth-first: `ring` holds the rooms that are `steps` rooms away, both ends counted.
        seen, ring, steps = {start}, [start], 1
        while ring:
            ring = [n for m in ring for n in joined[m] if n not in seen]
            seen.update(ring)
            steps += 1
            weight = areas[start] * plain_sum(areas[n] for n in ring)
            weights += weight
            total += weight * steps
    return total / weights


class ScoreTerm(NamedTuple):
    """One penalty of a floor plan."""

    name: str
    weight: float
    function: Callable[[PlanCandidate, Sequence[RoomEdge]], float]
    """Penalty of a candidate with a tree of doors, before the weight; 0 is best."""


TREE_SCORE: tuple[ScoreTerm, ...] = (
    ScoreTerm("unusual doors", 0.25, _door_costs),
    ScoreTerm("doors between private rooms", 3.0, _private_doors),
    ScoreTerm("paths through private rooms", 4.0, _private_passages),
    ScoreTerm("paths through bathrooms", 12.0, _through_bathroom),
    ScoreTerm("public rooms apart", 15.0, _public_apart),
    ScoreTerm("bathrooms behind a kitchen", 15.0, _behind_kitchen),
    ScoreTerm("no bathroom for all", 15.0, _none_for_all),
    ScoreTerm("rooms on a path, from the aim", 20.0, _depth_error),
)
"""Penalties that decide between the door trees of one candidate."""

PLAN_SCORE: tuple[ScoreTerm, ...] = (
    ScoreTerm("areas, from the programme", 3.0, _area_error),
    ScoreTerm("slender rooms", 2.0, _slender_rooms),
    ScoreTerm("long bedrooms", 4.0, _long_bedrooms),
    ScoreTerm("rooms too large", 1.5, _large_rooms),
    ScoreTerm("nooks", 1.5, _nooks),
    ScoreTerm("habitable rooms without daylight", 12.0, _dark_rooms),
    ScoreTerm("long house", 2.0, _long_house),
    ScoreTerm("neighbours apart", 1.0, _missing_neighbours),
    ScoreTerm("large halls", 12.0, _large_halls),
    ScoreTerm("halls with few doors", 1.0, _idle_halls),
    *TREE_SCORE,
)
"""All penalties of a candidate."""


def score_terms(
    plan: PlanCandidate,
    tree: Sequence[RoomEdge],
    terms: Sequence[ScoreTerm] = PLAN_SCORE,
) -> dict[str, float]:
    """Return the weighted penalties of a candidate with a tree of doors, by name."""
    return {term.name: term.weight * term.function(plan, tree) for term in terms}
