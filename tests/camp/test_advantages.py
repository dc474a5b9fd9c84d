"""Generalised advantages: by hand, by a scalar loop, by another library."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from internav_data.camp.config import PPOConfig  # noqa: E402
from internav_data.camp.rollout import Rollout  # noqa: E402


def advantages_of(rewards, values, last, terminated, truncated, final, **config):
    """Return the advantages of a rollout without observations."""
    rollout = Rollout(None, [], rewards, terminated, truncated, values, None, final, last)
    return rollout.advantages(PPOConfig(**config))


def _one(rewards, values, last, terminated, truncated, final, gamma=0.99, gae_lambda=0.95):
    column = [torch.tensor(x).unsqueeze(1) for x in (rewards, values)]
    flags = [torch.tensor(x).unsqueeze(1) for x in (terminated, truncated)]
    final = torch.tensor(final).unsqueeze(1)
    found = advantages_of(
        *column, torch.tensor([last]), *flags, final, gamma=gamma, gae_lambda=gae_lambda
    )
    return found.squeeze(1)


REWARDS, VALUES = [1.0, -0.01, 0.5, 10.0, 0.2], [0.5, 0.4, 0.3, 0.2, 0.1]
FINAL = [0.0, 0.7, 0.0, 0.0, 0.0]


def _at(*rows):
    return [k in rows for k in range(5)]


def test_golden_of_the_issue():
    found = _one(REWARDS, VALUES, 0.6, _at(3), _at(1), FINAL)
    assert found.dtype == torch.float32
    assert found.tolist() == pytest.approx([1.1621615, 0.283, 9.6149, 9.8, 0.694], abs=1e-6)


def test_nothing_is_expected_after_an_end_in_the_last_row():
    assert _one(REWARDS, VALUES, 0.6, _at(3, 4), _at(1), FINAL)[4] == pytest.approx(0.1)


def test_ended_wins_over_cut_off():
    both = _one(REWARDS, VALUES, 0.6, _at(1, 3), _at(1), FINAL)
    assert both[1] == pytest.approx(-0.01 - 0.4)


def test_a_cut_in_the_last_row_expects_what_was_seen_before_the_reset():
    final = [0.0, 0.7, 0.0, 0.0, 2.0]
    assert _one(REWARDS, VALUES, 0.6, _at(3), _at(1, 4), final)[4] == pytest.approx(0.1 + 0.99 * 2)


def _scalar(rewards, values, last, terminated, truncated, final, gamma, gae_lambda):
    """Sum discounted surprises from each row on, in float64, until an end: the definition."""
    steps = len(rewards)
    found = np.zeros(steps)
    for t in range(steps):
        weight = 1.0
        for k in range(t, steps):
            if terminated[k]:
                ahead = 0.0
            elif truncated[k]:
                ahead = final[k]
            else:
                ahead = values[k + 1] if k + 1 < steps else last
            found[t] += weight * (rewards[k] + gamma * ahead - values[k])
            if terminated[k] or truncated[k]:
                break
            weight *= gamma * gae_lambda
    return found


@pytest.mark.parametrize("seed", range(20))
def test_agrees_with_a_scalar_reference(seed):
    rng = np.random.default_rng(seed)
    steps, count = 17, 5
    floats = rng.normal(size=(3, steps, count))
    flags = rng.random((2, steps, count)) < 0.2
    last = rng.normal(size=count)
    gamma, gae_lambda = rng.random(2)
    found = advantages_of(
        *(torch.tensor(x, dtype=torch.float32) for x in (floats[0], floats[1], last)),
        *(torch.tensor(x) for x in flags),
        torch.tensor(floats[2], dtype=torch.float32), gamma=gamma, gae_lambda=gae_lambda,
    )  # fmt: skip
    for k in range(count):
        right = _scalar(
            floats[0][:, k], floats[1][:, k], last[k], flags[0][:, k], flags[1][:, k],
            floats[2][:, k], gamma, gae_lambda,
        )  # fmt: skip
        assert found[:, k].numpy() == pytest.approx(right, abs=1e-5)


def test_agrees_with_stable_baselines():
    from gymnasium import spaces
    from stable_baselines3.common import buffers

    rng = np.random.default_rng(0)
    steps, count = 12, 3
    box = spaces.Box(-1, 1, (1,))
    theirs = buffers.RolloutBuffer(steps, box, box, gae_lambda=0.95, gamma=0.99, n_envs=count)
    rewards, values = rng.normal(size=(2, steps, count)).astype(np.float32)
    ended = rng.random((steps, count)) < 0.2
    last = rng.normal(size=count).astype(np.float32)
    episode_starts = np.zeros(count)
    for t in range(steps):
        nothing = np.zeros((count, 1))
        value = torch.tensor(values[t])
        theirs.add(nothing, nothing, rewards[t], episode_starts, value, value)
        episode_starts = ended[t]
    theirs.compute_returns_and_advantage(torch.tensor(last), episode_starts)
    ours = advantages_of(
        *(torch.tensor(x) for x in (rewards, values, last, ended, np.zeros_like(ended))),
        torch.zeros(steps, count), gamma=0.99, gae_lambda=0.95,
    )  # fmt: skip
    assert ours.numpy() == pytest.approx(theirs.advantages, abs=1e-5)


def test_an_endless_reward_of_one_is_worth_what_the_series_says():
    steps, gamma = 400, 0.9
    worth = 1.0 / (1.0 - gamma)
    found = _one([1.0] * steps, [0.0] * steps, worth, [False] * steps, [False] * steps,
                 [0.0] * steps, gamma, 1.0)  # fmt: skip
    assert found[0] == pytest.approx(worth, rel=1e-4)
