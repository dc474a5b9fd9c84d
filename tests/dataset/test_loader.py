"""Episodes by number, filtered, as columns, and in other libraries' hands."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from internav_data.dataset import EPISODES, load_dataset, locate, read_manifest
from internav_data.dataset import from_table as records_of
from internav_data.dataset.select import condition
from internav_data.records import Episode, House
from internav_data.records.errors import CorruptDataError, UsageError


@pytest.fixture(scope="module")
def ds(dataset_folder):
    return load_dataset(dataset_folder)


@pytest.fixture(scope="module")
def everything(ds):
    return records_of(ds.to_table(), EPISODES)


def test_index_slice_iteration_and_table_give_the_same_records(ds, everything):
    assert len(ds) == len(everything) == 130 * 6
    assert list(ds) == everything
    assert [ds[i] for i in range(len(ds))] == everything
    assert ds[:] == everything
    assert ds.__getitems__([5, 1, 700]) == [everything[k] for k in (5, 1, 700)]
    assert isinstance(ds[np.int64(3)], Episode)


@settings(max_examples=60, deadline=None)
@given(st.slices(130 * 6))
def test_slices_are_those_of_a_list(ds, everything, cut):
    assert ds[cut] == everything[cut]


@pytest.mark.parametrize("number", [780, -781, 10**9])
def test_beyond_the_end(ds, number):
    with pytest.raises(IndexError):
        ds[number]


def test_rows_are_sorted_within_a_split(ds):
    for split in ("train", "val", "test"):
        keys = [(e.scene_id, e.index) for e in load_dataset(ds.path, split)]
        assert keys == sorted(keys)
        assert len(keys) == ds.manifest.counts[split].episodes


CONDITIONS = st.sampled_from(
    [
        ("room_count", ">=", 4),
        ("room_count", "in", [1, 3]),
        ("mode", "==", "blocked"),
        ("sealed", "==", True),
        ("shortest_path_m", "<", 9.5),
        ("obstructed_path_steps", ">", 30),
        ("scene_id", "!=", "scene-000002"),
        ("mode", "not in", ["blocked"]),
    ]
)
_OPS = {
    ">=": lambda a, b: a is not None and a >= b,
    ">": lambda a, b: a is not None and a > b,
    "<": lambda a, b: a is not None and a < b,
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
    "in": lambda a, b: a in b,
    "not in": lambda a, b: a not in b,
}


@settings(max_examples=20, deadline=None)
@given(st.lists(CONDITIONS, min_size=1, max_size=3), st.sampled_from([None, "train", "val"]))
def test_filters_select_the_same_rows_as_python(ds, everything, filters, split):
    def keep(episode):
        return split in (None, episode.split) and all(
            _OPS[op](getattr(episode, name), value) for name, op, value in filters
        )

    kept = load_dataset(ds.path, split, filters=filters)
    expected = [episode for episode in everything if keep(episode)]
    assert len(kept) == len(expected)
    assert list(kept) == expected
    assert records_of(kept.to_table(), EPISODES) == expected
    assert kept[-1:] == expected[-1:]


def test_a_choice_of_conditions(ds, everything):
    kept = load_dataset(ds.path, filters=[[("index", "==", 0)], [("index", "==", 3)]])
    assert list(kept) == [episode for episode in everything if episode.index in (0, 3)]


def test_null_is_selected_in_plain_and_in_nested_columns(ds, everything):
    for name in ("obstructed_path_m", "obstacles"):
        kept = load_dataset(ds.path, filters=[(name, "is", None)])
        rest = load_dataset(ds.path, filters=[(name, "is not", None), ("index", "<", 3)])
        assert list(kept) == [e for e in everything if getattr(e, name) is None]
        assert list(rest) == [e for e in everything if getattr(e, name) is not None and e.index < 3]
    assert condition(" expert IS  not Null ") == ("expert", "is not", None)
    assert condition("obstructed_path_m is null") == ("obstructed_path_m", "is", None)
    for text in ("expert = null", "expert!=None", "expert is", "expert is 3"):
        with pytest.raises(UsageError, match="is null"):
            condition(text)


@pytest.mark.parametrize(
    "filters",
    [
        [("rooms_count", ">", 1)],
        [("room_count", "~", 1)],
        [("room_count", ">", "four")],
        [("obstacles", "==", 1)],
        [],
        [("room_count", ">")],
        [("room_count", ">", 1), [("index", "==", 0)]],
        [("obstructed_path_m", "==", None)],
        [("expert", "is", 3)],
        "room_count > 4",
        [7],
    ],
)
def test_an_error_of_filters_states_the_expected_form(ds, filters):
    with pytest.raises(UsageError, match=r"expected|did you mean"):
        load_dataset(ds.path, filters=filters)


def test_an_error_of_a_filters_value_tells_the_columns_type(ds):
    with pytest.raises(UsageError, match="room_count is int16"):
        load_dataset(ds.path, filters=[("room_count", ">", "four")])


def test_an_episodes_id_is_no_number(ds, everything):
    chosen = everything[1].episode_id
    with pytest.raises(UsageError, match=r"filters=\[\('episode_id', '=', "):
        ds[chosen]
    assert load_dataset(ds.path, filters=[("episode_id", "=", chosen)])[0] == everything[1]


def test_an_empty_choice_of_columns_gives_none(ds):
    assert ds.to_table([]).column_names == []
    pytest.importorskip("torch")
    assert ds.to_torch(["obstacles"]) == {}


def test_unknown_split_and_column(ds):
    with pytest.raises(UsageError, match="training"):
        load_dataset(ds.path, split="training")
    with pytest.raises(UsageError, match="did you mean 'obstacles'"):
        load_dataset(ds.path, columns=["obstacle"])


def test_columns_give_dictionaries(ds, everything):
    part = load_dataset(ds.path, "val", columns=["obstacles", "shortest_path_m"])
    expected = [e for e in everything if e.split == "val"]
    rows = [{"obstacles": e.obstacles, "shortest_path_m": e.shortest_path_m} for e in expected]
    assert list(part) == rows
    assert part[3] == rows[3]
    assert part.to_table().column_names == ["obstacles", "shortest_path_m"]
    assert list(part.iterable(shuffle=False)) == rows


def test_scene_comes_with_its_assets(ds):
    for episode in ds[::97]:
        house = ds.scene(episode.scene_id)
        assert isinstance(house, House)
        assert house.scene_id == episode.scene_id
        assert len(house.rooms) == episode.room_count
        assert {t.asset_id for t in house.objects} <= house.assets.keys()
        assert {o.asset_id for o in episode.obstacles} <= ds.assets.keys()
        assert ds.scene(episode.scene_id) is house
    with pytest.raises(UsageError, match="scene-17"):
        ds.scene("scene-17")
    assert len(ds.scene_ids) == 130


def test_pickled_by_path_and_manifest(ds):
    some = load_dataset(ds.path, "train", filters=[("room_count", ">", 2)])
    some[0]
    data = pickle.dumps(some)
    assert len(data) < 4000, "no rows"
    again = pickle.loads(data)  # noqa: S301 - our own
    assert list(again) == list(some)
    assert again.fingerprint == some.fingerprint


def test_pandas_has_the_scalars(ds, everything):
    frame = ds.to_pandas()
    assert frame["shortest_path_m"].tolist() == [e.shortest_path_m for e in everything]
    assert frame["obstructed_path_steps"].isna().sum() == sum(
        e.obstructed_path_steps is None for e in everything
    )
    assert "obstacles" not in frame


def test_row_groups_end_where_scenes_end(dataset_folder):
    import pyarrow.parquet as pq

    counts = []
    for file in read_manifest(dataset_folder).of("episodes"):
        parquet = pq.ParquetFile(locate(dataset_folder, file))
        seen: set[str] = set()
        for group in range(parquet.num_row_groups):
            ids = set(parquet.read_row_group(group, columns=["scene_id"])["scene_id"].to_pylist())
            assert not ids & seen
            seen |= ids
        rows = [parquet.metadata.row_group(k).num_rows for k in range(parquet.num_row_groups)]
        counts += rows[:-1]
    assert counts
    assert all(400 <= count < 400 + 6 for count in counts)


def test_memory_held_is_bounded(ds):
    some = load_dataset(ds.path)
    some.limit_caches(row_group_bytes=1, files=1, houses=2)
    for number in (0, 779, 400, 1, 778):
        some[number]
        assert some.row_group_cache.groups_held == 1


def test_a_read_file_leaves_no_cycle(ds):
    """A footer of 2 MB in a cycle would stay until the collector runs, which sees it as small."""
    import gc

    some = load_dataset(ds.path)
    some.to_table(["room_count"])
    gc.collect()
    gc.disable()
    try:
        some.to_table(["room_count", "mode"])
        assert gc.collect() == 0
    finally:
        gc.enable()


def test_another_process_opens_its_own_files(ds, monkeypatch):
    some = load_dataset(ds.path)
    some[0]
    cache = some.row_group_cache
    file, (_, _, reader) = cache.file(0), cache.group_of(0)
    assert cache.group_of(0)[2] is reader
    monkeypatch.setattr("os.getpid", lambda: -1)
    assert some[0] == ds[0]
    assert cache.group_of(0)[2] is not reader
    assert cache.file(0) is not file


def test_duckdb_reads_it(dataset_folder, everything):
    import duckdb

    found = duckdb.sql(
        f"select count(*), sum(len(obstacles)), sum(list_sum([o.mass_kg for o in obstacles])), "  # noqa: S608
        f"sum(start.x) from '{dataset_folder}/data/episodes/*.parquet'"
    ).fetchall()[0]
    assert found == (
        len(everything),
        sum(len(e.obstacles) for e in everything),
        pytest.approx(sum(o.mass_kg for e in everything for o in e.obstacles)),
        pytest.approx(sum(e.start.x for e in everything)),
    )


def test_polars_reads_it(dataset_folder, everything):
    import polars as pl

    frame = pl.read_parquet(f"{dataset_folder}/data/episodes/*.parquet")
    by_id = {e.episode_id: e for e in everything}
    for row in frame.sample(20, seed=1).iter_rows(named=True):
        episode = by_id[row["episode_id"]]
        expert = episode.expert
        assert (row["expert"] and row["expert"]["actions"]) == (expert and list(expert.actions))
        assert row["room_paths"] == [list(path) for path in episode.room_paths]
        assert [o["quaternion"]["w"] for o in row["obstacles"]] == [
            o.quaternion[3] for o in episode.obstacles
        ]


def test_pandas_reads_every_file(dataset_folder):
    import pandas as pd

    for file in read_manifest(dataset_folder).files:
        assert len(pd.read_parquet(dataset_folder / file.path)) == file.rows


def test_numbers_of_a_row_are_plain_python(ds):
    episode = ds[0]
    assert type(episode.shortest_path_m) is float
    assert type(episode.index) is int
    assert type(episode.sealed) is bool
    assert type(episode.obstacles[0].quaternion) is tuple
    assert type(episode.expert.actions[0]) is int


@pytest.mark.parametrize("split", ["train", "val", "test"])
def test_a_split_needs_no_file_of_another_one(damaged_folder, split):
    whole = load_dataset(damaged_folder)
    episodes = [episode for episode in whole if episode.split == split]
    houses = {e.scene_id: whole.scene(e.scene_id) for e in episodes[::40]}
    for file in whole.manifest.files:
        if file.split not in {None, split}:
            (damaged_folder / file.path).unlink()
    ds = load_dataset(damaged_folder, split)
    assert list(ds) == episodes
    assert {scene_id: ds.scene(scene_id) for scene_id in houses} == houses
    assert {e.scene_id for e in ds} == set(ds.scene_ids)
    assert len(load_dataset(damaged_folder, split, [("room_count", ">", 0)])) == len(episodes)
    with pytest.raises(CorruptDataError, match="missing"):
        load_dataset(damaged_folder)
    other = "scene-000001" if split != "test" else "scene-000000"
    with pytest.raises(UsageError, match=f"split {split}: no scene '{other}' among its"):
        ds.scene(other)


def test_assets_are_needed_for_houses_alone(damaged_folder):
    (file,) = load_dataset(damaged_folder).manifest.of("assets")
    (damaged_folder / file.path).unlink()
    ds = load_dataset(damaged_folder, "train")
    assert len(list(ds)) == len(ds)
    with pytest.raises(CorruptDataError, match=f"{file.path}.*missing"):
        ds.scene(ds[0].scene_id)


def test_a_missing_file_of_the_split_itself_is_noticed_on_loading(damaged_folder):
    file = load_dataset(damaged_folder).manifest.of("scenes", "val")[0]
    (damaged_folder / file.path).unlink()
    with pytest.raises(CorruptDataError, match=f"{file.path}.*missing"):
        load_dataset(damaged_folder, "val")
    assert load_dataset(damaged_folder, "test")[0].split == "test"
