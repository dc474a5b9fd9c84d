"""Makers of seating groups: sofas before televisions, tables with chairs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from internav_data.houses.groups import narrow, within
from internav_data.houses.pieces import (
    BACK_GAP_M,
    FACING_LEFT,
    FACING_RIGHT,
    FACING_ROOM,
    FACING_WALL,
    Group,
    Picker,
    PlacedAsset,
    against,
    in_front,
    overlap,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.core.typing import Floats
    from internav_data.houses.groups import RoomContext
    from internav_data.records import Asset

WATCHING = frozenset({"ArmChair", "Bed", "Sofa"})
"""Types of asset from which somebody watches television."""
MIN_WATCHED_M, MAX_WATCHED_M = 1.2, 5.5
"""Distances at which a television is watched, metres."""
WATCHED_COSINE = math.cos(math.radians(45.0))
"""Cosine of the largest angle between the line of sight and the fronts of seat and television."""
_SINES = np.array([0.0, 1.0, 0.0, -1.0])
"""Sines of the quarter turns; the cosine of q is the sine of q + 1, at index q - 3."""


def seating(p: Picker, room: RoomContext) -> list[Group]:
    """Make a sofa facing a television, a coffee table between, an armchair beside."""
    stand = p.one("TVStand")
    sofa = p.one("Sofa", narrow(max(1.6, 0.6 * room.long_m)), any_size=True)
    if sofa is None:
        return []
    out: list[Group] = []
    if stand is not None:
        screen = _screen(p, stand)
        for distance in _viewing_distances(room, stand, sofa):
            out += _around(p, screen, sofa, distance)
    return out


def _screen(p: Picker, stand: Asset) -> Group:
    """Make a stand with a television on it; no picture hangs behind the television."""
    base = against(stand)
    asset = p.one("Television", lambda a: a.size[0] <= stand.size[0] and a.size[1] <= stand.size[1])
    screen = p.resting(base, 0, asset, 0.0, 0.0) if asset is not None else None
    if screen is None:
        return Group((base,))
    (hx, hy), wall = screen.half, BACK_GAP_M
    return Group((base, screen), ((screen.x - hx, wall, screen.x + hx, max(wall, screen.y - hy)),))


def _viewing_distances(room: RoomContext, stand: Asset, sofa: Asset) -> list[float]:
    """Return gaps (m) between stand and sofa: to the opposite wall if that is near, else less."""
    gaps = []
    for span in (room.short_m, room.long_m):
        gap = span - stand.size[1] - sofa.size[1] - 2 * BACK_GAP_M - 0.02
        if 1.4 <= gap <= 3.4:  # noqa: PLR2004 - metres one watches from
            gaps.append(gap)
    return [*gaps, 2.4, 1.9, 1.5]


def _around(p: Picker, screen: Group, sofa: Asset, gap: float) -> list[Group]:
    """Make a sofa across from a screen, with and without coffee table, rug and armchair."""
    base = screen.items[0]
    front = base.y + base.half[1]
    seat = PlacedAsset(sofa, base.x, front + gap + sofa.size[1] / 2.0, FACING_WALL)
    lane = (base.x - 0.4, front, base.x + 0.4, front + 0.5)
    plain = screen.with_items(seat).with_clearance(lane)
    coffee = p.one("CoffeeTable", lambda a: a.size[1] <= gap - 1.1 and a.size[0] <= sofa.size[0])
    if coffee is None:
        return [plain]
    middle = front + gap - 0.42 - coffee.size[1] / 2.0
    table = PlacedAsset(coffee, base.x, middle, FACING_WALL)
    with_table = plain.with_items(table)
    room = 2.0 * min(front + gap - 0.06 - middle, middle - front - 0.06)
    carpet = p.one(
        "Rug", lambda a: coffee.size[1] + 0.1 <= a.size[1] <= room and coffee.size[0] <= a.size[0]
    )
    if carpet is not None and p.chance(0.7):
        lying = PlacedAsset(carpet, base.x, middle, FACING_WALL)
        with_table = plain.with_items(lying, table)
    chair = p.one("ArmChair", narrow(1.0))
    if chair is None:
        return [with_table, plain]
    side = 1 if p.chance(0.5) else -1
    away = sofa.size[0] / 2.0 + 0.15 + chair.size[1] / 2.0
    beside = PlacedAsset(
        chair, base.x + side * away, middle, FACING_LEFT if side > 0 else FACING_RIGHT
    )
    full = with_table.with_items(beside)
    return [full, with_table, plain] if p.chance(0.6) else [with_table, plain]


def sofa_alone(p: Picker, room: RoomContext) -> list[Group]:
    """Make a sofa with its back to the wall."""
    asset = p.one("Sofa", narrow(max(1.6, 0.6 * room.long_m)), any_size=True)
    if asset is None:
        return []
    out = []
    for sofa in (asset, p.smallest("Sofa") or asset):
        item = against(sofa)
        out.append(Group((item,), (in_front(item, 0.5),)))
    return out


def television(p: Picker, room: RoomContext) -> list[Group]:
    """Make a television on its stand."""
    del room
    stand = p.one("TVStand")
    if stand is None:
        return []
    screen = _screen(p, stand)
    return [screen.with_clearance(in_front(screen.items[0], 0.5))]


def watched_poses(
    poses: Floats, group: Group, placed: Sequence[tuple[Group, float, float, int]]
) -> Floats:
    """Return the poses at which a group along a wall is faced by a bed or a seat, and faces it.

    Parameters
    ----------
    poses
        (m, 3) float64: x and y in metres, quarter turns; the group's wall is behind it.
    group
        Group with what is watched in its first item.
    placed
        Groups in the room with x, y and quarter turns.

    """
    watched = np.zeros(len(poses), dtype=bool)
    middle = _moved(group.items[0], poses[:, 0], poses[:, 1], poses[:, 2])
    front = _direction(poses[:, 2] + FACING_ROOM)
    for other, x, y, turn in placed:
        for item in other.items:
            if item.asset.type in WATCHING:
                seat = _moved(item, x, y, np.array([turn]))
                line = middle - seat
                metres = np.hypot(*line.T)
                ahead = _dot(line, _direction(np.array([item.turn + turn])))
                back = -_dot(line, front)
                near = (metres >= MIN_WATCHED_M) & (metres <= MAX_WATCHED_M)
                watched |= near & (np.minimum(ahead, back) >= WATCHED_COSINE * metres)
    return poses[watched]


def _dot(first: Floats, second: Floats) -> Floats:
    """Return the dot products (n,) of vectors (n, 2) of the plane, equal on every machine."""
    found: Floats = first[:, 0] * second[:, 0] + first[:, 1] * second[:, 1]
    return found


def _direction(turns: Floats) -> Floats:
    """Return the unit vectors (n, 2) in which assets of some quarter turns face."""
    quarters = turns.astype(np.int64) % 4
    return np.column_stack([_SINES[quarters], -_SINES[quarters - 3]])


def _moved(item: PlacedAsset, x: Floats | float, y: Floats | float, turns: Floats) -> Floats:
    """Return the places (n, 2) of an item of a group at some poses of the group."""
    quarters = turns.astype(np.int64) % 4
    sin, cos = _SINES[quarters], _SINES[quarters - 3]
    return np.column_stack([x + cos * item.x - sin * item.y, y + sin * item.x + cos * item.y])


def dining(p: Picker, room: RoomContext) -> list[Group]:
    """Make a table with chairs pushed in, as large as the room allows."""
    largest = 1.1 if room.area_m2 < 12 else 1.6 if room.area_m2 < 18 else 2.9  # noqa: PLR2004
    chair = p.one("Chair")
    out: list[list[Group]] = []
    for limit in (largest, 1.5, 1.0):
        asset = p.one("DiningTable", within(0.6 * limit, limit), any_size=True)
        if asset is not None and limit <= largest:
            out.append(_seated(p, PlacedAsset(asset, 0.0, 0.0, FACING_WALL), chair))
    # A smaller table with all its chairs comes before a large one with few.
    many = [group for table in out for group in table[:-1]]
    return many + [group for table in out for group in table[-1:]]


def _seated(p: Picker, table: PlacedAsset, chair: Asset | None) -> list[Group]:
    """Make a table with six, four and two chairs; without any only where there are none."""
    plain = Group((table,))
    if chair is None:
        return [plain]
    hx = table.half[0]
    pitch = chair.size[0] + 0.12
    seats = max(1, int((2 * hx - 0.1) / pitch))
    along = [(k - (seats - 1) / 2.0) * pitch for k in range(seats)]
    long_sides = [p.tucked(table, chair, side, a) for side in (0, 2) for a in along]
    ends = [p.tucked(table, chair, side, 0.0) for side in (1, 3)]
    # A corner has room for one chair: those at the ends give way.
    near = [p.parts(item) for item in long_sides]
    ends = [e for e in ends if not any(overlap(p.parts(e), other, 0.04) for other in near)]
    kind = ("Apple", "Bread", "Laptop")[int(float(p.rng.random()) * 3)]
    small = p.one(kind) if p.chance(0.5) else None
    resting = p.resting(table, 0, small, 0.1, 0.05) if small else None
    laid = plain if resting is None else plain.with_items(resting)
    four = laid.with_items(*long_sides)
    two = laid.with_items(*long_sides[:1], *long_sides[seats : seats + 1])
    six = [four.with_items(*ends)] if p.chance(0.5) else []
    return [*six, four, two]
