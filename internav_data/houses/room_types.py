"""The table of room types: everything that houses know of a type stands in its one record.

Sources: `paper` follows the room sizes that the paper's Table 2 implies (about 24 m² each, as in
ProcTHOR), `realistic` the ranges measured on real homes: bedrooms 5-17, bathrooms 2-7.5, kitchens
5.3-9, living rooms 19-48 m²; habitable rooms at least 6.5 m² and 2.13 m wide, double bedrooms
11.5 m² and 2.75 m, halls 0.91 m clear.

A record has no optional facts about the type itself: a forgotten one is a `TypeError` that names
it. Furniture groups are named here and made in `internav_data.houses.group_makers`, so that a
configuration can be checked without numba.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.records import HousePreset

Placement = Literal["corner", "centre", "sun", "any", "open"]
"""Preferred position of a furniture group: along the walls, or free-standing (`open`)."""


@dataclass(frozen=True, slots=True)
class RoomStandard:
    """Sizes of one type of room; areas and widths are clear, between wall faces."""

    area_m2: float
    """Typical area."""
    low_m2: float
    """Smallest allowed area."""
    high_m2: float
    """Largest usual area."""
    width_m: float
    """Smallest allowed clear width."""
    aspect: float
    """Largest usual ratio of the longer side to the shorter one."""


class WindowSize(NamedTuple):
    """Window of a type of room, centimetres."""

    width_cm: int
    sill_cm: int
    height_cm: int


class ExtraRoom(NamedTuple):
    """Share of a type among the rooms that homes of five and more have beside the core."""

    weight: float
    max_count: int
    """Largest number of rooms of the type in one home."""


@dataclass(frozen=True, slots=True)
class RoomPair:
    """Relation of two types of room."""

    door_cost: float
    """Unusualness of a door between the two; the doors of a plan are the cheapest ones."""
    shared_wall: float = 0.0
    """Penalty of a plan in which both types occur and no two of them can have a door."""
    loop_share: float = 0.0
    """Share of the possible doors beyond the door tree that are built, at `loops` = 1. Pairs of
    public rooms have 1 without an entry."""
    open_plan: bool = False
    """Whether one opening of 2.4 m may join the two."""


@dataclass(frozen=True, slots=True)
class FurnitureRule:
    """One furniture group that a type of room may have."""

    group: str
    """Name of the group in `internav_data.houses.group_makers.GROUP_MAKERS`."""
    placement: Placement = "any"
    """Preferred position in the room."""
    share: float = 1.0
    """Expected number at `furnishing` = 1; from 1.0 on one is tried at any `furnishing`."""
    per_m2: float = 0.0
    """Additional expected number for each square metre."""
    min_m2: float = 0.0
    """Clear area from which a room has the group."""
    without: str = ""
    """Type of room: only houses without it have the group here."""
    lacking: str = ""
    """Type of asset: only a room that has none of it yet has the group."""
    watched: bool = False
    """Whether it stands only where a bed or a seat that is there already faces it."""
    one_a_house: bool = False
    """Whether one room of a house has the group: drawn from those whose rules say so."""


@dataclass(frozen=True, slots=True)
class RoomType:
    """All facts about one type of room."""

    paper: RoomStandard
    """Sizes in the preset `paper`."""
    realistic: RoomStandard
    """Sizes in the preset `realistic`."""
    private: bool
    """Whether the room should not be on the path to another; public rooms may be walked through."""
    habitable: bool
    """Whether people stay there: such rooms want daylight and keep the legal minima."""
    small: bool
    """Whether it is a service room: a narrow door, often tucked into a corner of a larger room."""
    host: bool
    """Whether a small room may be tucked into a corner of this one."""
    position: int
    """Position in the order of rooms: types near each other here tend to be neighbours."""
    hall_end: int | None
    """Position among the rooms that fill the end of a hall; None for those beside it."""
    wing: bool
    """Whether the living room of a larger home may lead there."""
    entrance: int
    """Preference for the entrance, 0 first; 5 where it is put only if nothing else has an outer
    wall."""
    extra: ExtraRoom | None
    """Share among the further rooms of larger homes; None for none."""
    window: WindowSize
    """Size of its windows."""
    floor: Literal["planks", "carpet", "tiles"]
    """Floor material; `carpet` in a third of the rooms, else planks."""
    wall: Literal["paint", "bricks", "tiles"]
    """Wall material; `bricks` in few of the rooms, else paint."""
    needs: tuple[str, ...]
    """Types of asset without which it does not work: a room that lacks one is furnished anew."""
    cooks: bool
    """Whether it has stove, sink and counter where the house has no kitchen."""
    pairs: Mapping[str, RoomPair]
    """Relations to other types. A pair stands in one of its two records, no matter which."""
    furniture: tuple[FurnitureRule, ...]
    """Furniture rules, in the order in which the groups are placed."""

    def standard(self, preset: HousePreset) -> RoomStandard:
        """Return the sizes of the type in a preset."""
        return self.paper if preset == "paper" else self.realistic


_PICTURES = FurnitureRule("painting", "centre", 0.7, 0.03)
_PLANT = FurnitureRule("plant", "corner", 0.5, 0.015)
_LAMP = FurnitureRule("floor_lamp", "corner", 0.5)
_RUG = FurnitureRule("rug", "open", 0.4)
_COOKING = tuple(
    FurnitureRule(group, "corner", 1.0, without="kitchen", lacking=lacking)
    for group, lacking in (
        ("kitchen_run", ""),
        ("short_run", "Stove"),
        ("sink_alone", "Sink"),
        ("counter", "CounterTop"),
        ("fridge", "Fridge"),
    )
)
"""Kitchenette of a room in a house without a kitchen."""

ROOM_TYPES: Mapping[str, RoomType] = {
    "bedroom": RoomType(
        paper=RoomStandard(25.0, 9.0, 60.0, 2.6, 1.6),
        realistic=RoomStandard(11.3, 6.5, 17.0, 2.13, 1.75),
        private=True,
        habitable=True,
        small=False,
        host=True,
        position=9,
        hall_end=None,
        wing=True,
        entrance=5,
        extra=ExtraRoom(3.0, 4),
        window=WindowSize(130, 90, 122),
        floor="carpet",
        wall="paint",
        needs=("Bed", "Wardrobe"),
        cooks=False,
        pairs={},
        furniture=(
            FurnitureRule("bed", "centre", 1.0),
            FurnitureRule("wardrobe", "corner", 1.0),
            FurnitureRule("dresser", "any", 0.6),
            FurnitureRule("desk", "sun", 0.45, min_m2=10.0),
            FurnitureRule("vanity", "sun", 0.3, min_m2=12.0),
            FurnitureRule("television", "any", 0.2, min_m2=16.0, watched=True),
            FurnitureRule("bookshelf", "corner", 0.3, 0.01),
            FurnitureRule("armchair", "corner", 0.35, min_m2=14.0),
            FurnitureRule("hamper", "corner", 0.3),
            FurnitureRule("bench", "any", 0.25, min_m2=12.0),
            _LAMP,
            _PLANT,
            FurnitureRule("wall_mirror", "any", 0.3),
            _PICTURES,
            _RUG,
        ),
    ),
    "bathroom": RoomType(
        paper=RoomStandard(13.0, 4.5, 30.0, 1.8, 1.9),
        realistic=RoomStandard(4.6, 3.0, 7.5, 1.5, 2.2),
        private=True,
        habitable=False,
        small=True,
        host=False,
        position=8,
        hall_end=None,
        wing=True,
        entrance=5,
        extra=ExtraRoom(1.3, 3),
        window=WindowSize(60, 140, 60),
        floor="tiles",
        wall="tiles",
        needs=("Toilet", "Sink"),
        cooks=False,
        pairs={
            "bedroom": RoomPair(6.0, shared_wall=0.5, loop_share=0.5),
        },
        furniture=(
            FurnitureRule("tub", "corner", 0.7, min_m2=6.0),
            FurnitureRule("shower", "corner", 1.0, lacking="Bathtub"),
            FurnitureRule("toilet", "corner", 1.0),
            FurnitureRule("washbasin", "corner", 1.0),
            FurnitureRule("shower", "corner", 0.3, lacking="Shower", min_m2=9.0),
            FurnitureRule("hamper", "corner", 0.5, min_m2=4.0),
            FurnitureRule("laundry", "corner", 0.4, without="laundry", min_m2=7.0),
            FurnitureRule("bookshelf", "corner", 0.5, min_m2=7.0),
            FurnitureRule("bench", "any", 0.3, min_m2=9.0),
            FurnitureRule("bin", "corner", 0.4, min_m2=4.0),
            FurnitureRule("stool", "any", 0.2, min_m2=6.0),
            FurnitureRule("plant", "corner", 0.2, min_m2=6.0),
            FurnitureRule("rug", "open", 0.4, min_m2=4.0),
        ),
    ),
    "dining": RoomType(
        paper=RoomStandard(24.0, 9.0, 60.0, 2.7, 1.6),
        realistic=RoomStandard(11.0, 7.5, 16.0, 2.5, 1.7),
        private=False,
        habitable=True,
        small=False,
        host=False,
        position=2,
        hall_end=1,
        wing=False,
        entrance=4,
        extra=ExtraRoom(1.4, 1),
        window=WindowSize(150, 80, 130),
        floor="planks",
        wall="paint",
        needs=("DiningTable",),
        cooks=False,
        pairs={
            "bathroom": RoomPair(5.0),
            "bedroom": RoomPair(4.5),
        },
        furniture=(
            FurnitureRule("dining", "open", 1.0),
            FurnitureRule("dresser", "centre", 0.8),
            FurnitureRule("bookshelf", "corner", 0.4, 0.01),
            FurnitureRule("side_table", "any", 0.4),
            FurnitureRule("armchair", "corner", 0.2, min_m2=16.0),
            _LAMP,
            _PLANT,
            _PICTURES,
        ),
    ),
    "office": RoomType(
        paper=RoomStandard(19.0, 7.5, 40.0, 2.4, 1.6),
        realistic=RoomStandard(9.0, 6.6, 13.0, 2.13, 1.75),
        private=True,
        habitable=True,
        small=False,
        host=True,
        position=6,
        hall_end=None,
        wing=True,
        entrance=5,
        extra=ExtraRoom(1.0, 1),
        window=WindowSize(130, 90, 122),
        floor="carpet",
        wall="paint",
        needs=("Desk",),
        cooks=False,
        pairs={},
        furniture=(
            FurnitureRule("desk", "sun", 1.0),
            FurnitureRule("bookshelf", "corner", 0.9, 0.03),
            FurnitureRule("cabinet", "any", 0.7),
            FurnitureRule("armchair", "corner", 0.5, min_m2=10.0),
            FurnitureRule("sofa_alone", "centre", 0.3, min_m2=13.0),
            FurnitureRule("side_table", "any", 0.3),
            FurnitureRule("safe", "corner", 0.25),
            FurnitureRule("bin", "corner", 0.6),
            FurnitureRule("box", "corner", 0.3),
            _LAMP,
            _PLANT,
            _PICTURES,
            _RUG,
        ),
    ),
    "laundry": RoomType(
        paper=RoomStandard(12.0, 4.5, 25.0, 1.8, 1.9),
        realistic=RoomStandard(4.0, 2.6, 7.0, 1.5, 2.2),
        private=True,
        habitable=False,
        small=True,
        host=False,
        position=0,
        hall_end=None,
        wing=True,
        entrance=5,
        extra=ExtraRoom(0.9, 1),
        window=WindowSize(60, 140, 60),
        floor="tiles",
        wall="tiles",
        needs=("WashingMachine",),
        cooks=False,
        pairs={
            "bathroom": RoomPair(8.0),
        },
        furniture=(
            FurnitureRule("laundry", "corner", 1.0),
            FurnitureRule("sink_alone", "any", 0.6, min_m2=4.0),
            FurnitureRule("hamper", "corner", 0.9),
            FurnitureRule("storage_rack", "corner", 0.6, min_m2=4.0),
            FurnitureRule("counter", "any", 0.4, min_m2=8.0),
            FurnitureRule("bin", "corner", 0.4),
            FurnitureRule("box", "corner", 0.4),
        ),
    ),
    "storage": RoomType(
        paper=RoomStandard(10.0, 4.0, 20.0, 1.8, 2.0),
        realistic=RoomStandard(3.4, 2.2, 7.0, 1.3, 2.4),
        private=True,
        habitable=False,
        small=True,
        host=False,
        position=7,
        hall_end=None,
        wing=False,
        entrance=5,
        extra=ExtraRoom(0.7, 1),
        window=WindowSize(60, 150, 50),
        floor="tiles",
        wall="paint",
        needs=(),
        cooks=False,
        pairs={},
        furniture=(
            FurnitureRule("storage_rack", "corner", 1.0, 0.06),
            FurnitureRule("bookshelf", "corner", 0.5, 0.03),
            FurnitureRule("box", "corner", 0.9, 0.12),
            FurnitureRule("safe", "corner", 0.3),
            FurnitureRule("stool", "any", 0.3),
        ),
    ),
    "kitchen": RoomType(
        paper=RoomStandard(25.0, 8.0, 60.0, 2.5, 1.7),
        realistic=RoomStandard(8.0, 6.6, 9.0, 2.13, 1.9),
        private=False,
        habitable=True,
        small=False,
        host=False,
        position=1,
        hall_end=2,
        wing=False,
        entrance=3,
        extra=None,
        window=WindowSize(120, 112, 100),
        floor="tiles",
        wall="paint",
        needs=("Stove", "Sink", "CounterTop", "Fridge"),
        cooks=False,
        pairs={
            "bathroom": RoomPair(9.0),
            "bedroom": RoomPair(4.5),
            "dining": RoomPair(0.5, shared_wall=1.0, open_plan=True),
            "laundry": RoomPair(2.0, shared_wall=0.4, loop_share=0.5),
            "storage": RoomPair(2.4),
        },
        furniture=(
            FurnitureRule("kitchen_run", "corner", 1.0),
            FurnitureRule("short_run", "corner", 1.0, lacking="Stove"),
            FurnitureRule("sink_alone", "corner", 1.0, lacking="Sink"),
            FurnitureRule("counter", "corner", 1.0, lacking="CounterTop"),
            FurnitureRule("fridge", "corner", 1.0, lacking="Fridge"),
            FurnitureRule("counter", "corner", 0.5, 0.015),
            FurnitureRule("dining", "open", 1.0, without="dining", min_m2=11.0, one_a_house=True),
            FurnitureRule("island", "open", 0.35, min_m2=20.0),
            FurnitureRule("bin", "corner", 0.8),
            FurnitureRule("bookshelf", "corner", 0.3, 0.01),
            FurnitureRule("side_table", "any", 0.2, min_m2=14.0),
            FurnitureRule("stool", "any", 0.2, min_m2=9.0),
            _PLANT,
            _PICTURES,
        ),
    ),
    "living": RoomType(
        paper=RoomStandard(32.0, 12.0, 90.0, 3.0, 1.6),
        realistic=RoomStandard(25.0, 19.0, 48.0, 3.2, 1.7),
        private=False,
        habitable=True,
        small=False,
        host=True,
        position=3,
        hall_end=0,
        wing=False,
        entrance=1,
        extra=None,
        window=WindowSize(180, 60, 150),
        floor="planks",
        wall="bricks",
        needs=("Sofa",),
        cooks=True,
        pairs={
            "bathroom": RoomPair(3.5),
            "bedroom": RoomPair(3.0, loop_share=0.35),
            "dining": RoomPair(0.6, shared_wall=0.8, open_plan=True),
            "kitchen": RoomPair(0.8, shared_wall=0.8, open_plan=True),
            "office": RoomPair(2.6, shared_wall=0.2, loop_share=0.35),
            "storage": RoomPair(3.2),
        },
        furniture=(
            FurnitureRule("seating", "centre", 1.0),
            FurnitureRule("sofa_alone", "centre", 1.0, lacking="Sofa"),
            *_COOKING,
            FurnitureRule("dining", "open", 1.0, without="dining", min_m2=16.0, one_a_house=True),
            FurnitureRule("bookshelf", "corner", 0.8, 0.02),
            FurnitureRule("armchair", "corner", 0.6, 0.01),
            FurnitureRule("side_table", "any", 0.5, 0.01),
            FurnitureRule("dresser", "any", 0.3),
            FurnitureRule("piano", "any", 0.12, min_m2=24.0),
            FurnitureRule("desk", "sun", 0.2, without="office", min_m2=26.0),
            FurnitureRule("dog_bed", "corner", 0.2),
            FurnitureRule("stool", "any", 0.2),
            _LAMP,
            _PLANT,
            _PICTURES,
            FurnitureRule("rug", "open", 0.2),
        ),
    ),
    "hall": RoomType(
        paper=RoomStandard(20.0, 4.0, 80.0, 1.5, 9.0),
        realistic=RoomStandard(7.0, 1.5, 20.0, 0.98, 12.0),
        private=False,
        habitable=False,
        small=False,
        host=False,
        position=5,
        hall_end=None,
        wing=False,
        entrance=0,
        extra=None,
        window=WindowSize(90, 100, 110),
        floor="planks",
        wall="paint",
        needs=(),
        cooks=False,
        pairs={
            "bathroom": RoomPair(1.8),
            "bedroom": RoomPair(2.0),
            "dining": RoomPair(2.8),
            "kitchen": RoomPair(2.6, shared_wall=0.4),
            "laundry": RoomPair(2.2, loop_share=0.5),
            "living": RoomPair(0.5, shared_wall=0.8),
            "office": RoomPair(2.0, loop_share=0.35),
            "storage": RoomPair(2.0),
        },
        furniture=(
            FurnitureRule("coat_rack", "corner", 0.9),
            FurnitureRule("shoe_cabinet", "any", 0.8),
            FurnitureRule("bench", "any", 0.3, min_m2=8.0),
            FurnitureRule("side_table", "any", 0.4, min_m2=8.0),
            _PLANT,
            FurnitureRule("wall_mirror", "any", 0.4),
            _PICTURES,
            FurnitureRule("rug", "open", 0.5),
        ),
    ),
    "studio": RoomType(
        paper=RoomStandard(28.0, 12.5, 80.0, 3.2, 1.7),
        realistic=RoomStandard(30.0, 22.0, 45.0, 3.6, 1.7),
        private=False,
        habitable=True,
        small=False,
        host=True,
        position=4,
        hall_end=None,
        wing=False,
        entrance=2,
        extra=None,
        window=WindowSize(140, 112, 100),
        floor="planks",
        wall="bricks",
        needs=("Bed", "Wardrobe"),
        cooks=True,
        pairs={
            "bathroom": RoomPair(2.0),
            "bedroom": RoomPair(3.0),
            "kitchen": RoomPair(0.8, shared_wall=0.8),
        },
        furniture=(
            FurnitureRule("bed", "centre", 1.0),
            *_COOKING,
            FurnitureRule("seating", "centre", 1.0, min_m2=22.0),
            FurnitureRule("sofa_alone", "centre", 1.0, lacking="Sofa"),
            FurnitureRule("wardrobe", "corner", 1.0),
            FurnitureRule("dining", "open", 0.8, without="dining", one_a_house=True),
            FurnitureRule("desk", "sun", 0.4),
            FurnitureRule("bookshelf", "corner", 0.5, 0.01),
            FurnitureRule("armchair", "corner", 0.3),
            FurnitureRule("bin", "corner", 0.5),
            FurnitureRule("side_table", "any", 0.3),
            _LAMP,
            _PLANT,
            _PICTURES,
            _RUG,
        ),
    ),
}
"""Room types by name. Append new ones: the order decides the draws of larger homes."""


def type_pair(first: str, second: str) -> tuple[str, str]:
    """Return two types in the order of `ROOM_PAIRS`' keys."""
    return (first, second) if first <= second else (second, first)


def room_pairs(types: Mapping[str, RoomType]) -> dict[tuple[str, str], RoomPair]:
    """Collect the relations of all records by pair of types, each pair sorted.

    Raises
    ------
    ValueError
        When a record names an unknown type, or a pair stands in both of its records.
    """
    out: dict[tuple[str, str], RoomPair] = {}
    for name, record in types.items():
        for other, pair in record.pairs.items():
            key = type_pair(name, other)
            if other not in types:
                raise ValueError(f"room type '{name}' has a pair with the unknown type '{other}'")
            if key in out:
                raise ValueError(f"the room types '{name}' and '{other}' name each other: once")
            out[key] = pair
    return out


ROOM_PAIRS: Mapping[tuple[str, str], RoomPair] = room_pairs(ROOM_TYPES)
"""Relations of two types, by their names in alphabetical order."""
