from __future__ import annotations

import numpy as np
import pytest

from internav_data.dataset import load_dataset
from internav_data.envs.sensors import DEFAULT_SENSORS
from internav_data.envs.single import InterNavEnv
from internav_data.evaluation.evaluator import EvaluationConfig, chosen, episode_generator, evaluate
from internav_data.evaluation.reference_policies import (
    RandomPolicy,
    ScriptedPolicy,
    reference_policy,
)
from internav_data.records.errors import UsageError

SHORT = EvaluationConfig(batch=3, max_steps=30)


class Looking(RandomPolicy):
    """Draws as `RandomPolicy` does, and ends where what it sees is bright: pictures matter."""

    image_size = 16
    sensors = DEFAULT_SENSORS

    def act(self, observations):
        bright = observations["rgb"].reshape(len(observations["rgb"]), -1).mean(axis=1)
        return np.where(bright > 150, 11, super().act(observations))


@pytest.fixture(scope="module")
def alone(played_data):
    return evaluate(Looking(), played_data, EvaluationConfig(batch=1, max_steps=30))


@pytest.mark.parametrize("batch", [2, 5, 64])
def test_the_batch_changes_nothing(played_data, alone, batch):
    assert evaluate(Looking(), played_data, EvaluationConfig(batch=batch, max_steps=30)) == alone


def test_processes_change_nothing(played_data, alone):
    assert (
        evaluate(Looking(), played_data, EvaluationConfig(batch=4, workers=2, max_steps=30))
        == alone
    )


def test_neither_neighbours_nor_order_change_an_episode(played_data, alone):
    known = {result.episode_id: result for result in alone}
    assert [result.episode_id for result in alone] == [e.episode_id for e in played_data]
    few = evaluate(Looking(), played_data, EvaluationConfig(batch=2, max_steps=30, limit=5))
    assert len(few) == 5
    assert all(known[result.episode_id] == result for result in few)
    only = load_dataset(played_data.path, "test")
    assert [known[r.episode_id] for r in evaluate(Looking(), only, SHORT)] == evaluate(
        Looking(), only, SHORT
    )


def test_the_seed_changes_what_is_drawn(played_data, alone):
    other = evaluate(Looking(), played_data, EvaluationConfig(seed=1, batch=4, max_steps=30))
    assert [r.actions for r in other] != [r.actions for r in alone]


def test_what_was_done_can_be_played_again(played_data, alone):
    env = InterNavEnv(played_data, image_size=16, max_steps=30)
    for result in alone[::5]:
        env.reset(options={"episode_id": result.episode_id})
        for action in result.actions:
            *_, terminated, truncated, info = env.step(action)
        assert terminated or truncated
        said = info["metrics"]
        assert (said["success"], said["steps"]) == (result.success, result.steps)
        assert said["distance_to_goal_m"] == result.distance_m
        assert said["return"] == result.reward_sum
        assert said["pushes_tried"] == result.pushes_tried


def test_long_episodes_are_cut_off(played_data):
    turning = ScriptedPolicy("turning", lambda _: [1] * 100)
    results = evaluate(turning, played_data, EvaluationConfig(max_steps=7, limit=4))
    assert [(r.steps, r.success, r.path_m) for r in results] == [(7, False, 0.0)] * 4
    assert [len(r.actions) for r in results] == [7] * 4


def test_seats_of_ended_episodes_wait_for_the_last(played_data):
    """One long episode among short ones, over many more steps than an idle seat may wait."""
    first = played_data[0].episode_id
    script = ScriptedPolicy("one long", lambda e: [1] * 40 if e.episode_id == first else [11])
    results = evaluate(script, played_data, EvaluationConfig(batch=16, max_steps=40))
    assert [r.steps for r in results] == [40] + [1] * (len(played_data) - 1)


def test_progress_is_told(played_data):
    told = []
    evaluate(
        reference_policy("random", played_data), played_data, SHORT, lambda *said: told.append(said)
    )
    assert told[-1] == (len(played_data), len(played_data))
    assert [done for done, _ in told] == sorted({done for done, _ in told})


def test_a_choice_is_fixed_and_smaller_ones_are_parts_of_it():
    assert chosen(5, None) == chosen(5, 9) == [0, 1, 2, 3, 4]
    few, many = chosen(1000, 20), chosen(1000, 300)
    assert len(few) == 20
    assert set(few) < set(many)
    assert few == sorted(few)
    assert 100 < np.mean(np.array(many) % 2 == 0) * 300 < 200, "both modes"


def test_random_numbers_belong_to_the_episode(hand_episode):
    from dataclasses import replace

    first = episode_generator(3, hand_episode).random(4)
    assert (episode_generator(3, hand_episode).random(4) == first).all()
    for other in (
        episode_generator(4, hand_episode),
        episode_generator(3, replace(hand_episode, index=2)),
        episode_generator(3, replace(hand_episode, scene_id="scene-000004")),
    ):
        assert (other.random(4) != first).all()


@pytest.mark.parametrize(
    "wrong",
    [{"batch": 0}, {"max_steps": 0}, {"max_steps": 10**6}, {"limit": 0}, {"seed": -1}],
)
def test_settings_that_cannot_be_meant(played_data, wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        evaluate(RandomPolicy(), played_data, EvaluationConfig(**wrong))


def test_nothing_to_play_says_so(played_data):
    empty = load_dataset(played_data.path, filters=[("room_count", ">", 9)])
    with pytest.raises(UsageError, match=r"room_count.*stats"):
        evaluate(RandomPolicy(), empty)
