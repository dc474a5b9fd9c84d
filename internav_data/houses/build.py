"""From a seed to a house."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.geometry import round_m
from internav_data.houses.choice import choose_floor_plan
from internav_data.houses.furniture import furnish
from internav_data.houses.materials import draw_materials
from internav_data.houses.openings import draw_doors, draw_windows
from internav_data.houses.plan_file import load_floor_plan
from internav_data.houses.programme import programme
from internav_data.houses.standards import CEILING_CM
from internav_data.houses.walls import build_walls
from internav_data.records import Door, FloorPlanStream, House, Purpose, Room, Window, generator
from internav_data.records.splits import split_of_scene

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.catalog import Catalogue
    from internav_data.houses.config import HouseConfig
    from internav_data.houses.plan import Corner, FloorPlan, Opening
    from internav_data.records import Vec2


def _metres(corners: Sequence[Corner]) -> tuple[Vec2, ...]:
    return tuple((round_m(x / 100.0), round_m(y / 100.0)) for x, y in corners)


def _centre(opening: Opening) -> tuple[float, float, float]:
    middle, line = round_m((opening.low + opening.high) / 200.0), round_m(opening.at / 100.0)
    return (middle, line, 0.0) if opening.along_x else (line, middle, 90.0)


def _door(number: int, opening: Opening) -> Door:
    x, y, yaw = _centre(opening)
    if opening.kind is None:
        msg = "a window is no door"
        raise TypeError(msg)
    return Door(
        door_id=number,
        rooms=opening.rooms,
        kind=opening.kind,
        x=x,
        y=y,
        yaw_deg=yaw,
        width_m=round_m((opening.high - opening.low) / 100.0),
        height_m=round_m(opening.top / 100.0),
        open=opening.open,
    )


def _window(number: int, opening: Opening) -> Window:
    x, y, yaw = _centre(opening)
    return Window(
        window_id=number,
        room=opening.rooms[1],
        x=x,
        y=y,
        yaw_deg=yaw,
        width_m=round_m((opening.high - opening.low) / 100.0),
        height_m=round_m((opening.top - opening.bottom) / 100.0),
        sill_m=round_m(opening.bottom / 100.0),
    )


def _rooms(
    floor_plan: FloorPlan, surfaces: Sequence[tuple[str, str]], ceiling_cm: int
) -> tuple[Room, ...]:
    return tuple(
        Room(
            room_id=room,
            type=name,
            polygon=_metres(floor_plan.grid.polygon(frozenset({room}))),
            area_m2=round_m(floor_plan.grid.area_cm2(room) / 1e4),
            ceiling_m=round_m(ceiling_cm / 100.0),
            floor_material=surfaces[room][0],
            wall_material=surfaces[room][1],
        )
        for room, name in enumerate(floor_plan.types)
    )


def _ceiling_cm(seed: int, scene: int, attempt: int) -> int:
    """Draw a height for the whole house: mostly 2.5 to 2.8 m."""
    rng = generator(seed, Purpose.FLOOR_PLAN, scene, attempt, draw=FloorPlanStream.CEILING)
    low, high = CEILING_CM
    draw = float(rng.random())
    return 5 * round((low + (high - low) * draw * draw) / 5)


def build_house(
    seed: int, scene: int, config: HouseConfig, catalogue: Catalogue, attempt: int = 0
) -> House:
    """Build one house: a pure function of its arguments.

    Raises
    ------
    UsageError
        For a configuration that cannot be meant.

    """
    if config.floor_plan is not None:
        config.check()
        floor_plan = load_floor_plan(config.floor_plan)
    else:
        specs = programme(seed, scene, config, attempt)
        floor_plan = choose_floor_plan(seed, scene, config, specs, attempt)
    ceiling_cm = floor_plan.ceiling_cm or _ceiling_cm(seed, scene, attempt)
    doors = list(floor_plan.doors)
    if config.floor_plan is None:
        doors = draw_doors(floor_plan, config, seed, scene, attempt)
    windows = list(floor_plan.windows or ())
    if floor_plan.windows is None and config.windows:
        windows = draw_windows(floor_plan, doors, ceiling_cm, seed, scene, attempt)
    return _assembled(
        floor_plan, doors, windows, ceiling_cm, (seed, scene, attempt), config, catalogue
    )


def _assembled(
    floor_plan: FloorPlan,
    doors: Sequence[Opening],
    windows: Sequence[Opening],
    ceiling_cm: int,
    key: tuple[int, int, int],
    config: HouseConfig,
    catalogue: Catalogue,
) -> House:
    seed, scene, attempt = key
    grid, types = floor_plan.grid, floor_plan.types
    openings = [*doors, *windows]
    surfaces, materials = draw_materials(types, seed, scene, attempt)
    things = furnish(
        grid,
        types,
        openings,
        ceiling_cm / 100.0,
        config.furnishing,
        catalogue,
        seed,
        scene,
        attempt,
    )
    used = sorted({thing.asset_id for thing in things})
    return House(
        scene_id=f"scene-{scene:06d}",
        scene=scene,
        seed=seed,
        split=split_of_scene(scene),
        preset=config.preset,
        outline=_metres(grid.polygon(frozenset(range(len(types))))),
        rooms=_rooms(floor_plan, surfaces, ceiling_cm),
        doors=tuple(_door(k, o) for k, o in enumerate(doors)),
        windows=tuple(_window(k, o) for k, o in enumerate(windows)),
        walls=build_walls(grid, openings, ceiling_cm),
        objects=things,
        materials=materials,
        room_graph=tuple(sorted({o.rooms for o in doors if o.open})),
        area_m2=round_m(sum(grid.area_cm2(room) for room in range(len(types))) / 1e4),
        assets={asset_id: catalogue.assets[asset_id] for asset_id in used},
    )
