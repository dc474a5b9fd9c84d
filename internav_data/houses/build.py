"""Houses by stages over a draft: rooms, floor plan, doors, windows, furniture, materials.

`build_house(seed, scene, config, catalogue)` runs `STAGES` over a `HouseDraft` and writes the
record: each stage is one function of the draft, with random numbers of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from internav_data.catalog.attributes import DRAWS
from internav_data.core.arithmetic import plain_sum
from internav_data.geometry import round_m
from internav_data.houses.choice import choose_floor_plan
from internav_data.houses.furniture import furnish
from internav_data.houses.materials import draw_materials
from internav_data.houses.openings import draw_doors, draw_windows
from internav_data.houses.plan_file import load_floor_plan
from internav_data.houses.programme import programme
from internav_data.houses.standards import CEILING_CM
from internav_data.houses.walls import build_walls
from internav_data.records import Door, FloorPlanStream, House, Purpose, Room, SceneKey, Window
from internav_data.records.splits import split_of_scene

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from internav_data.catalog import Catalogue
    from internav_data.catalog.attributes import HiddenAttributes
    from internav_data.houses.config import HouseConfig
    from internav_data.houses.plan import Corner, FloorPlan, Opening
    from internav_data.houses.programme import RoomSpec
    from internav_data.records import Material, SceneObject, Vec2


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


def _ceiling_cm(key: SceneKey) -> int:
    """Draw the ceiling height of a house: mostly 2.5 to 2.8 m."""
    rng = key.generator(Purpose.FLOOR_PLAN, draw=FloorPlanStream.CEILING)
    low, high = CEILING_CM
    draw = float(rng.random())
    return 5 * round((low + (high - low) * draw * draw) / 5)


@dataclass(slots=True)
class HouseDraft:
    """A house while it is built: each of `STAGES` sets the fields that the later ones read."""

    key: SceneKey
    config: HouseConfig
    catalogue: Catalogue
    hidden: HiddenAttributes | None = None
    """Distribution of the furniture's attributes; None where their look tells them."""
    rooms: tuple[RoomSpec, ...] = field(init=False, repr=False)
    """Set by `draw_rooms`: types, areas and standards; empty for a user's floor plan."""
    plan: FloorPlan = field(init=False, repr=False)
    """Set by `draw_plan`."""
    ceiling_cm: int = field(init=False, repr=False)
    """Set by `draw_plan`."""
    doors: tuple[Opening, ...] = field(init=False, repr=False)
    """Set by `place_doors`."""
    windows: tuple[Opening, ...] = field(init=False, repr=False)
    """Set by `place_windows`."""
    objects: tuple[SceneObject, ...] = field(init=False, repr=False)
    """Set by `place_furniture`, and by `draw_attributes` anew."""
    surfaces: Sequence[tuple[str, str]] = field(init=False, repr=False)
    """Set by `choose_materials`: materials of floor and walls by room."""
    materials: tuple[Material, ...] = field(init=False, repr=False)
    """Set by `choose_materials`."""


def draw_rooms(draft: HouseDraft) -> None:
    """Choose the rooms' types and wanted areas, unless the user gave a floor plan."""
    user_plan = draft.config.floor_plan is not None
    draft.rooms = () if user_plan else programme(draft.key, draft.config)


def draw_plan(draft: HouseDraft) -> None:
    """Lay out the rooms and decide which of them doors join; draw the ceiling's height."""
    path = draft.config.floor_plan
    draft.plan = (
        choose_floor_plan(draft.key, draft.config, draft.rooms)
        if path is None
        else load_floor_plan(path)
    )
    draft.ceiling_cm = draft.plan.ceiling_cm or _ceiling_cm(draft.key)


def place_doors(draft: HouseDraft) -> None:
    """Place the doors of the plan, those of loops and the entrance; or the user's doors."""
    draft.doors = (
        tuple(draw_doors(draft.key, draft.config, draft.plan))
        if draft.config.floor_plan is None
        else draft.plan.doors
    )


