"""Datasets of either engine, with the other one's second opinions, from generation to training."""

import json
from dataclasses import asdict

import pytest
from scene_stubs import InProcess

from internav_data.dataset import compute_stats, load_dataset, read_manifest
from internav_data.dataset.card import card_text
from internav_data.dataset.stats import stats_of
from internav_data.generation import generate, load_config
from internav_data.generation.reproduce import scene_again
from internav_data.generation.run import with_held_engine
from internav_data.physics.engines import second_engine
from internav_data.physics.engines.installed import available_engines
from internav_data.records.errors import UsageError
from internav_data.verification import validate

SCENES = 4
ENGINES = ("bullet", "mujoco")
pytestmark = pytest.mark.skipif(
    set(available_engines()) != set(ENGINES), reason="one engine alone has a wheel here"
)


def config_of(engine, *, cross_check=True):
    options = {"physics.engine": engine, "physics.cross_check": cross_check}
    # Balanced: uniform draws leave few objects large enough to be pushed.
    given = ["episodes_per_scene=3", "house.rooms=1", "episodes.balance=true"]
    return load_config(overrides=given, options=options)


@pytest.fixture(scope="module", params=ENGINES)
def crossed(request, tmp_path_factory):
    """A dataset of an engine whose outcomes have the other one's second opinion."""
    out = tmp_path_factory.mktemp(request.param) / "d"
    generate(out, config_of(request.param), SCENES, executor=InProcess())
    return out


def files_of(out):
    return {p.relative_to(out): p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()}


def opinions(out):
    return [
        outcome
        for episode in load_dataset(out)
        for obstacle in episode.obstacles
        for outcome in obstacle.outcomes
        if outcome.agrees is not None
    ]


def test_it_is_valid_and_names_both_engines(crossed):
    engine = read_manifest(crossed).config["physics"]["engine"]
    findings = validate(crossed, "physics")
    assert findings.ok, findings.summary()
    for episode in load_dataset(crossed):
        assert episode.physics.engine == engine
        assert episode.physics.build.startswith({"bullet": "pybullet", "mujoco": "mujoco"}[engine])
        assert episode.physics.other_engine == second_engine(engine)
        assert episode.agreed == all(
            o.agrees is not False for b in episode.obstacles for o in b.outcomes
        )
    asked = opinions(crossed)
    assert asked
    assert validate(crossed, "physics", engine=second_engine(engine)).agreement["all"].agree == sum(
        o.agrees for o in asked
    )


def test_workers_and_an_extension_make_the_same_bytes(crossed, tmp_path):
    engine = read_manifest(crossed).config["physics"]["engine"]
    generate(tmp_path / "d", config_of(engine), 2, executor=InProcess())
    with pytest.raises(UsageError, match=f"physics.engine: there '{engine}', asked for"):
        generate(tmp_path / "d", config_of(second_engine(engine)), SCENES, executor=InProcess())
    with pytest.raises(UsageError, match=r"physics.cross_check: there True, asked for False"):
        generate(tmp_path / "d", config_of(engine, cross_check=False), SCENES)
    other = config_of(second_engine(engine))
    # Processes of their own for one of the engines: they take seconds to begin.
    executor = "processes" if engine == "mujoco" else InProcess()
    generate(tmp_path / "d", with_held_engine(other, tmp_path / "d"), SCENES, 2, executor=executor)
    assert files_of(tmp_path / "d") == files_of(crossed)


def test_statistics_and_card_tell_the_share(crossed):
    asked, stats = opinions(crossed), compute_stats(crossed)
    found = stats["agreement"]
    assert found["asked"] == len(asked)
    assert found["share"] == pytest.approx(sum(o.agrees for o in asked) / len(asked), abs=1e-3)
    episodes = load_dataset(crossed)
    assert found["episodes"] == sum(episode.agreed for episode in episodes)
    assert found["episodes_share"] == pytest.approx(found["episodes"] / len(episodes), abs=1e-3)
    manifest = read_manifest(crossed)
    assert "A second physics engine was asked" in card_text(manifest, stats_of(crossed, manifest))
    assert json.loads((crossed / "stats.json").read_text())["agreement"] == found


def test_readers_and_environments_choose_what_is_agreed_on(crossed):
    pytest.importorskip("gymnasium")
    from internav_data.envs import InterNavVectorEnv

    sure = load_dataset(crossed, filters=[("agreed", "==", True)])
    ids = {episode.episode_id for episode in load_dataset(crossed) if episode.agreed}
    assert {episode.episode_id for episode in sure} == ids
    env = InterNavVectorEnv(2, crossed, 16, agreed_only=True, shuffle=False)
    seen = {i for _ in range(len(ids)) for i in env.reset()[1]["episode_id"]}
    assert seen == ids
    run = env.slots[0].run
    assert run.world.engine == read_manifest(crossed).config["physics"]["engine"]
    for action in (0, 5, 6, 9, 0):
        env.step([action, action])
    with pytest.raises(UsageError, match="no episodes for"):
        InterNavVectorEnv(1, crossed, 16, agreed_only=True, filters=[("room_count", ">", 5)])


def test_a_dataset_of_one_opinion_has_none_to_choose_by(tmp_path, crossed):
    pytest.importorskip("gymnasium")
    from internav_data.envs import InterNavEnv

    engine = read_manifest(crossed).config["physics"]["engine"]
    config = config_of(engine, cross_check=False)
    generate(tmp_path / "d", config, 1, executor=InProcess())
    (first, *_), (mine, *_) = load_dataset(crossed, "val"), load_dataset(tmp_path / "d")
    plain, asked = asdict(mine), asdict(first)
    for episode in (plain, asked):
        for obstacle in episode["obstacles"]:
            for outcome in obstacle["outcomes"]:
                del outcome["agrees"], outcome["other_pose"]
        for name in ("other_engine", "other_build"):
            del episode["physics"][name]
        del episode["agreed"]
    assert plain == asked, "a second opinion changes nothing else"
    assert mine.agreed is None
    assert compute_stats(tmp_path / "d")["agreement"] is None
    for dataset in (tmp_path / "d", load_dataset(tmp_path / "d")):
        with pytest.raises(UsageError, match="agreed_only: one physics engine alone was asked"):
            InterNavEnv(dataset, 16, agreed_only=True)


def test_one_scene_again_is_the_datasets(crossed):
    engine = read_manifest(crossed).config["physics"]["engine"]
    text, verdict = scene_again(config_of(engine), 1, 0, crossed)
    assert f"; physics: {engine}" in verdict
    assert "the same as in" in verdict
    assert json.loads(text)["physics"]["other_engine"] == second_engine(engine)
