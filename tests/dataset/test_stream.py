"""Orders are pure functions; shares are exact; a stream goes on where it was left."""

from __future__ import annotations

import json
import pickle
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from internav_data.dataset import load_dataset
from internav_data.dataset.order import WINDOW, epoch_order, share
from internav_data.records.errors import UsageError


@pytest.fixture(scope="module")
def ds(dataset_folder):
    return load_dataset(dataset_folder, columns=["episode_id"])


def ids(stream):
    return [row["episode_id"] for row in stream]


@given(st.integers(0, 10**6), st.integers(1, 64))
def test_shares_are_exact(count, members):
    bounds = [share(count, k, members) for k in range(members)]
    assert bounds[0][0] == 0
    assert bounds[-1][1] == count
    assert all(a[1] == b[0] for a, b in pairwise(bounds))
    sizes = {stop - start for start, stop in bounds}
    assert max(sizes) - min(sizes) <= 1


@settings(deadline=None)
@given(st.lists(st.integers(0, 30), max_size=30), st.integers(0, 2**40), st.integers(0, 1000))
def test_order_is_a_permutation_and_pure(sizes, seed, epoch):
    blocks = np.cumsum([0, *sizes])
    order = epoch_order(blocks, seed=seed, epoch=epoch, shuffle=True)
    assert sorted(order.tolist()) == list(range(blocks[-1]))
    again = epoch_order(blocks, seed=seed, epoch=epoch, shuffle=True)
    assert order.tolist() == again.tolist()


def test_order_depends_on_seed_and_epoch_and_stays_in_windows():
    blocks = np.arange(0, 10_001, 100)
    orders = [
        epoch_order(blocks, seed=s, epoch=e, shuffle=True).tolist()
        for s, e in ((0, 0), (0, 1), (1, 0))
    ]
    assert len({tuple(order) for order in orders}) == 3
    for start in range(0, 10_000, 100 * WINDOW):
        assert len({row // 100 for row in orders[0][start : start + 100 * WINDOW]}) <= WINDOW


def test_a_known_order_never_changes():
    order = epoch_order(np.array([0, 4, 8, 12]), seed=3, epoch=1, shuffle=True)
    assert order.tolist() == KNOWN


KNOWN = [1, 3, 8, 5, 9, 4, 11, 6, 2, 7, 10, 0]


@pytest.mark.parametrize(("world", "workers"), [(1, 1), (2, 1), (3, 2), (5, 4), (7, 3)])
def test_ranks_and_workers_part_the_epoch(ds, world, workers):
    whole = ids(ds.iterable(seed=4, epoch=2))
    parts = []
    for rank in range(world):
        for worker in range(workers):
            stream = ds.iterable(
                seed=4,
                epoch=2,
                rank=rank,
                world_size=world,
                worker_id=worker,
                num_workers=workers,
            )
            part = ids(stream)
            assert len(stream) == len(part)
            parts += part
    assert parts == whole
    assert Counter(parts).most_common(1)[0][1] == 1
    assert len(parts) == len(ds)


def test_unshuffled_is_the_order_on_disk(ds):
    assert ids(ds.iterable(shuffle=False)) == ids(ds)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 780), st.booleans(), st.integers(0, 5))
def test_resumed_stream_goes_on(dataset_folder, cut, shuffle, epoch):
    ds = load_dataset(dataset_folder, columns=["episode_id"], filters=[("index", "<", 4)])
    cut = min(cut, len(ds))
    whole = ids(ds.iterable(seed=1, epoch=epoch, shuffle=shuffle))
    stream = ds.iterable(seed=1, epoch=epoch, shuffle=shuffle)
    running = iter(stream)
    head = [next(running)["episode_id"] for _ in range(cut)]
    state = json.loads(json.dumps(stream.state_dict()))
    resumed = load_dataset(
        dataset_folder, columns=["episode_id"], filters=[("index", "<", 4)]
    ).iterable()
    resumed.load_state_dict(state)
    assert head + ids(resumed) == whole
    resumed.set_epoch(epoch)
    assert ids(resumed) == whole


def test_state_of_another_dataset_or_share_is_refused(ds, dataset_folder):
    state = ds.iterable(rank=0, world_size=2).state_dict()
    with pytest.raises(UsageError, match="rank"):
        ds.iterable(rank=1, world_size=2).load_state_dict(state)
    other = load_dataset(dataset_folder, "train", columns=["episode_id"])
    with pytest.raises(UsageError, match="dataset"):
        other.iterable(rank=0, world_size=2).load_state_dict(state)


@pytest.mark.parametrize(
    "arguments",
    [
        {"rank": 2, "world_size": 2},
        {"rank": -1},
        {"world_size": 0},
        {"worker_id": 0},
        {"worker_id": 3, "num_workers": 3},
    ],
)
def test_impossible_shares_are_refused(ds, arguments):
    with pytest.raises(UsageError, match=r"rank|worker"):
        ds.iterable(**arguments)


def test_stream_is_pickled_with_its_place(ds):
    stream = ds.iterable(seed=9)
    assert ids(pickle.loads(pickle.dumps(stream))) == ids(stream)  # noqa: S301 - our own


def collate(rows):
    return [row["episode_id"] for row in rows]


@pytest.mark.parametrize(("context", "workers"), [("fork", 2), ("spawn", 1)])
@pytest.mark.parametrize("style", ["map", "iterable"])
def test_torch_data_loader(ds, context, workers, style):
    data = pytest.importorskip("torch.utils.data")
    ds[0]  # open files and a cache before the fork
    source = ds.iterable(seed=1) if style == "iterable" else ds
    loader = data.DataLoader(
        source,
        batch_size=32,
        num_workers=workers,
        multiprocessing_context=context,
        collate_fn=collate,
    )
    got = [episode_id for batch in loader for episode_id in batch]
    assert sorted(got) == sorted(ids(ds))
    if style == "map":
        assert got == ids(ds)


def test_torch_data_loader_without_workers_and_with_records(dataset_folder):
    data = pytest.importorskip("torch.utils.data")
    ds = load_dataset(dataset_folder, "val")
    loader = data.DataLoader(ds.iterable(shuffle=False), batch_size=None, collate_fn=None)
    assert list(loader) == list(ds)


def test_to_torch(dataset_folder):
    torch = pytest.importorskip("torch")
    ds = load_dataset(dataset_folder)
    tensors = ds.to_torch()
    episodes = list(ds)
    assert tensors["shortest_path_m"].dtype == torch.float64
    assert tensors["mode"].tolist() == [int(e.mode == "lengthened") for e in episodes]
    assert tensors["obstructed_path_steps"].tolist() == [
        -1 if e.obstructed_path_steps is None else e.obstructed_path_steps for e in episodes
    ]
    assert tensors["obstructed_path_m"].isnan().tolist() == [
        e.obstructed_path_m is None for e in episodes
    ]
    assert tensors["sealed"].tolist() == [e.sealed for e in episodes]
    assert "episode_id" not in tensors
