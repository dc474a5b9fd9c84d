"""Settings of the world: bounds, effect, and datasets of earlier releases."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from builders import UPRIGHT

from internav_data.dataset.commit import identity_of, open_staging
from internav_data.dataset.manifest import read_manifest, write_manifest
from internav_data.generation import GenerationConfig, load_config
from internav_data.physics import Body
from internav_data.records import PUSH_SPECS, Pose
from internav_data.records.errors import CorruptDataError, UsageError
from internav_data.records.physics import push_spec
from internav_data.world import Action, HouseModel, World, WorldConfig

KEPT = Path(__file__).parents[1] / "data" / "dataset-10"


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("world.push_model=shove", "world.push_model is 'shove': expected one of force, kick"),
        ("world.force_n=0", "world.force_n: expected 1.0 … 2000.0, got 0.0"),
        ("world.force_n=1e9", "world.force_n: expected 1.0 … 2000.0, got 1000000000.0"),
        ("world.force_n=nan", "world.force_n: expected a finite number, got nan"),
        ("world.force_n=strong", "world.force_n: expected a number, got 'strong'"),
        ("world.hands=three", "world.hands is 'three': expected one of free, real"),
        (
            "episodes.push_model=kick",
            "no key 'episodes.push_model'; did you mean 'world.push_model'?",
        ),
    ],
)
def test_bad_values_get_one_line(setting, message):
    with pytest.raises(UsageError) as error:
        load_config(overrides=[setting]).check()
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_an_unknown_push_model_is_refused_in_python():
    with pytest.raises(UsageError, match=r"^world.push_model: expected .* got 'shove'$"):
        GenerationConfig(world=WorldConfig(push_model="shove")).check()  # type: ignore[arg-type]
    with pytest.raises(UsageError, match=r"^world.hands: expected .* got 'three'$"):
        GenerationConfig(world=WorldConfig(hands="three")).check()  # type: ignore[arg-type]


@pytest.mark.parametrize("preset", ["dense", "long"])
def test_a_kick_is_given_no_force(preset):
    words = r"^world.force_n: 'kick' moves every mass at once and has no force, got {} N; set it"
    with pytest.raises(UsageError, match=words.format(90)):
        load_config(overrides=["world.push_model=kick", "world.force_n=90"]).check()
    kicked = {"world.push_model": "kick"}
    with pytest.raises(UsageError, match=words.format(800)):
        load_config(options=kicked, episode_preset=preset).check()
    load_config(overrides=["world.force_n=200"], options=kicked, episode_preset=preset).check()
    WorldConfig("kick", 800.0).check()  # an environment may kick where a dataset pushes


def test_specs_of_pushes():
    assert WorldConfig().push_spec == PUSH_SPECS["force"]
    assert WorldConfig(force_n=90.0).push_spec == replace(PUSH_SPECS["force"], force_n=90.0)
    assert push_spec("kick", 90.0) == PUSH_SPECS["kick"]
    assert math.isinf(push_spec("kick").force_n)


def test_the_force_decides_what_can_be_moved(hand_house):
    heavy = replace(hand_house.assets["Chair_0"], mass_kg=60.0)
    body = Body.of(heavy, Pose(3.75, 1.0, 0.0, UPRIGHT))
    model = HouseModel.of(hand_house)
    pushed = {}
    for force in (50.0, 200.0, 800.0):
        config = WorldConfig(force_n=force)
        world = World(model, [body], (12, 4, 0), (28, 4), config)
        pushed[force] = world.step(Action.PUSH_AHEAD)
    assert pushed[50.0].reason == "too heavy"
    assert pushed[800.0].displacement_m > pushed[200.0].displacement_m


def test_worlds_of_other_settings_differ(hand_house):
    model = HouseModel.of(hand_house)
    by_force = [
        World(model, [], (12, 4, 0), (28, 4), WorldConfig(force_n=force)) for force in (200, 100)
    ]
    assert by_force[0] != by_force[1]


@pytest.mark.parametrize(
    ("config", "expected"),
    [
        ({}, WorldConfig()),
        ({"world": {"push_model": "kick", "later": 1}}, WorldConfig("kick")),
        ({"world": {"force_n": 150}}, WorldConfig(force_n=150.0)),
    ],
)
def test_settings_of_a_dataset(config, expected):
    assert WorldConfig.of_dataset(config) == expected


@pytest.mark.parametrize("world", [{"push_model": "shove"}, {"force_n": -1}, {"force_n": "x"}])
def test_a_dataset_with_settings_that_no_generator_writes(world):
    with pytest.raises(CorruptDataError, match=r"manifest.json: world\.|config: world\."):
        WorldConfig.of_dataset({"world": world})


def test_a_dataset_of_an_earlier_release_has_its_push_model_under_the_present_key():
    assert '"push_model": "force"' in (KEPT / "manifest.json").read_text()
    config = read_manifest(KEPT).config
    assert "push_model" not in config["episodes"]
    assert WorldConfig.of_dataset(config) == WorldConfig("force")


@pytest.mark.parametrize("model", ["force", "kick"])
def test_a_dataset_of_an_earlier_release_is_extended_with_its_push_model(tmp_path, model):
    manifest = read_manifest(KEPT)
    episodes = {**manifest.config["episodes"], "push_model": model}
    before = {key: value for key, value in manifest.config.items() if key != "world"}
    write_manifest(tmp_path, replace(manifest, config={**before, "episodes": episodes}))
    there, defaults = identity_of(manifest), GenerationConfig().identity(manifest.catalogue_digest)

    def asked(name):
        config = {
            key: {**value, **there.config.get(key, {})} if isinstance(value, dict) else value
            for key, value in {**defaults, **there.config}.items()
            for value in [defaults.get(key, value) if isinstance(value, dict) else value]
        }
        world = {**defaults["world"], "push_model": name}
        return replace(there, config={**config, "world": world})

    open_staging(tmp_path, asked(model), defaults)
    other = "kick" if model == "force" else "force"
    with pytest.raises(UsageError, match=rf"config.world.push_model: there '{model}'"):
        open_staging(tmp_path, asked(other), defaults)
