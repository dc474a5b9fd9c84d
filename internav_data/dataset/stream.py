"""Iteration over a dataset: shuffled, shared among ranks and workers, resumable in mid-epoch."""

from __future__ import annotations

import functools
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data.core.lru import LRUCache
from internav_data.dataset.order import WINDOW, epoch_order
from internav_data.dataset.shared_numbers import SharedNumbers
from internav_data.dataset.spans import (
    Spans,
    cut,
    make_even,
    positions,
    share_of,
    span_length,
    spans_of,
    union,
)
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from internav_data.dataset.loader import Dataset

_EPOCH, _LOADS, _READ = 0, 1, 2
"""Numbers that a stream shares with its workers: the epoch, how often a state was loaded, and
whether workers have read in this epoch."""


@dataclass(slots=True)
class _Iteration:
    """Latest iteration: a worker's positions in the order of an epoch, and how many are read."""

    epoch: int
    spans: Spans
    taken: int = 0


@dataclass(frozen=True, slots=True)
class _Remainder:
    """Unread rest of an epoch, from states: of all ranks, of one rank, or of one worker."""

    epoch: int
    spans: Spans
    rank: tuple[int, int]
    """Rank and number of ranks that it belongs to; (0, 1): all ranks share it."""
    worker: tuple[int, int]
    """Worker and number of workers; (0, 1): the workers share it."""


