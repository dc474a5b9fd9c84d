"""The table of asset types: number, design, count, size and mass of each type.

Source: the object types of AI2-THOR and ProcTHOR (Deitke et al. 2022) as counted in the simulator;
sizes are minimum, median and maximum in metres, masses one figure a type.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from internav_data.catalog.designs import (
    food,
    machines,
    rooms,
    seating,
    small,
    soft,
    storage,
    tables,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from internav_data.catalog.designs import Design

Range = tuple[float, float, float]
"""Minimum, median and maximum, metres."""


class AssetType(NamedTuple):
    """Facts about one type of asset."""

    number: int
    """Key of the type's random numbers. A new type takes the next free number, wherever it stands
    in the table; a number is never changed or used again, so that no other type is redrawn."""
    type: str
    """Name: letters and digits."""
    design: Design
    """Function that draws one asset of the type."""
    pushable: int
    """Number of assets that can be pushed."""
    pickable: int
    """Number of assets that can be picked up."""
    fixed: int
    """Number of assets that can be neither pushed nor picked up."""
    mass_kg: float
    """Mass of an asset of median size."""
    width: Range
    depth: Range
    height: Range
    likeness: float
    """Correlation of the three sizes. 0: drawn independently; 1: the widest is also the highest."""
    blocks: bool = True
    """Whether the agent's disc must keep clear of it. Rugs are floor: bodies of no physics, drawn
    4 mm high at most, so that what stands on the floor below them does not look sunk."""

    @property
    def asset_count(self) -> int:
        """Number of assets of the type."""
        return self.pushable + self.pickable + self.fixed


# fmt: off
OBSTACLES: tuple[AssetType, ...] = (
    AssetType(0, "ArmChair", seating.arm_chair, 32, 0, 6, 28.3, (.59, .94, 1.53), (.62, .89, 1.21), (.62, .88, 1.27), .5),  # noqa: E501
    AssetType(1, "DogBed", soft.dog_bed, 3, 0, 0, .98, (.73, .99, 1.18), (.73, .83, 1.18), (.11, .18, .32), .9),  # noqa: E501
    AssetType(2, "Box", small.box, 0, 34, 0, .3, (.21, .40, .69), (.21, .41, .55), (.15, .28, .47), .6),  # noqa: E501
    AssetType(3, "Chair", seating.chair, 44, 0, 12, 10., (.36, .48, .65), (.37, .54, .87), (.67, .88, 1.23), .4),  # noqa: E501
    AssetType(4, "Desk", tables.desk, 28, 0, 7, 34., (.83, 1.39, 2.53), (.36, .62, 1.92), (.57, .79, 2.08), .3),  # noqa: E501
    AssetType(5, "DiningTable", tables.dining_table, 24, 0, 6, 85., (.72, 1.47, 2.81), (.68, .96, 1.61), (.63, .76, 1.06), .5),  # noqa: E501
    AssetType(6, "SideTable", tables.side_table, 66, 0, 8, 11., (.25, .62, 1.83), (.24, .39, .93), (.39, .66, 1.28), .4),  # noqa: E501
    AssetType(7, "Sofa", seating.sofa, 32, 0, 5, 104., (1.55, 2.40, 2.86), (.68, .93, 1.78), (.61, .92, 1.29), .4),  # noqa: E501
    AssetType(8, "Stool", seating.stool, 10, 0, 0, 3.18, (.31, .41, .59), (.23, .32, .46), (.45, .67, .76), .7),  # noqa: E501
    AssetType(9, "Television", machines.television, 26, 0, 6, 9.83, (.82, 1.14, 1.70), (.07, .31, .56), (.52, .81, 1.21), .8),  # noqa: E501
    AssetType(10, "Pillow", soft.pillow, 0, 30, 2, .7, (.32, .43, .70), (.17, .35, .58), (.10, .14, .25), .6),  # noqa: E501
    AssetType(11, "Bread", food.bread, 0, 30, 0, .7, (.12, .16, .28), (.22, .29, .39), (.08, .14, .17), .4),  # noqa: E501
    AssetType(12, "Apple", food.apple, 1, 30, 0, .2, (.06, .10, .14), (.06, .10, .14), (.08, .12, .15), .95),  # noqa: E501
    AssetType(13, "AlarmClock", small.alarm_clock, 1, 30, 0, .8, (.10, .19, .27), (.05, .09, .20), (.11, .18, .26), .5),  # noqa: E501
    AssetType(14, "Lettuce", food.lettuce, 0, 30, 0, .47, (.12, .15, .19), (.20, .24, .27), (.12, .15, .18), .6),  # noqa: E501
    AssetType(15, "GarbageCan", small.garbage_can, 31, 0, 0, .7, (.37, .45, .68), (.27, .37, .53), (.38, .56, .66), .6),  # noqa: E501
    AssetType(16, "Laptop", small.laptop, 1, 30, 0, 2.3, (.32, .40, .50), (.25, .30, .38), (.26, .29, .39), .9),  # noqa: E501
    AssetType(17, "Microwave", machines.microwave, 30, 0, 0, 7., (.61, .61, .70), (.32, .36, .43), (.33, .35, .40), .6),  # noqa: E501
    AssetType(18, "Pot", small.pot, 0, 30, 0, .57, (.25, .29, .44), (.22, .31, .54), (.12, .16, .25), .5),  # noqa: E501
    AssetType(19, "Tomato", food.tomato, 0, 30, 0, .12, (.09, .12, .15), (.10, .13, .15), (.07, .10, .15), .95),  # noqa: E501
)
"""Types that are spawned as obstacles."""

FURNITURE: tuple[AssetType, ...] = (
    AssetType(20, "Bed", soft.bed, 0, 0, 12, 80., (.92, 1.37, 1.96), (1.65, 2.24, 2.52), (.55, .91, 1.25), .6),  # noqa: E501
    AssetType(21, "CoffeeTable", tables.coffee_table, 0, 0, 10, 22., (.70, 1.13, 1.50), (.50, .66, .90), (.32, .44, .52), .5),  # noqa: E501
    AssetType(22, "Dresser", storage.dresser, 0, 0, 8, 48., (.76, 1.20, 1.62), (.42, .51, .58), (.74, .97, 1.30), .3),  # noqa: E501
    AssetType(23, "TVStand", storage.tv_stand, 0, 0, 8, 38., (.90, 1.20, 1.90), (.38, .60, .64), (.42, .71, .80), .4),  # noqa: E501
    AssetType(24, "ShelvingUnit", storage.shelving_unit, 0, 0, 8, 30., (.60, .91, 1.50), (.28, .34, .42), (.90, 1.44, 2.0), .4),  # noqa: E501
    AssetType(25, "Bookcase", storage.bookcase, 0, 0, 6, 42., (.60, .80, 1.20), (.26, .30, .36), (1.2, 1.90, 2.12), .3),  # noqa: E501
    AssetType(26, "Wardrobe", storage.wardrobe, 0, 0, 6, 95., (.80, 1.20, 1.80), (.54, .60, .64), (1.8, 2.02, 2.2), .3),  # noqa: E501
    AssetType(27, "Nightstand", storage.nightstand, 0, 0, 6, 14., (.40, .48, .60), (.36, .42, .48), (.48, .58, .68), .5),  # noqa: E501
    AssetType(28, "Fridge", machines.fridge, 0, 0, 8, 95., (.60, .91, 1.00), (.65, .72, .80), (1.66, 1.80, 1.88), .7),  # noqa: E501
    AssetType(29, "CounterTop", rooms.counter_top, 0, 0, 12, 90., (.60, 2.00, 3.66), (.61, .61, .61), (.91, .94, .96), .2),  # noqa: E501
    AssetType(30, "Stove", machines.stove, 0, 0, 5, 60., (.60, .66, .76), (.61, .62, .66), (.92, .96, 1.10), .5),  # noqa: E501
    AssetType(31, "Dishwasher", machines.dishwasher, 0, 0, 4, 45., (.45, .60, .60), (.58, .60, .61), (.82, .85, .87), .5),  # noqa: E501
    AssetType(32, "KitchenIsland", rooms.kitchen_island, 0, 0, 5, 110., (1.2, 1.60, 2.2), (.70, .85, 1.0), (.90, .92, .95), .6),  # noqa: E501
    AssetType(33, "Sink", rooms.sink, 0, 0, 8, 25., (.46, .66, .95), (.40, .46, .54), (.80, .86, .92), .5),  # noqa: E501
    AssetType(34, "Toilet", rooms.toilet, 0, 0, 5, 38., (.38, .44, .53), (.66, .72, .92), (.72, .80, .99), .6),  # noqa: E501
    AssetType(35, "Bathtub", rooms.bathtub, 0, 0, 5, 60., (1.5, 1.70, 1.8), (.70, .75, .82), (.50, .55, .62), .6),  # noqa: E501
    AssetType(36, "Shower", rooms.shower, 0, 0, 4, 55., (.80, .90, 1.10), (.80, .90, 1.0), (2.0, 2.04, 2.1), .6),  # noqa: E501
    AssetType(37, "FloorLamp", machines.floor_lamp, 0, 0, 8, 6., (.28, .52, .70), (.28, .51, .62), (1.4, 1.60, 1.9), .5),  # noqa: E501
    AssetType(38, "HousePlant", rooms.house_plant, 0, 0, 10, 6., (.24, .36, .70), (.24, .39, .70), (.40, .65, 1.5), .9),  # noqa: E501
    AssetType(39, "LaundryHamper", rooms.laundry_hamper, 0, 0, 5, 3., (.40, .55, .60), (.34, .43, .48), (.55, .74, .80), .5),  # noqa: E501
    AssetType(40, "WashingMachine", machines.washing_machine, 0, 0, 4, 70., (.60, .68, .69), (.58, .66, .70), (.85, .95, 1.05), .8),  # noqa: E501
    AssetType(41, "ClothesDryer", machines.clothes_dryer, 0, 0, 4, 45., (.60, .68, .69), (.58, .66, .70), (.85, .95, 1.05), .8),  # noqa: E501
    AssetType(42, "Ottoman", seating.ottoman, 0, 0, 6, 9., (.45, .85, 1.10), (.42, .52, .70), (.36, .43, .48), .6),  # noqa: E501
    AssetType(43, "Safe", storage.safe, 0, 0, 4, 35., (.35, .40, .50), (.36, .45, .48), (.32, .40, .60), .7),  # noqa: E501
    AssetType(44, "OfficeChair", seating.office_chair, 0, 0, 6, 14., (.58, .64, .70), (.58, .64, .70), (.88, 1.04, 1.24), .6),  # noqa: E501
    AssetType(45, "FilingCabinet", storage.filing_cabinet, 0, 0, 5, 32., (.38, .42, .80), (.45, .56, .62), (.60, .72, 1.32), .3),  # noqa: E501
    AssetType(46, "CoatRack", storage.coat_rack, 0, 0, 4, 5., (.36, .44, .52), (.36, .44, .52), (1.6, 1.74, 1.85), .6),  # noqa: E501
    AssetType(47, "ShoeCabinet", storage.shoe_cabinet, 0, 0, 5, 20., (.60, .80, 1.10), (.22, .30, .36), (.50, .85, 1.2), .3),  # noqa: E501
    AssetType(48, "Rug", rooms.rug, 0, 0, 12, 6., (.60, 1.60, 3.0), (.50, 1.20, 2.2), (.002, .0028, .004), .8, blocks=False),  # noqa: E501
    AssetType(49, "Painting", rooms.painting, 0, 0, 10, 3., (.40, .81, 1.4), (.024, .03, .04), (.36, .62, 1.0), .6),  # noqa: E501
    AssetType(50, "Mirror", rooms.mirror, 0, 0, 6, 6., (.40, .60, .90), (.02, .026, .04), (.60, .90, 1.3), .4),  # noqa: E501
    AssetType(51, "Piano", storage.piano, 0, 0, 3, 200., (1.4, 1.48, 1.54), (.56, .60, .66), (1.06, 1.16, 1.3), .4),  # noqa: E501
    AssetType(52, "Bench", seating.bench, 0, 0, 6, 14., (.80, 1.10, 1.5), (.32, .38, .46), (.42, .46, .50), .5),  # noqa: E501
    AssetType(53, "StorageRack", storage.storage_rack, 0, 0, 6, 24., (.80, 1.10, 1.6), (.36, .45, .55), (1.4, 1.80, 2.0), .4),  # noqa: E501
    AssetType(54, "Crate", storage.crate, 0, 0, 5, 4., (.34, .46, .60), (.28, .36, .44), (.22, .30, .40), .6),  # noqa: E501
    AssetType(55, "VanityTable", tables.vanity_table, 0, 0, 4, 26., (.80, 1.0, 1.2), (.40, .45, .50), (1.2, 1.36, 1.5), .4),  # noqa: E501
)
"""Types that only stand in houses."""
# fmt: on


def by_name(types: Iterable[AssetType]) -> dict[str, AssetType]:
    """Return asset types by name.

    Raises
    ------
    ValueError
        When two of them share a name, or a number: their assets would be drawn alike.
    """
    out: dict[str, AssetType] = {}
    numbers: dict[int, str] = {}
    for record in types:
        if record.type in out:
            raise ValueError(f"asset type '{record.type}' stands twice in the table")
        if record.number in numbers:
            raise ValueError(
                f"asset types '{numbers[record.number]}' and '{record.type}' have the same "
                f"number {record.number}: give the new one the next free number"
            )
        out[record.type], numbers[record.number] = record, record.type
    return out


ASSET_TYPES: Mapping[str, AssetType] = by_name((*OBSTACLES, *FURNITURE))
"""All asset types by name: `OBSTACLES` and `FURNITURE` joined. A new type is a row
in one of those two."""
