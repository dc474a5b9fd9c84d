"""Makers of furniture groups for sleeping, working, washing and storing.

Each maker returns the variants of one group, the preferred one first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from internav_data.houses.pieces import (
    BACK_GAP_M,
    FACING_LEFT,
    FACING_RIGHT,
    Group,
    Picker,
    PlacedAsset,
    against,
    in_front,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.records import Asset

DOUBLE_BED_M = 1.3
"""Beds from this width on are for two."""
SIDE_GAP_M = 0.03
EYE_LEVEL_M = 1.25
"""Lower edge of pictures and mirrors on a wall."""


@dataclass(frozen=True, slots=True)
class RoomContext:
    """Facts about a room that the makers of groups may use."""

    area_m2: float
    """Area between the wall faces."""
    short_m: float
    """Shorter side of the largest rectangle in the room."""
    long_m: float
    """Longer side of the room's bounding box."""
    types: frozenset[str]
    """All types of room in the house."""


def narrow(limit: float) -> Callable[[Asset], bool]:
    """Return a predicate for assets at most `limit` metres wide."""
    return lambda asset: asset.size[0] <= limit


def within(low: float, high: float) -> Callable[[Asset], bool]:
    """Return a predicate for assets of a width from `low` to `high` metres."""
    return lambda asset: low <= asset.size[0] <= high


def _beside(item: PlacedAsset, asset: Asset, side: int) -> PlacedAsset:
    """Stand an asset against the wall beside another, left (-1) or right (1)."""
    x = item.x + side * (item.half[0] + asset.size[0] / 2.0 + SIDE_GAP_M)
    return against(asset, x)


def bed(p: Picker, room: RoomContext) -> list[Group]:
    """Make a bed with its head to the wall and a nightstand on either side."""
    double = room.area_m2 >= 11.5 and room.short_m >= 2.75  # noqa: PLR2004 - the stated minima
    asset = p.one("Bed", lambda a: (a.size[0] >= DOUBLE_BED_M) == double)
    if asset is None:
        asset = p.smallest("Bed")
    if asset is None:
        return []
    main = against(asset)
    foot = in_front(main, 0.45)
    plain = Group((main,), (foot,))
    stand = p.one("Nightstand", narrow(0.65))
    lengthwise = PlacedAsset(asset, 0.0, BACK_GAP_M + asset.size[0] / 2.0, FACING_RIGHT)
    corner = Group((lengthwise,), (in_front(lengthwise, 0.5, 0.5),))
    if stand is None:
        return [plain, corner, *_narrow_beds(p)]
    left, right = _beside(main, stand, -1), _beside(main, stand, 1)
    one, both = plain.with_items(left), plain.with_items(left, right)
    clock = p.one("AlarmClock") if p.chance(0.5) else None
    if clock is not None:
        resting = p.resting(left, 1, clock, 0.0, 0.0)
        if resting is not None:
            one, both = one.with_items(resting), both.with_items(resting)
    first = [both] if double or p.chance(0.3) else []
    return [*first, one, plain, corner, *_narrow_beds(p)]


def _narrow_beds(p: Picker) -> list[Group]:
    """Make the smallest bed, head or side to the wall, for rooms in which no other fits."""
    asset = p.smallest("Bed")
    if asset is None:
        return []
    side = BACK_GAP_M + asset.size[0] / 2.0
    turned = (PlacedAsset(asset, 0.0, side, turn) for turn in (FACING_RIGHT, FACING_LEFT))
    return [Group((item,), (in_front(item, 0.4, 0.4),)) for item in (against(asset), *turned)]


def _plain(
    *kinds: str, front: float = 0.3, share: float = 0.9
) -> Callable[[Picker, RoomContext], list[Group]]:
    """Return a maker of one piece against a wall, of any of some types."""

    def make(p: Picker, room: RoomContext) -> list[Group]:
        del room
        out: list[Group] = []
        start = int(float(p.rng.random()) * len(kinds))
        for kind in kinds[start:] + kinds[:start]:
            # The smallest of its kind where the one drawn does not fit.
            for asset in (p.one(kind), p.smallest(kind)):
                if asset is not None:
                    item = against(asset)
                    out.append(Group((item,), (in_front(item, front, share),) if front else ()))
        return out

    return make


