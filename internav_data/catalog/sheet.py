"""The facts sheet: how many assets of each type there are, how large and how heavy.

Source: the object types of AI2-THOR and ProcTHOR as counted in the project's facts; sizes are
minimum, median, maximum in metres, masses one figure a type.
"""

from __future__ import annotations

from typing import NamedTuple

Range = tuple[float, float, float]
"""Minimum, median, maximum, metres."""


class TypeSheet(NamedTuple):
    """What is known of one type."""

    type: str
    pushable: int
    pickable: int
    fixed: int
    mass_kg: float
    width: Range
    depth: Range
    height: Range
    likeness: float
    """0: width, depth and height are drawn alone, 1: large in one is large in all."""
    blocks: bool = True

    @property
    def assets(self) -> int:
        """How many assets the type has."""
        return self.pushable + self.pickable + self.fixed


# fmt: off
OBSTACLES: tuple[TypeSheet, ...] = (
    TypeSheet("ArmChair", 32, 0, 6, 28.3, (.59, .94, 1.53), (.62, .89, 1.21), (.62, .88, 1.27), .5),
    TypeSheet("DogBed", 3, 0, 0, .98, (.73, .99, 1.18), (.73, .83, 1.18), (.11, .18, .32), .9),
    TypeSheet("Box", 0, 34, 0, .3, (.21, .40, .69), (.21, .41, .55), (.15, .28, .47), .6),
    TypeSheet("Chair", 44, 0, 12, 10., (.36, .48, .65), (.37, .54, .87), (.67, .88, 1.23), .4),
    TypeSheet("Desk", 28, 0, 7, 34., (.83, 1.39, 2.53), (.36, .62, 1.92), (.57, .79, 2.08), .3),
    TypeSheet("DiningTable", 24, 0, 6, 85., (.72, 1.47, 2.81), (.68, .96, 1.61), (.63, .76, 1.06), .5),  # noqa: E501
    TypeSheet("SideTable", 66, 0, 8, 11., (.25, .62, 1.83), (.24, .39, .93), (.39, .66, 1.28), .4),
    TypeSheet("Sofa", 32, 0, 5, 104., (1.55, 2.40, 2.86), (.68, .93, 1.78), (.61, .92, 1.29), .4),
    TypeSheet("Stool", 10, 0, 0, 3.18, (.31, .41, .59), (.23, .32, .46), (.45, .67, .76), .7),
    TypeSheet("Television", 26, 0, 6, 9.83, (.82, 1.14, 1.70), (.07, .31, .56), (.52, .81, 1.21), .8),  # noqa: E501
    TypeSheet("Pillow", 0, 30, 2, .7, (.32, .43, .70), (.17, .35, .58), (.10, .14, .25), .6),
    TypeSheet("Bread", 0, 30, 0, .7, (.12, .16, .28), (.22, .29, .39), (.08, .14, .17), .4),
    TypeSheet("Apple", 1, 30, 0, .2, (.06, .10, .14), (.06, .10, .14), (.08, .12, .15), .95),
    TypeSheet("AlarmClock", 1, 30, 0, .8, (.10, .19, .27), (.05, .09, .20), (.11, .18, .26), .5),
    TypeSheet("Lettuce", 0, 30, 0, .47, (.12, .15, .19), (.20, .24, .27), (.12, .15, .18), .6),
    TypeSheet("GarbageCan", 31, 0, 0, .7, (.37, .45, .68), (.27, .37, .53), (.38, .56, .66), .6),
    TypeSheet("Laptop", 1, 30, 0, 2.3, (.32, .40, .50), (.25, .30, .38), (.26, .29, .39), .9),
    TypeSheet("Microwave", 30, 0, 0, 7., (.61, .61, .70), (.32, .36, .43), (.33, .35, .40), .6),
    TypeSheet("Pot", 0, 30, 0, .57, (.25, .29, .44), (.22, .31, .54), (.12, .16, .25), .5),
    TypeSheet("Tomato", 0, 30, 0, .12, (.09, .12, .15), (.10, .13, .15), (.07, .10, .15), .95),
)

