"""Presets, and configs read from plain data."""

import dataclasses
import json
import re

import pytest

from internav_data.camp.agents import AGENTS, check_settings, make_agent
from internav_data.camp.config import CampConfig, config_of, from_mapping, preset
from internav_data.core.config import config_toml, plain
from internav_data.core.field_docs import descriptions
from internav_data.records.errors import UsageError


def test_the_paper_preset_is_the_papers():
    paper = preset("paper")
    paper.check()
    assert paper.ppo.chunk_steps == 0
    assert (paper.network.image_size, paper.network.hidden) == (300, 512)
    assert not paper.network.shared_encoder
    assert (paper.ppo.clip_coef, paper.ppo.clip_vloss, paper.ppo.update_epochs) == (0.1, True, 1)
    assert (paper.agent.sync_every, paper.ppo.num_minibatches, paper.ppo.num_steps) == (3, 1, 30)
    stages = paper.stages
    assert (stages.learning_rate, stages.joint_learning_rate) == (3e-4, 1e-4)
    assert (
        stages.total_timesteps * stages.auxiliary_share
        == stages.total_timesteps * stages.single_room_share
        == 1e6
    )


def test_the_small_preset_is_the_sheets():
    small = preset("small")
    small.check()
    assert (small.network.image_size, small.network.hidden) == (64, 128)
    assert small.network.shared_encoder
    ppo = small.ppo
    assert (ppo.num_envs, ppo.num_steps, ppo.update_epochs, ppo.num_minibatches) == (16, 64, 3, 4)
    assert (ppo.chunk_steps, ppo.clip_coef, ppo.clip_vloss) == (16, 0.2, False)


@pytest.mark.parametrize("chunk_steps", [0, 1, 32, 64, 100])
def test_chunks_of_a_divisor_of_the_steps_or_of_whole_rollouts(chunk_steps):
    changed = from_mapping(preset("small"), {"ppo": {"chunk_steps": chunk_steps}}, "file")
    assert changed.ppo.chunk_steps == chunk_steps


def test_plain_data_is_read_back():
    for name in ("paper", "small"):
        config = preset(name)
        assert from_mapping(CampConfig(), json.loads(json.dumps(plain(config))), "file") == config


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"ppo": {"clip_cof": 0.1}}, "did you mean 'ppo.clip_coef'"),
        ({"ppo": {"clip_coef": "much"}}, "expected a number"),
        ({"ppo": {"num_envs": 0}}, "ppo.num_envs is 0"),
        ({"ppo": {"num_minibatches": 5}}, "must divide"),
        ({"ppo": {"chunk_steps": 24}}, "must divide ppo.num_steps (64)"),
        ({"ppo": {"gamma": 1.5}}, "expected 0.0 … 1.0"),
        ({"network": {"encoder": "paper", "image_size": 32}}, "needs 36 pixels"),
        ({"agent": {"intent": "some"}}, "expected one of"),
        ({"agent": {"forbidden": ["navigate"]}}, "expected one of"),
        ({"stages": {"auxiliary_share": 0.95}}, "add up"),
        ({"seed": -1}, "seed is -1"),
    ],
)
def test_invalid_settings_are_refused(changes, words):
    with pytest.raises(UsageError, match=re.escape(words)):
        from_mapping(preset("small"), changes, "file")


def test_unknown_presets_are_refused():
    with pytest.raises(UsageError, match="paper, small"):
        preset("large")


def test_every_field_is_documented():
    config = CampConfig()
    values = [getattr(config, f.name) for f in dataclasses.fields(config)]
    for part in (config, *filter(dataclasses.is_dataclass, values)):
        notes = descriptions(type(part))
        for field in dataclasses.fields(part):
            assert notes.get(field.name), f"{type(part).__name__}.{field.name}"


def test_the_released_penalty_of_a_wrong_done_can_be_set():
    config = from_mapping(preset("small"), {"data": {"failed_done_reward": -1.0}}, "file")
    assert config.data.failed_done_reward == -1.0


@pytest.mark.parametrize("name", AGENTS)
def test_a_method_with_an_intent_says_so_in_its_row(name):
    """`--intent none` changes the agent of such a method, and of no other."""
    agent = make_agent(name, preset("small"))
    assert agent.uses_intent == AGENTS[name].intent


def test_settings_of_ones_own_are_numbers_by_name(tmp_path):
    """From the command line, over those of a file, whose other names stay; they are written."""
    file = tmp_path / "mine.toml"
    file.write_text("[mine]\nwidth = 1\ndecay = 0.5\n")
    config = config_of("small", file, ["mine.width=3"])
    assert config.mine == {"width": 3.0, "decay": 0.5}
    check_settings("mine", config)
    file.write_text(config_toml(config))
    assert config_of("small", file) == config
    assert from_mapping(preset("small"), json.loads(json.dumps(plain(config))), "test") == config
    with pytest.raises(UsageError, match=r"mine.decay: method 'ppo' has no settings of its own"):
        check_settings("ppo", config)
    with pytest.raises(UsageError, match=r"mine.width: expected a number"):
        config_of("small", None, ["mine.width=wide"])


@pytest.mark.parametrize("name", AGENTS)
def test_a_setting_that_a_method_has_no_use_for_is_refused(name):
    """What a method reads changes its agent or its labels; the rest would change nothing."""
    changes = {
        "intent": "none", "sync_every": 1, "hand_back_step": True, "forbidden": ["push"],
        "initial_interaction_probability": 0.1, "nie_objects": 2, "nie_weight": 1.0,
    }  # fmt: skip
    assert {each for method in AGENTS.values() for each in method.settings} == set(changes)
    for setting, value in changes.items():
        config = from_mapping(preset("small"), {"agent": {setting: value}}, "test")
        check_settings("mine", config)
        if setting in AGENTS[name].settings:
            check_settings(name, config)
            continue
        with pytest.raises(UsageError, match=f"agent.{setting} is .*'{name}' has no use for it"):
            check_settings(name, config)
