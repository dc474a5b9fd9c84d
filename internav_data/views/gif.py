"""Animated GIFs with one palette a frame, in which only changed pixels are stored.

After the GIF89a specification (CompuServe 1990): blocks, LZW codes of 9 to 12 bits. Replays take a
third of the bytes that Pillow needs, as small changes of colour are left out and palettes fit the
changed pixels alone (docs/decisions.md). OpenCV writes entire frames, three to ten times as much.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, BinaryIO, Final

import numpy as np
from numba import njit

from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from internav_data.core.typing import Floats, Image

_UNCHANGED: Final = 255
"""Palette entry of unchanged pixels: transparent."""
_TOLERANCE: Final = 6
"""Maximum difference, in each of red, green and blue, of a pixel that counts as unchanged."""
_CLEAR, _END, _FIRST, _CODES = 256, 257, 258, 4096
"""LZW: the codes for clear and end, the first free code, and the number of codes."""


def write_gif(file: BinaryIO, frames: Iterable[Image], fps: float) -> int:
    """Write frames as an animated GIF that repeats for ever.

    Parameters
    ----------
    file
        Binary file, open for writing.
    frames
        (h, w, 3) uint8 RGB each, all of one size.
    fps
        Frames a second; equal ones in a row are stored as one that stays longer. Viewers show
        no more than 50 a second.

    Returns
    -------
    Number of frames that were given.

    Raises
    ------
    UsageError
        No frames, or frames of several sizes.
    """
    shown: Image | None = None
    waiting = b""
    last: Image | None = None
    count = shown_until = 0
    for frame in frames:
        if shown is None:
            _begin(file, frame.shape)
            shown = np.zeros_like(frame)
        elif frame.shape != shown.shape:
            raise UsageError(f"a GIF's frames are of one size: {shown.shape}, then {frame.shape}")
        if last is None or not np.array_equal(frame, last):
            now = round(100.0 * count / fps)
            _write_frame(file, waiting, now - shown_until)
            waiting, shown_until = _picture(frame, shown, last), now
            last = frame
        count += 1
    if not count:
        raise UsageError("a GIF needs at least one frame")
    _write_frame(file, waiting, round(100.0 * count / fps) - shown_until)
    file.write(b";")
    return count


def _begin(file: BinaryIO, shape: tuple[int, ...]) -> None:
    height, width = shape[:2]
    file.write(b"GIF89a" + struct.pack("<HHBBB", width, height, 0x70, 0, 0))
    file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")


def _write_frame(file: BinaryIO, picture: bytes, hundredths: int) -> None:
    """Write a picture once its duration is known."""
    if picture:
        stay = min(max(hundredths, 2), 65535)
        # Flags: leave the picture where it is, one entry is transparent.
        file.write(b"\x21\xf9\x04" + struct.pack("<BHBB", 0b101, stay, _UNCHANGED, 0) + picture)


def _picture(frame: Image, shown: Image, last: Image | None) -> bytes:
    """Encode the changed pixels, and update `shown` (h, w, 3) to the viewer's picture."""
    if last is None:
        changed = np.ones(frame.shape[:2], np.uint8)
    else:
        changed = _changed(frame, shown, last, _TOLERANCE)
    rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
    if not len(rows):
        rows = columns = np.zeros(1, np.int64)
    top, left = int(rows[0]), int(columns[0])
    box = (slice(top, int(rows[-1]) + 1), slice(left, int(columns[-1]) + 1))
    part, mask = np.ascontiguousarray(frame[box]), np.ascontiguousarray(changed[box])
    palette, places = _palette(part, mask)
    indices = np.empty(mask.shape, np.uint8)
    _assign_entries(part, mask, places, palette, indices, shown[box])
    head = struct.pack("<BHHHHB", 0x2C, left, top, mask.shape[1], mask.shape[0], 0x87)
    data = _lzw(indices.ravel()).tobytes()
    blocks = (data[k : k + 255] for k in range(0, len(data), 255))
    body = b"".join(bytes([len(block)]) + block for block in blocks)
    return head + palette.tobytes() + b"\x08" + body + b"\x00"


def _palette(part: Image, mask: Image) -> tuple[Image, NDArray[np.int64]]:
    """Return at most 255 colours (256, 3) for masked pixels, and each coarse colour's entry."""
    sums = _coarse(part, mask)
    taken = np.flatnonzero(sums[:, 3])
    colours = sums[taken, :3] / sums[taken, 3:]
    boxes = _split(colours, sums[taken, 3], _UNCHANGED)
    palette = np.zeros((256, 3), np.uint8)
    for axis in range(3):
        weights = np.bincount(boxes, sums[taken, 3], minlength=256)
        mean = np.bincount(boxes, sums[taken, axis], minlength=256) / np.maximum(weights, 1.0)
        palette[:, axis] = np.round(mean)
    places = np.zeros(len(sums), np.int64)
    places[taken] = boxes
    return palette, places


@njit(cache=True)
def _changed(frame: Image, shown: Image, last: Image, tolerance: int) -> Image:
    """Return a mask (h, w) of pixels that changed and differ from the viewer's picture."""
    height, width = frame.shape[:2]
    out = np.zeros((height, width), np.uint8)
    for y in range(height):
        for x in range(width):
            far, other = False, False
            for k in range(3):
                # Signed: the difference of two uint8 wraps around.
                off = np.int64(frame[y, x, k]) - np.int64(shown[y, x, k])
                far |= bool(abs(off) > tolerance)
                other |= bool(frame[y, x, k] != last[y, x, k])
            out[y, x] = far and other
    return out


