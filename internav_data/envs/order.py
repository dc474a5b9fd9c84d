"""Order of episodes: a pure function of (seed, position), house by house."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from internav_data.records import LoaderStream, Purpose, generator

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.dataset import Dataset
    from internav_data.records import Episode


def scene_bounds(dataset: Dataset[Episode]) -> NDArray[np.int64]:
    """Return the episode numbers at which a new house begins, then the count: (scenes + 1,)."""
    column = dataset.to_table(["scene_id"]).column("scene_id")
    codes = column.combine_chunks().dictionary_encode().indices.to_numpy()
    starts = np.flatnonzero(np.diff(codes)) + 1
    return np.concatenate([[0], starts, [len(codes)]]).astype(np.int64)


class EpisodeOrder:
    """Order of episodes: each once an epoch, several of the same house in a row.

    A house costs more to prepare than an episode. So the episodes of each house are shuffled and
    cut into runs, and the runs of all houses are shuffled.

    Parameters
    ----------
    bounds : (scenes + 1,) int64
        Episode numbers at which houses begin; see `scene_bounds`.
    seed
        Seed of the order.
    episodes_per_house
        Number of episodes of one house in a row, at least 1.
    shuffle
        Whether to shuffle; False keeps the order on disk.
    """

    def __init__(
        self,
        bounds: NDArray[np.int64],
        seed: int,
        *,
        episodes_per_house: int = 4,
        shuffle: bool = True,
    ) -> None:
        self._bounds, self._seed = bounds, seed
        self._episodes_per_house, self._shuffle = episodes_per_house, shuffle
        self._count = int(bounds[-1])
        counts = np.diff(bounds)
        # One row a run: its scene, the place of its first episode in the scene, and its length.
        runs = -(-counts // episodes_per_house)
        self._scenes = np.repeat(np.arange(len(counts), dtype=np.int32), runs)
        first = np.repeat(np.cumsum(runs) - runs, runs)
        self._starts = (np.arange(len(self._scenes)) - first).astype(np.int32) * episodes_per_house
        self._lengths = np.minimum(episodes_per_house, counts[self._scenes] - self._starts)
        self._epoch = -1
        self._runs = self._ends = np.empty(0, np.int64)

    def number(self, position: int) -> int:
        """Return the number, in the dataset, of the episode at a position (0 and up)."""
        epoch, offset = divmod(position, self._count)
        if not self._shuffle:
            return offset
        if epoch != self._epoch:
            rng = generator(self._seed, Purpose.LOADER, attempt=LoaderStream.HOUSES, draw=epoch)
            self._runs = rng.permutation(len(self._scenes))
            self._ends = np.cumsum(self._lengths[self._runs])  # positions at which runs end
            self._epoch = epoch
        at = int(np.searchsorted(self._ends, offset, side="right"))
        run = int(self._runs[at])
        nth = offset - int(self._ends[at]) + int(self._lengths[run])
        scene = int(self._scenes[run])
        low, high = int(self._bounds[scene]), int(self._bounds[scene + 1])
        rng = generator(self._seed, Purpose.LOADER, scene, LoaderStream.EPISODES, 0, epoch)
        within = rng.permutation(high - low)
        return low + int(within[int(self._starts[run]) + nth])
