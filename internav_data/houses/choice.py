"""Choice of a floor plan: the best-scored of some candidates that keep the standards."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from internav_data.core.arithmetic import plain_sum
from internav_data.houses.access import door_tree, possible_doors
from internav_data.houses.layouts import draw_layout, row_layout
from internav_data.houses.plan import FloorGrid, FloorPlan
from internav_data.houses.plan_score import (
    TREE_SCORE,
    MeasuredRoom,
    PlanCandidate,
    measured_room,
    score_terms,
)
from internav_data.houses.standards import MIN_DOOR_CM, WALL_CM
from internav_data.records import FloorPlanStream, Purpose
from internav_data.records.errors import QuarantineError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.random import Generator

    from internav_data.houses.config import HouseConfig
    from internav_data.houses.plan import RoomEdge
    from internav_data.houses.programme import RoomSpec
    from internav_data.houses.slicing import Layout
    from internav_data.records import SceneKey

MAX_TRIES = 8
"""Number of times that `candidates` may be drawn while none of them keeps the standards."""
MAX_TRIES_HOME = 4
"""The same while the best one has one of the faults of `MUST_NOT`."""
MUST_NOT = (
    "habitable rooms without daylight",
    "public rooms apart",
    "long bedrooms",
    "bathrooms behind a kitchen",
    "no bathroom for all",
)
"""Penalties of a plan that no home has if it can be helped."""
JITTERS = (0.6, 2.0, 4.0, 4.0, 4.0)
"""Random parts of the door costs, one for each door tree that a candidate is tried with."""
MIN_JOG_CM = 50
"""Parallel walls nearer than this, side by side or end to end, are no architecture."""


def plan_candidate(
    layout: Layout, specs: Sequence[RoomSpec], config: HouseConfig, *, lenient: bool = False
) -> PlanCandidate | None:
    """Measure a layout; None where a room breaks its standard or the walls cannot be drawn.

    `lenient` accepts rooms that are too large or too slender.
    """
    grid = FloorGrid.of([layout[k] for k in range(len(specs))])
    # Rooms may swallow each other where a programme is tight.
    if len(grid.cells) != len(specs):
        return None
    rooms: list[MeasuredRoom] = []
    for room, spec in enumerate(specs):
        found = measured_room(grid, room, spec, lenient=lenient)
        if found is None:
            return None
        rooms.append(found)
    if _jogs(grid) or not _drawable(grid, len(specs)):
        return None
    spans = possible_doors(grid, MIN_DOOR_CM[config.preset])
    types = tuple(spec.type for spec in specs)
    # A lenient plan is the last resort: any depth will do.
    rooms_on_path = None if lenient else config.rooms_on_path(len(specs))
    return PlanCandidate(grid, tuple(rooms), types, spans, rooms_on_path)


def best_tree(candidate: PlanCandidate, rng: Generator) -> list[RoomEdge] | None:
    """Choose doors that join all rooms: as usual as can be, and as deep as `rooms_on_path` asks.

    Where a depth is asked for, several trees are drawn with more and more jitter: the cheapest
    doors alone make shallow houses.
    """
    best: tuple[float, list[RoomEdge]] | None = None
    edges = sorted(candidate.spans)
    for jitter in JITTERS[:1] if candidate.rooms_on_path is None else JITTERS:
        tree = door_tree(candidate.types, edges, rng, jitter)
        if tree is None:
            return None
        score = _tree_score(candidate, tree)
        if best is None or score < best[0]:
            best = (score, tree)
    return best[1] if best is not None else None


def improved_tree(candidate: PlanCandidate, tree: Sequence[RoomEdge]) -> list[RoomEdge]:
    """Swap doors of a tree, one at a time and the best swap first, while that lowers its score.

    Hill climbing over the spanning trees of the rooms; it draws no random number.
    """
    best = sorted(tree)
    score = _tree_score(candidate, best)
    while True:
        swaps = ((_tree_score(candidate, other), other) for other in _swaps(candidate, best))
        lowest, other = min(swaps, default=(score, best))
        if lowest >= score:
            return best
        score, best = lowest, other


def _tree_score(candidate: PlanCandidate, tree: Sequence[RoomEdge]) -> float:
    return plain_sum(score_terms(candidate, tree, TREE_SCORE).values())


def _swaps(candidate: PlanCandidate, tree: Sequence[RoomEdge]) -> list[list[RoomEdge]]:
    """Return all spanning trees that differ from one by one door, each in ascending order."""
    # A further door closes a loop of doors, of which any other may go.
    return [
        sorted({*tree, new} - {old})
        for new in sorted(set(candidate.spans) - set(tree))
        for old in _doors_between(tree, *new)
    ]


def _doors_between(tree: Sequence[RoomEdge], first: int, last: int) -> list[RoomEdge]:
    """Return the doors that one passes from a room to another along a tree."""
    paths: dict[int, list[RoomEdge]] = {first: []}
    while last not in paths:
        for a, b in tree:
            for here, there in ((a, b), (b, a)):
                if here in paths and there not in paths:
                    paths[there] = [*paths[here], (a, b)]
    return paths[last]


def scored_plan(candidate: PlanCandidate | None, rng: Generator) -> FloorPlan | None:
    """Return a candidate as a floor plan with its doors and score; None where it has no doors."""
    tree = None if candidate is None else best_tree(candidate, rng)
    if candidate is None or tree is None:
        return None
    return FloorPlan(
        candidate.types,
        candidate.grid,
        tuple(tree),
        spans=candidate.spans,
        score_terms=score_terms(candidate, tree),
    )


def _jogs(grid: FloorGrid) -> bool:
    """Return whether two walls run beside each other so closely that it looks like a mistake."""
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
    """Return whether the outline and every room are simple polygons."""
    return bool(grid.polygon(frozenset(range(rooms)))) and all(
        grid.polygon(frozenset({room})) for room in range(rooms)
    )


def _will_do(plan: FloorPlan, tries: int) -> bool:
    """Return whether a plan is taken after some times `config.candidates` draws."""
    return tries >= MAX_TRIES_HOME or not any(plan.score_terms[name] for name in MUST_NOT)


def _improved(plan: FloorPlan, candidate: PlanCandidate) -> FloorPlan:
    """Return a plan with better doors, where a depth is asked for: few drawn trees have it."""
    if candidate.rooms_on_path is None:
        return plan
    tree = improved_tree(candidate, plan.tree)
    return replace(plan, tree=tuple(tree), score_terms=score_terms(candidate, tree))


def choose_floor_plan(key: SceneKey, config: HouseConfig, specs: Sequence[RoomSpec]) -> FloorPlan:
    """Draw `config.candidates` floor plans and return the best one; a plain row if all fail.

    Tight programmes get more draws, but only until the first plan that works.

    Raises
    ------
    QuarantineError
        When not even a row of rooms keeps the standards. No programme of 1 to 10 rooms does that;
        the error guards against standards that exclude each other.
    """
    rng = key.generator(Purpose.FLOOR_PLAN, draw=FloorPlanStream.CANDIDATES)
    best: tuple[FloorPlan, PlanCandidate] | None = None
    for k in range(config.candidates * MAX_TRIES):
        rounds = k // config.candidates
        if rounds and best is not None and _will_do(best[0], rounds):
            break
        candidate = plan_candidate(draw_layout(specs, rng, config.wings), specs, config)
        found = scored_plan(candidate, rng)
        if candidate is None or found is None:
            continue
        if best is None or found.score < best[0].score:
            best = found, candidate
    plan = None if best is None else _improved(*best)
    if plan is None:
        plan = scored_plan(plan_candidate(row_layout(specs), specs, config, lenient=True), rng)
    if plan is None:
        raise QuarantineError(
            f"scene {key.scene}: no floor plan keeps the {config.preset} standards for "
            f"{', '.join(spec.type for spec in specs)}; try another seed or programme"
        )
    return plan
