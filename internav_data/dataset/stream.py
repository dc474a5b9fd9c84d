"""Iteration over a dataset: shuffled, shared among ranks and workers, resumable in mid-epoch."""

from __future__ import annotations

import functools
import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data.core.lru import LRUCache
from internav_data.dataset.order import WINDOW, epoch_order, share
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from internav_data.dataset.loader import Dataset


class EpisodeStream:
    """An iterable over one rank's share of a dataset; made by `Dataset.iterable`.

    In a torch DataLoader every worker takes its share of the rank's share: import torch before
    making the stream. Call `set_epoch` before each epoch.

    `state_dict` holds the position of the latest iteration; after `load_state_dict` the next
    iteration goes on from there. Streams live in the DataLoader's workers, so with workers use a
    loader that collects their states (torchdata's StatefulDataLoader does).
    """

    def __init__(
        self,
        dataset: Dataset[Any],
        *,
        seed: int = 0,
        epoch: int = 0,
        shuffle: bool = True,
        rank: int = 0,
        world_size: int = 1,
        worker_id: int | None = None,
        num_workers: int | None = None,
    ) -> None:
        _check_member("rank", rank, "world_size", world_size)
        if (worker_id is None) != (num_workers is None):
            raise UsageError("worker_id and num_workers: give both or none")
        if worker_id is not None and num_workers is not None:
            _check_member("worker_id", worker_id, "num_workers", num_workers)
        self.dataset = dataset
        self._seed, self._epoch, self._shuffle = seed, epoch, shuffle
        self._rank = (rank, world_size)
        self._worker = None if num_workers is None else (worker_id or 0, num_workers)
        self._position = 0
        self._resume = False
        _register_with_torch()

    def set_epoch(self, epoch: int) -> None:
        """Start the given epoch at the next iteration."""
        self._epoch, self._position, self._resume = epoch, 0, False

    def state_dict(self) -> dict[str, Any]:
        """Return the position of the latest iteration: plain values, fit for JSON."""
        worker, workers = self._workers()
        return {
            "seed": self._seed,
            "epoch": self._epoch,
            "shuffle": self._shuffle,
            "rank": self._rank[0],
            "world_size": self._rank[1],
            "worker_id": worker,
            "num_workers": workers,
            "position": self._position,
            "dataset": self.dataset.fingerprint,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on from the position of another stream with the same arguments.

        Raises
        ------
        UsageError
            The state belongs to another dataset, selection or share.

        """
        mine = self.state_dict()
        for name in sorted(mine.keys() - {"epoch", "position", "seed", "shuffle"}):
            if state.get(name) != mine[name]:
                raise UsageError(
                    f"load_state_dict: {name}: the state was saved with {state.get(name)!r}, this "
                    f"stream has {mine[name]!r}: open the same dataset with the same arguments"
                )
        self._seed, self._shuffle = int(state["seed"]), bool(state["shuffle"])
        self._epoch, self._position = int(state["epoch"]), int(state["position"])
        self._resume = True

    def __iter__(self) -> Iterator[Any]:
        if not self._resume:
            self._position = 0
        self._resume = False
        rows = self.rows()
        cache = self.dataset.row_group_cache
        # Rows come from WINDOW groups in turn: these stay, whatever else the dataset reads.
        recent: LRUCache[int, tuple[int, int, Any]] = LRUCache(WINDOW)
        bounds = cache.all_bounds()
        groups = np.searchsorted(bounds, rows, side="right") - 1
        for k in range(self._position, len(rows)):
            row = int(rows[k])
            first, _, reader = recent.get(int(groups[k]), functools.partial(cache.group_of, row))
            self._position = k + 1
            yield reader.rows(row - first, row - first + 1)[0]

    def __len__(self) -> int:
        start, stop = share(len(self.dataset), *self._rank)
        if self._worker is not None:
            low, high = share(stop - start, *self._worker)
            return high - low
        return stop - start

    def rows(self) -> np.ndarray[Any, np.dtype[np.int64]]:
        """Return the row numbers of this worker's share of the epoch, in order: (n,) int64."""
        order = epoch_order(
            self.dataset.blocks(), seed=self._seed, epoch=self._epoch, shuffle=self._shuffle
        )
        start, stop = share(len(order), *self._rank)
        low, high = share(stop - start, *self._workers())
        return self.dataset.row_numbers(order[start + low : start + high])

    def _workers(self) -> tuple[int, int]:
        if self._worker is not None:
            return self._worker
        info = None
        if "torch.utils.data" in sys.modules:
            info = sys.modules["torch.utils.data"].get_worker_info()
        return (0, 1) if info is None else (info.id, info.num_workers)


def _check_member(name: str, member: int, total: str, members: int) -> None:
    if members < 1 or not 0 <= member < members:
        raise UsageError(
            f"{name}, {total}: expected 0 <= {name} < {total}, got {member}, {members}"
        )


def _register_with_torch() -> None:
    """Make torch's DataLoader take streams for iterable datasets, if torch is imported."""
    module = sys.modules.get("torch.utils.data")
    if module is not None:
        module.IterableDataset.register(EpisodeStream)
