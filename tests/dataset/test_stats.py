"""Statistics from columns against counting record by record; what else lies beside the data."""

from __future__ import annotations

import json
import statistics
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from internav_data.core.field_docs import descriptions
from internav_data.dataset import compute_stats, load_dataset, read_manifest
from internav_data.dataset.nodes import Record, Sequence
from internav_data.dataset.stats import stats_of
from internav_data.dataset.summary_statistics import path_efficiency
from internav_data.dataset.tables import TABLES


@pytest.mark.parametrize("split", [None, "train", "val"])
def test_statistics_are_those_of_the_records(dataset_folder, split):
    ds = load_dataset(dataset_folder, split)
    episodes = list(ds)
    stats = compute_stats(ds)
    assert stats == compute_stats(dataset_folder, split)
    assert stats["episodes"] == len(episodes)
    assert stats["scenes"] == len({e.scene_id for e in episodes})
    for row, (low, high) in zip(stats["table2"], ((1, 2), (3, 5), (6, 10)), strict=True):
        part = [e for e in episodes if low <= e.room_count <= high]
        assert row["rooms"] == f"{low}-{high}"
        assert row["episodes"] == len(part)
        assert row["scenes"] == len({e.scene_id for e in part})
        assert row["ratio"] == pytest.approx(len(part) / len(episodes), abs=1e-6)
        means = {
            "obstacle_num": [len(e.obstacles) for e in part],
            "distance_m": [0.25 * e.shortest_path_steps for e in part],
            "cross_room_num": [e.rooms_on_path for e in part],
        }
        for name, values in means.items():
            assert row[name] == pytest.approx(statistics.mean(values or [0.0]), abs=1e-6)
        assert row["blocked"] == sum(e.mode == "blocked" for e in part)
        assert row["sealed"] == sum(e.sealed for e in part)
    obstacles = [o for e in episodes for o in e.obstacles]
    assert stats["obstacle_types"] == Counter(o.type for o in obstacles)
    assert stats["obstacles_pushable"] == sum(o.pushable for o in obstacles)
    assert stats["obstacles_pickable"] == sum(o.pickable for o in obstacles)
    assert stats["obstacles_fixed"] == sum(not (o.pushable or o.pickable) for o in obstacles)
    assert stats["facing_wall_share"] is None, "nothing states it"
    assert stats["relevant_share"] is None
    assert stats["modes"] == Counter(e.mode for e in episodes)
    blocked = [e for e in episodes if e.mode == "blocked"]
    share = sum(e.sealed for e in blocked) / len(blocked)
    assert stats["sealed_share_of_blocked"] == pytest.approx(share, abs=1e-6)
    assert stats["room_count"] == Counter(str(e.room_count) for e in episodes)
    longer = [
        e.obstructed_path_steps - e.shortest_path_steps for e in episodes if e.mode == "lengthened"
    ]
    assert stats["detour_steps"]["median"] == statistics.median(longer)
    assert stats["shortest_path_m"]["mean"] == pytest.approx(
        statistics.mean(e.shortest_path_m for e in episodes), abs=1e-6
    )


@pytest.mark.parametrize("split", [None, "train"])
def test_interactions_are_those_of_the_records(dataset_folder, split):
    episodes = list(load_dataset(dataset_folder, split))
    stats = compute_stats(str(dataset_folder), split)
    spl = [
        e.shortest_path_m / max(e.shortest_path_m, e.expert.path_m) if e.expert else 0.0
        for e in episodes
    ]
    sts = [e.shortest_path_m / 0.25 / e.expert.steps if e.expert else 0.0 for e in episodes]
    solved = [e.expert for e in episodes if e.expert]
    assert 0 < len(solved) < len(episodes), "some have none"
    expert = stats["expert"]
    assert expert["solved"] == len(solved)
    assert expert["solved_share"] == pytest.approx(len(solved) / len(episodes), abs=1e-6)
    assert expert["spl"] == pytest.approx(statistics.mean(spl), abs=1e-6)
    assert expert["sts"] == pytest.approx(statistics.mean(sts), abs=1e-6)
    assert expert["steps"]["mean"] == pytest.approx(statistics.mean(e.steps for e in solved))
    interactions = Counter(str(e.pushes + e.picks) for e in solved)
    assert expert["interactions"] == interactions
    assert expert["pushes"] == pytest.approx(statistics.mean(e.pushes for e in solved), abs=1e-6)
    assert expert["picks"] == pytest.approx(statistics.mean(e.picks for e in solved), abs=1e-6)
    for row in stats["outcomes"]:
        able = "pickable" if row["action"] == "pick" else "pushable"
        tried = [
            outcome
            for e in episodes
            for o in e.obstacles
            for outcome in o.outcomes
            if outcome.action == row["action"] and getattr(o, able)
        ]
        assert row["possible"] == len(tried)
        assert row["success_share"] == pytest.approx(
            statistics.mean(o.success for o in tried), abs=1e-6
        )
        assert row["opened"] == sum(o.opened for o in tried)
    blocked = [e for e in episodes if e.mode == "blocked"]
    opened = [any(x.opened for o in e.obstacles for x in o.outcomes) for e in blocked]
    assert stats["openable_share_of_blocked"] == pytest.approx(statistics.mean(opened), abs=1e-6)
    # 130 scenes of 6: refused draws count for the dataset, not for a split.
    assert expert["refused"] == 13
    assert expert["refused_share"] == pytest.approx(13 / (13 + 130 * 6), abs=1e-6)


