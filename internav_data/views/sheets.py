"""Contact sheets of pictures, and pictures on disk."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from internav_data.core.storage import write_atomically
from internav_data.records.errors import InternavError, UsageError
from internav_data.views.canvas import Canvas

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.core.typing import Image
    from internav_data.records import RGB

_PAPER: RGB = (250, 249, 246)
_INK: RGB = (52, 54, 62)
_GAP_PX = 8
_LABEL_PX = 20


def contact_sheet(
    images: Sequence[Image], columns: int, labels: Sequence[str] | None = None
) -> Image:
    """Lay pictures out in rows, each centred in a cell of the largest one's size.

    Parameters
    ----------
    images
        (h, w, 3) uint8 RGB each, of any sizes.
    columns
        Pictures a row.
    labels
        ASCII text below each picture.

    Raises
    ------
    UsageError
        No pictures, no columns, or another number of labels than pictures.
    """
    if not images or columns < 1:
        raise UsageError(
            f"a contact sheet needs at least one picture and one column, got {len(images)} "
            f"pictures and {columns} columns"
        )
    if labels is not None and len(labels) != len(images):
        raise UsageError(f"{len(images)} pictures need as many labels, got {len(labels)}")
    cell_h = max(image.shape[0] for image in images) + (_LABEL_PX if labels is not None else 0)
    cell_w = max(image.shape[1] for image in images)
    rows = -(-len(images) // columns)
    columns = min(columns, len(images))
    sheet: Image = np.empty(
        (rows * (cell_h + _GAP_PX) + _GAP_PX, columns * (cell_w + _GAP_PX) + _GAP_PX, 3), np.uint8
    )
    sheet[:] = _PAPER
    for k, image in enumerate(images):
        height, width = image.shape[:2]
        left = _GAP_PX + (k % columns) * (cell_w + _GAP_PX)
        top = _GAP_PX + (k // columns) * (cell_h + _GAP_PX)
        space = cell_h - (_LABEL_PX if labels is not None else 0) - height
        row, column = top + space // 2, left + (cell_w - width) // 2
        sheet[row : row + height, column : column + width] = image
        if labels is not None:
            below = top + cell_h - _LABEL_PX
            sheet[below : below + _LABEL_PX, left : left + cell_w] = _label(labels[k], cell_w)
    return sheet


def _label(text: str, width: int) -> Image:
    strip = Canvas((0.0, 0.0), (float(width), float(_LABEL_PX)), max(width, _LABEL_PX), _PAPER)
    strip.text((width / 2.0, _LABEL_PX / 2.0), text, 8.0, _INK)
    return strip.finished()[:_LABEL_PX, :width]


def png_bytes(image: Image) -> bytes:
    """Return an RGB picture (h, w, 3) uint8 as PNG.

    Raises
    ------
    InternavError
        It is no picture.
    """
    good, data = cv2.imencode(".png", cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    if not good:
        raise InternavError(f"a picture of shape {image.shape} cannot be written as PNG")
    found: bytes = data.tobytes()
    return found


def write_png(path: Path, image: Image) -> None:
    """Write an RGB picture (h, w, 3) uint8 atomically as PNG.

    Raises
    ------
    InternavError
        The file cannot be written.
    """
    path = Path(path)
    try:
        data = png_bytes(image)
    except InternavError as error:
        raise InternavError(f"{path}: {error}") from None
    try:
        write_atomically(path, data)
    except OSError as error:
        raise InternavError(f"{path}: cannot be written: {error.strerror}") from error
