"""Videos: MP4 or GIF files, written atomically."""

from __future__ import annotations

import itertools
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cv2

from internav_data.core.files import check_replaceable
from internav_data.records.errors import InternavError, UsageError
from internav_data.views.gif import write_gif

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from internav_data.core.typing import Image

FORMATS: Final = ("mp4", "gif")
"""Kinds of video, chosen by the suffix of the file's name."""


def video_format(path: Path) -> str:
    """Return the kind of video that a path's suffix names.

    Raises
    ------
    UsageError
        The suffix is none of `FORMATS`.
    """
    suffix = Path(path).suffix.lower().removeprefix(".")
    if suffix not in FORMATS:
        raise UsageError(
            f"{path}: the suffix says which kind of video to write; expected .mp4 or .gif, "
            f"got {f'.{suffix}' if suffix else 'none'}"
        )
    return suffix


def write_video(path: Path, frames: Iterable[Image], fps: float) -> int:
    """Write a video atomically; it replaces an older file.

    MP4 holds MPEG-4 Part 2 video (`mp4v`), as the wheels of OpenCV have no encoder for H.264: VLC,
    mpv, ffplay and most desktop players play it, browsers do not. GIF plays anywhere.

    Parameters
    ----------
    path
        File to write; its suffix (.mp4 or .gif) decides the format.
    frames
        (h, w, 3) uint8 RGB each, all of one size, taken one at a time. An MP4 of odd sides gets
        one more row or column.
    fps
        Frames a second.

    Returns
    -------
    Number of frames that were written.

    Raises
    ------
    UsageError
        Another suffix, no frames, frames of several sizes, or fps not above 0.
    InternavError
        The file cannot be written.
    """
    path = Path(path)
    kind = video_format(path)
    if not fps > 0.0:
        raise UsageError(f"a video's frames a second: expected more than 0, got {fps}")
    write = _gif if kind == "gif" else _mp4
    try:
        check_replaceable(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        # The encoder tells the container by the name's end.
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}.", suffix=f".{kind}", dir=path.parent)
        os.close(handle)
    except OSError as error:
        raise InternavError(f"{path}: cannot be written: {error.strerror}") from error
    part = Path(name)
    try:
        count = write(part, frames, fps)
        part.chmod(0o644)
        part.replace(path)
    except OSError as error:
        raise InternavError(f"{path}: cannot be written: {error.strerror}") from error
    finally:
        part.unlink(missing_ok=True)
    return count


def _gif(path: Path, frames: Iterable[Image], fps: float) -> int:
    with path.open("wb") as file:
        return write_gif(file, frames, fps)


def _mp4(path: Path, frames: Iterable[Image], fps: float) -> int:
    rest = iter(frames)
    first = next(rest, None)
    if first is None:
        raise UsageError("a video needs at least one frame")
    height, width = first.shape[:2]
    size = (width + width % 2, height + height % 2)
    fourcc: Callable[..., int] = cv2.VideoWriter.fourcc
    writer = cv2.VideoWriter(str(path), fourcc(*"mp4v"), fps, size)
    count = 0
    try:
        if not writer.isOpened():
            raise InternavError(
                f"{path.name}: this build of OpenCV cannot encode MPEG-4; write a .gif instead, or "
                "install opencv-python-headless"
            )
        for frame in itertools.chain([first], rest):
            if frame.shape != first.shape:
                raise UsageError(f"a video's frames are of one size: {first.shape}, {frame.shape}")
            even = cv2.copyMakeBorder(
                frame, 0, size[1] - height, 0, size[0] - width, cv2.BORDER_REPLICATE
            )
            writer.write(cv2.cvtColor(even, cv2.COLOR_RGB2BGR))
            count += 1
    finally:
        writer.release()
    return count
