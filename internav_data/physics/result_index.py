"""Index of the result cache: the row of each key, in memory.

Keys are digests, so an index on disk would be touched all over by every batch of new rows and be
written many times as often as the values. A file that only grows at its end is written once; each
batch of rows stands beside one value with all of its keys, and every process reads those.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

PREFIX: Final = 8
"""Bytes of a key that the index knows; the checksum of a value covers all of them."""
_RECENT: Final = 4096
"""Number of rows beyond which new ones are sorted in among the others, 16 bytes a row."""


def prefix_of(key: bytes) -> bytes:
    """Return the bytes of a key that the index knows, filled up where it is shorter."""
    return key[:PREFIX].ljust(PREFIX, b"\0")


class RowIndex:
    """Rows by the first bytes of their keys; of rows with the same key, the latest."""

    def __init__(self) -> None:
        self.end = 1
        """Number of the row that comes next."""
        self._prefixes: NDArray[np.uint64] = np.empty(0, np.uint64)
        self._rows: NDArray[np.int64] = np.empty(0, np.int64)
        self._recent: dict[int, int] = {}

    def __len__(self) -> int:
        return len(self._rows) + len(self._recent)

    def add(self, batches: Sequence[tuple[int, bytes]], oldest: int = 0) -> None:
        """Add batches of rows that follow each other, and drop rows below `oldest` some time.

        A batch is the number of its first row, and the prefixes of all its keys. One without keys
        takes a number all the same.

        Raises
        ------
        ValueError
            A batch holds no whole prefixes.
        """
        found = [np.frombuffer(prefixes, ">u8").astype(np.uint64) for _, prefixes in batches]
        if not found:
            return
        counts = [len(prefixes) for prefixes in found]
        rows = np.concatenate(
            [np.arange(f, f + n) for (f, _), n in zip(batches, counts, strict=True)]
        )
        self.end = max(self.end, batches[-1][0] + max(1, counts[-1]))
        prefixes = np.concatenate(found)
        if len(rows) + len(self._recent) <= _RECENT:
            self._recent.update(zip(prefixes.tolist(), rows.tolist(), strict=True))
            return
        self._merge(prefixes, rows, oldest)

    def _merge(self, prefixes: NDArray[np.uint64], rows: NDArray[np.int64], oldest: int) -> None:
        known = np.fromiter(self._recent, np.uint64, len(self._recent))
        at = np.fromiter(self._recent.values(), np.int64, len(self._recent))
        prefixes = np.concatenate([self._prefixes, known, prefixes])
        rows = np.concatenate([self._rows, at, rows])
        kept = rows >= oldest
        prefixes, rows = prefixes[kept], rows[kept]
        order = np.lexsort((rows, prefixes))
        prefixes, rows = prefixes[order], rows[order]
        latest = np.append(prefixes[1:] != prefixes[:-1], True)[: len(rows)]
        self._prefixes, self._rows = prefixes[latest], rows[latest]
        self._recent.clear()

    def row(self, key: bytes) -> int | None:
        """Return the row of a key, None if there is none. Another key may have it."""
        prefix = int.from_bytes(prefix_of(key), "big")
        recent = self._recent.get(prefix)
        if recent is not None:
            return recent
        at = int(self._prefixes.searchsorted(np.uint64(prefix)))
        if at < len(self._rows) and int(self._prefixes[at]) == prefix:
            return int(self._rows[at])
        return None

    def clear(self) -> None:
        """Drop all rows; numbers go on."""
        self._prefixes, self._rows = self._prefixes[:0], self._rows[:0]
        self._recent.clear()
