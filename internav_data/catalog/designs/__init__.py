"""Designs: how each type of thing looks. One function a type draws on a sketch pad.

A design gets the sketch, width, depth and height in metres and dice for its choices; `fitted`
stretches the drawing to the asked size, so that a design may be a little off.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

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
    from collections.abc import Callable, Mapping

    from internav_data.catalog.sampling import UniformSampler
    from internav_data.catalog.shapes import Sketch

    Design = Callable[[Sketch, float, float, float, UniformSampler], None]

DESIGNS: Mapping[str, Design] = {
    "ArmChair": seating.arm_chair,
    "DogBed": soft.dog_bed,
    "Box": small.box,
    "Chair": seating.chair,
    "Desk": tables.desk,
    "DiningTable": tables.dining_table,
    "SideTable": tables.side_table,
    "Sofa": seating.sofa,
    "Stool": seating.stool,
    "Television": machines.television,
    "Pillow": soft.pillow,
    "Bread": food.bread,
    "Apple": food.apple,
    "AlarmClock": small.alarm_clock,
    "Lettuce": food.lettuce,
    "GarbageCan": small.garbage_can,
    "Laptop": small.laptop,
    "Microwave": machines.microwave,
    "Pot": small.pot,
    "Tomato": food.tomato,
    "Bed": soft.bed,
    "CoffeeTable": tables.coffee_table,
    "Dresser": storage.dresser,
    "TVStand": storage.tv_stand,
    "ShelvingUnit": storage.shelving_unit,
    "Bookcase": storage.bookcase,
    "Wardrobe": storage.wardrobe,
    "Nightstand": storage.nightstand,
    "Fridge": machines.fridge,
    "CounterTop": rooms.counter_top,
    "Stove": machines.stove,
    "Dishwasher": machines.dishwasher,
    "KitchenIsland": rooms.kitchen_island,
    "Sink": rooms.sink,
    "Toilet": rooms.toilet,
    "Bathtub": rooms.bathtub,
    "Shower": rooms.shower,
    "FloorLamp": machines.floor_lamp,
    "HousePlant": rooms.house_plant,
    "LaundryHamper": rooms.laundry_hamper,
    "WashingMachine": machines.washing_machine,
    "ClothesDryer": machines.clothes_dryer,
    "Ottoman": seating.ottoman,
    "Safe": storage.safe,
    "OfficeChair": seating.office_chair,
    "FilingCabinet": storage.filing_cabinet,
    "CoatRack": storage.coat_rack,
    "ShoeCabinet": storage.shoe_cabinet,
    "Rug": rooms.rug,
    "Painting": rooms.painting,
    "Mirror": rooms.mirror,
    "Piano": storage.piano,
    "Bench": seating.bench,
    "StorageRack": storage.storage_rack,
    "Crate": storage.crate,
    "VanityTable": tables.vanity_table,
}
