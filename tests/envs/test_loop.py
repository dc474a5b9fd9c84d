"""The loop of an agent in environments: who acts when, and what is reset."""

import subprocess
import sys

import numpy as np
import pytest

from internav_data.envs.loop import EnvironmentLoop


class Counters:
    """Two environments that show their age; episodes end after 2 and are cut off after 3 steps."""

    num_envs = 2

    def __init__(self):
        self.ages, self.resets = np.zeros(2, int), []

    def reset(self, *, seed=None, options=None):
        mask = (options or {}).get("reset_mask", np.ones(2, bool))
        self.resets.append((seed, mask.tolist(), (options or {}).get("episode_id")))
        self.ages[mask] = 0
        return {"age": self.ages}, {"episode_id": np.array([f"e{len(self.resets)}"] * 2)}

    def step(self, actions):
        self.ages += actions
        done, cut = self.ages == [2, 9], self.ages == [9, 3]
        return {"age": self.ages}, self.ages * 0.5, done, cut, {}

    def restore(self, states):
        self.ages[:] = states
        return {"age": self.ages}, {}


@pytest.fixture
def loop():
    made = EnvironmentLoop(Counters())
    made.reset(seed=3)
    return made


def test_every_step_is_yielded_before_finished_environments_are_reset(loop):
    acted = []

    def act(observations, episode_starts):
        acted.append((observations["age"].tolist(), episode_starts.tolist()))
        return np.ones(2, int)

    rows = [
        (step.observations["age"].tolist(), step.terminated.tolist(), step.truncated.tolist())
        for step in loop.run(act, 4)
    ]
    assert rows == [
        ([1, 1], [False, False], [False, False]),
        ([2, 2], [True, False], [False, False]),
        ([1, 3], [False, False], [False, True]),
        ([2, 1], [True, False], [False, False]),
    ]
    assert acted == [
        ([0, 0], [True, True]),
        ([1, 1], [False, False]),
        ([0, 2], [True, False]),
        ([1, 0], [False, True]),
    ]
    masks = [mask for _, mask, _ in loop.env.resets]
    assert masks == [[True, True], [True, False], [False, True], [True, False]]


def test_after_the_last_step_the_next_episode_has_begun(loop):
    """A second run goes on where the first one stopped."""
    list(loop.run(lambda *_: np.ones(2, int), 2))
    assert loop.observations["age"].tolist() == [0, 2]
    assert loop.episode_starts.tolist() == [True, False]
    assert loop.infos["episode_id"].tolist() == ["e2", "e2"]
    (step,) = loop.run(lambda *_: np.ones(2, int), 1)
    assert step.truncated.tolist() == [False, True]


def test_a_caller_may_end_episodes_and_choose_the_next_ones(loop):
    for step in loop.run(lambda *_: np.ones(2, int), 1):
        step.reset_mask[1] = True
        step.reset_options["episode_id"] = ["a", "b"]
    assert loop.env.resets[-1] == (None, [False, True], ["a", "b"])
    assert loop.episode_starts.tolist() == [False, True]


def test_a_caller_may_stop_at_any_step(loop):
    for step in loop.run(lambda *_: np.ones(2, int)):
        if step.terminated.any():
            break
    assert loop.observations["age"].tolist() == [2, 2]
    assert len(loop.env.resets) == 1


def test_it_goes_on_from_snapshots(loop):
    loop.restore([1, 0], np.array([False, True]))
    acted = []
    list(loop.run(lambda *seen: acted.append(seen[1].tolist()) or np.ones(2, int), 1))
    assert acted == [[False, True]]
    assert loop.episode_starts.tolist() == [True, False]


def test_it_needs_no_torch():
    script = "import sys, internav_data.envs.loop; print('torch' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "False"