FURNITURE: tuple[TypeSheet, ...] = (
    TypeSheet("Bed", 0, 0, 12, 80., (.92, 1.37, 1.96), (1.65, 2.24, 2.52), (.55, .91, 1.25), .6),
    TypeSheet("CoffeeTable", 0, 0, 10, 22., (.70, 1.13, 1.50), (.50, .66, .90), (.32, .44, .52), .5),  # noqa: E501
    TypeSheet("Dresser", 0, 0, 8, 48., (.76, 1.20, 1.62), (.42, .51, .58), (.74, .97, 1.30), .3),
    TypeSheet("TVStand", 0, 0, 8, 38., (.90, 1.20, 1.90), (.38, .60, .64), (.42, .71, .80), .4),
    TypeSheet("ShelvingUnit", 0, 0, 8, 30., (.60, .91, 1.50), (.28, .34, .42), (.90, 1.44, 2.0), .4),  # noqa: E501
    TypeSheet("Bookcase", 0, 0, 6, 42., (.60, .80, 1.20), (.26, .30, .36), (1.2, 1.90, 2.12), .3),
    TypeSheet("Wardrobe", 0, 0, 6, 95., (.80, 1.20, 1.80), (.54, .60, .64), (1.8, 2.02, 2.2), .3),
    TypeSheet("Nightstand", 0, 0, 6, 14., (.40, .48, .60), (.36, .42, .48), (.48, .58, .68), .5),
    TypeSheet("Fridge", 0, 0, 8, 95., (.60, .91, 1.00), (.65, .72, .80), (1.66, 1.80, 1.88), .7),
    TypeSheet("CounterTop", 0, 0, 12, 90., (.60, 2.00, 3.66), (.61, .61, .61), (.91, .94, .96), .2),
    TypeSheet("Stove", 0, 0, 5, 60., (.60, .66, .76), (.61, .62, .66), (.92, .96, 1.10), .5),
    TypeSheet("Dishwasher", 0, 0, 4, 45., (.45, .60, .60), (.58, .60, .61), (.82, .85, .87), .5),
    TypeSheet("KitchenIsland", 0, 0, 5, 110., (1.2, 1.60, 2.2), (.70, .85, 1.0), (.90, .92, .95), .6),  # noqa: E501
    TypeSheet("Sink", 0, 0, 8, 25., (.46, .66, .95), (.40, .46, .54), (.80, .86, .92), .5),
    TypeSheet("Toilet", 0, 0, 5, 38., (.38, .44, .53), (.66, .72, .92), (.72, .80, .99), .6),
    TypeSheet("Bathtub", 0, 0, 5, 60., (1.5, 1.70, 1.8), (.70, .75, .82), (.50, .55, .62), .6),
    TypeSheet("Shower", 0, 0, 4, 55., (.80, .90, 1.10), (.80, .90, 1.0), (2.0, 2.04, 2.1), .6),
    TypeSheet("FloorLamp", 0, 0, 8, 6., (.28, .52, .70), (.28, .51, .62), (1.4, 1.60, 1.9), .5),
    TypeSheet("HousePlant", 0, 0, 10, 6., (.24, .36, .70), (.24, .39, .70), (.40, .65, 1.5), .9),
    TypeSheet("LaundryHamper", 0, 0, 5, 3., (.40, .55, .60), (.34, .43, .48), (.55, .74, .80), .5),
    TypeSheet("WashingMachine", 0, 0, 4, 70., (.60, .68, .69), (.58, .66, .70), (.85, .95, 1.05), .8),  # noqa: E501
    TypeSheet("ClothesDryer", 0, 0, 4, 45., (.60, .68, .69), (.58, .66, .70), (.85, .95, 1.05), .8),
    TypeSheet("Ottoman", 0, 0, 6, 9., (.45, .85, 1.10), (.42, .52, .70), (.36, .43, .48), .6),
    TypeSheet("Safe", 0, 0, 4, 35., (.35, .40, .50), (.36, .45, .48), (.32, .40, .60), .7),
    TypeSheet("OfficeChair", 0, 0, 6, 14., (.58, .64, .70), (.58, .64, .70), (.88, 1.04, 1.24), .6),
    TypeSheet("FilingCabinet", 0, 0, 5, 32., (.38, .42, .80), (.45, .56, .62), (.60, .72, 1.32), .3),  # noqa: E501
    TypeSheet("CoatRack", 0, 0, 4, 5., (.36, .44, .52), (.36, .44, .52), (1.6, 1.74, 1.85), .6),
    TypeSheet("ShoeCabinet", 0, 0, 5, 20., (.60, .80, 1.10), (.22, .30, .36), (.50, .85, 1.2), .3),
    TypeSheet("Rug", 0, 0, 12, 6., (.60, 1.60, 3.0), (.50, 1.20, 2.2), (.006, .01, .014), .8, blocks=False),  # noqa: E501
    TypeSheet("Painting", 0, 0, 10, 3., (.40, .81, 1.4), (.024, .03, .04), (.36, .62, 1.0), .6),
    TypeSheet("Mirror", 0, 0, 6, 6., (.40, .60, .90), (.02, .026, .04), (.60, .90, 1.3), .4),
    TypeSheet("Piano", 0, 0, 3, 200., (1.4, 1.48, 1.54), (.56, .60, .66), (1.06, 1.16, 1.3), .4),
    TypeSheet("Bench", 0, 0, 6, 14., (.80, 1.10, 1.5), (.32, .38, .46), (.42, .46, .50), .5),
    TypeSheet("StorageRack", 0, 0, 6, 24., (.80, 1.10, 1.6), (.36, .45, .55), (1.4, 1.80, 2.0), .4),
    TypeSheet("Crate", 0, 0, 5, 4., (.34, .46, .60), (.28, .36, .44), (.22, .30, .40), .6),
    TypeSheet("VanityTable", 0, 0, 4, 26., (.80, 1.0, 1.2), (.40, .45, .50), (1.2, 1.36, 1.5), .4),
)
# fmt: on

SHEETS: dict[str, TypeSheet] = {sheet.type: sheet for sheet in (*OBSTACLES, *FURNITURE)}
"""Every type in a fixed order: random numbers depend on the place, so append only."""
