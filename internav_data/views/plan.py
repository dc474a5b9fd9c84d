"""Houses from above, as `internav-gen show` draws them after the paper's figure 4."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np

from internav_data.geometry import HIGHEST_M
from internav_data.views.canvas import OVERSAMPLING, Canvas
from internav_data.views.captions import with_caption
from internav_data.views.floors import paint_floor
from internav_data.views.silhouettes import paint, silhouettes

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from internav_data.core.typing import Floats, Image
    from internav_data.records import RGB, Door, House, Room, Vec2, Wall, Window

PAPER: RGB = (250, 249, 246)
INK: RGB = (52, 54, 62)
TINT: RGB = (58, 128, 246)
_WALL: RGB = (66, 68, 78)
_BREAST: RGB = (126, 130, 140)
_THRESHOLD: RGB = (222, 205, 178)
_PANE: RGB = (176, 216, 240)
_ENTRANCE: RGB = (176, 62, 48)
_LABEL: RGB = (70, 66, 62)
_MARGIN_M = 0.75
_SCALE_PX = 8.0
"""Height of the scale's letters, pixels."""
_WALL_M = 0.12
_RUG_M = 0.05
_SCALE_HIGH_M, _SCALE_TEXT_M = 0.09, 2.12
_BESIDE_M = 0.1
_OVERHEAD_M = 1.95
"""Height above which a hanging object is left out: it would hide those below."""


def draw_house(house: House, *, pixels: int = 900, caption: bool = True) -> Image:
    """Draw a house from above, north (y) up.

    Parameters
    ----------
    house
        The house; `house.assets` holds the assets of its objects.
    pixels
        Longer side of the plan; the caption is added below it.
    caption
        Whether to add a line that names the house.

    Returns
    -------
    (h, w, 3) uint8 RGB.
    """
    canvas = house_canvas(house, pixels)
    paint_house(canvas, house)
    paint_labels(canvas, house, taken=[])
    if not caption:
        return canvas.finished()
    return with_caption(canvas.finished(), [house_line(house)], [])


def house_line(house: House) -> str:
    """Return the caption of a house's picture, one line."""
    count = len(house.rooms)
    rooms = "1 room" if count == 1 else f"{count} rooms"
    parts = [house.scene_id, rooms, f"{house.area_m2:.0f} m2", f"{len(house.objects)} objects"]
    return "   ".join([*parts, house.split, house.preset])


def house_canvas(house: House, pixels: int) -> Canvas:
    """Return an empty canvas around a house."""
    return Canvas(*map_corners(house), pixels, PAPER)


def map_corners(house: House) -> tuple[Vec2, Vec2]:
    """Return the lower left and the upper right corner of a house's picture, metres."""
    xs, ys = [p[0] for p in house.outline], [p[1] for p in house.outline]
    low = (min(xs) - _MARGIN_M, min(ys) - _MARGIN_M)
    return low, (max(xs) + _MARGIN_M, max(ys) + _MARGIN_M)


def paint_house(
    canvas: Canvas,
    house: House,
    on_path: Collection[int] | None = None,
    *,
    scale_at: Vec2 | None = None,
    letter_px: float = _SCALE_PX,
) -> None:
    """Paint floors, shadows, objects, walls, windows and doors, in this order; then a scale.

    With `on_path`, these rooms are tinted and the other rooms' floors pale. The scale's lower left
    corner is outside the house, clear of the entrance's arrow, or at
    `scale_at`; its letters are `letter_px` high.
    """
    for room in house.rooms:
        paint_floor(canvas, house, room)
    for room in house.rooms:
        if on_path is not None:
            colour, strength = (TINT, 0.13) if room.room_id in on_path else (PAPER, 0.55)
            canvas.blend(canvas.mask([room.polygon]), colour, strength)
    seen = [
        outline
        for object_ in house.objects
        for outline in silhouettes(house.assets[object_.asset_id], object_.pose)
        if outline.low_m < _OVERHEAD_M
    ]
    solid = [_rectangle(w) for w in house.walls if w.z_min < HIGHEST_M and w.z_max > HIGHEST_M]
    _shadow(canvas, solid, 0.09, 0.34)
    _shadow(canvas, [o.plan for o in seen if o.top_m > _RUG_M], 0.05, 0.30)
    paint(canvas, seen, line_px=1.0, colour=None)
    for wall in house.walls:
        if wall.z_min < HIGHEST_M and wall.z_max <= HIGHEST_M:
            canvas.fill(_rectangle(wall), _BREAST)
    for rectangle in solid:
        canvas.fill(rectangle, _WALL)
    for door in house.doors:
        _paint_door(canvas, house, door)
    for window in house.windows:
        _paint_window(canvas, window)
    _paint_scale(canvas, scale_at or _scale_place(canvas, house, letter_px), letter_px)


