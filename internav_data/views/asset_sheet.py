"""Pictures of assets by the agent's camera, and a contact sheet of the catalogue.

Assets stand on the floor of an endless room; the sheet has one cell for each type, with several of
its assets side by side.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from internav_data.catalog import ASSET_TYPES
from internav_data.geometry import part_corners, transform
from internav_data.records import House, Material, Pose, Room
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from internav_data.catalog import Catalogue
    from internav_data.core.typing import Floats, Image
    from internav_data.records import RGB, Asset
    from internav_data.render.camera import StaticScene

_TURN_DEG = -24.0
"""Assets are turned a little, so that front, side and top are seen."""
_PITCH_DEG = 24.0
_FROM_ABOVE_DEG = 50.0
"""Pitch for flat assets."""
_DISTANCE: Final = 1.6
"""Distance of the camera as a multiple of the width of the picture where the assets stand."""
_OVERSAMPLING: Final = 2
_BACKGROUND: Final[RGB] = (247, 247, 245)
_FLOOR_M: Final = 100.0
"""Half a side of the floor, beyond all that is pictured."""
_FLOOR: Final = -1
"""Instance id of the floor."""
_LABEL_PX = 26
_INK, _FAINT, _GAP = (52, 56, 62), (120, 124, 130), (226, 226, 222)
_FLAT = ("Rug",)
_LONG = 1.5
"""Assets so many times wider than high are shown one fewer a cell."""


def _chosen(assets: Sequence[Asset], count: int) -> list[Asset]:
    """Choose some assets of a type, evenly from the first to the last."""
    if len(assets) <= count:
        return list(assets)
    return [assets[round(k * (len(assets) - 1) / (count - 1))] for k in range(count)]


@lru_cache(maxsize=1)
def _studio() -> StaticScene:
    """Return a house that is one floor without walls."""
    from internav_data.render.camera import StaticScene  # noqa: PLC0415 - seconds

    a = _FLOOR_M
    square = ((-a, -a), (a, -a), (a, a), (-a, a))
    room = Room(0, "studio", square, 4.0 * a * a, a, "plain", "plain")
    plain = Material("plain", (255, 255, 255), "plain")
    return StaticScene.of(
        House(
            scene_id="studio", scene=0, seed=0, split="train", preset="", outline=square,
            rooms=(room,), doors=(), windows=(), walls=(), objects=(), materials=(plain,),
            room_graph=(), area_m2=room.area_m2, assets={},
        )
    )  # fmt: skip


def draw_assets(
    assets: Sequence[Asset], width: int, height: int, *, turn_deg: float = _TURN_DEG
) -> Image:
    """Draw assets side by side on a floor, as large as fits, shape (height, width, 3) uint8.

    Raises
    ------
    UsageError
        There are no assets.
    """
    if not assets:
        raise UsageError("no assets to draw: give at least one")
    from internav_data.render.camera import Camera, CameraView, camera_axes  # noqa: PLC0415

    pitch_deg = _FROM_ABOVE_DEG if all(a.type in _FLAT for a in assets) else _PITCH_DEG
    placed = _side_by_side(assets, turn_deg)
    corners = np.vstack([transform(part_corners(p), pose) for a, pose in placed for p in a.parts])
    axes = camera_axes(90.0, pitch_deg)
    eye, window = _framing(corners, axes, width / height)
    left, top, pixels_per_tan = window[0], window[1], width * _OVERSAMPLING / window[2]
    scene = _studio()
    props = scene.props(placed)
    # The camera draws a square of 90 degrees, tangents -1 to 1; the window is cut out of it.
    camera = Camera(math.ceil(2.0 * pixels_per_tan), portals=False)
    view = CameraView(scene, props, eye[0], eye[1], 90.0, pitch_deg, eye[2])
    shown, _, ids = camera.render([view])
    for k in range(len(props)):
        props.hide(k)
    bare = camera.render([view]).rgb
    column, row = (round((at + 1.0) * pixels_per_tan) for at in (left, top))
    cut = (
        0,
        slice(row, row + height * _OVERSAMPLING),
        slice(column, column + width * _OVERSAMPLING),
    )
    # On the floor only shadows are kept: the rest of its shading is the distance's.
    light = shown[cut].astype(np.float64) / np.maximum(bare[cut], 1)
    floor = np.array(_BACKGROUND) * np.minimum(light, 1.0)
    picture = np.where((ids[cut] == _FLOOR)[..., None], floor, shown[cut])
    blocks = picture.reshape(height, _OVERSAMPLING, width, _OVERSAMPLING, 3).mean(axis=(1, 3))
    image: Image = np.rint(blocks).astype(np.uint8)
    return image


def _side_by_side(assets: Sequence[Asset], turn_deg: float) -> list[tuple[Asset, Pose]]:
    """Place assets along +x, turned about their upright axes."""
    turn = math.radians(turn_deg)
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    widths = [a.size[0] * c + a.size[1] * s for a in assets]
    gap = 0.16 * max(widths)
    upright = (0.0, 0.0, math.sin(turn / 2.0), math.cos(turn / 2.0))
    placed, x = [], 0.0
    for asset, across in zip(assets, widths, strict=True):
        placed.append((asset, Pose(x + across / 2.0, 0.0, 0.0, upright)))
        x += across + gap
    return placed


def _framing(corners: Floats, axes: Floats, aspect: float) -> tuple[Floats, Floats]:
    """Return the camera's position (3,) and the picture's window (left, top, width) in tangents.

    `corners` (n, 3) is what the window frames, `axes` (3, 3) the camera's, `aspect` the picture's
    width divided by its height.
    """
    low, high = corners.min(axis=0), corners.max(axis=0)
    away = corners @ axes.T
    spans = np.ptp(away, axis=0)
    distance = _DISTANCE * max(spans[0], spans[1] * aspect) + spans[2] / 2.0
    eye = (low + high) / 2.0 - distance * axes[2]
    seen = (corners - eye) @ axes.T
    tangents = seen[:, :2] / seen[:, 2:]
    first, last = tangents.min(axis=0), tangents.max(axis=0)
    wide = max((last[0] - first[0]) / 0.92, (last[1] - first[1]) / 0.86 * aspect)
    middle = (first + last) / 2.0
    return eye, np.array([middle[0] - wide / 2.0, middle[1] - wide / aspect / 2.0, wide])


def _cell(type_: str, assets: Sequence[Asset], width: int, height: int, count: int) -> Image:
    import cv2  # noqa: PLC0415 - seconds, all of these

    long = assets[0].size[0] > _LONG * assets[0].size[2]
    picture = draw_assets(_chosen(assets, count - 1 if long else count), width, height - _LABEL_PX)
    cell = np.empty((height, width, 3), np.uint8)
    cell[:] = _BACKGROUND
    cell[_LABEL_PX:] = picture
    font = cv2.FONT_HERSHEY_SIMPLEX
    cv2.putText(cell, type_, (9, 19), font, 0.5, _INK, 1, cv2.LINE_AA)
    text = str(len(assets))
    (wide, _), _ = cv2.getTextSize(text, font, 0.42, 1)
    cv2.putText(cell, text, (width - wide - 9, 19), font, 0.42, _FAINT, 1, cv2.LINE_AA)
    cell[0, :] = cell[-1, :] = _GAP
    cell[:, 0] = cell[:, -1] = _GAP
    return cell


def draw_asset_sheet(
    catalogue: Catalogue,
    types: Sequence[str] | None = None,
    *,
    columns: int = 5,
    each: int = 4,
    cell_px: tuple[int, int] = (380, 200),
) -> Image:
    """Draw one cell a type, shape (rows * height, columns * width, 3) uint8.

    Parameters
    ----------
    catalogue
        Catalogue with the assets.
    types
        Asset types in the order of the cells; by default all, the obstacle types first.
    columns, each
        Number of cells in a row, and of assets in a cell.
    cell_px
        Width and height of a cell, pixels.

    Raises
    ------
    UsageError
        A type has no assets.
    """
    known = [*(t for t in ASSET_TYPES if t in catalogue.types)]
    known += [t for t in catalogue.types if t not in ASSET_TYPES]
    chosen = list(types) if types is not None else known
    width, height = cell_px
    cells = []
    for type_ in chosen:
        assets = catalogue.of_type(type_)
        if not assets:
            raise UsageError(f"unknown asset type {type_!r}; known: {', '.join(known)}")
        cells.append(_cell(type_, assets, width, height, each))
    rows = -(-len(cells) // columns)
    sheet = np.full((rows * height, columns * width, 3), 247, np.uint8)
    for k, cell in enumerate(cells):
        top, left = k // columns * height, k % columns * width
        sheet[top : top + height, left : left + width] = cell
    return sheet


def write_asset_sheet(path: Path, catalogue: Catalogue, types: Sequence[str] | None = None) -> None:
    """Write the contact sheet as PNG.

    Raises
    ------
    InternavError
        The file cannot be written.
    """
    from internav_data.views.sheets import write_png  # noqa: PLC0415 - cv2, which takes seconds

    write_png(path, draw_asset_sheet(catalogue, types))
