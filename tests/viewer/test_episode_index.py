import itertools
from dataclasses import replace

import numpy as np
import pytest

from internav_data.dataset import load_dataset
from internav_data.records.errors import UsageError
from internav_data.viewer.episode_filter import EpisodeFilter, page_of_query

CHOICES = {
    "rooms": ("", "2", "1,3"),
    "mode": ("", "blocked", "blocked,lengthened"),
    "sealed": ("", "yes", "no"),
    "split": ("", "train,val"),
    "obstacles": ("", "2", "1-1", "2-"),
    "distance": ("", "3.11-9", "-8", "5.33-5.33"),
    "types": ("", "Apple", "Apple,Chair", "Sofa"),
}


@pytest.fixture(scope="module")
def episodes(folder):
    return list(load_dataset(folder))


def slowly(episodes, query):
    """Rows that the conditions keep, one record after the other."""

    def within(value, text):
        low, dash, high = text.partition("-")
        return float(low or 0) <= value <= (float(high or "inf") if dash else float(low))

    tests = {
        "rooms": lambda e, text: str(e.room_count) in text.split(","),
        "mode": lambda e, text: e.mode in text.split(","),
        "sealed": lambda e, text: e.sealed == (text == "yes"),
        "split": lambda e, text: e.split in text.split(","),
        "obstacles": lambda e, text: within(e.obstacle_count, text),
        "distance": lambda e, text: within(e.shortest_path_m, text),
        "types": lambda e, text: bool({o.type for o in e.obstacles} & set(text.split(","))),
    }
    return [
        row
        for row, episode in enumerate(episodes)
        if all(tests[key](episode, text) for key, text in query.items() if text)
    ]


def test_filters_keep_what_plain_python_keeps(viewed, episodes):
    kept = 0
    for values in itertools.product(*CHOICES.values()):
        query = dict(zip(CHOICES, values, strict=True))
        if sum(map(bool, values)) > 3:
            continue
        rows = viewed.index.select(EpisodeFilter.of_query(query)).tolist()
        assert rows == slowly(episodes, query), query
        kept += len(rows)
    assert kept > 1000


def test_counts_leave_out_their_own_condition(viewed, episodes):
    query = {"mode": "blocked", "sealed": "yes", "types": "Apple"}
    counts = viewed.index.counts(EpisodeFilter.of_query(query))
    for key, values in (("mode", ("blocked", "lengthened")), ("split", ("train", "val", "test"))):
        others = {name: text for name, text in query.items() if name != key}
        for value in values:
            assert counts[key][value] == len(slowly(episodes, others | {key: value}))
    assert counts["types"]["Chair"] == len(slowly(episodes, query | {"types": "Chair"}))
    assert sum(counts["distance"].values()) == len(slowly(episodes, query))


def test_more_types_than_a_word_has_bits(viewed):
    index, names = viewed.index, tuple(f"T{t:03d}" for t in range(130))
    bits = np.zeros((len(index), 3), np.uint64)
    for row in range(len(index)):
        for t in (row, row + 64):
            bits[row, t // 64] |= np.uint64(1 << t % 64)
    many = replace(index, type_names=names, types=bits)
    for t in (0, 20, 64, 90):
        kept = many.select(EpisodeFilter(types=frozenset([names[t]]))).tolist()
        assert kept == [row for row in range(len(index)) if t in (row, row + 64)]
        assert many.counts(EpisodeFilter())["types"][names[t]] == len(kept)
    assert many.summary(3)["types"] == ["T003", "T067"]


def test_orders_begin_with_the_most_and_keep_ties(viewed, episodes):
    longest = viewed.index.select(EpisodeFilter(order="longest")).tolist()
    assert longest == sorted(range(36), key=lambda row: -episodes[row].shortest_path_m)
    most = viewed.index.select(EpisodeFilter(order="obstacles")).tolist()
    assert most == sorted(range(36), key=lambda row: -episodes[row].obstacle_count)


def test_summaries_are_those_of_the_records_that_the_first_page_reads(viewed, folder):
    from internav_data.viewer import ViewedDataset

    new = ViewedDataset(folder)
    before = new.episodes({"limit": "12"})
    assert before["counts"] is None
    _ = viewed.index
    after = viewed.episodes({"limit": "12"})
    assert after["counts"] is not None
    assert before["episodes"] == after["episodes"]
    assert before["total"] == after["total"] == 36


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ({"room": "1"}, ["filter 'room'", "rooms"]),
        ({"rooms": "many"}, ["rooms", "a number", "'many'"]),
        ({"mode": "open"}, ["mode", "blocked", "'open'"]),
        ({"sealed": "maybe"}, ["sealed", "yes, no"]),
        ({"distance": "nan-3"}, ["distance", "a number", "'nan'"]),
        ({"obstacles": "-1-3"}, ["obstacles", "'1-3'"]),
        ({"order": "newest"}, ["order", "longest"]),
        ({"types": ",".join(map(str, range(300)))}, ["types", "at most 200"]),
    ],
)
def test_wrong_conditions_are_named(query, words):
    with pytest.raises(UsageError) as error:
        EpisodeFilter.of_query(query)
    assert all(word in str(error.value) for word in words), error.value


@pytest.mark.parametrize(
    "query", [{"limit": "97"}, {"limit": "0"}, {"offset": "-1"}, {"limit": "x"}]
)
def test_pages_are_bounded(query):
    with pytest.raises(UsageError):
        page_of_query(query)