class EpisodeStream:
    """An iterable over one rank's share of a dataset; made by `Dataset.iterable`.

    In a torch DataLoader every worker takes its share of the rank's share: import torch before
    making the stream. Call `set_epoch` before each epoch; workers that persist follow it.

    All ranks read equally many episodes, so that a loop of DistributedDataParallel ends
    everywhere at once. `drop_last` has the meaning of torch's DistributedSampler: False repeats up
    to `world_size` - 1 episodes, True leaves as many out. None reads each episode once, for sums
    over a dataset; lengths then differ by one at most.

    `state_dict` holds what the latest iteration has not read yet. The states of all ranks and
    workers together resume with any other `world_size` and number of workers; a rank or a worker
    resumes from its own state where neither has changed. Streams live in the DataLoader's workers,
    so with workers use a loader that collects their states (torchdata's StatefulDataLoader does).
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
        drop_last: bool | None = False,
        worker_id: int | None = None,
        num_workers: int | None = None,
    ) -> None:
        _check_member("rank", rank, "world_size", world_size)
        if (worker_id is None) != (num_workers is None):
            raise UsageError("worker_id and num_workers: give both or none")
        if worker_id is not None and num_workers is not None:
            _check_member("worker_id", worker_id, "num_workers", num_workers)
        self.dataset = dataset
        self._seed, self._shuffle = seed, shuffle
        self._rank, self._drop_last = (rank, world_size), drop_last
        self._worker = None if num_workers is None else (worker_id or 0, num_workers)
        self._shared = SharedNumbers(epoch, 0, 0)
        self._loads = 0
        self._iteration: _Iteration | None = None
        self._rest: _Remainder | None = None
        _register_with_torch()

    def set_epoch(self, epoch: int) -> None:
        """Start the given epoch at the next iteration, in workers too.

        A state that was just loaded stays where it is of this epoch.
        """
        self._shared[_EPOCH], self._shared[_READ], self._iteration = epoch, 0, None
        if self._rest is not None and self._rest.epoch != epoch:
            self._rest = None

    def state_dict(self) -> dict[str, Any]:
        """Return what the latest iteration has not read: plain values, fit for JSON.

        `remaining` holds ranges [start, stop) of positions in the order of the epoch, which all
        ranks and workers share; positions from the number of episodes on are padding.

        Raises
        ------
        UsageError
            A DataLoader's workers read the episodes: only their streams know how far.

        """
        if self._iteration is None and self._shared[_READ] and not self._shared.in_worker:
            raise UsageError(
                "state_dict: a DataLoader's workers read this stream: ask the streams there for "
                "their states (torchdata's StatefulDataLoader does)"
            )
        now = self._iteration or self._next()
        worker, workers = self._workers()
        return {
            "seed": self._seed,
            "epoch": now.epoch,
            "shuffle": self._shuffle,
            "rank": self._rank[0],
            "world_size": self._rank[1],
            "worker_id": worker,
            "num_workers": workers,
            "remaining": [list(span) for span in cut(now.spans, now.taken, span_length(now.spans))],
            "dataset": self.dataset.fingerprint,
        }

    def load_state_dict(self, state: Mapping[str, Any] | Sequence[Mapping[str, Any]]) -> None:
        """Go on where other streams of the same dataset were left.

        Parameters
        ----------
        state
            State of this rank and worker; or states of all ranks and workers of a run, in any
            order, which resume with another number of either.

        Raises
        ------
        UsageError
            The states belong to another dataset or selection, or some are missing.

        """
        states = [state] if isinstance(state, Mapping) else list(state)
        rest = self._joined(states)
        self._seed, self._shuffle = int(states[0]["seed"]), bool(states[0]["shuffle"])
        self._shared[_EPOCH], self._iteration, self._rest = rest.epoch, None, rest
        if not self._shared.in_worker:
            self._shared[_LOADS] = self._loads = self._loads + 1

    def __iter__(self) -> Iterator[Any]:
        self._iteration = self._next()
        self._rest = None
        if self._shared.in_worker:
            self._shared[_READ] = 1
        return self._episodes(self._iteration)

    def __len__(self) -> int:
        """Return the number of episodes of the next iteration: this rank's, of all its workers."""
        return span_length(self._next(self._worker or (0, 1)).spans)

    def rows(self) -> NDArray[np.int64]:
        """Return the row numbers that the next iteration reads, in order: (n,) int64."""
        return self._rows_of(self._next())

    def _episodes(self, iteration: _Iteration) -> Iterator[Any]:
        if self._loads != self._shared[_LOADS]:
            raise UsageError(
                "load_state_dict: the DataLoader's workers had started before and do not know of "
                "the state: make the DataLoader after loading it"
            )
        rows = self._rows_of(iteration)
        cache = self.dataset.row_group_cache
        # Rows come from WINDOW groups in turn: these stay, whatever else the dataset reads.
        recent: LRUCache[int, tuple[int, int, Any]] = LRUCache(WINDOW)
        bounds = cache.all_bounds()
        groups = np.searchsorted(bounds, rows, side="right") - 1
        for k in range(len(rows)):
            row = int(rows[k])
            first, _, reader = recent.get(int(groups[k]), functools.partial(cache.group_of, row))
            iteration.taken = k + 1
            yield reader.rows(row - first, row - first + 1)[0]

    def _rows_of(self, iteration: _Iteration) -> NDArray[np.int64]:
        order = epoch_order(
            self.dataset.blocks(), seed=self._seed, epoch=iteration.epoch, shuffle=self._shuffle
        )
        if not len(order):
            return order
        return self.dataset.row_numbers(order[positions(iteration.spans) % len(order)])

    def _next(self, worker: tuple[int, int] | None = None) -> _Iteration:
        """Return the iteration that comes next: a loaded rest, or the share of the epoch."""
        worker = worker or self._workers()
        count = len(self.dataset)
        rest = self._rest or _Remainder(self._shared[_EPOCH], _all(count), (0, 1), (0, 1))
        spans = rest.spans
        if rest.rank == (0, 1):
            spans = make_even(spans, count, self._rank[1], drop_last=self._drop_last)
            spans = share_of(spans, *self._rank)
        if rest.worker == (0, 1):
            spans = share_of(spans, *worker)
        return _Iteration(rest.epoch, spans)

    def _joined(self, states: Sequence[Mapping[str, Any]]) -> _Remainder:
        """Return the rest of an epoch that states hold together."""
        self._check_alike(states)
        try:
            parts = {
                (int(s["rank"]), int(s["worker_id"])): spans_of(s["remaining"]) for s in states
            }
            world, workers = int(states[0]["world_size"]), int(states[0]["num_workers"])
            epoch = int(states[0]["epoch"])
        except (KeyError, TypeError, ValueError) as error:
            raise UsageError(f"load_state_dict: {error!r}: no state of a stream") from error
        if len(parts) == len(states) == world * workers:
            return _Remainder(epoch, union(parts.values(), len(self.dataset)), (0, 1), (0, 1))
        if {(rank, world) for rank, _ in parts} != {self._rank}:
            raise UsageError(
                f"load_state_dict: rank: got {len(states)} states of {world} ranks x {workers} "
                f"workers, this is rank {self._rank[0]} of {self._rank[1]}: give its own states, "
                "or those of all ranks and workers"
            )
        if len(parts) == len(states) == workers:
            spans = [span for _, part in sorted(parts.items()) for span in part]
            return _Remainder(epoch, spans, self._rank, (0, 1))
        ((_, worker),) = parts if len(states) == 1 else ((0, -1),)
        if (worker, workers) != self._workers():
            raise UsageError(
                f"load_state_dict: worker_id, num_workers: got {len(states)} states of {workers} "
                f"workers, this is worker {self._workers()[0]} of {self._workers()[1]}: give its "
                "own state, or those of all workers"
            )
        return _Remainder(epoch, parts[self._rank[0], worker], self._rank, (worker, workers))

    def _check_alike(self, states: Sequence[Mapping[str, Any]]) -> None:
        if not states:
            raise UsageError("load_state_dict: expected a state, or those of all ranks, got none")
        names = ("seed", "epoch", "shuffle", "world_size", "num_workers")
        wanted = {name: states[0].get(name) for name in names}
        wanted["dataset"] = self.dataset.fingerprint
        for state in states:
            for name, value in wanted.items():
                if name not in state or state[name] != value:
                    raise UsageError(
                        f"load_state_dict: {name}: expected {value!r}, a state has "
                        f"{state.get(name)!r}: give states of one run, and open the same dataset"
                    )

    def _workers(self) -> tuple[int, int]:
        if self._worker is not None:
            return self._worker
        info = None
        if "torch.utils.data" in sys.modules:
            info = sys.modules["torch.utils.data"].get_worker_info()
        return (0, 1) if info is None else (info.id, info.num_workers)


def _all(count: int) -> Spans:
    return [(0, count)] if count else []


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
