"""Sensors: spaces, buffers and shared memory derive from them; one's own is three lines."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from internav_data.envs import InterNavEnv, InterNavProcesses, InterNavVectorEnv, Sensor
from internav_data.envs.sensors import DEFAULT_SENSORS, SENSORS
from internav_data.records.errors import UsageError
from internav_data.world import Action

AHEAD, LEFT, WAIT = 0, 1, -1


def steps_space(size):
    return spaces.Discrete(501)


def write_steps(run, frames, out):
    out[...] = len(run.actions)


STEPS = Sensor("steps", steps_space, write_steps)


def close_space(size):
    return spaces.Box(0.0, 1.0, (1,), np.float32)


def write_close(run, frames, out):
    out[...] = (frames.depth[0] < 1.0).mean()


CLOSE = Sensor("close", close_space, write_close, camera=True)
OWN = ("goal", "depth", STEPS, CLOSE)


def test_a_sensor_of_ones_own_is_observed_by_one_by_many_and_by_processes(small):
    alone = InterNavEnv(small, 16, sensors=OWN)
    many = InterNavVectorEnv(2, small, 16, sensors=OWN)
    processes = InterNavProcesses(2, small, 2, 16, sensors=OWN)
    try:
        seen = [alone.reset(seed=3)[0], many.reset(seed=3)[0], processes.reset(seed=3)[0]]
        for steps, action in enumerate((WAIT, LEFT, WAIT, LEFT), 1):
            one, *both = seen
            assert alone.observation_space.contains(one)
            for other in both:
                assert set(other) == {"goal", "depth", "steps", "close"}
                assert many.observation_space.contains(dict(other))
                np.testing.assert_array_equal(other["steps"], [steps - 1] * 2)
                np.testing.assert_array_equal(other["close"][0], one["close"])
                shares = (other["depth"] < 1.0).mean(axis=(1, 2, 3))
                np.testing.assert_allclose(other["close"][:, 0], shares, atol=1e-6)
            acts = np.array([action] * 2)
            seen = [alone.step(action)[0], many.step(acts)[0], processes.step(acts)[0]]
    finally:
        processes.close()


def test_spaces_and_observations_have_the_sensors_asked_for(small):
    for names in (DEFAULT_SENSORS, ("goal",), tuple(SENSORS), ()):
        env = InterNavVectorEnv(2, small, 16, sensors=names)
        seen, _ = env.reset(seed=0)
        assert set(seen) == set(names) == set(env.single_observation_space)
        assert env.observation_space.contains(seen)


def test_what_is_observed_changes_nothing_else(small):
    blind, seeing = (InterNavVectorEnv(2, small, 16, sensors=s) for s in ((), tuple(SENSORS)))
    blind.reset(seed=5), seeing.reset(seed=5)
    for action in (AHEAD, LEFT, AHEAD, 11, WAIT):
        one, other = blind.step([action] * 2), seeing.step([action] * 2)
        for mine, theirs in zip(one[1:4], other[1:4], strict=True):
            np.testing.assert_array_equal(mine, theirs)
    assert blind.state() == seeing.state()


def test_a_picture_is_drawn_again_after_every_action_that_changes_it(small):
    """A row of the table of actions that forgets `changes_picture` shows a stale picture."""
    env, fresh = InterNavEnv(small, 16), InterNavEnv(small, 16)
    acts = [int(action) for action in Action if action != Action.DONE]
    pictures, rng = set(), np.random.default_rng(4)
    for seed in range(3):
        env.reset(seed=seed), fresh.reset(seed=seed)
        for action in rng.permutation(acts * 2).tolist():
            seen = env.step(action)[0]
            other = fresh.restore(env.state())[0]
            for name, value in seen.items():
                np.testing.assert_array_equal(value, other[name])
            pictures.add(seen["rgb"].tobytes())
    assert len(pictures) > 12


@pytest.mark.parametrize(
    ("sensors", "message"),
    [
        (["rgb", "smell"], "expected some of"),
        ("rgb", "expected some of"),
        (["rgb", "rgb"], "each name once"),
        ([Sensor("goal", steps_space, write_steps), "goal"], "each name once"),
        ([Sensor("words", lambda _: spaces.Text(9), write_steps)], "space of arrays"),
    ],
)
def test_sensors_that_cannot_be_are_refused(small, sensors, message):
    with pytest.raises(UsageError, match=message):
        InterNavVectorEnv(1, small, 16, sensors=sensors)


def test_gymnasium_makes_environments_with_sensors(small):
    env = gymnasium.make("internav_data.envs:InterNav-v0", dataset=small, sensors=["held"])
    assert list(env.observation_space) == ["held"]
