"""Order of the episodes of an epoch: a pure function of (seed, epoch)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from internav_data.records import LoaderStream, Purpose, generator

if TYPE_CHECKING:
    from numpy.typing import NDArray

WINDOW = 8
"""Number of row groups that are shuffled into one another and in memory at a time."""


def epoch_order(
    blocks: NDArray[np.int64], *, seed: int, epoch: int, shuffle: bool
) -> NDArray[np.int64]:
    """Return the positions 0 … n - 1 in the order of an epoch, (n,) int64.

    Row groups are shuffled, then the rows of every `WINDOW` neighbouring groups: far apart in the
    data, yet read a few files at a time.

    Parameters
    ----------
    blocks : (groups + 1,) int64
        Positions at which row groups start, and n.
    seed, epoch : int
        Seed and number of the epoch, on which alone the order depends.
    shuffle : bool
        False for the order on disk.

    """
    count = int(blocks[-1])
    if not shuffle:
        return np.arange(count)
    rng = generator(seed, Purpose.LOADER, attempt=LoaderStream.ROWS, draw=epoch)
    parts = [np.arange(blocks[k], blocks[k + 1]) for k in rng.permutation(len(blocks) - 1)]
    windows = [np.concatenate(parts[k : k + WINDOW]) for k in range(0, len(parts), WINDOW)]
    return np.concatenate([rng.permutation(w) for w in windows] or [np.arange(0)])
