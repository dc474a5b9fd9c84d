"""Captions below a picture: lines of text and a legend of swatches."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from internav_data.views.canvas import Canvas

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.core.typing import Image
    from internav_data.records import RGB

    Swatch = tuple[RGB, str]

_PAPER: RGB = (250, 249, 246)
_INK: RGB = (52, 54, 62)
_LETTER_PX = 9.0
_ROW_PX = 22
_EDGE_PX = 14


def with_caption(picture: Image, lines: Sequence[str], legend: Sequence[Swatch]) -> Image:
    """Return a picture with text and a legend below it.

    Parameters
    ----------
    picture
        (h, w, 3) uint8 RGB.
    lines
        ASCII text; lines too long for the picture's width are broken at runs of spaces.
    legend
        Colours with their meanings, set side by side.
    """
    width = picture.shape[1]
    measure = Canvas((0.0, 0.0), (float(width), 1.0), width, _PAPER)
    room = width - 2.0 * _EDGE_PX
    rows = [row for line in lines for row in _wrapped(measure, line, room)]
    legend_rows = _legend_rows(measure, legend, room)
    height = _ROW_PX * (len(rows) + len(legend_rows)) + 10
    strip = Canvas((0.0, 0.0), (float(width), float(height)), max(width, height), _PAPER)
    y = height - _ROW_PX / 2.0 - 2.0
    for row in rows:
        strip.text((_EDGE_PX, y), row, _LETTER_PX, _INK, anchor="left")
        y -= _ROW_PX
    for swatches in legend_rows:
        for x, colour, text in swatches:
            strip.disc((x + 6.0, y), 5.5, colour)
            strip.disc((x + 6.0, y), 5.5, _INK, 0.8)
            strip.text((x + 17.0, y), text, _LETTER_PX * 0.9, _INK, anchor="left")
        y -= _ROW_PX
    below = strip.finished()[:, :width]
    return np.asarray(np.vstack([picture, below]), np.uint8)


def _wrapped(measure: Canvas, line: str, room: float) -> list[str]:
    rows: list[str] = []
    for piece in line.split("   "):
        joined = f"{rows[-1]}   {piece}" if rows else piece
        if rows and measure.text_width(joined, _LETTER_PX) <= room:
            rows[-1] = joined
        else:
            rows.append(piece)
    return rows


def _legend_rows(
    measure: Canvas, legend: Sequence[Swatch], room: float
) -> list[list[tuple[float, RGB, str]]]:
    rows: list[list[tuple[float, RGB, str]]] = []
    x = 0.0
    for colour, text in legend:
        width = 17.0 + measure.text_width(text, _LETTER_PX * 0.9) + 18.0
        if not rows or x + width > room:
            rows.append([])
            x = 0.0
        rows[-1].append((_EDGE_PX + x, colour, text))
        x += width
    return rows
