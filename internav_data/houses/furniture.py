"""Furnish a house: room by room, rule by rule, each group at the first pose where it fits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.geometry import round_m
from internav_data.houses.clutter import clutter_room
from internav_data.houses.furnishing import RoomState, quarter_quaternion, room_state
from internav_data.houses.group_makers import GROUP_MAKERS
from internav_data.houses.groups import RoomContext
from internav_data.houses.pieces import Picker, consistent
from internav_data.houses.plan import clear_area_m2
from internav_data.houses.room_types import ROOM_TYPES
from internav_data.houses.sitting import watched_poses
from internav_data.records import Purpose, SceneObject

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.catalog import Catalogue
    from internav_data.houses.plan import FloorPlan, Opening
    from internav_data.houses.room_types import FurnitureRule
    from internav_data.records import SceneKey

COOKING = ("Stove", "Sink", "CounterTop", "Fridge")
"""Types of asset that a kitchenette needs."""
CERTAIN = 1.0
"""Share from which on a rule is indispensable: its group is tried at any furnishing."""
TRIES = 8
"""Number of times that a room is furnished while it lacks what it needs."""
MAX_GROUPS = 4
"""Largest number of groups that one rule puts into one room."""


def furnish(
    key: SceneKey,
    floor_plan: FloorPlan,
    openings: Sequence[Opening],
    ceiling_m: float,
    density: float,
    clutter: float,
    catalogue: Catalogue,
) -> tuple[SceneObject, ...]:
    """Return the furniture of a house, by room and group.

    Parameters
    ----------
    key
        Key of the scene's random numbers.
    floor_plan
        Rooms to furnish.
    openings
        Doors and windows: items keep clear of them.
    ceiling_m
        Height of the rooms, metres.
    density
        `HouseConfig.furnishing`.
    clutter
        `HouseConfig.clutter`.
    catalogue
        Assets to choose from.
    """
    objects: list[SceneObject] = []
    types = frozenset(floor_plan.types)
    for room, rules in enumerate(_rules(key, floor_plan)):
        # Each room has random numbers of its own: furnishing one changes no other.
        picker = Picker(catalogue, key.generator(Purpose.FURNITURE, draw=room))
        best: RoomState | None = None
        for attempt in range(TRIES):
            state = room_state(floor_plan, room, openings, ceiling_m)
            # Once a room lacks something, what it must have comes first, in its smallest form.
            ordered = sorted(rules, key=lambda r: r.share < CERTAIN) if attempt else rules
            _furnish_room(state, ordered, types, picker, density, smallest=attempt > 1)
            if best is None or len(_missing(state, types)) < len(_missing(best, types)):
                best = state
            if not _missing(best, types):
                break
        if best is not None and clutter > 0.0:
            rng = key.generator(Purpose.CLUTTER, draw=room)
            clutter_room(best, Picker(catalogue, rng), clutter)
        if best is not None:
            objects += _scene_objects(best, len(objects), _groups(objects))
    return tuple(objects)


def _rules(key: SceneKey, floor_plan: FloorPlan) -> list[tuple[FurnitureRule, ...]]:
    """Return the rules of each room; of those for one room a house, one room has them."""
    grid, types = floor_plan.grid, floor_plan.types
    rules = [ROOM_TYPES[name].furniture for name in types]
    may_have = [
        room
        for room, listed in enumerate(rules)
        for rule in listed
        if rule.one_a_house
        and rule.without not in types
        and clear_area_m2(grid, room) >= rule.min_m2
    ]
    draw = float(key.generator(Purpose.FURNITURE, draw=len(types)).random())
    chosen = may_have[int(draw * len(may_have))] if may_have else -1
    return [
        tuple(rule for rule in listed if not rule.one_a_house or room == chosen)
        for room, listed in enumerate(rules)
    ]


def _present(state: RoomState) -> set[str]:
    return {item.asset.type for group, *_ in state.placed for item in group.items}


def _missing(state: RoomState, types: frozenset[str]) -> set[str]:
    """Return the types of asset that a room needs and does not have."""
    record = ROOM_TYPES[state.type]
    kitchenette = COOKING if record.cooks and "kitchen" not in types else ()
    return {*record.needs, *kitchenette} - _present(state)


def _groups(objects: Sequence[SceneObject]) -> int:
    return 1 + max((item.group for item in objects), default=-1)


def _times(rule: FurnitureRule, picker: Picker, area_m2: float, density: float) -> int:
    """Draw the number of groups of a rule to try: its expected number, rounded at random."""
    draw = float(picker.rng.random())
    if area_m2 < rule.min_m2:
        return 0
    if rule.share >= CERTAIN and rule.per_m2 == 0.0:
        return 1
    expected = (rule.share + rule.per_m2 * area_m2) * density
    if rule.share >= CERTAIN:
        expected = max(1.0, expected)
    certain = int(expected)
    return min(MAX_GROUPS, certain + (draw < expected - certain))


def _furnish_room(
    state: RoomState,
    rules: Sequence[FurnitureRule],
    types: frozenset[str],
    picker: Picker,
    density: float,
    *,
    smallest: bool,
) -> None:
    width, depth = float(state.inner[2] - state.inner[0]), float(state.inner[3] - state.inner[1])
    room = RoomContext(state.area_m2, state.short_m, max(width, depth), types)
    for rule in rules:
        times = _times(rule, picker, state.area_m2, density)
        if rule.without in types or rule.lacking in _present(state):
            continue
        for _ in range(times):
            if not _try_rule(state, rule, room, picker, smallest=smallest):
                break


def _try_rule(
    state: RoomState, rule: FurnitureRule, room: RoomContext, picker: Picker, *, smallest: bool
) -> bool:
    groups = GROUP_MAKERS[rule.group](picker, room)
    if smallest:
        groups.sort(key=lambda group: (group.right - group.left) * group.depth)
    for group in groups:
        if not consistent(picker, group):
            continue
        poses = (
            state.in_the_open(group, picker.rng)
            if rule.placement == "open"
            else state.along_walls(group, picker.rng, rule.placement)
        )
        if rule.watched:
            poses = watched_poses(poses, group, state.placed)
        if state.place(group, poses):
            return True
    return False


def _scene_objects(state: RoomState, first: int, first_group: int) -> list[SceneObject]:
    """Turn a room's groups into objects with ids, in the order they were placed."""
    out: list[SceneObject] = []
    for number, (group, x, y, turn) in enumerate(state.placed):
        base = first + len(out)
        for item in group.items:
            dx, dy = ((item.x, item.y), (-item.y, item.x), (-item.x, -item.y), (item.y, -item.x))[
                turn
            ]
            out.append(
                SceneObject(
                    object_id=first + len(out),
                    asset_id=item.asset.asset_id,
                    type=item.asset.type,
                    room=state.room,
                    x=round_m(x + dx),
                    y=round_m(y + dy),
                    z=round_m(item.z),
                    quaternion=quarter_quaternion(item.turn + turn),
                    group=first_group + number if len(group.items) > 1 else -1,
                    support=base + item.support if item.support >= 0 else -1,
                )
            )
    return out