def test_shares_of_types_compare_what_stands_with_what_is_drawn(dataset_folder):
    manifest = read_manifest(dataset_folder)
    rows = stats_of(dataset_folder, manifest).type_shares
    assert {row.drawn for row in rows} == {None}
    assert sum(row.standing for row in rows) == pytest.approx(1.0, abs=1e-4)
    kind, other = rows[0].type, "Zebra"
    drawn = replace(manifest, obstacle_shares={kind: 0.25, other: 0.75})
    by_type = {row.type: row for row in stats_of(dataset_folder, drawn).type_shares}
    assert by_type[kind].ratio == pytest.approx(rows[0].standing / 0.25, abs=1e-5)
    assert (by_type[other].standing, by_type[other].ratio) == (0.0, 0.0)


def test_stats_file_equals_compute_stats(dataset_folder):
    stored = json.loads((dataset_folder / "stats.json").read_text())
    assert stored == json.loads(json.dumps(compute_stats(dataset_folder)))


def test_statistics_of_nothing(tmp_path):
    from internav_data.dataset import Identity, assemble, open_staging

    identity = Identity("test", "1", 0, 1, "0", {})
    open_staging(tmp_path, identity)
    assemble(tmp_path, identity, [], 0)
    stats = compute_stats(tmp_path)
    assert stats["episodes"] == 0
    assert [row["ratio"] for row in stats["table2"]] == [0, 0, 0]
    assert list(load_dataset(tmp_path)) == []


def test_efficiency_of_paths_without_length():
    shortest_m, taken_m = np.array([0.0, 0.0, 2.0, 3.0]), np.array([0.0, 0.5, 1.0, 4.0])
    assert path_efficiency(shortest_m, taken_m).tolist() == [1.0, 0.0, 1.0, 0.75]


def test_card_names_every_file_and_column(dataset_folder):
    yaml = pytest.importorskip("yaml")
    text = (dataset_folder / "README.md").read_text()
    _, front, body = text.split("---\n", 2)
    configs = yaml.safe_load(front)["configs"]
    assert [c["config_name"] for c in configs if c.get("default")] == ["episodes"]
    manifest = read_manifest(dataset_folder)
    for config in configs:
        files = config["data_files"]
        if config["config_name"] == "assets":
            assert files == [f.path for f in manifest.of("assets")]
            continue
        assert [f["split"] for f in files] == ["train", "val", "test"]
        for entry in files:
            named = manifest.of(config["config_name"], entry["split"])
            assert entry["path"] == [f.path for f in named]
    assert "*" not in front
    for spec in TABLES[:2]:
        assert all(f"| `{name}` |" in body for name in spec.schema.names)


def test_croissant_names_every_file_and_only_known_columns(dataset_folder):
    described = json.loads((dataset_folder / "croissant.json").read_text())
    files = {f["@id"]: f for f in described["distribution"] if f["@type"] == "cr:FileObject"}
    manifest = read_manifest(dataset_folder)
    assert {f.path: f.sha256 for f in manifest.files} == {
        name: f["sha256"] for name, f in files.items()
    }
    sets = {
        f["@id"]: f["includes"] for f in described["distribution"] if f["@type"] == "cr:FileSet"
    }
    assert sets == {
        f"{table}-files": [f.path for f in manifest.of(table)] for table in ("episodes", "scenes")
    }
    for record_set, spec in zip(described["recordSet"], TABLES[:2], strict=True):
        columns = [f["name"] for f in record_set["field"]]
        left_out = set(spec.schema.names) - set(columns)
        assert left_out == ({"node_paths"} if spec.name == "episodes" else set())
        assert all("dataType" in f or f["subField"] for f in record_set["field"])


def test_no_field_of_the_records_has_a_lost_docstring():
    def count(node):
        if isinstance(node, Sequence):
            return count(node.item)
        if isinstance(node, Record):
            return len(descriptions(node.cls)) + sum(count(f.node) for f in node.fields)
        return 0

    assert [count(spec.node) for spec in TABLES] >= [8, 8, 6]
