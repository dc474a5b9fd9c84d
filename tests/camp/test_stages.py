"""Order and length of the training stages: section 5.2, and the same steps for all."""

import itertools

import pytest

pytest.importorskip("torch")

from internav_data.camp.config import from_mapping, preset
from internav_data.camp.stages import PARTS, order_seed, schedule
from internav_data.records.errors import UsageError

LONG = {"stages": {"total_timesteps": 2_000_000}}


def config_of(name):
    """Return a preset, long enough for its auxiliary stages."""
    return preset(name) if name == "paper" else from_mapping(preset(name), LONG, "test")


def steps_of(stages, config):
    each = config.ppo.num_envs * config.ppo.num_steps
    return {stage.name: stage.updates * each for stage in stages}


@pytest.mark.parametrize("name", ["small", "paper"])
def test_every_method_gets_the_same_steps(name):
    config = config_of(name)
    deep, flat = (schedule(config, PARTS, hierarchical=deep) for deep in (True, False))
    assert sum(steps_of(deep, config).values()) == sum(steps_of(flat, config).values())
    assert sum(steps_of(deep, config).values()) == pytest.approx(
        config.stages.total_timesteps, rel=1e-2
    )
    single = sum(n for stage, n in steps_of(flat, config).items() if stage != "all")
    assert single == pytest.approx(0.2 * config.stages.total_timesteps, rel=0.05)


def test_the_papers_stages_are_one_policy_after_the_other():
    config = preset("paper")
    stages = schedule(config, PARTS, hierarchical=True)
    assert [stage.name for stage in stages] == [
        "auxiliary-navigate", "auxiliary-push", "auxiliary-pick", "single", "all",
    ]  # fmt: skip
    assert steps_of(stages, config)["single"] == pytest.approx(1e6, rel=1e-3)
    assert steps_of(stages, config)["all"] == pytest.approx(8e6, rel=1e-3)
    assert [set(stage.tasks) for stage in stages] == [
        {"navigate"},
        {"push"},
        {"pick"},
        set(),
        set(),
    ]
    assert [stage.rate for stage in stages] == [3e-4, 3e-4, 3e-4, 1e-4, 1e-4]
    assert [stage.single_room for stage in stages] == [True, True, True, True, False]
    # One decay over all of it, each stage going on where the last one ended.
    ends = [(stage.decay_from, stage.decay_to) for stage in stages]
    assert ends[0][0] == 0.0
    assert ends[-1][1] == 1.0
    assert all(one[1] == two[0] for one, two in itertools.pairwise(ends))


def test_short_runs_have_no_auxiliary_stage_whatever_the_method():
    for hierarchical in (True, False):
        stages = schedule(preset("small"), PARTS, hierarchical=hierarchical)
        assert [stage.name for stage in stages] == ["single", "all"]
        steps = steps_of(stages, preset("small"))
        assert sum(steps.values()) == pytest.approx(300_000, rel=0.01)


def test_small_trains_the_tasks_side_by_side_and_decays_in_each_stage():
    stages = schedule(config_of("small"), PARTS, hierarchical=True)
    assert [stage.name for stage in stages] == ["auxiliary", "single", "all"]
    assert stages[0].tasks == ("navigate",) * 6 + ("push",) * 5 + ("pick",) * 5
    assert {(stage.decay_from, stage.decay_to) for stage in stages} == {(0.0, 1.0)}
    assert [stage.critic for stage in stages] == ["auxiliary", "main", "main"]
    flat = schedule(config_of("small"), PARTS, hierarchical=False)
    assert {stage.critic for stage in flat} == {"main"}
    assert {stage.rate for stage in flat} == {3e-4}
    assert not any(stage.tasks for stage in flat)


def test_a_part_alone_is_that_part_of_the_whole():
    config = config_of("small")
    whole = schedule(config, PARTS, hierarchical=True)
    assert [schedule(config, (part,), hierarchical=True)[0] for part in PARTS] == whole


@pytest.mark.parametrize("parts", [(), ("al",), ("all", "single"), ("auxiliary", "all")])
def test_parts_follow_each_other(parts):
    with pytest.raises(UsageError, match="--stages"):
        schedule(preset("small"), parts, hierarchical=True)


def test_what_leaves_nothing_to_do_is_refused():
    tiny = {"total_timesteps": 1000, "min_auxiliary_timesteps": 0}
    tiny = from_mapping(preset("small"), {"stages": tiny}, "test")
    with pytest.raises(UsageError, match="less than one update of 1024"):
        schedule(tiny, ("auxiliary",), hierarchical=True)
    two = {**LONG, "ppo": {"num_envs": 2, "num_minibatches": 1}}
    two = from_mapping(preset("small"), two, "test")
    with pytest.raises(UsageError, match="3 at least"):
        schedule(two, PARTS, hierarchical=True)


def test_orders_of_episodes_differ_by_stage_and_seed():
    names = ("cloning", *PARTS)
    seeds = {order_seed(seed, name) for seed in range(5) for name in names}
    assert len(seeds) == 20
