"""Real scenes, small ones: what the commands and the Python functions make of them."""

import dataclasses
import json
from collections import Counter
from types import SimpleNamespace

import jsonschema
import pytest
import scene_stubs

from internav_data.catalog import catalogue, split_of_asset
from internav_data.dataset import load_dataset, schemas, stage_scene
from internav_data.generation import generate, generate_episodes, generate_house, load_config
from internav_data.generation.reproduce import scene_again
from internav_data.generation.run import identity_for
from internav_data.generation.scenes import ATTEMPTS, build_scene, obstacle_pool
from internav_data.records.errors import QuarantineError, UsageError, ValidationError

CONFIG = load_config(
    overrides=[
        *("episodes_per_scene=2", "house.rooms=1-2", "episodes.blind_expert=true"),
        "seed=3",  # one of its episodes has no expert, and is drawn again
    ]
)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    out = tmp_path_factory.mktemp("real") / "d"
    assert generate(out, CONFIG, 3, workers=1).episodes == 5
    return out


def test_generate_episodes_equals_the_dataset(dataset):
    held = [episode for episode in load_dataset(dataset) if episode.scene_id == "scene-000002"]
    house = generate_house(seed=CONFIG.seed, scene=2, config=CONFIG)
    assert house == load_dataset(dataset).scene("scene-000002")
    assert list(generate_episodes(house, 2, config=CONFIG)) == held
    assert generate_episodes(house, 1, first=1, config=CONFIG) == (held[1],)


def test_every_column_of_episodes_has_values(dataset):
    """A column that nothing fills is null in every row, which readers and rules allow."""
    table = load_dataset(dataset).to_table()
    empty = [name for name in table.column_names if table[name].null_count == len(table)]
    assert empty == ["agreed"], "that is of two engines"


def test_redraws_of_all_scenes_are_in_manifest_and_report(dataset, tmp_path):
    from internav_data.dataset import compute_stats, read_manifest

    counts = Counter()
    for scene in range(3):
        counts.update(build_scene(scene, CONFIG, catalogue()).redraws)
    assert counts["no expert"], "nothing was drawn again: choose another seed"
    assert read_manifest(dataset).redraws == counts
    again = generate(dataset, CONFIG, 3, workers=1)
    refused = counts["no expert"] / (counts["no expert"] + 5)
    assert again.redraws == counts
    assert again.refused_share == pytest.approx(refused, abs=1e-6)
    assert compute_stats(dataset)["expert"]["solved"] == 5


def test_unsolvable_episodes_stay_on_demand(monkeypatch, tmp_path):
    from internav_data.dataset import assemble, compute_stats, load_dataset, open_staging
    from internav_data.episodes import build

    # An expert that never finds a plan: which episodes it truly solves is for its own tests.
    monkeypatch.setattr(build, "solve", lambda _: None)
    with pytest.raises(QuarantineError, match=r"no expert: \d"):
        build_scene(0, CONFIG, catalogue(), episodes=1)
    episodes = dataclasses.replace(CONFIG.episodes, keep_unsolvable=True)
    config = dataclasses.replace(CONFIG, episodes=episodes)
    made = build_scene(0, config, catalogue())
    identity = identity_for(config, catalogue())
    staging = open_staging(tmp_path, identity)
    stage_scene(staging, 0, made.house, made.episodes, redraws=made.redraws)
    manifest = assemble(tmp_path, identity, tuple(catalogue().assets.values()), 1)
    held = list(load_dataset(tmp_path))
    assert [episode.expert for episode in held] == [None, None]
    assert all(obstacle.outcomes for episode in held for obstacle in episode.obstacles)
    assert "no expert" not in manifest.redraws
    values = compute_stats(tmp_path)["expert"]
    assert (values["solved"], values["solved_share"], values["spl"], values["refused"]) == (
        0,
        0,
        0,
        0,
    )


def test_real_scenes_have_the_same_bytes_for_any_workers(dataset, tmp_path):
    generate(tmp_path / "d", CONFIG, 3, workers=3)
    names = sorted(p.relative_to(dataset) for p in dataset.rglob("*") if p.is_file())
    assert names
    for name in names:
        assert (tmp_path / "d" / name).read_bytes() == (dataset / name).read_bytes(), name


