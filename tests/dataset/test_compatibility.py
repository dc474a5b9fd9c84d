"""Datasets of later and earlier releases of the same format are read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from internav_data.dataset import EPISODES, from_table, load_dataset, read_table, to_table
from internav_data.dataset.compatibility import conformed, problems
from internav_data.dataset.parquet import open_parquet
from internav_data.records.errors import CorruptDataError

KEPT = sorted((Path(__file__).parents[1] / "data").glob("dataset-*"))


@pytest.mark.parametrize("folder", KEPT, ids=lambda folder: folder.name)
def test_every_dataset_ever_kept_loads(folder):
    dataset = load_dataset(folder)
    episodes = list(dataset)
    assert episodes
    assert all(episode.obstacles and dataset.scene(episode.scene_id) for episode in episodes)


def test_outcomes_of_the_first_kept_dataset_have_no_poses():
    episodes = list(load_dataset(KEPT[0]))
    outcomes = [o for e in episodes for obstacle in e.obstacles for o in obstacle.outcomes]
    assert any(outcome.success for outcome in outcomes)
    assert {(o.pose, o.moved, o.at_rest) for o in outcomes} == {(None, None, None)}


def test_there_is_a_kept_dataset():
    assert KEPT


def episodes_of(folder):
    return list(load_dataset(folder, "train"))


def with_part(column, change):
    """Return a list column whose items, structs, are changed as a table of their own."""
    chunk = pa.concat_arrays(column.chunks)
    flat = change(pa.Table.from_struct_array(chunk.values)).combine_chunks()
    fields = [flat.schema.field(k) for k in range(flat.num_columns)]
    items = pa.StructArray.from_arrays(
        [flat.column(k).chunk(0) for k in range(len(fields))], fields=fields
    )
    kind = pa.list_(pa.field("element", items.type, nullable=False))
    return pa.ListArray.from_arrays(chunk.offsets, items, type=kind)


def test_later_columns_are_ignored_at_the_top_and_inside(dataset_folder, tmp_path):
    episodes = episodes_of(dataset_folder)
    table = to_table(episodes, EPISODES)
    at = table.column_names.index("obstacles")
    news = with_part(
        table.column("obstacles"), lambda t: t.append_column("news", pa.array(range(t.num_rows)))
    )
    kind = pa.field("obstacles", news.type, nullable=False)
    later = table.set_column(at, kind, news).append_column("news", pa.array(["x"] * len(table)))
    pq.write_table(later, tmp_path / "later.parquet")
    assert from_table(read_table(tmp_path / "later.parquet", EPISODES), EPISODES) == episodes
    names = ["mode", "expert.steps", "obstacles.list.element.type"]
    with open_parquet(tmp_path / "later.parquet", EPISODES) as file:
        part = file.read_all(names)
    assert part.column("mode").to_pylist() == [episode.mode for episode in episodes]
    assert part.column("expert").to_pylist() == [
        episode.expert and {"steps": episode.expert.steps} for episode in episodes
    ]
    assert part.column("obstacles").to_pylist() == [
        [{"type": obstacle.type} for obstacle in episode.obstacles] for episode in episodes
    ]


def test_columns_that_an_earlier_release_did_not_write_are_null(dataset_folder):
    episodes = episodes_of(dataset_folder)
    table = to_table(episodes, EPISODES)
    at = table.column_names.index("obstacles")
    fewer = with_part(table.column("obstacles"), lambda t: t.drop_columns(["outcomes"]))
    kind = pa.field("obstacles", fewer.type, nullable=False)
    earlier = table.set_column(at, kind, fewer).drop_columns(["expert"])
    assert not problems(earlier.schema, EPISODES.schema)
    back = from_table(conformed(earlier, EPISODES.schema), EPISODES)
    bare = [
        replace(
            episode,
            expert=None,
            obstacles=tuple(replace(o, outcomes=None) for o in episode.obstacles),
        )
        for episode in episodes
    ]
    assert back == bare


@pytest.mark.parametrize("name", ["mode", "start", "obstacles"])
def test_a_column_that_must_be_there_is_named(dataset_folder, tmp_path, name):
    table = to_table(episodes_of(dataset_folder), EPISODES).drop_columns([name])
    pq.write_table(table, tmp_path / "less.parquet")
    with pytest.raises(CorruptDataError, match=f"{name} is missing"):
        read_table(tmp_path / "less.parquet", EPISODES)


def test_another_type_is_named(dataset_folder):
    schema = EPISODES.schema
    at = schema.get_field_index("sealed")
    other = schema.set(at, pa.field("sealed", pa.int8(), nullable=False))
    assert problems(other, schema) == ["sealed is int8, expected bool"]
    maybe = schema.set(at, pa.field("sealed", pa.bool_()))
    assert problems(maybe, schema) == ["sealed may be null"]