wardrobe = _plain("Wardrobe", front=0.55)
dresser = _plain("Dresser", front=0.5)
bookshelf = _plain("Bookcase", "ShelvingUnit", front=0.4)
storage_rack = _plain("StorageRack", "ShelvingUnit", front=0.4)
plant = _plain("HousePlant", front=0.0)
floor_lamp = _plain("FloorLamp", front=0.0)
armchair = _plain("ArmChair", front=0.5)
hamper = _plain("LaundryHamper", front=0.0)
bin_ = _plain("GarbageCan", front=0.0)
dog_bed = _plain("DogBed", front=0.2)
piano = _plain("Piano", front=0.7)
bench = _plain("Bench", "Ottoman", front=0.3)
stool = _plain("Stool", "Ottoman", front=0.0)
box = _plain("Box", front=0.0)
safe = _plain("Safe", front=0.3)
cabinet = _plain("FilingCabinet", front=0.4)
coat_rack = _plain("CoatRack", front=0.0)
shoe_cabinet = _plain("ShoeCabinet", front=0.3)
toilet = _plain("Toilet", front=0.35, share=0.8)
tub = _plain("Bathtub", front=0.35, share=0.35)
shower = _plain("Shower", front=0.4, share=0.5)
fridge = _plain("Fridge", front=0.6)


def vanity(p: Picker, room: RoomContext) -> list[Group]:
    """Make a dressing table with a stool before it."""
    del room
    asset, seat = p.one("VanityTable"), p.one("Stool")
    if asset is None:
        return []
    top = against(asset)
    plain = Group((top,), (in_front(top, 0.6, 0.6),))
    return [plain] if seat is None else [plain.with_items(p.tucked(top, seat, 0, 0.0)), plain]


def side_table(p: Picker, room: RoomContext) -> list[Group]:
    """Make a small table against a wall, with a small item on it."""
    del room
    asset = p.one("SideTable")
    if asset is None:
        return []
    group = Group((against(asset),), ())
    for kind in ("AlarmClock", "Laptop", "Box"):
        small = p.one(kind) if p.chance(0.3) else None
        resting = p.resting(group.items[0], 0, small, 0.0, 0.0) if small else None
        if resting is not None:
            return [group.with_items(resting), group]
    return [group]


def painting(p: Picker, room: RoomContext) -> list[Group]:
    """Make a picture on the wall."""
    del room
    asset = p.one("Painting", narrow(1.3), any_size=True)
    return [Group((against(asset, z=EYE_LEVEL_M + 0.1),))] if asset else []


def wall_mirror(p: Picker, room: RoomContext) -> list[Group]:
    """Make a mirror on the wall."""
    del room
    asset = p.one("Mirror")
    if asset is None:
        return []
    hung = max(0.05, 1.95 - asset.size[2]) if asset.size[2] < 1.4 else 0.0  # noqa: PLR2004 - tall ones stand
    return [Group((against(asset, z=round(hung, 2)),))]


def rug(p: Picker, room: RoomContext) -> list[Group]:
    """Make a rug on free floor."""
    asset = p.one("Rug", lambda a: a.size[0] < 0.6 * room.long_m and a.size[1] < 0.6 * room.short_m)
    return [Group((PlacedAsset(asset, 0.0, 0.0, 0),))] if asset else []


def desk(p: Picker, room: RoomContext) -> list[Group]:
    """Make a desk against the wall with its chair before it."""
    asset = p.one("Desk", narrow(max(1.2, 0.5 * room.long_m)), any_size=True)
    seat = p.one("OfficeChair") if p.chance(0.7) else p.one("Chair")
    if asset is None:
        return []
    top = against(asset)
    group = Group((top,), (in_front(top, 0.7, 0.6),))
    if seat is not None:
        chair = p.tucked(top, seat, 0, 0.0)
        group = Group((top, chair), (in_front(chair, 0.4),))
    for kind, dx in (("Laptop", 0.0), ("AlarmClock", 0.35)):
        small = p.one(kind) if p.chance(0.6) else None
        resting = p.resting(top, 0, small, dx, 0.0) if small else None
        if resting is not None:
            group = group.with_items(resting)
    return [group]


def washbasin(p: Picker, room: RoomContext) -> list[Group]:
    """Make a basin with a mirror over it."""
    del room
    glass = p.one("Mirror", narrow(0.9))
    out: list[Group] = []
    for asset in (p.one("Sink"), p.smallest("Sink")):
        if asset is None:
            continue
        basin = against(asset)
        plain = Group((basin,), (in_front(basin, 0.5, 0.8),))
        height = max(EYE_LEVEL_M - 0.05, asset.size[2] + 0.05)
        if glass is not None and height + glass.size[2] < 2.2:  # noqa: PLR2004 - under any ceiling
            out.append(plain.with_items(against(glass, z=round(height, 2))))
        out += [plain, Group((basin,), (in_front(basin, 0.25, 0.6),))]
    return out


def laundry(p: Picker, room: RoomContext) -> list[Group]:
    """Make washing machine and dryer side by side."""
    del room
    washer, dryer = p.one("WashingMachine"), p.one("ClothesDryer")
    if washer is None:
        return []
    first = against(washer)
    one = Group((first,), (in_front(first, 0.6),))
    if dryer is None:
        return [one]
    second = _beside(first, dryer, 1)
    return [one.with_items(second).with_clearance(in_front(second, 0.6)), one]
