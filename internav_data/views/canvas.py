"""Canvas measured in metres, y up. It is drawn oversampled and shrunk, for smooth edges."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Literal

import cv2
import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from internav_data.core.typing import Floats, Image
    from internav_data.records import RGB, Vec2

    Points = Sequence[Vec2] | Floats

OVERSAMPLING = 2
"""Factor of oversampling; with cv2's own anti-aliasing twice is as good as four times."""
_SHIFT = 4
"""Fractional bits of cv2's coordinates: sixteenths of a pixel."""
_FONT = cv2.FONT_HERSHEY_DUPLEX
_CAP_HEIGHT = 21.0
"""Height of a capital letter of the font at scale 1, pixels."""


class Canvas:
    """Picture of a rectangle of the floor.

    Lengths named `_px` are pixels of the finished picture; all others are metres.

    Parameters
    ----------
    low, high
        Corners of the rectangle, metres.
    pixels
        Longer side of the finished picture.
    background
        Colour to start from.
    """

    def __init__(self, low: Vec2, high: Vec2, pixels: int, background: RGB) -> None:
        width, height = high[0] - low[0], high[1] - low[1]
        self._low = np.array(low)
        self._high = np.array(high)
        self.scale = pixels / max(width, height)
        """Pixels of the finished picture a metre."""
        shape = (
            max(1, round(height * self.scale)) * OVERSAMPLING,
            max(1, round(width * self.scale)) * OVERSAMPLING,
        )
        self.image: Image = np.empty((*shape, 3), dtype=np.uint8)
        self.image[:] = background

    def finished(self) -> Image:
        """Return the picture at its final size, (h, w, 3) uint8 RGB."""
        height, width = self.image.shape[:2]
        size = (width // OVERSAMPLING, height // OVERSAMPLING)
        return np.asarray(cv2.resize(self.image, size, interpolation=cv2.INTER_AREA), np.uint8)

    def fill(self, polygon: Points, colour: RGB) -> None:
        """Fill a simple polygon."""
        cv2.fillPoly(self.image, [self._fixed(polygon)], colour, cv2.LINE_AA, _SHIFT)

    def mask(self, polygons: Sequence[Points]) -> Image:
        """Return the union of polygons as an (H, W) uint8 mask of 0 … 255, oversampled."""
        mask: Image = np.zeros(self.image.shape[:2], dtype=np.uint8)
        for polygon in polygons:
            cv2.fillPoly(mask, [self._fixed(polygon)], 255, cv2.LINE_AA, _SHIFT)
        return mask

    def blend(self, mask: Image, colour: RGB, strength: float) -> None:
        """Blend a colour into the picture by a mask (H, W) uint8, `strength` in [0, 1]."""
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        if len(rows) == 0:
            return
        box = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
        weight = mask[box][..., None].astype(np.float32) * (strength / 255.0)
        part = self.image[box].astype(np.float32)
        part += (np.array(colour, dtype=np.float32) - part) * weight
        self.image[box] = part.astype(np.uint8)

    def line(self, points: Points, colour: RGB, width_px: float, *, closed: bool = False) -> None:
        """Draw a polyline."""
        thickness = max(1, round(width_px * OVERSAMPLING))
        cv2.polylines(
            self.image, [self._fixed(points)], closed, colour, thickness, cv2.LINE_AA, _SHIFT
        )

    def dashes(self, points: Points, colour: RGB, width_px: float, dash_m: float) -> None:
        """Draw a dashed polyline; gaps are as long as dashes, which continue round corners."""
        path = np.asarray(points, dtype=np.float64)
        along = 0.0
        for a, b in itertools.pairwise(path):
            length = math.dist(a, b)
            if length == 0.0:
                continue
            first = math.floor(along / dash_m)
            last = math.floor((along + length) / dash_m)
            for k in range(first, last + 1):
                begin, end = max(k * dash_m - along, 0.0), min((k + 1) * dash_m - along, length)
                if k % 2 == 0 and end > begin:
                    ends = np.array([a + (b - a) * begin / length, a + (b - a) * end / length])
                    self.line(ends, colour, width_px)
            along += length

    def disc(self, centre: Vec2, radius: float, colour: RGB, width_px: float | None = None) -> None:
        """Fill a disc, or draw a ring if a line width is given."""
        fixed = self._fixed([centre])[0, 0]
        thickness = cv2.FILLED if width_px is None else max(1, round(width_px * OVERSAMPLING))
        size = round(radius * self.scale * OVERSAMPLING * 2**_SHIFT)
        cv2.circle(
            self.image,
            (int(fixed[0]), int(fixed[1])),
            size,
            colour,
            thickness,
            cv2.LINE_AA,
            _SHIFT,
        )

    def arc(self, centre: Vec2, radius: float, from_deg: float, to_deg: float) -> Floats:
        """Return points (n, 2) of an arc, counter-clockwise from one bearing to the other."""
        steps = max(2, math.ceil(abs(to_deg - from_deg) / 5.0))
        turns = np.radians(np.linspace(from_deg, to_deg, steps + 1))
        return np.column_stack(
            [centre[0] + radius * np.cos(turns), centre[1] + radius * np.sin(turns)]
        )

    def text(
        self,
        at: Vec2,
        text: str,
        height_px: float,
        colour: RGB,
        *,
        anchor: Literal["left", "centre"] = "centre",
        halo: RGB | None = None,
    ) -> None:
        """Write ASCII text, vertically centred on a point, capitals `height_px` high."""
        font = height_px * OVERSAMPLING / _CAP_HEIGHT
        thickness = max(1, round(font * 1.2))
        (width, height), _ = cv2.getTextSize(text, _FONT, font, thickness)
        x, y = self._fixed([at])[0, 0] / 2**_SHIFT
        origin = (round(x - (width / 2 if anchor == "centre" else 0)), round(y + height / 2))
        if halo is not None:
            mask: Image = np.zeros(self.image.shape[:2], dtype=np.uint8)
            cv2.putText(mask, text, origin, _FONT, font, 255, thickness, cv2.LINE_AA)
            wide = cv2.GaussianBlur(mask, (0, 0), sigmaX=1.6 * OVERSAMPLING)
            self.blend(np.minimum(wide.astype(np.uint16) * 4, 255).astype(np.uint8), halo, 0.9)
        cv2.putText(self.image, text, origin, _FONT, font, colour, thickness, cv2.LINE_AA)

    def text_width(self, text: str, height_px: float) -> float:
        """Return the width of a text, metres."""
        font = height_px * OVERSAMPLING / _CAP_HEIGHT
        (width, _), _ = cv2.getTextSize(text, _FONT, font, max(1, round(font * 1.2)))
        return float(width) / (self.scale * OVERSAMPLING)

    def window(self, low: Vec2, high: Vec2) -> tuple[slice, slice]:
        """Return the rows and columns of the oversampled picture that a rectangle covers."""
        corners = self._fixed([low, high])[:, 0].astype(np.float64) / 2**_SHIFT
        height, width = self.image.shape[:2]
        top, bottom = math.floor(corners[1, 1]), math.ceil(corners[0, 1]) + 1
        left, right = math.floor(corners[0, 0]), math.ceil(corners[1, 0]) + 1
        # Negative bounds would wrap to the picture's other end.
        return (
            slice(min(max(0, top), height), min(max(0, bottom), height)),
            slice(min(max(0, left), width), min(max(0, right), width)),
        )

    def metres(self, window: tuple[slice, slice]) -> tuple[Floats, Floats]:
        """Return the coordinates of a window's pixel centres: x (columns,), y (rows,), metres."""
        step = self.scale * OVERSAMPLING
        x = self._low[0] + (np.arange(window[1].start, window[1].stop) + 0.5) / step
        y = self._high[1] - (np.arange(window[0].start, window[0].stop) + 0.5) / step
        return x, y

    def _fixed(self, points: Points) -> NDArray[np.int32]:
        """Metres to cv2's fixed-point pixels, shape (n, 1, 2)."""
        array = np.asarray(points, dtype=np.float64).reshape(-1, 1, 2)
        scale = self.scale * OVERSAMPLING * 2**_SHIFT
        out = np.empty_like(array)
        out[..., 0] = (array[..., 0] - self._low[0]) * scale
        out[..., 1] = (self._high[1] - array[..., 1]) * scale
        return np.rint(out).astype(np.int32)