def _rectangle(wall: Wall) -> list[Vec2]:
    return [
        (wall.x_min, wall.y_min),
        (wall.x_max, wall.y_min),
        (wall.x_max, wall.y_max),
        (wall.x_min, wall.y_max),
    ]


def _shadow(
    canvas: Canvas, shapes: Sequence[Sequence[Vec2] | Floats], reach: float, strength: float
) -> None:
    """Darken the floor around shapes, softly, as light from the upper left would leave it."""
    if not shapes:
        return
    moved = [np.asarray(s) + np.array([reach * 0.5, -reach * 0.5]) for s in shapes]
    width = max(1.0, reach * canvas.scale * OVERSAMPLING)
    mask = cv2.GaussianBlur(canvas.mask(moved), (0, 0), sigmaX=width * 0.8)
    canvas.blend(np.asarray(mask, np.uint8), (40, 34, 30), strength)


def _frame(x: float, y: float, yaw_deg: float) -> Floats:
    """Along and across unit vectors of a wall and a point on it, shape (3, 2)."""
    turn = math.radians(yaw_deg)
    along = (math.cos(turn), math.sin(turn))
    return np.array([along, (-along[1], along[0]), (x, y)])


def _band(frame: Floats, width: float, depth: float, shift: float = 0.0) -> Floats:
    """Rectangle (4, 2) along a wall, moved across it by `shift`."""
    along, across, at = frame
    a, d = along * width / 2.0, across * depth / 2.0
    centre = at + across * shift
    return np.array([centre - a - d, centre + a - d, centre + a + d, centre - a + d])


def _paint_door(canvas: Canvas, house: House, door: Door) -> None:
    frame = _frame(door.x, door.y, door.yaw_deg)
    along, across, at = frame
    half = along * door.width_m / 2.0
    if door.open:
        if door.kind != "opening":
            canvas.fill(_band(frame, door.width_m, _WALL_M), _THRESHOLD)
            for side in (-1.0, 1.0):
                edge = at + across * side * _WALL_M / 2.0
                canvas.line(np.array([edge - half, edge + half]), (176, 158, 132), 0.8)
        return
    canvas.fill(_band(frame, door.width_m, _WALL_M * 0.9), (150, 104, 70))
    canvas.line(_band(frame, door.width_m, _WALL_M), _ENTRANCE, 1.4, closed=True)
    head, shaft = _arrow(house, door)
    canvas.fill(head, _ENTRANCE)
    canvas.line(shaft, _ENTRANCE, 2.0)


def _in_some_room(house: House, point: Floats) -> bool:
    polygon = np.asarray(house.outline, dtype=np.float32).reshape(-1, 1, 2)
    place = (float(point[0]), float(point[1]))
    return bool(cv2.pointPolygonTest(polygon, place, measureDist=False) >= 0)


def _paint_window(canvas: Canvas, window: Window) -> None:
    frame = _frame(window.x, window.y, window.yaw_deg)
    canvas.fill(_band(frame, window.width_m, _WALL_M), (245, 248, 250))
    canvas.fill(_band(frame, window.width_m, _WALL_M * 0.4), _PANE)
    canvas.line(_band(frame, window.width_m, _WALL_M), _WALL, 0.8, closed=True)


def _arrow(house: House, door: Door) -> tuple[Floats, Floats]:
    """Head (3, 2) and shaft (2, 2) of the arrow outside a closed door, towards it."""
    along, across, at = _frame(door.x, door.y, door.yaw_deg)
    inwards = across * (1.0 if _in_some_room(house, at + across * 0.3) else -1.0)
    aside, tip = along * 0.16, at - inwards * 0.14
    head = np.array([tip, tip - inwards * 0.24 + aside, tip - inwards * 0.24 - aside])
    return head, np.array([tip - inwards * 0.44, tip - inwards * 0.2])


def _scale_place(canvas: Canvas, house: House, letter_px: float = _SCALE_PX) -> Vec2:
    """Return the lower left corner of the scale: below the house, else above it.

    At either end of the side, whichever no arrow of an entrance lies across.
    """
    xs, ys = [p[0] for p in house.outline], [p[1] for p in house.outline]
    wide = _scale_width(canvas, letter_px)
    right = max(xs) - wide
    places = [(x, y) for y in (min(ys) - 0.45, max(ys) + 0.36) for x in (min(xs), right)]
    arrows = [np.vstack(_arrow(house, door)) for door in house.doors if not door.open]
    return next((p for p in places if not any(_on_scale(wide, p, a) for a in arrows)), places[0])


