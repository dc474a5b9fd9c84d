"""What stands in which room: one table, in the order in which people would carry it in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from internav_data.houses import groups as g
from internav_data.houses import kitchens as k
from internav_data.houses import sitting as s

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from internav_data.houses.groups import RoomContext
    from internav_data.houses.pieces import Group, Picker

Placement = Literal["corner", "centre", "sun", "any", "open"]


@dataclass(frozen=True, slots=True)
class FurnitureRule:
    """One group that a type of room may have."""

    make: Callable[[Picker, RoomContext], list[Group]]
    prefer: Placement = "any"
    """Where along the walls; `open` stands free."""
    share: float = 1.0
    """How often, at furnishing 1; 1.0 and above: always, whatever the furnishing."""
    per_m2: float = 0.0
    """How many more for each square metre."""
    min_m2: float = 0.0
    """Rooms smaller than this go without."""
    without: str = ""
    """Only in houses that lack this type of room."""
    lacking: str = ""
    """Only while the room has no thing of this type."""


_PICTURES = FurnitureRule(g.painting, "centre", 0.7, 0.03)
_PLANT = FurnitureRule(g.plant, "corner", 0.5, 0.015)
_LAMP = FurnitureRule(g.floor_lamp, "corner", 0.5)
_RUG = FurnitureRule(g.rug, "open", 0.4)

RULES: Mapping[str, tuple[FurnitureRule, ...]] = {
    "bedroom": (
        FurnitureRule(g.bed, "centre", 1.0),
        FurnitureRule(g.wardrobe, "corner", 1.0),
        FurnitureRule(g.dresser, "any", 0.6),
        FurnitureRule(g.desk, "sun", 0.45, min_m2=10.0),
        FurnitureRule(g.vanity, "sun", 0.3, min_m2=12.0),
        FurnitureRule(s.television, "any", 0.2, min_m2=16.0),
        FurnitureRule(g.bookshelf, "corner", 0.3, 0.01),
        FurnitureRule(g.armchair, "corner", 0.35, min_m2=14.0),
        FurnitureRule(g.hamper, "corner", 0.3),
        FurnitureRule(g.bench, "any", 0.25, min_m2=12.0),
        _LAMP,
        _PLANT,
        FurnitureRule(g.wall_mirror, "any", 0.3),
        _PICTURES,
        _RUG,
    ),
    "living": (
        FurnitureRule(s.seating, "centre", 1.0),
        FurnitureRule(s.sofa_alone, "centre", 1.0, lacking="Sofa"),
        FurnitureRule(k.kitchen_run, "corner", 1.0, without="kitchen", min_m2=14.0),
        FurnitureRule(g.fridge, "corner", 1.0, without="kitchen", lacking="Fridge", min_m2=14.0),
        FurnitureRule(s.dining, "open", 1.0, without="dining", min_m2=20.0),
        FurnitureRule(g.bookshelf, "corner", 0.8, 0.02),
        FurnitureRule(g.armchair, "corner", 0.6, 0.01),
        FurnitureRule(g.side_table, "any", 0.5, 0.01),
        FurnitureRule(g.dresser, "any", 0.3),
        FurnitureRule(g.piano, "any", 0.12, min_m2=24.0),
        FurnitureRule(g.desk, "sun", 0.2, without="office", min_m2=26.0),
        FurnitureRule(g.dog_bed, "corner", 0.2),
        FurnitureRule(g.stool, "any", 0.2),
        _LAMP,
        _PLANT,
        _PICTURES,
        FurnitureRule(g.rug, "open", 0.2),
    ),
    "kitchen": (
        FurnitureRule(k.kitchen_run, "corner", 1.0),
        FurnitureRule(k.short_run, "corner", 1.0, lacking="Stove"),
        FurnitureRule(g.fridge, "corner", 1.0, lacking="Fridge"),
        FurnitureRule(k.counter, "corner", 0.5, 0.015),
        FurnitureRule(s.dining, "open", 1.0, without="dining", min_m2=11.0),
        FurnitureRule(k.island, "open", 0.35, min_m2=20.0),
        FurnitureRule(g.bin_, "corner", 0.8),
        FurnitureRule(g.bookshelf, "corner", 0.3, 0.01),
        FurnitureRule(g.side_table, "any", 0.2, min_m2=14.0),
        FurnitureRule(g.stool, "any", 0.2, min_m2=9.0),
        _PLANT,
        _PICTURES,
    ),
    "dining": (
        FurnitureRule(s.dining, "open", 1.0),
        FurnitureRule(g.dresser, "centre", 0.8),
        FurnitureRule(g.bookshelf, "corner", 0.4, 0.01),
        FurnitureRule(g.side_table, "any", 0.4),
        FurnitureRule(g.armchair, "corner", 0.2, min_m2=16.0),
        _LAMP,
        _PLANT,
        _PICTURES,
    ),
    "bathroom": (
        FurnitureRule(g.tub, "corner", 0.7, min_m2=6.0),
        FurnitureRule(g.shower, "corner", 1.0, lacking="Bathtub"),
        FurnitureRule(g.toilet, "corner", 1.0),
        FurnitureRule(g.washbasin, "corner", 1.0),
        FurnitureRule(g.shower, "corner", 0.3, min_m2=9.0),
        FurnitureRule(g.hamper, "corner", 0.5, min_m2=4.0),
        FurnitureRule(g.laundry, "corner", 0.4, without="laundry", min_m2=7.0),
        FurnitureRule(g.bookshelf, "corner", 0.5, min_m2=7.0),
        FurnitureRule(g.bench, "any", 0.3, min_m2=9.0),
        FurnitureRule(g.bin_, "corner", 0.4, min_m2=4.0),
        FurnitureRule(g.stool, "any", 0.2, min_m2=6.0),
        FurnitureRule(g.plant, "corner", 0.2, min_m2=6.0),
        FurnitureRule(g.rug, "open", 0.4, min_m2=4.0),
    ),
    "hall": (
        FurnitureRule(g.coat_rack, "corner", 0.9),
        FurnitureRule(g.shoe_cabinet, "any", 0.8),
        FurnitureRule(g.bench, "any", 0.3, min_m2=8.0),
        FurnitureRule(g.side_table, "any", 0.4, min_m2=8.0),
        _PLANT,
        FurnitureRule(g.wall_mirror, "any", 0.4),
        _PICTURES,
        FurnitureRule(g.rug, "open", 0.5),
    ),
    "office": (
        FurnitureRule(g.desk, "sun", 1.0),
        FurnitureRule(g.bookshelf, "corner", 0.9, 0.03),
        FurnitureRule(g.cabinet, "any", 0.7),
        FurnitureRule(g.armchair, "corner", 0.5, min_m2=10.0),
        FurnitureRule(s.sofa_alone, "centre", 0.3, min_m2=13.0),
        FurnitureRule(g.side_table, "any", 0.3),
        FurnitureRule(g.safe, "corner", 0.25),
        FurnitureRule(g.bin_, "corner", 0.6),
        FurnitureRule(g.box, "corner", 0.3),
        _LAMP,
        _PLANT,
        _PICTURES,
        _RUG,
    ),
    "laundry": (
        FurnitureRule(g.laundry, "corner", 1.0),
        FurnitureRule(k.sink_alone, "any", 0.6, min_m2=4.0),
        FurnitureRule(g.hamper, "corner", 0.9),
        FurnitureRule(g.storage_rack, "corner", 0.6, min_m2=4.0),
        FurnitureRule(k.counter, "any", 0.4, min_m2=8.0),
        FurnitureRule(g.bin_, "corner", 0.4),
        FurnitureRule(g.box, "corner", 0.4),
    ),
    "storage": (
        FurnitureRule(g.storage_rack, "corner", 1.0, 0.06),
        FurnitureRule(g.bookshelf, "corner", 0.5, 0.03),
        FurnitureRule(g.box, "corner", 0.9, 0.12),
        FurnitureRule(g.safe, "corner", 0.3),
        FurnitureRule(g.stool, "any", 0.3),
    ),
    "studio": (
        FurnitureRule(g.bed, "centre", 1.0),
        FurnitureRule(k.kitchen_run, "corner", 1.0),
        FurnitureRule(k.short_run, "corner", 1.0, lacking="Stove"),
        FurnitureRule(g.fridge, "corner", 1.0, lacking="Fridge"),
        FurnitureRule(s.seating, "centre", 1.0, min_m2=22.0),
        FurnitureRule(s.sofa_alone, "centre", 1.0, lacking="Sofa"),
        FurnitureRule(g.wardrobe, "corner", 1.0),
        FurnitureRule(s.dining, "open", 0.8),
        FurnitureRule(g.desk, "sun", 0.4),
        FurnitureRule(g.bookshelf, "corner", 0.5, 0.01),
        FurnitureRule(g.armchair, "corner", 0.3),
        FurnitureRule(g.bin_, "corner", 0.5),
        FurnitureRule(g.side_table, "any", 0.3),
        _LAMP,
        _PLANT,
        _PICTURES,
        _RUG,
    ),
}
