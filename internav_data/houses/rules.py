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

Prefer = Literal["corner", "centre", "sun", "any", "open"]


@dataclass(frozen=True, slots=True)
class Rule:
    """One group that a type of room may have."""

    make: Callable[[Picker, RoomContext], list[Group]]
    prefer: Prefer = "any"
    """Where along the walls; `open` stands free."""
    share: float = 1.0
    """How often, at furnishing 1; 1.0 and above: always, whatever the furnishing."""
    per_m2: float = 0.0
    """How many more for each square metre."""
    least_m2: float = 0.0
    """Rooms smaller than this go without."""
    without: str = ""
    """Only in houses that lack this type of room."""
    lacking: str = ""
    """Only while the room has no thing of this type."""


_PICTURES = Rule(g.painting, "centre", 0.7, 0.03)
_PLANT = Rule(g.plant, "corner", 0.5, 0.015)
_LAMP = Rule(g.floor_lamp, "corner", 0.5)
_RUG = Rule(g.rug, "open", 0.4)

RULES: Mapping[str, tuple[Rule, ...]] = {
    "bedroom": (
        Rule(g.bed, "centre", 1.0),
        Rule(g.wardrobe, "corner", 1.0),
        Rule(g.dresser, "any", 0.6),
        Rule(g.desk, "sun", 0.45, least_m2=10.0),
        Rule(g.vanity, "sun", 0.3, least_m2=12.0),
        Rule(s.television, "any", 0.2, least_m2=16.0),
        Rule(g.shelf, "corner", 0.3, 0.01),
        Rule(g.armchair, "corner", 0.35, least_m2=14.0),
        Rule(g.hamper, "corner", 0.3),
        Rule(g.bench, "any", 0.25, least_m2=12.0),
        _LAMP,
        _PLANT,
        Rule(g.wall_mirror, "any", 0.3),
        _PICTURES,
        _RUG,
    ),
    "living": (
        Rule(s.seating, "centre", 1.0),
        Rule(s.sofa_alone, "centre", 1.0, lacking="Sofa"),
        Rule(k.kitchen_run, "corner", 1.0, without="kitchen", least_m2=14.0),
        Rule(g.fridge, "corner", 1.0, without="kitchen", lacking="Fridge", least_m2=14.0),
        Rule(s.dining, "open", 1.0, without="dining", least_m2=20.0),
        Rule(g.shelf, "corner", 0.8, 0.02),
        Rule(g.armchair, "corner", 0.6, 0.01),
        Rule(g.side_table, "any", 0.5, 0.01),
        Rule(g.dresser, "any", 0.3),
        Rule(g.piano, "any", 0.12, least_m2=24.0),
        Rule(g.desk, "sun", 0.2, without="office", least_m2=26.0),
        Rule(g.dog_bed, "corner", 0.2),
        Rule(g.stool, "any", 0.2),
        _LAMP,
        _PLANT,
        _PICTURES,
        Rule(g.rug, "open", 0.2),
    ),
    "kitchen": (
        Rule(k.kitchen_run, "corner", 1.0),
        Rule(k.short_run, "corner", 1.0, lacking="Stove"),
        Rule(g.fridge, "corner", 1.0, lacking="Fridge"),
        Rule(k.counter, "corner", 0.5, 0.015),
        Rule(s.dining, "open", 1.0, without="dining", least_m2=11.0),
        Rule(k.island, "open", 0.35, least_m2=20.0),
        Rule(g.bin_, "corner", 0.8),
        Rule(g.shelf, "corner", 0.3, 0.01),
        Rule(g.side_table, "any", 0.2, least_m2=14.0),
        Rule(g.stool, "any", 0.2, least_m2=9.0),
        _PLANT,
        _PICTURES,
    ),
    "dining": (
        Rule(s.dining, "open", 1.0),
        Rule(g.dresser, "centre", 0.8),
        Rule(g.shelf, "corner", 0.4, 0.01),
        Rule(g.side_table, "any", 0.4),
        Rule(g.armchair, "corner", 0.2, least_m2=16.0),
        _LAMP,
        _PLANT,
        _PICTURES,
    ),
    "bathroom": (
        Rule(g.tub, "corner", 0.7, least_m2=6.0),
        Rule(g.shower, "corner", 1.0, lacking="Bathtub"),
        Rule(g.toilet, "corner", 1.0),
        Rule(g.washbasin, "corner", 1.0),
        Rule(g.shower, "corner", 0.3, least_m2=9.0),
        Rule(g.hamper, "corner", 0.5, least_m2=4.0),
        Rule(g.laundry, "corner", 0.4, without="laundry", least_m2=7.0),
        Rule(g.shelf, "corner", 0.5, least_m2=7.0),
        Rule(g.bench, "any", 0.3, least_m2=9.0),
        Rule(g.bin_, "corner", 0.4, least_m2=4.0),
        Rule(g.stool, "any", 0.2, least_m2=6.0),
        Rule(g.plant, "corner", 0.2, least_m2=6.0),
        Rule(g.rug, "open", 0.4, least_m2=4.0),
    ),
    "hall": (
        Rule(g.coat_rack, "corner", 0.9),
        Rule(g.shoe_cabinet, "any", 0.8),
        Rule(g.bench, "any", 0.3, least_m2=8.0),
        Rule(g.side_table, "any", 0.4, least_m2=8.0),
        _PLANT,
        Rule(g.wall_mirror, "any", 0.4),
        _PICTURES,
        Rule(g.rug, "open", 0.5),
    ),
    "office": (
        Rule(g.desk, "sun", 1.0),
        Rule(g.shelf, "corner", 0.9, 0.03),
        Rule(g.cabinet, "any", 0.7),
        Rule(g.armchair, "corner", 0.5, least_m2=10.0),
        Rule(s.sofa_alone, "centre", 0.3, least_m2=13.0),
        Rule(g.side_table, "any", 0.3),
        Rule(g.safe, "corner", 0.25),
        Rule(g.bin_, "corner", 0.6),
        Rule(g.box, "corner", 0.3),
        _LAMP,
        _PLANT,
        _PICTURES,
        _RUG,
    ),
    "laundry": (
        Rule(g.laundry, "corner", 1.0),
        Rule(k.sink_alone, "any", 0.6, least_m2=4.0),
        Rule(g.hamper, "corner", 0.9),
        Rule(g.storage_rack, "corner", 0.6, least_m2=4.0),
        Rule(k.counter, "any", 0.4, least_m2=8.0),
        Rule(g.bin_, "corner", 0.4),
        Rule(g.box, "corner", 0.4),
    ),
    "storage": (
        Rule(g.storage_rack, "corner", 1.0, 0.06),
        Rule(g.shelf, "corner", 0.5, 0.03),
        Rule(g.box, "corner", 0.9, 0.12),
        Rule(g.safe, "corner", 0.3),
        Rule(g.stool, "any", 0.3),
    ),
    "studio": (
        Rule(g.bed, "centre", 1.0),
        Rule(k.kitchen_run, "corner", 1.0),
        Rule(k.short_run, "corner", 1.0, lacking="Stove"),
        Rule(g.fridge, "corner", 1.0, lacking="Fridge"),
        Rule(s.seating, "centre", 1.0, least_m2=22.0),
        Rule(s.sofa_alone, "centre", 1.0, lacking="Sofa"),
        Rule(g.wardrobe, "corner", 1.0),
        Rule(s.dining, "open", 0.8),
        Rule(g.desk, "sun", 0.4),
        Rule(g.shelf, "corner", 0.5, 0.01),
        Rule(g.armchair, "corner", 0.3),
        Rule(g.bin_, "corner", 0.5),
        Rule(g.side_table, "any", 0.3),
        _LAMP,
        _PLANT,
        _PICTURES,
        _RUG,
    ),
}