def place_windows(draft: HouseDraft) -> None:
    """Place windows in the outer walls beside the doors; or the user's windows."""
    draft.windows = draft.plan.windows or ()
    if draft.plan.windows is None and draft.config.windows:
        drawn = draw_windows(draft.key, draft.plan, draft.doors, draft.ceiling_cm)
        draft.windows = tuple(drawn)


def place_furniture(draft: HouseDraft) -> None:
    """Furnish room by room, clear of doors and windows."""
    draft.objects = furnish(
        draft.key,
        draft.plan,
        (*draft.doors, *draft.windows),
        draft.ceiling_cm / 100.0,
        draft.config.furnishing,
        draft.config.clutter,
        draft.catalogue,
    )


def draw_attributes(draft: HouseDraft) -> None:
    """Draw the attributes of each piece of furniture, where they are hidden."""
    hidden = draft.hidden
    if hidden is None:
        return
    # A row for each object, whatever its asset is.
    rows = draft.key.generator(Purpose.FURNITURE_ATTRIBUTES).random((len(draft.objects), DRAWS))
    objects = []
    for placed, row in zip(draft.objects, rows.tolist(), strict=True):
        asset = draft.catalogue.assets[placed.asset_id]
        dynamics = hidden.dynamics(asset, row)
        own = None if dynamics == asset.dynamics else dynamics
        objects.append(replace(placed, dynamics=own, affordance=hidden.affordance(asset)))
    draft.objects = tuple(objects)


def choose_materials(draft: HouseDraft) -> None:
    """Draw the materials of floors and walls."""
    draft.surfaces, draft.materials = draw_materials(draft.key, draft.plan.types)


STAGES: tuple[Callable[[HouseDraft], None], ...] = (
    draw_rooms,
    draw_plan,
    place_doors,
    place_windows,
    place_furniture,
    draw_attributes,
    choose_materials,
)
"""Stages of a draft, in order. Each has random numbers of its own: a stage that draws more or
fewer of them changes no other."""


def build_house(
    seed: int,
    scene: int,
    config: HouseConfig,
    catalogue: Catalogue,
    attempt: int = 0,
    *,
    hidden: HiddenAttributes | None = None,
) -> House:
    """Build one house: a pure function of its arguments.

    Raises
    ------
    UsageError
        The configuration is out of its bounds, or its parts contradict each other.
    QuarantineError
        When no floor plan keeps the standards.
    """
    config.check()
    draft = HouseDraft(SceneKey(seed, scene, attempt), config, catalogue, hidden)
    for stage in STAGES:
        stage(draft)
    return _finished(draft)


def _finished(draft: HouseDraft) -> House:
    """Turn a draft on centimetres into the record in metres, with its walls."""
    plan, grid = draft.plan, draft.plan.grid
    count = len(plan.types)
    used = sorted({item.asset_id for item in draft.objects})
    return House(
        scene_id=f"scene-{draft.key.scene:06d}",
        scene=draft.key.scene,
        seed=draft.key.seed,
        split=split_of_scene(draft.key.scene),
        preset=draft.config.preset,
        outline=_metres(grid.polygon(frozenset(range(count)))),
        rooms=_rooms(plan, draft.surfaces, draft.ceiling_cm),
        doors=tuple(_door(k, o) for k, o in enumerate(draft.doors)),
        windows=tuple(_window(k, o) for k, o in enumerate(draft.windows)),
        walls=build_walls(grid, (*draft.doors, *draft.windows), draft.ceiling_cm),
        objects=draft.objects,
        materials=draft.materials,
        room_graph=tuple(sorted({o.rooms for o in draft.doors if o.open})),
        area_m2=round_m(plain_sum(grid.area_cm2(room) for room in range(count)) / 1e4),
        assets={asset_id: draft.catalogue.assets[asset_id] for asset_id in used},
    )
