"""A contact sheet of the catalogue: one cell a type, several of its assets side by side."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from internav_data.catalog import SHEETS
from internav_data.records.errors import UsageError
from internav_data.views.orthographic import OrthographicView, Surface, asset_surface, draw_surface

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from internav_data.catalog import Catalogue
    from internav_data.core.typing import Image
    from internav_data.records import Asset

_TURN_DEG = -24.0
"""Things are turned a little, so that front, side and top are seen."""
_PITCH_DEG = 24.0
_LABEL_PX = 26
_INK, _FAINT, _GAP = (52, 56, 62), (120, 124, 130), (226, 226, 222)
_FROM_ABOVE_DEG = 50.0
_FLAT = ("Rug",)
_LONG = 1.5
"""Things so much wider than high are shown one fewer a cell."""


def _chosen(assets: Sequence[Asset], count: int) -> list[Asset]:
    """Choose some assets of a type, evenly from the first to the last."""
    if len(assets) <= count:
        return list(assets)
    return [assets[round(k * (len(assets) - 1) / (count - 1))] for k in range(count)]


def draw_assets(
    assets: Sequence[Asset], width: int, height: int, *, turn_deg: float = _TURN_DEG
) -> Image:
    """Draw assets side by side on a floor, as large as fits, shape (height, width, 3) uint8."""
    if not assets:
        raise UsageError("no assets to draw: give at least one")
    pitch = _FROM_ABOVE_DEG if all(a.type in _FLAT for a in assets) else _PITCH_DEG
    turn = math.radians(turn_deg)
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    wide = [a.size[0] * c + a.size[1] * s for a in assets]
    gap = 0.16 * max(wide)
    surfaces, x = [], 0.0
    for asset, across in zip(assets, wide, strict=True):
        surfaces.append(asset_surface(asset).moved((x + across / 2.0, 0.0, 0.0), turn_deg))
        x += across + gap
    whole = Surface.joined(surfaces)
    tilt = math.radians(pitch)
    right = whole.corners[..., 0]
    down = -whole.corners[..., 1] * math.sin(tilt) - whole.corners[..., 2] * math.cos(tilt)
    spans = (float(np.ptp(right)), float(np.ptp(down)))
    scale = min(0.92 * width / spans[0], 0.86 * height / spans[1])
    middle = float(down.max() + down.min()) / 2.0
    centre = (float(right.max() + right.min()) / 2.0, -middle / math.sin(tilt), 0.0)
    view = OrthographicView(width, height, scale, centre, yaw_deg=0.0, pitch_deg=pitch)
    return draw_surface(whole, view)


def _cell(type_: str, assets: Sequence[Asset], width: int, height: int, count: int) -> Image:
    import cv2  # noqa: PLC0415 - seconds, all of these

    long = assets[0].size[0] > _LONG * assets[0].size[2]
    picture = draw_assets(_chosen(assets, count - 1 if long else count), width, height - _LABEL_PX)
    cell = np.empty((height, width, 3), np.uint8)
    cell[:] = (247, 247, 245)
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
        Where the assets come from.
    types
        Which types, in this order; all by default, the obstacle types first.
    columns, each
        Cells in a row, and assets in a cell.
    cell_px
        Width and height of a cell, pixels.

    Raises
    ------
    UsageError
        When a type has no assets.
    """
    known = [*(t for t in SHEETS if t in catalogue.types)]
    known += [t for t in catalogue.types if t not in SHEETS]
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
    UsageError
        When the file cannot be written.
    """
    import cv2  # noqa: PLC0415 - seconds, all of these

    image = draw_asset_sheet(catalogue, types)
    good, data = cv2.imencode(".png", image[:, :, ::-1])
    if not good:
        raise UsageError(f"{path}: the picture could not be encoded")
    try:
        path.write_bytes(data.tobytes())
    except OSError as error:
        raise UsageError(f"{path}: cannot be written ({error.strerror}); choose another") from error
