"""Orders are pure functions; shares are exact; a stream goes on where it was left."""

from __future__ import annotations

import json
import pickle
from collections import Counter
from itertools import pairwise

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from internav_data.dataset import load_dataset
from internav_data.dataset.order import WINDOW, epoch_order
from internav_data.dataset.spans import share
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
                drop_last=None,
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


def streams(ds, world, workers, **arguments):
    return [
        ds.iterable(rank=r, world_size=world, worker_id=w, num_workers=workers, **arguments)
        for r in range(world)
        for w in range(workers)
    ]


@pytest.mark.parametrize("world", [1, 2, 3, 4, 7, 8, 11])
@pytest.mark.parametrize("drop_last", [False, True])
def test_ranks_read_equally_many(ds, world, drop_last):
    parts = [ids(ds.iterable(rank=r, world_size=world, drop_last=drop_last)) for r in range(world)]
    assert len({len(part) for part in parts}) == 1
    counts = Counter(episode for part in parts for episode in part)
    missing, twice = len(ds) - len(counts), sum(counts.values()) - len(counts)
    assert missing == (len(ds) % world if drop_last else 0)
    assert twice == (0 if drop_last else -len(ds) % world)


def test_more_ranks_than_episodes_read_one_each(dataset_folder):
    few = load_dataset(dataset_folder, columns=["episode_id"], filters=[("room_count", ">", 99)])
    assert ids(few.iterable(world_size=3)) == []
    few = load_dataset(dataset_folder, columns=["episode_id"], filters=[("index", "<", 4)])
    world = 2 * len(few) + 5
    parts = [ids(few.iterable(rank=r, world_size=world)) for r in range(world)]
    assert {len(part) for part in parts} == {1}
    assert {part[0] for part in parts} == set(ids(few))


PAIRS = [(1, 1), (2, 1), (1, 3), (2, 2), (3, 2), (5, 1), (4, 3)]


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.sampled_from(PAIRS), min_size=2, max_size=4),
    st.sampled_from([False, True, None]),
    st.booleans(),
    st.data(),
)
def test_a_run_resumes_with_other_ranks_and_workers(dataset_folder, runs, drop_last, shuffle, data):
    ds = load_dataset(dataset_folder, columns=["episode_id"])
    read, states, spare = Counter(), [], 0
    for number, (world, workers) in enumerate(runs):
        spare += world - 1
        states_before, states = states, []
        for stream in streams(ds, world, workers, seed=3, shuffle=shuffle, drop_last=drop_last):
            if states_before:
                stream.load_state_dict(data.draw(st.permutations(states_before)))
            last = number == len(runs) - 1
            count = len(stream) if last else data.draw(st.integers(0, len(stream)))
            running = iter(stream)
            read.update(next(running)["episode_id"] for _ in range(count))
            states.append(json.loads(json.dumps(stream.state_dict())))
    missing, twice = len(ds) - len(read), sum(read.values()) - len(read)
    assert missing <= (spare if drop_last else 0)
    assert twice <= (spare if drop_last is False else 0)
    assert all(state["remaining"] == [] for state in states)


def test_a_rank_resumes_from_its_own_states_with_other_workers(ds):
    whole = ids(ds.iterable(rank=1, world_size=3))
    old = [ds.iterable(rank=1, world_size=3, worker_id=k, num_workers=2) for k in range(2)]
    read = [next(iter(stream))["episode_id"] for stream in old]
    states = [stream.state_dict() for stream in old]
    for workers in (1, 2, 5):
        parts = []
        for k in range(workers):
            new = ds.iterable(rank=1, world_size=3, worker_id=k, num_workers=workers)
            new.load_state_dict(states)
            parts += ids(new)
        assert sorted(parts + read) == sorted(whole)


def test_states_that_are_not_all_or_not_its_own_are_refused(ds):
    states = [stream.state_dict() for stream in streams(ds, 2, 2)]
    mine = {"rank": 0, "world_size": 2, "worker_id": 1, "num_workers": 2}
    ds.iterable(**mine).load_state_dict(states[1])
    for wrong, name in (
        (states[0], "worker_id"),
        (states[2], "rank"),
        (states[:3], "rank"),
        ([*states, states[0]], "rank"),
        ([states[1], states[1]], "worker_id"),
        ([states[0], {**states[1], "epoch": 5}], "epoch"),
        ([], "none"),
        ({**states[1], "remaining": [[0, 1, 2]]}, "no state"),
        ({**states[1], "remaining": [[5, 1]]}, "no range"),
        ({name: states[1][name] for name in states[1] if name != "remaining"}, "remaining"),
    ):
        with pytest.raises(UsageError, match=name):
            ds.iterable(**mine).load_state_dict(wrong)
    with pytest.raises(UsageError, match="worker_id"):
        ds.iterable(rank=0, world_size=2).load_state_dict(states[0])


