"""Groups of furniture by what people do there: sleep, sit, eat, cook, wash, work, keep things.

Each maker returns the variants of one group, the one most wished for first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from internav_data.houses.pieces import (
    BACK_GAP_M,
    FACING_LEFT,
    FACING_RIGHT,
    FACING_WALL,
    Group,
    Item,
    Picker,
    against,
    in_front,
    overlap,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.records import Asset

DOUBLE_BED_M = 1.3
"""Beds from this width on are for two."""
SIDE_GAP_M = 0.03
EYE_LEVEL_M = 1.25
"""Lower edge of what hangs on a wall."""


@dataclass(frozen=True, slots=True)
class Place:
    """What a maker may know of the room it furnishes."""

    area_m2: float
    short_m: float
    long_m: float
    types: frozenset[str]
    """All types of room in the house."""


def narrow(limit: float) -> Callable[[Asset], bool]:
    """Return a test for assets at most so wide."""
    return lambda asset: asset.size[0] <= limit


def _beside(item: Item, asset: Asset, side: int) -> Item:
    """Stand an asset against the wall beside another, left (-1) or right (1)."""
    x = item.x + side * (item.half[0] + asset.size[0] / 2.0 + SIDE_GAP_M)
    return against(asset, x)


def bed(p: Picker, place: Place) -> list[Group]:
    """Make a bed with its head to the wall and a nightstand on either side."""
    double = place.area_m2 >= 11.5 and place.short_m >= 2.75  # noqa: PLR2004 - the stated minima
    asset = p.one("Bed", lambda a: (a.size[0] >= DOUBLE_BED_M) == double)
    if asset is None:
        asset = min(p.catalogue.of_type("Bed"), key=lambda a: (a.size[0], a.asset_id), default=None)
    if asset is None:
        return []
    main = against(asset)
    foot = in_front(main, 0.45)
    plain = Group((main,), (foot,))
    stand = p.one("Nightstand", narrow(0.65))
    lengthwise = Item(asset, 0.0, BACK_GAP_M + asset.size[0] / 2.0, FACING_RIGHT)
    corner = Group((lengthwise,), (in_front(lengthwise, 0.5, 0.5),))
    if stand is None:
        return [plain, corner]
    left, right = _beside(main, stand, -1), _beside(main, stand, 1)
    one, both = plain.with_items(left), plain.with_items(left, right)
    clock = p.one("AlarmClock") if p.chance(0.5) else None
    if clock is not None:
        resting = p.resting(left, 1, clock, 0.0, 0.0)
        if resting is not None:
            one, both = one.with_items(resting), both.with_items(resting)
    return [both, one, plain, corner] if double or p.chance(0.3) else [one, plain, corner]


def _plain(*kinds: str, front: float = 0.3) -> Callable[[Picker, Place], list[Group]]:
    """One piece against a wall: any of some types."""

    def make(p: Picker, place: Place) -> list[Group]:
        del place
        out: list[Group] = []
        start = int(float(p.rng.random()) * len(kinds))
        for kind in kinds[start:] + kinds[:start]:
            asset = p.one(kind)
            if asset is not None:
                item = against(asset)
                out.append(Group((item,), (in_front(item, front, 0.9),) if front else ()))
        return out

    return make


wardrobe = _plain("Wardrobe", front=0.55)
dresser = _plain("Dresser", front=0.5)
shelf = _plain("Bookcase", "ShelvingUnit", front=0.4)
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
toilet = _plain("Toilet", front=0.5)
tub = _plain("Bathtub", front=0.5)
shower = _plain("Shower", front=0.5)
fridge = _plain("Fridge", front=0.6)


def vanity(p: Picker, place: Place) -> list[Group]:
    """Make a dressing table with a stool before it."""
    del place
    asset, seat = p.one("VanityTable"), p.one("Stool")
    if asset is None:
        return []
    top = against(asset)
    plain = Group((top,), (in_front(top, 0.6, 0.6),))
    return [plain] if seat is None else [plain.with_items(p.tucked(top, seat, 0, 0.0)), plain]


def side_table(p: Picker, place: Place) -> list[Group]:
    """Make a small table against a wall, with something on it."""
    del place
    asset = p.one("SideTable")
    if asset is None:
        return []
    group = Group((against(asset),), ())
    for kind in ("AlarmClock", "Laptop", "Box"):
        thing = p.one(kind) if p.chance(0.3) else None
        resting = p.resting(group.items[0], 0, thing, 0.0, 0.0) if thing else None
        if resting is not None:
            return [group.with_items(resting), group]
    return [group]


def painting(p: Picker, place: Place) -> list[Group]:
    """Make a picture on the wall."""
    del place
    asset = p.one("Painting", narrow(1.3), any_size=True)
    return [Group((against(asset, z=EYE_LEVEL_M + 0.1),))] if asset else []


def wall_mirror(p: Picker, place: Place) -> list[Group]:
    """Make a mirror on the wall."""
    del place
    asset = p.one("Mirror")
    if asset is None:
        return []
    hung = max(0.05, 1.95 - asset.size[2]) if asset.size[2] < 1.4 else 0.0  # noqa: PLR2004 - tall ones stand
    return [Group((against(asset, z=round(hung, 2)),))]


def rug(p: Picker, place: Place) -> list[Group]:
    """Make a rug on free floor."""
    asset = p.one(
        "Rug", lambda a: a.size[0] < 0.6 * place.long_m and a.size[1] < 0.6 * place.short_m
    )
    return [Group((Item(asset, 0.0, 0.0, 0),))] if asset else []


def seating(p: Picker, place: Place) -> list[Group]:
    """Make sofa facing a television, coffee table between, an armchair beside."""
    stand = p.one("TVStand")
    screen = p.one("Television", lambda a: stand is not None and a.size[0] <= stand.size[0] + 0.05)
    sofa = p.one("Sofa", narrow(max(1.6, 0.6 * place.long_m)), any_size=True)
    if sofa is None:
        return []
    out: list[Group] = []
    if stand is not None:
        base = against(stand)
        resting = p.resting(base, 0, screen, 0.0, 0.0) if screen is not None else None
        screens = (base,) if resting is None else (base, resting)
        for distance in _viewing_distances(place, stand, sofa):
            out += _around(p, screens, sofa, distance)
        out.append(Group((*screens,), (in_front(base, 0.5),)))
    return out


def _viewing_distances(place: Place, stand: Asset, sofa: Asset) -> list[float]:
    """Gaps between television stand and sofa: to the opposite wall if that is near, else nearer."""
    gaps = []
    for span in (place.short_m, place.long_m):
        gap = span - stand.size[1] - sofa.size[1] - 2 * BACK_GAP_M - 0.02
        if 1.4 <= gap <= 3.4:  # noqa: PLR2004 - metres one watches from
            gaps.append(gap)
    return [*gaps, 2.4, 1.9, 1.5]


def _around(p: Picker, screens: tuple[Item, ...], sofa: Asset, gap: float) -> list[Group]:
    """Make sofa across from a screen, with and without what stands between and beside."""
    base = screens[0]
    front = base.y + base.half[1]
    seat = Item(sofa, base.x, front + gap + sofa.size[1] / 2.0, FACING_WALL)
    lane = (base.x - 0.4, front, base.x + 0.4, front + 0.5)
    plain = Group((*screens, seat), (lane,))
    coffee = p.one("CoffeeTable", lambda a: a.size[1] <= gap - 1.1 and a.size[0] <= sofa.size[0])
    if coffee is None:
        return [plain]
    middle = front + gap - 0.42 - coffee.size[1] / 2.0
    table = Item(coffee, base.x, middle, FACING_WALL)
    with_table = plain.with_items(table)
    room = 2.0 * min(front + gap - 0.06 - middle, middle - front - 0.06)
    carpet = p.one(
        "Rug", lambda a: coffee.size[1] + 0.1 <= a.size[1] <= room and coffee.size[0] <= a.size[0]
    )
    if carpet is not None and p.chance(0.7):
        lying = Item(carpet, base.x, middle, FACING_WALL)
        on_it = p.resting(lying, len(plain.items), coffee, 0.0, 0.0, FACING_WALL)
        if on_it is not None:
            with_table = plain.with_items(lying, on_it)
    chair = p.one("ArmChair", narrow(1.0))
    if chair is None:
        return [with_table, plain]
    side = 1 if p.chance(0.5) else -1
    away = sofa.size[0] / 2.0 + 0.15 + chair.size[1] / 2.0
    beside = Item(chair, base.x + side * away, middle, FACING_LEFT if side > 0 else FACING_RIGHT)
    full = with_table.with_items(beside)
    return [full, with_table, plain] if p.chance(0.6) else [with_table, plain]


def sofa_alone(p: Picker, place: Place) -> list[Group]:
    """Make a sofa with its back to the wall."""
    asset = p.one("Sofa", narrow(max(1.6, 0.6 * place.long_m)), any_size=True)
    if asset is None:
        return []
    item = against(asset)
    return [Group((item,), (in_front(item, 0.6),))]


def television(p: Picker, place: Place) -> list[Group]:
    """Make a television on its stand."""
    del place
    stand, screen = p.one("TVStand"), p.one("Television")
    if stand is None:
        return []
    base = against(stand)
    resting = p.resting(base, 0, screen, 0.0, 0.0) if screen else None
    items = (base,) if resting is None else (base, resting)
    return [Group(items, (in_front(base, 0.5),))]


def dining(p: Picker, place: Place) -> list[Group]:
    """Make a table with chairs pushed in, for as many as the room can take."""
    largest = 1.1 if place.area_m2 < 12 else 1.6 if place.area_m2 < 18 else 2.9  # noqa: PLR2004
    asset = p.one("DiningTable", lambda a: 0.6 * largest <= a.size[0] <= largest, any_size=True)
    chair = p.one("Chair")
    if asset is None:
        return []
    table = Item(asset, 0.0, 0.0, FACING_WALL)
    plain = Group((table,))
    if chair is None:
        return [plain]
    hx = table.half[0]
    seats = max(1, int((2 * hx - 0.1) / (chair.size[0] + 0.12)))
    along = [(k - (seats - 1) / 2.0) * (chair.size[0] + 0.12) for k in range(seats)]
    long_sides = [p.tucked(table, chair, side, a) for side in (0, 2) for a in along]
    ends = [p.tucked(table, chair, side, 0.0) for side in (1, 3)]
    # Corners have room for one pair of knees.
    near = [p.parts(item) for item in long_sides]
    ends = [e for e in ends if not any(overlap(p.parts(e), other, 0.04) for other in near)]
    four = plain.with_items(*long_sides)
    bowl = (
        p.one(["Apple", "Bread", "Laptop"][int(float(p.rng.random()) * 3)])
        if p.chance(0.5)
        else None
    )
    resting = p.resting(table, 0, bowl, 0.1, 0.05) if bowl else None
    extra = () if resting is None else (resting,)
    six = four.with_items(*ends)
    two = plain.with_items(*long_sides[:1], *long_sides[seats : seats + 1])
    out = [six, four, two] if p.chance(0.5) else [four, two]
    return [g.with_items(*extra) for g in out] + [plain]


def desk(p: Picker, place: Place) -> list[Group]:
    """Make a desk against the wall with its chair before it."""
    asset = p.one("Desk", narrow(max(1.2, 0.5 * place.long_m)), any_size=True)
    seat = p.one("OfficeChair") if p.chance(0.7) else p.one("Chair")
    if asset is None:
        return []
    top = against(asset)
    group = Group((top,), (in_front(top, 0.7, 0.6),))
    if seat is not None:
        chair = p.tucked(top, seat, 0, 0.0)
        group = Group((top, chair), (in_front(chair, 0.4),))
    for kind, dx in (("Laptop", 0.0), ("AlarmClock", 0.35)):
        thing = p.one(kind) if p.chance(0.6) else None
        resting = p.resting(top, 0, thing, dx, 0.0) if thing else None
        if resting is not None:
            group = group.with_items(resting)
    return [group]


def washbasin(p: Picker, place: Place) -> list[Group]:
    """Make a basin with a mirror over it."""
    del place
    asset, glass = p.one("Sink"), p.one("Mirror", narrow(0.9))
    if asset is None:
        return []
    basin = against(asset)
    group = Group((basin,), (in_front(basin, 0.5),))
    height = max(EYE_LEVEL_M - 0.05, asset.size[2] + 0.05)
    if glass is not None and height + glass.size[2] < 2.2:  # noqa: PLR2004 - under any ceiling
        hung = against(glass, z=round(height, 2))
        if glass.size[0] <= asset.size[0] + 0.1:
            return [group.with_items(hung), group]
    return [group]


def laundry(p: Picker, place: Place) -> list[Group]:
    """Make washing machine and dryer side by side."""
    del place
    washer, dryer = p.one("WashingMachine"), p.one("ClothesDryer")
    if washer is None:
        return []
    first = against(washer)
    one = Group((first,), (in_front(first, 0.6),))
    if dryer is None:
        return [one]
    second = _beside(first, dryer, 1)
    return [one.with_items(second).keeping(in_front(second, 0.6)), one]
