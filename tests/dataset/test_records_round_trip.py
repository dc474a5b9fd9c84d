"""Whatever a record can hold comes back from Arrow and from Parquet as it was."""

from __future__ import annotations

import dataclasses
import math
import re

import pyarrow.parquet as pq
import pytest
import strategies
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from internav_data.dataset import (
    ASSETS,
    EPISODES,
    SCENES,
    from_table,
    read_table,
    to_table,
    write_parquet,
)
from internav_data.dataset.decode import RecordReader
from internav_data.records import Episode, Start
from internav_data.records.errors import ValidationError

EASY = settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))


@EASY
@given(st.lists(strategies.episodes, max_size=5))
def test_episodes_return_from_arrow(records):
    assert from_table(to_table(records, EPISODES), EPISODES) == records


@EASY
@given(st.lists(strategies.houses, max_size=3))
def test_houses_return_from_arrow(records):
    assert from_table(to_table(records, SCENES), SCENES, {"assets": {}}) == records


@EASY
@given(st.lists(strategies.assets, max_size=3))
def test_assets_return_from_arrow(records):
    assert from_table(to_table(records, ASSETS), ASSETS) == records


@EASY
@given(records=st.lists(strategies.episodes, min_size=1, max_size=6))
def test_episodes_return_from_parquet(tmp_path_factory, records):
    path = tmp_path_factory.mktemp("parquet") / "x.parquet"
    write_parquet(path, records, EPISODES)
    back = from_table(read_table(path, EPISODES), EPISODES)
    assert back == records
    assert [type(v) for v in dataclasses.astuple(back[0])] == [
        type(v) for v in dataclasses.astuple(records[0])
    ]


def test_poses_of_outcomes_alone_have_no_dictionary(dataset_folder):
    group = pq.read_metadata(next(dataset_folder.glob("data/episodes/*"))).row_group(0)
    chunks = [group.column(k) for k in range(group.num_columns)]
    plain = {c.path_in_schema for c in chunks if "RLE_DICTIONARY" not in c.encodings}
    poses = {c.path_in_schema for c in chunks if re.search(r"[._]pose\.", c.path_in_schema)}
    flags = {c.path_in_schema for c in chunks if c.physical_type == "BOOLEAN"}
    assert poses
    assert plain == poses | flags


@EASY
@given(records=st.lists(strategies.episodes, min_size=2, max_size=6), data=st.data())
def test_any_run_of_rows_of_a_sliced_table_is_read(records, data):
    cut = data.draw(st.integers(0, len(records)))
    reader = RecordReader(to_table(records, EPISODES).slice(cut), EPISODES)
    a, b = sorted(data.draw(st.tuples(*[st.integers(0, len(records) - cut)] * 2)))
    assert reader.rows(a, b) == records[cut:][a:b]


@pytest.mark.parametrize(
    ("values", "column"),
    [
        ({"shortest_path_m": math.nan}, "shortest_path_m"),
        ({"room_count": 1 << 15}, "room_count"),
        ({"mode": "shut"}, "mode"),
        ({"index": None}, "index"),
        ({"scene_id": 17}, "scene_id"),
        ({"start": strategies.plain(Start, x=math.inf)}, "start.x"),
    ],
)
def test_a_value_that_its_column_cannot_hold_is_refused_by_name(values, column):
    episode = strategies.plain(Episode, **values)
    with pytest.raises(ValidationError, match=f"column {column}:"):
        to_table([episode], EPISODES)


def test_a_table_of_other_columns_is_refused():
    with pytest.raises(ValidationError, match="missing"):
        from_table(to_table([], EPISODES).drop_columns(["seed"]), EPISODES)
