import dataclasses
from importlib import resources

import pytest

from internav_data.catalog import catalogue
from internav_data.core.config import config_toml, known_keys
from internav_data.generation.config import EPISODE_PRESETS, GenerationConfig, load_config
from internav_data.generation.scenes import obstacle_pool, obstacle_shares
from internav_data.records.errors import UsageError


def refusal(*overrides, path=None):
    with pytest.raises(UsageError) as caught:
        load_config(path, overrides).check()
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_defaults_are_the_papers():
    config = load_config()
    assert config == GenerationConfig()
    assert (config.episodes_of("train"), config.episodes_of("test")) == (50, 5)
    config.check()


@pytest.mark.parametrize("name", EPISODE_PRESETS)
def test_presets_of_episodes_are_sound_and_installed(name):
    config = load_config(episode_preset=name)
    config.check()
    assert (config == GenerationConfig()) == (name == "paper")
    folder = resources.files("internav_data.generation") / "presets"
    assert (folder / f"{name}.toml").is_file()
    assert {entry.name for entry in folder.iterdir()} == {f"{n}.toml" for n in EPISODE_PRESETS}


def test_a_file_wins_over_a_preset_and_both_are_overridden(tmp_path):
    path = tmp_path / "c.toml"
    path.write_text("[episodes]\nmin_detour_steps = 3\nmin_interactions = 3\n")
    dense = load_config(episode_preset="dense")
    config = load_config(path, ["episodes.min_interactions=2"], episode_preset="dense")
    assert (config.episodes.min_detour_steps, config.episodes.min_interactions) == (3, 2)
    assert config.episodes.max_obstacles == dense.episodes.max_obstacles
    with pytest.raises(UsageError, match="'sparse': expected one of paper, balanced, dense, long"):
        load_config(episode_preset="sparse")


def test_a_file_and_overrides_in_that_order(tmp_path):
    path = tmp_path / "c.toml"
    path.write_text('seed = 7\nepisodes_per_scene = 12\n[house]\nrooms = "2-5"\nscale = 1\n')
    config = load_config(path, ["seed=8", "episodes.max_obstacles=[1, 2, 3]", "house.rooms=4"])
    assert (config.seed, config.episodes_per_scene, config.house.rooms) == (8, 12, "4")
    assert config.house.scale == 1.0
    assert isinstance(config.house.scale, float)
    assert config.episodes.max_obstacles == (1, 2, 3)
    assert config.episodes_of("test") == 2, "a tenth, rounded up"


def test_paths_in_a_file_are_relative_to_it(tmp_path):
    path = tmp_path / "c.toml"
    path.write_text('assets = ["meshes"]\n[house]\nfloor_plan = "plan.toml"\n')
    config = load_config(path)
    assert config.assets == (str(tmp_path / "meshes"),)
    assert config.house.floor_plan == str(tmp_path / "plan.toml")


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("house.scal=1.1", ["'house.scal'", "did you mean 'house.scale'"]),
        ("rooms=4", ["'rooms'", "'house.rooms'"]),
        ("weather=rain", ["no key 'weather'; there are seed, "]),
        ("episodes.engine=mujoco", ["did you mean 'physics.engine'?"]),
        (
            "house.rooms_on_way_large=4",
            ["'house.rooms_on_way_large'", "'house.rooms_on_path_large'"],
        ),
        ("episodes.lateral_stdm=1", ["'episodes.lateral_stdm'", "'episodes.lateral_std_m'"]),
        ("scenes=10", ["'scenes'", "command line"]),
        ("zzzzzz=1", ["'zzzzzz'", "seed"]),
        ("seed=a", ["seed", "a whole number", "'a'"]),
        ("seed=true", ["a whole number"]),
        ("seed=1.5", ["a whole number", "1.5"]),
        ("seed=-1", ["0 to 2^63"]),
        ("house.scale=big", ["house.scale", "a number"]),
        ("house.scale=nan", ["finite"]),
        ("house.windows=1", ["true or false"]),
        ("house.preset=palace", ["'palace'", "paper, realistic"]),
        ("episodes.max_obstacles=[1, 2]", ["a list of 3"]),
        ("episodes.max_obstacles=[1, 2, 'x']", ["max_obstacles[2]", "a whole number"]),
        ("episodes_per_scene=0", ["1 or more"]),
        ("episodes_per_scene=-3", ["1 or more"]),
        ("house=1", ["table of settings"]),
        ("seed", ["KEY=VALUE"]),
        ("house.rooms=kitchen:40", ["10 rooms"]),
    ],
)
def test_invalid_settings_are_refused(override, words):
    message = refusal(override)
    for word in words:
        assert word in message, message