def test_the_epoch_of_a_state_may_be_set_again(ds):
    stream = ds.iterable(epoch=3)
    running = iter(stream)
    head = [next(running)["episode_id"] for _ in range(10)]
    again = ds.iterable()
    again.load_state_dict(stream.state_dict())
    again.set_epoch(3)  # as loops do before each epoch
    assert len(again) == len(ds) - 10
    assert head + ids(again) == ids(ds.iterable(epoch=3))
    again.load_state_dict(stream.state_dict())
    again.set_epoch(4)
    assert ids(again) == ids(ds.iterable(epoch=4))


def collate(rows):
    return [row["episode_id"] for row in rows]


@pytest.mark.parametrize(
    ("style", "context", "workers"),
    [("map", "fork", 2), ("map", "spawn", 1), ("iterable", "fork", 2)],  # spawned streams: below
)
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


@pytest.mark.parametrize(
    ("context", "workers", "persistent"),
    [("fork", 2, True), ("fork", 2, False), ("spawn", 1, True), (None, 0, False)],
)
def test_set_epoch_reaches_workers(ds, context, workers, persistent):
    data = pytest.importorskip("torch.utils.data")
    stream = ds.iterable(seed=1)
    loader = data.DataLoader(
        stream,
        batch_size=32,
        num_workers=workers,
        persistent_workers=persistent,
        multiprocessing_context=context,
        collate_fn=collate,
    )

    def epoch(number):
        stream.set_epoch(number)
        return [episode for batch in loader for episode in batch]

    orders = [epoch(number) for number in (0, 1, 0, 7)]
    assert orders[0] == orders[2]
    assert len({tuple(order) for order in orders}) == 3
    assert all(sorted(order) == sorted(ids(ds)) for order in orders)
    if workers < 2:
        assert orders[3] == ids(ds.iterable(seed=1, epoch=7))


def test_states_and_workers_that_do_not_know_of_each_other_are_refused(ds):
    data = pytest.importorskip("torch.utils.data")
    stream = ds.iterable(seed=1)
    state = stream.state_dict()
    loader = data.DataLoader(
        stream,
        batch_size=None,
        num_workers=1,
        persistent_workers=True,
        multiprocessing_context="fork",
    )
    next(iter(loader))
    with pytest.raises(UsageError, match="state_dict: a DataLoader's workers"):
        stream.state_dict()
    stream.load_state_dict(state)
    with pytest.raises(UsageError, match="make the DataLoader after"):
        list(loader)


def test_a_state_goes_into_any_number_of_a_loaders_workers(ds):
    data = pytest.importorskip("torch.utils.data")
    old = streams(ds, 2, 1)
    head = [next(iter(stream))["episode_id"] for stream in old]
    stream = ds.iterable()
    stream.load_state_dict([stream.state_dict() for stream in old])
    loader = data.DataLoader(stream, batch_size=None, num_workers=2, multiprocessing_context="fork")
    rest = [row["episode_id"] for row in loader]
    assert len(rest) == len(stream)
    assert sorted(head + rest) == sorted(ids(ds))


def test_torch_data_loader_without_workers_and_with_records(dataset_folder):
    data = pytest.importorskip("torch.utils.data")
    ds = load_dataset(dataset_folder, "val")
    loader = data.DataLoader(ds.iterable(shuffle=False), batch_size=None, collate_fn=None)
    assert list(loader) == list(ds)


@pytest.mark.parametrize("rows", [[True, None, False], [True, False]])
def test_truth_values_that_can_be_missing_have_one_type(rows):
    pytest.importorskip("torch")
    from internav_data.dataset.tensors import tensors

    tensor = tensors(pa.table({"agreed": rows}))["agreed"]
    assert str(tensor.dtype) == "torch.int8"
    assert tensor.tolist() == [-1 if row is None else int(row) for row in rows]


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