@njit(cache=True)
def _coarse(part: Image, mask: Image) -> Floats:
    """Sum up red, green, blue and count (32768, 4) for colours that agree in five bits each."""
    sums = np.zeros((32768, 4))
    for y in range(mask.shape[0]):
        for x in range(mask.shape[1]):
            if mask[y, x]:
                r, g, b = int(part[y, x, 0]), int(part[y, x, 1]), int(part[y, x, 2])
                place = (r >> 3) << 10 | (g >> 3) << 5 | b >> 3
                sums[place, 0] += r
                sums[place, 1] += g
                sums[place, 2] += b
                sums[place, 3] += 1.0
    return sums


@njit(cache=True)
def _split(colours: Floats, weights: Floats, max_boxes: int) -> NDArray[np.int64]:
    """Divide colours (n, 3) into boxes: always the one of largest spread, at its mean.

    Heckbert's median cut (1982), but along the axis of largest variance and at the mean.
    """
    count = len(colours)
    boxes = np.zeros(count, np.int64)
    means, spreads = np.zeros((max_boxes, 3)), np.zeros((max_boxes, 3))
    _measure_box(colours, weights, boxes, 0, means, spreads)
    for new in range(1, max_boxes):
        widest = np.argmax(spreads[:new])
        box, axis = widest // 3, widest % 3
        if spreads[box, axis] <= 0.0:
            break
        for k in range(count):
            if boxes[k] == box and colours[k, axis] > means[box, axis]:
                boxes[k] = new
        _measure_box(colours, weights, boxes, box, means, spreads)
        _measure_box(colours, weights, boxes, new, means, spreads)
    return boxes


@njit(cache=True)
def _measure_box(
    colours: Floats, weights: Floats, boxes: NDArray[np.int64], box: int,
    means: Floats, spreads: Floats,
) -> None:  # fmt: skip
    """Write a box's mean colour and the squares about it, 0 along axes without a split."""
    total, first, second = 0.0, np.zeros(3), np.zeros(3)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for k in range(len(colours)):
        if boxes[k] == box:
            total += weights[k]
            for axis in range(3):
                value = colours[k, axis]
                first[axis] += weights[k] * value
                second[axis] += weights[k] * value * value
                low[axis], high[axis] = min(low[axis], value), max(high[axis], value)
    for axis in range(3):
        means[box, axis] = first[axis] / max(total, 1.0)
        spread = second[axis] - means[box, axis] * first[axis]
        # Means are rounded: a box must have something above and something not above its mean.
        apart = total > 0.0 and low[axis] + 1e-6 < means[box, axis] < high[axis] - 1e-6
        spreads[box, axis] = max(spread, 1e-9) if apart else 0.0


@njit(cache=True)
def _assign_entries(
    part: Image, mask: Image, places: NDArray[np.int64], palette: Image,
    indices: Image, shown: Image,
) -> None:  # fmt: skip
    """Write each pixel's palette entry (h, w) and the viewer's picture (h, w, 3)."""
    for y in range(mask.shape[0]):
        for x in range(mask.shape[1]):
            if not mask[y, x]:
                indices[y, x] = 255
                continue
            r, g, b = int(part[y, x, 0]), int(part[y, x, 1]), int(part[y, x, 2])
            entry = places[(r >> 3) << 10 | (g >> 3) << 5 | b >> 3]
            indices[y, x] = entry
            for k in range(3):
                shown[y, x, k] = palette[entry, k]


@njit(cache=True)
def _append_code(out: Image, state: NDArray[np.int64], code: int) -> None:
    """Append a code; `state` is bits written, the next free code, bits a code."""
    bit, size = state[0], state[2]
    for k in range(size):
        if code >> k & 1:
            out[(bit + k) >> 3] |= 1 << ((bit + k) & 7)
    state[0] = bit + size
    # A decoder takes the wider codes once its table is full: one code behind this one's.
    if state[1] >= 1 << size and size < 12:
        state[2] = size + 1


@njit(cache=True)
def _lzw(pixels: Image) -> Image:
    """Encode pixels (n,) of eight bits."""
    count = len(pixels)
    # No more than a code of 12 bits a pixel, and one to clear for each full table.
    out = np.zeros(count * 12 // 8 + count // 512 + 64, np.uint8)
    table = np.zeros((_CODES, 256), np.int16)
    state = np.array([0, _FIRST, 9])
    _append_code(out, state, _CLEAR)
    prefix = int(pixels[0])
    for n in range(1, count):
        pixel = int(pixels[n])
        longer = int(table[prefix, pixel])
        if longer:
            prefix = longer
            continue
        _append_code(out, state, prefix)
        if state[1] < _CODES - 1:
            table[prefix, pixel] = state[1]
            state[1] += 1
        else:
            _append_code(out, state, _CLEAR)
            table[:] = 0
            state[1], state[2] = _FIRST, 9
        prefix = pixel
    _append_code(out, state, prefix)
    _append_code(out, state, _END)
    return out[: (state[0] + 7) >> 3]
