"""A dataset's physics engine: part of its identity, taken over by whoever continues or reads it."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from scene_stubs import ASSET, CATALOGUE, InProcess, stub

from internav_data.dataset import held_config, load_dataset, read_manifest, write_manifest
from internav_data.generation.config import GenerationConfig, load_config
from internav_data.generation.run import check_standing, generate, with_held_engine
from internav_data.physics.config import PhysicsConfig
from internav_data.physics.engines import ENGINES, MODULES
from internav_data.physics.settling import SettleResult
from internav_data.records.errors import (
    CorruptDataError,
    InternavError,
    MissingEngineError,
    UsageError,
)

OLD = Path(__file__).parents[1] / "data" / "dataset-10"
"""A dataset of a release that knew one engine, under `episodes.engine`."""
GIVEN = ["episodes_per_scene=3"]
BULLET, MUJOCO = (
    load_config(overrides=GIVEN, options={"physics.engine": name}) for name in ("bullet", "mujoco")
)


@pytest.fixture(autouse=True)
def both_engines(monkeypatch):
    """Two engines that are installed; scenes here are stubs, so that neither solves anything."""
    for name in ("bullet", "mujoco"):
        monkeypatch.setitem(ENGINES, name, object)
        monkeypatch.setitem(MODULES, name, "json")


def made(out, scenes, config, **orders):
    out.parent.mkdir(parents=True, exist_ok=True)
    (out.parent / "stub.json").write_text(json.dumps(orders))
    return generate(out, config, scenes, assets=CATALOGUE, executor=InProcess(), setup=stub)


def contents(out):
    return {path: path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()}


def test_another_engine_neither_extends_nor_resumes_a_dataset(tmp_path):
    out = tmp_path / "a" / "d"
    made(out, 3, MUJOCO)
    before = contents(out)
    with pytest.raises(UsageError, match=r"physics.engine: there 'mujoco', asked for 'bullet'"):
        made(out, 6, BULLET)
    assert contents(out) == before
    made(out, 6, with_held_engine(BULLET, out))
    made(tmp_path / "b" / "d", 6, MUJOCO)
    assert {p.relative_to(out): b for p, b in contents(out).items()} == {
        p.relative_to(tmp_path / "b" / "d"): b for p, b in contents(tmp_path / "b" / "d").items()
    }


def test_an_unfinished_dataset_is_resumed_with_its_engine(tmp_path):
    out = tmp_path / "d"
    with pytest.raises(InternavError):
        made(out, 3, MUJOCO, full=2)
    assert not (out / "manifest.json").exists()
    assert held_config(out)["physics"]["engine"] == "mujoco"
    assert with_held_engine(BULLET, out) == MUJOCO
    made(out, 3, with_held_engine(BULLET, out))
    assert read_manifest(out).config["physics"]["engine"] == "mujoco"


def test_a_folder_without_scenes_binds_nobody(tmp_path):
    assert held_config(tmp_path / "none") is None
    with pytest.raises(InternavError):
        made(tmp_path / "d", 3, MUJOCO, hopeless=True)
    assert with_held_engine(BULLET, tmp_path / "d") == BULLET


def test_datasets_without_the_setting_are_of_the_first_engine():
    """Whatever engine is the default by now, and under the name that the setting had."""
    config = load_dataset(OLD).manifest.config
    assert config["physics"]["engine"] == "bullet"
    assert "engine" not in config["episodes"]
    assert with_held_engine(MUJOCO, OLD) == BULLET
    for older in ({}, {"physics": {}}):
        assert PhysicsConfig.of_dataset(older).engine == "bullet"
    assert PhysicsConfig.of_dataset({"physics": {"engine": "mujoco"}}).engine == "mujoco"


def test_a_dataset_without_the_setting_is_extended_as_one_of_the_first_engine(tmp_path):
    """Its settings that were not known yet do not have today's defaults, if these have changed."""
    out = tmp_path / "d"
    made(out, 3, BULLET)
    manifest = read_manifest(out)
    older = {key: value for key, value in manifest.config.items() if key != "physics"}
    write_manifest(out, replace(manifest, config=older))
    with pytest.raises(UsageError, match=r"physics.engine: there 'bullet', asked for 'mujoco'"):
        made(out, 6, MUJOCO)
    made(out, 6, with_held_engine(MUJOCO, out))
    assert read_manifest(out).scenes == 6


@pytest.mark.parametrize("engine", ["havok", 3, None])
def test_a_dataset_of_an_unknown_engine_is_refused_in_a_line(engine):
    with pytest.raises(CorruptDataError, match=r"physics.engine is .*: expected one of bullet"):
        PhysicsConfig.of_dataset({"physics": {"engine": engine}})


def test_a_missing_engine_costs_nothing_and_another_is_offered_for_new_data(tmp_path, monkeypatch):
    out = tmp_path / "d"
    monkeypatch.setitem(MODULES, "mujoco", "nowhere_to_be_found")
    with pytest.raises(MissingEngineError) as error:
        made(out, 3, MUJOCO)
    assert str(error.value) == (
        "the physics engine mujoco is not installed: pip install nowhere_to_be_found; "
        "--physics bullet is installed here and makes other data"
    )
    assert not out.exists()
    monkeypatch.setitem(MODULES, "mujoco", "json")
    made(out, 3, MUJOCO)
    before = contents(out)
    monkeypatch.setitem(MODULES, "mujoco", "nowhere_to_be_found")
    with pytest.raises(MissingEngineError) as error:
        made(out, 6, MUJOCO)
    assert str(error.value).startswith(f"{out}: the physics engine mujoco is not installed: pip")
    assert "--physics" not in str(error.value), "another engine would be refused"
    assert contents(out) == before
    monkeypatch.setitem(MODULES, "bullet", "nowhere_to_be_found")
    with pytest.raises(MissingEngineError, match=r"^no physics engine is installed; for bull"):
        made(tmp_path / "e", 3, BULLET)


def test_the_engine_is_part_of_the_config_whose_default_is_stated_once():
    assert GenerationConfig().physics == PhysicsConfig()
    with pytest.raises(UsageError, match=r"physics.engine is 'havok': expected one of bullet"):
        load_config(overrides=["physics.engine=havok"])
    with pytest.raises(UsageError, match=r"physics.engine: expected one of .*, got 'havok'"):
        replace(GenerationConfig(), physics=PhysicsConfig("havok")).check()


def test_a_missing_second_engine_is_named_before_anything_is_made(tmp_path, monkeypatch):
    config = replace(BULLET, physics=PhysicsConfig("bullet", cross_check=True))
    monkeypatch.setitem(MODULES, "mujoco", "nowhere_to_be_found")
    with pytest.raises(MissingEngineError, match=r"^cross-check: the physics engine mujoco is not"):
        made(tmp_path / "d", 3, config)
    assert not (tmp_path / "d").exists()


def test_meshes_of_users_fall_in_the_engine_that_is_chosen(monkeypatch):
    asked = []

    def fall(body, gap_m, near, engine):
        asked.append(engine)
        return SettleResult(body.pose, 0.1, 0.0, "")

    monkeypatch.setattr("internav_data.physics.settle", fall, raising=False)
    check_standing([ASSET], "mujoco")
    assert asked == ["mujoco"]