def test_a_scene_again_is_compared(dataset, tmp_path):
    text, verdict = scene_again(CONFIG, 2, 1, dataset)
    assert "the same as in" in verdict
    values = json.loads(text)
    assert values["episode_id"] == "scene-000002/0001"
    assert "assets" not in json.loads(scene_again(CONFIG, 2)[0])["scene"]
    other = dataclasses.replace(CONFIG, seed=1)
    with pytest.raises(UsageError, match="another config"):
        scene_again(other, 2, 1, dataset)
    with pytest.raises(UsageError, match="no episode"):
        scene_again(CONFIG, 2, 7, dataset)


def test_what_is_printed_of_a_scene_obeys_the_published_schemas(dataset):
    house, episode = (
        jsonschema.Draft202012Validator(schemas()[f"{name}.schema.json"])
        for name in ("scenes", "episodes")
    )
    one = json.loads(scene_again(CONFIG, 2, 1)[0])
    whole = json.loads(scene_again(CONFIG, 2)[0])
    episode.validate(one)
    house.validate(whole["scene"])
    assert [row["index"] for row in whole["episodes"]] == [0, 1]
    assert whole["episodes"][1] == one
    assert one in load_dataset(dataset).to_table().to_pylist()


def test_a_dataset_with_other_values_is_reported(dataset, monkeypatch):
    import internav_data.generation.reproduce as module

    true = module.made_again(CONFIG, 2, 1)
    moved = dataclasses.replace(true.episodes[1], shortest_path_m=99.0)
    false = dataclasses.replace(true, episodes=(true.episodes[0], moved))
    monkeypatch.setattr(module, "made_again", lambda *_: false)
    with pytest.raises(ValidationError, match=r"scene-000002/0001 differs.*: shortest_path_m$"):
        scene_again(CONFIG, 2, 1, dataset)


@pytest.mark.parametrize("fails", range(ATTEMPTS + 1))
@pytest.mark.parametrize("room", ["houses.build_house", "episodes.build_batch"])
def test_sub_seeds_are_tried_before_a_scene_is_given_up(monkeypatch, room, fails):
    tried = []

    def refused(name, attempt):
        if room.endswith(name):
            tried.append(attempt)
            if attempt < fails:
                raise QuarantineError(f"attempt {attempt}")

    def build_house(seed, scene, _config, _catalogue, attempt, **_):
        refused("build_house", attempt)
        return scene_stubs.house(seed, scene)

    def build_batch(house, count, _pool, _config, _world, *, attempt, **_):
        refused("build_batch", attempt)
        made = tuple(scene_stubs.episode(house, index) for index in range(count))
        return SimpleNamespace(episodes=made, redraws={})

    monkeypatch.setattr("internav_data.houses.build_house", build_house, raising=False)
    monkeypatch.setattr("internav_data.episodes.build_batch", build_batch, raising=False)
    if fails < ATTEMPTS:
        assert build_scene(2, CONFIG, scene_stubs.CATALOGUE).attempts == fails + 1
    else:
        with pytest.raises(QuarantineError, match=f"attempt {ATTEMPTS - 1}"):
            build_scene(2, CONFIG, scene_stubs.CATALOGUE)
    assert tried == list(range(min(fails + 1, ATTEMPTS)))


def test_unseen_assets_are_apart():
    config = load_config(overrides=["episodes.unseen_assets=true"])
    known = catalogue()
    pools = [obstacle_pool(known, config, split) for split in ("train", "val", "test")]
    ids = [{asset.asset_id for asset in pool} for pool in pools]
    assert sum(map(len, ids)) == len(set.union(*ids)) == len(known.spawnable)
    assert all(split_of_asset(asset) == "val" for asset in pools[1])
    assert obstacle_pool(known, CONFIG, "val") == known.spawnable


@pytest.mark.parametrize(("count", "first"), [(0, 0), (1, -1)])
def test_invalid_counts_are_refused(count, first):
    house = generate_house(seed=CONFIG.seed, scene=2, config=CONFIG)
    with pytest.raises(UsageError):
        generate_episodes(house, count, first, CONFIG)
    with pytest.raises(UsageError):
        generate_house(seed=0, scene=-1)