def _on_scale(wide: float, at: Vec2, points: Floats) -> bool:
    """Return whether the box of some points (n, 2) comes near a scale of some width."""
    low, high = points.min(axis=0), points.max(axis=0)
    return bool(
        at[0] - _BESIDE_M < high[0]
        and low[0] < at[0] + wide + _BESIDE_M
        and at[1] - _BESIDE_M < high[1]
        and low[1] < at[1] + _SCALE_HIGH_M + _BESIDE_M
    )


def _scale_width(canvas: Canvas, letter_px: float = _SCALE_PX) -> float:
    return _SCALE_TEXT_M + canvas.text_width("2 m", letter_px)


def _paint_scale(canvas: Canvas, at: Vec2, letter_px: float) -> None:
    """Draw a bar of two metres."""
    x, y = at
    for k, colour in ((0, INK), (1, PAPER)):
        left, high = x + k, y + _SCALE_HIGH_M
        canvas.fill([(left, y), (left + 1, y), (left + 1, high), (left, high)], colour)
    top = y + _SCALE_HIGH_M
    canvas.line([(x, y), (x + 2, y), (x + 2, top), (x, top)], INK, 1.0, closed=True)
    canvas.text(
        (x + _SCALE_TEXT_M, y + _SCALE_HIGH_M / 2.0),
        "2 m",
        letter_px,
        INK,
        anchor="left",
        halo=PAPER,
    )


def paint_labels(
    canvas: Canvas, house: House, taken: Sequence[Floats], *, letter_px: float = 9.5
) -> None:
    """Write each room's name and area where they hide least.

    Parameters
    ----------
    canvas, house
        A painted house.
    taken
        Further shapes (n, 2) to stay clear of.
    letter_px
        Height of the names' capital letters, pixels; less where a room is too narrow.
    """
    seen = [
        o
        for object_ in house.objects
        for o in silhouettes(house.assets[object_.asset_id], object_.pose)
        if o.low_m < _OVERHEAD_M
    ]
    blocked = canvas.mask([*(o.plan for o in seen if o.top_m > _RUG_M), *taken])
    rugs = canvas.mask([o.plan for o in seen if o.top_m <= _RUG_M])
    blocked = np.maximum(blocked, rugs // 2)
    for room in house.rooms:
        _label_room(canvas, room, blocked, letter_px)


def _label_room(canvas: Canvas, room: Room, blocked: Image, letter_px: float) -> None:
    name, area = room.type.replace("_", " "), f"{room.area_m2:.1f} m2"
    xs, ys = [p[0] for p in room.polygon], [p[1] for p in room.polygon]
    window = canvas.window((min(xs), min(ys)), (max(xs), max(ys)))
    inside = canvas.mask([room.polygon])[window] > 127
    free = np.where(inside, 1.0 - blocked[window].astype(np.float32) / 255.0, 0.0)
    x, y = canvas.metres(window)
    height = letter_px
    while height > 0.58 * letter_px and canvas.text_width(name, height) > 0.8 * (max(xs) - min(xs)):
        height -= 0.5
    size = (
        max(canvas.text_width(name, height), canvas.text_width(area, height * 0.8)),
        3.2 * height / canvas.scale,
    )
    at = _clearest(free.astype(np.float32), x, y, size)
    gap = 0.85 * height / canvas.scale
    canvas.text((at[0], at[1] + gap), name, height, _LABEL, halo=PAPER)
    canvas.text((at[0], at[1] - gap), area, height * 0.8, _LABEL, halo=PAPER)


def _clearest(free: NDArray[np.float32], x: Floats, y: Floats, size: Vec2) -> Vec2:
    """Return the centre of the box of a given size that covers most free floor."""
    step = abs(float(x[1] - x[0]))
    box = (max(1, round(size[0] / step)) | 1, max(1, round(size[1] / step)) | 1)
    cover = cv2.boxFilter(free, -1, box, borderType=cv2.BORDER_CONSTANT)
    # Among equals the spot nearest to the middle of the room is the natural one.
    rows = np.linspace(-1.0, 1.0, len(y))[:, None]
    columns = np.linspace(-1.0, 1.0, len(x))[None, :]
    score = cover - 0.04 * (rows * rows + columns * columns)
    row, column = np.unravel_index(int(np.argmax(score)), score.shape)
    return float(x[column]), float(y[row])
