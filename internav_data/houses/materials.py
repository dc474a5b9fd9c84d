"""Floor and wall materials of a house."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.houses.room_types import ROOM_TYPES
from internav_data.records import Material, Purpose

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.records import RGB, SceneKey

_FLOORS: Mapping[str, tuple[RGB, str]] = {
    "oak planks": (
        (186, 148, 104),
        "planks",
    ),
    "walnut planks": ((126, 90, 64), "planks"),
    "ash planks": ((208, 186, 152), "planks"),
    "pine planks": ((214, 174, 118), "planks"),
    "grey planks": ((158, 152, 144), "planks"),
    "white tiles": ((222, 222, 218), "tiles"),
    "grey tiles": ((168, 172, 174), "tiles"),
    "sand tiles": ((206, 192, 168), "tiles"),
    "slate tiles": ((108, 114, 120), "tiles"),
    "terracotta tiles": ((188, 116, 84), "tiles"),
    "beige carpet": ((202, 188, 166), "carpet"),
    "blue carpet": ((112, 132, 158), "carpet"),
    "green carpet": ((128, 148, 122), "carpet"),
    "concrete": ((176, 176, 172), "plain"),
}
_WALLS: Mapping[str, tuple[RGB, str]] = {
    "white paint": ((238, 236, 230), "plain"),
    "cream paint": ((236, 226, 202), "plain"),
    "pale blue paint": ((202, 216, 226), "plain"),
    "sage paint": ((200, 212, 190), "plain"),
    "blush paint": ((232, 208, 200), "plain"),
    "grey paint": ((208, 208, 206), "plain"),
    "ochre paint": ((224, 194, 138), "plain"),
    "striped paper": ((220, 214, 204), "stripes"),
    "white wall tiles": ((230, 234, 236), "tiles"),
    "aqua wall tiles": ((176, 212, 214), "tiles"),
    "red bricks": ((168, 96, 76), "bricks"),
}


def _names(table: Mapping[str, tuple[RGB, str]], patterns: set[str]) -> list[str]:
    return [name for name, (_, pattern) in table.items() if pattern in patterns]


def draw_materials(
    key: SceneKey, types: Sequence[str]
) -> tuple[list[tuple[str, str]], tuple[Material, ...]]:
    """Return (floor, wall) by room and the materials they name, in order of their names.

    A house has one kind of planks for its dry rooms and one kind of tiles for the others; walls
    share a colour, and single rooms have their own.
    """
    rng = key.generator(Purpose.MATERIALS)

    def one(names: Sequence[str]) -> str:
        return names[int(float(rng.random()) * len(names))]

    dry, wet = one(_names(_FLOORS, {"planks"})), one(_names(_FLOORS, {"tiles"}))
    usual = one(["white paint", "cream paint", "grey paint"])
    chosen: list[tuple[str, str]] = []
    for name in types:
        record = ROOM_TYPES[name]
        floor_draw, wall_draw = float(rng.random()), float(rng.random())
        floor, wall = dry, usual
        own, wall_own = one(_names(_FLOORS, {"carpet"})), one(_names(_WALLS, {"plain", "stripes"}))
        tiles, brick = one(_names(_WALLS, {"tiles"})), "red bricks"
        if record.floor == "tiles":
            floor = wet
        elif record.floor == "carpet" and floor_draw < 0.35:  # noqa: PLR2004 - a third of the bedrooms
            floor = own
        if record.wall == "tiles":
            wall = tiles
        elif wall_draw < 0.35:  # noqa: PLR2004 - a third of the rooms have a colour of their own
            wall = wall_own
        elif record.wall == "bricks" and wall_draw > 0.93:  # noqa: PLR2004 - bricks are rare
            wall = brick
        chosen.append((floor, wall))
    used = sorted({name for names in chosen for name in names})
    table = {**_FLOORS, **_WALLS}
    return chosen, tuple(Material(name, *table[name]) for name in used)
