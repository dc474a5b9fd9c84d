"""The cache against a list that is searched from its end."""

from __future__ import annotations

import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from internav_data.core.lru import LRUCache


@given(
    st.lists(st.integers(0, 9), max_size=60),
    st.integers(0, 12),
    st.lists(st.integers(0, 5), min_size=10, max_size=10),
)
def test_the_entries_used_last_stay(keys, capacity, weights):
    evicted, made = [], []

    def make(key):
        made.append(key)
        return key

    cache = LRUCache(capacity, weigh=lambda key: weights[key], on_evict=evicted.append)
    latest = []  # keys, the newest last
    expected_made, expected_evicted = [], []
    for key in keys:
        if key in latest:
            latest.remove(key)
        else:
            expected_made.append(key)
        latest.append(key)
        while sum(weights[k] for k in latest) > capacity and len(latest) > 1:
            expected_evicted.append(latest.pop(0))
        assert cache.get(key, lambda key=key: make(key)) == key
        assert [k for k in range(10) if k in cache] == sorted(latest)
        assert len(cache) == len(latest)
    assert (made, evicted) == (expected_made, expected_evicted)
    cache.clear()
    assert len(cache) == 0
    assert evicted == expected_evicted + latest


def test_a_known_value_costs_one_hash_of_its_key():
    """Keys are problems of physics: hashing one takes longer than all else."""
    hashed = []

    class Key:
        def __hash__(self):
            hashed.append(self)
            return 1

    cache, key = LRUCache(4), Key()
    cache.get(key, int)
    hashed.clear()
    cache.get(key, int)
    assert len(hashed) == 1


def test_the_newest_entry_stays_however_heavy():
    cache = LRUCache(1, weigh=len)
    assert cache.get("a", lambda: "heavy") == "heavy"
    assert "a" in cache
    assert cache.get("b", lambda: "heavier") == "heavier"
    assert ("a" in cache, "b" in cache) == (False, True)


def test_an_error_while_making_changes_nothing():
    cache = LRUCache(1)
    cache.get(1, lambda: "one")
    with pytest.raises(ZeroDivisionError):
        cache.get(2, lambda: 1 / 0)
    assert 1 in cache
    assert 2 not in cache


def test_a_capacity_can_grow():
    cache = LRUCache(1)
    cache.get(1, int)
    cache.capacity = 2
    cache.get(2, int)
    assert len(cache) == 2


def test_threads_that_ask_for_one_value_share_it():
    cache, made, others = LRUCache(4), [], []

    def make():
        made.append(threading.get_ident())
        if len(made) == 1:  # the second thread asks while the first one is at it
            others.append(threading.Thread(target=lambda: cache.get("key", make)))
            others[0].start()
            others[0].join(0.3)
        return object()

    first = cache.get("key", make)
    others[0].join()
    assert cache.get("key", make) is first
    assert len(made) == 1
