"""A file far away, of which ranges are fetched at once and held while they are read.

A row group's column chunks lie one after another, and a reader asks for each of them: a request
each. Held ranges are fetched in one, verified, and then decoded from memory: what is decoded is
what was verified, even where the store would answer otherwise the second time.
"""

from __future__ import annotations

import io
import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import BinaryIO

MAX_GAP_BYTES = 256 << 10
"""Bytes between two ranges below which both are fetched at once: a request costs as much."""


class PositionedFile(io.RawIOBase):
    """A file that is read and sought, whose bytes are fetched by `fetch`.

    Parameters
    ----------
    size
        Number of its bytes.

    """

    def __init__(self, size: int) -> None:
        super().__init__()
        self._size, self._at = size, 0

    def fetch(self, start: int, end: int) -> bytes:
        """Return the bytes start … end - 1, which the file has."""
        raise NotImplementedError

    def read(self, size: int = -1, /) -> bytes:
        """Return the next `size` bytes, all for -1; fewer at the end."""
        end = self._size if size < 0 else min(self._at + size, self._size)
        data = self.fetch(self._at, end) if self._at < end else b""
        self._at += len(data)
        return data

    def seek(self, offset: int, whence: int = os.SEEK_SET, /) -> int:
        """Move to a place in the file and return it."""
        base = {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._size}[whence]
        self._at = base + offset
        return self._at

    def readable(self) -> bool:
        """Return True."""
        return True

    def seekable(self) -> bool:
        """Return True."""
        return True


class RangesFile(PositionedFile):
    """A file of which ranges are held in memory.

    Parameters
    ----------
    file
        File that the bytes are read from.

    """

    def __init__(self, file: BinaryIO) -> None:
        super().__init__(file.seek(0, os.SEEK_END))
        self._file = file
        self._held: list[tuple[int, bytes]] = []

    def hold(self, ranges: Iterable[tuple[int, int]]) -> None:
        """Fetch ranges (start, end) of bytes, neighbours at once, and forget those held before."""
        self._held = []
        for start, end in joined(ranges):
            self._file.seek(start)
            self._held.append((start, self._file.read(end - start)))

    def release(self) -> None:
        """Forget the ranges that are held."""
        self._held = []

    def fetch(self, start: int, end: int) -> bytes:
        """Return bytes, from memory where a range that is held has all of them."""
        for first, data in self._held:
            if first <= start and end <= first + len(data):
                return data[start - first : end - first]
        self._file.seek(start)
        return self._file.read(end - start)

    def close(self) -> None:
        """Close the file and forget what is held."""
        self.release()
        self._file.close()
        super().close()


def joined(ranges: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return ranges in order, those as one that are at most `MAX_GAP_BYTES` apart."""
    found: list[tuple[int, int]] = []
    for start, end in sorted(ranges):
        if found and start - found[-1][1] <= MAX_GAP_BYTES:
            found[-1] = (found[-1][0], max(end, found[-1][1]))
        else:
            found.append((start, end))
    return found