def test_errors_name_the_file(tmp_path):
    path = tmp_path / "c.toml"
    path.write_text("[house]\nscal = 1\n")
    assert str(path) in refusal(path=path)
    path.write_text("seed = = 1\n")
    assert "not TOML" in refusal(path=path)
    assert "cannot be read" in refusal(path=tmp_path / "none.toml")
    assert "is no folder" in refusal(f'assets=["{tmp_path}/none"]')


def test_identity_leaves_paths_out(tmp_path):
    one, two = tmp_path / "a.toml", tmp_path / "b.toml"
    one.write_text("x = 1")
    two.write_text("x = 1")
    base = GenerationConfig()

    def identity(path):
        house = dataclasses.replace(base.house, floor_plan=str(path))
        return dataclasses.replace(base, house=house).identity("c")

    assert identity(one) == identity(two)
    two.write_text("x = 2")
    assert identity(one) != identity(two)
    spelled_out = dataclasses.replace(base, test_episodes_per_scene=5)
    assert base.identity("c") == spelled_out.identity("c")


WORDS = {
    "paper": "realistic",
    "look": "hidden",
    "": "4",
    "force": "kick",
    "free": "real",
    "bullet": "mujoco",
    "mujoco": "bullet",
    "keep": "drop",
}
"""Another value for each setting that is a word."""


@pytest.mark.parametrize("key", known_keys(GenerationConfig()))
def test_every_value_but_paths_is_identity(key):
    if key in {"assets", "house.floor_plan"}:
        pytest.skip("what counts is their content")
    base = GenerationConfig()
    value = base
    for name in key.split("."):
        value = getattr(value, name)
    if isinstance(value, str):
        text = WORDS[value]
    else:
        other = {bool: "false" if value else "true", int: "3", float: "0.77", tuple: "[1, 1, 1]"}
        other[dict] = "{Sofa = 2}"
        text = other[type(value)]
    changed = load_config(overrides=[f"{key}={text}"])
    assert base.identity("c") != changed.identity("c")


def test_tables_of_values_are_merged_and_read_back(tmp_path):
    path = tmp_path / "c.toml"
    path.write_text("[episodes.asset_weights]\nSofa = 4\nApple = 0.5\n")
    config = load_config(path, ["episodes.asset_weights.Sofa=2", "episodes.asset_weights={Pot=3}"])
    assert config.episodes.asset_weights == {"Sofa": 2.0, "Apple": 0.5, "Pot": 3.0}
    path.write_text(config_toml(config))
    assert load_config(path) == config


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("episodes.asset_weights=[1]", ["asset_weights: expected a table of values by name"]),
        ("episodes.asset_weights={Sofa='x'}", ["asset_weights.Sofa: expected a number, got 'x'"]),
        ("episodes.asset_weights={Sofa=-1}", ["asset_weights.Sofa: expected 0.0", "got -1.0"]),
        ("episodes.asset_weights.Sofa=nan", ["asset_weights.Sofa: expected a finite number"]),
        ("episodes.balance=1", ["balance: expected true or false, got 1"]),
        ("episodes.idle_obstacles=hide", ["idle_obstacles is 'hide'", "keep, drop"]),
        ("episodes.refuse_facing_wall=2", ["refuse_facing_wall: expected true or false"]),
    ],
)
def test_bad_values_of_episodes_are_refused_in_a_line(override, words):
    message = refusal(override)
    assert all(word in message for word in words), message


def test_an_unknown_type_is_refused_before_a_run():
    config = load_config(overrides=["episodes.asset_weights={Soffa = 2}"])
    with pytest.raises(UsageError, match="'Soffa'; did you mean Sofa"):
        config.check()
    with pytest.raises(UsageError, match="'Soffa'; did you mean Sofa"):
        obstacle_shares(catalogue(), config)
    with pytest.raises(UsageError, match="'Soffa'; did you mean Sofa"):
        obstacle_pool(catalogue(), config, "train")


def test_types_of_ones_own_meshes_may_be_weighed(tmp_path):
    overrides = [f"assets=['{tmp_path}']", "episodes.asset_weights={Lamp = 2}"]
    load_config(overrides=overrides).check()  # what the folder holds is read later
    with pytest.raises(UsageError, match="no obstacle has the type 'Lamp'"):
        load_config(overrides=overrides[1:]).check()


def test_one_set_is_one_setting():
    assert "expected a number" in refusal("house.scale=1.1\nseed = 5")
