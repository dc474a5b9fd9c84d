"""Furniture groups by the names that `ROOM_TYPES` uses."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.houses import groups, kitchens, sitting

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from internav_data.houses.groups import RoomContext
    from internav_data.houses.pieces import Group, Picker

    GroupMaker = Callable[[Picker, RoomContext], list[Group]]

GROUP_MAKERS: Mapping[str, GroupMaker] = {
    "armchair": groups.armchair,
    "bed": groups.bed,
    "bench": groups.bench,
    "bin": groups.bin_,
    "bookshelf": groups.bookshelf,
    "box": groups.box,
    "cabinet": groups.cabinet,
    "coat_rack": groups.coat_rack,
    "counter": kitchens.counter,
    "desk": groups.desk,
    "dining": sitting.dining,
    "dog_bed": groups.dog_bed,
    "dresser": groups.dresser,
    "floor_lamp": groups.floor_lamp,
    "fridge": groups.fridge,
    "hamper": groups.hamper,
    "island": kitchens.island,
    "kitchen_run": kitchens.kitchen_run,
    "laundry": groups.laundry,
    "painting": groups.painting,
    "piano": groups.piano,
    "plant": groups.plant,
    "rug": groups.rug,
    "safe": groups.safe,
    "seating": sitting.seating,
    "shoe_cabinet": groups.shoe_cabinet,
    "short_run": kitchens.short_run,
    "shower": groups.shower,
    "side_table": groups.side_table,
    "sink_alone": kitchens.sink_alone,
    "sofa_alone": sitting.sofa_alone,
    "stool": groups.stool,
    "storage_rack": groups.storage_rack,
    "television": sitting.television,
    "toilet": groups.toilet,
    "tub": groups.tub,
    "vanity": groups.vanity,
    "wall_mirror": groups.wall_mirror,
    "wardrobe": groups.wardrobe,
    "washbasin": groups.washbasin,
}
"""Function of each furniture group: it returns the group's variants, the preferred one first."""
