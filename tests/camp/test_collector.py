"""Rollouts: what is seen, paid and expected at ends, cuts and boundaries."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from internav_data.camp.agents import AGENTS, make_agent  # noqa: E402
from internav_data.camp.rollout import Collector, orders_of, uniforms_of  # noqa: E402


@pytest.fixture
def diary(fake):
    """Make an environment that keeps all it showed, paid and was told to reset."""

    class Diary(fake):
        def __init__(self, **given):
            super().__init__(**given)
            self.shown, self.paid, self.resets = [], [], []

        def step(self, actions):
            said = super().step(actions)
            self.shown.append(said[0])
            self.paid.append(said[1])
            return said

        def reset(self, **given):
            seen, infos = super().reset(**given)
            if given.get("options"):
                self.resets.append((len(self.shown) - 1, given["options"]["reset_mask"].copy()))
            self.shown.append(seen) if not self.shown else None
            return seen, infos

    return Diary


@pytest.mark.parametrize("method", AGENTS)
def test_cuts_are_valued_before_the_reset_and_ends_are_not(diary, config, method):
    """Values come from the last observations and the hidden states after them, step by step."""
    env, agent = diary(), make_agent(method, config(agent={"initial_done_probability": 0.05}))
    collector = Collector(env, agent)
    collector.loop.reset()
    uniforms = uniforms_of(0, 0, range(4), 30)
    rollout = collector.collect(uniforms)
    assert rollout.truncated.any()
    assert rollout.terminated.any()
    assert (rollout.final_values[~rollout.truncated] == 0).all()
    state, episode_starts = agent.initial_state(4), torch.ones(4, dtype=torch.bool)
    for t in range(30):
        seen = {name: what[t] for name, what in rollout.batch.observations.items()}
        with torch.no_grad():
            step = agent.act(seen, state, episode_starts, uniforms[t])
            last = {name: torch.from_numpy(what) for name, what in env.shown[t + 1].items()}
            expected = agent.value(last, step.state)
        state, episode_starts = step.state, rollout.truncated[t] | rollout.terminated[t]
        cut = rollout.truncated[t]
        torch.testing.assert_close(rollout.final_values[t][cut], expected[cut])
        assert torch.equal(step.action, torch.from_numpy(env.actions[t]))
        torch.testing.assert_close(step.value, rollout.values[t])
    torch.testing.assert_close(rollout.rewards, torch.tensor(np.stack(env.paid)).float())


def test_who_is_done_is_reset_at_once_and_nobody_else(diary, config):
    env, agent = diary(), make_agent("camp", config())
    collector = Collector(env, agent)
    collector.loop.reset()
    rollout = collector.collect(uniforms_of(0, 0, range(4), 20))
    over = rollout.terminated | rollout.truncated
    rows = [t for t in range(20) if over[t].any()]
    assert [(t - 1) for t, _ in env.resets] == [t - 1 + 0 for t in [row + 1 for row in rows]]
    for (_, mask), row in zip(env.resets, rows, strict=True):
        assert mask.tolist() == over[row].tolist()
    assert torch.equal(rollout.batch.episode_starts[1:], over[:-1])
    assert rollout.batch.episode_starts[0].all()
    assert collector.loop.episode_starts.tolist() == over[-1].tolist()


def test_buffers_that_are_written_again_do_no_harm(fake, config):
    """Environments may overwrite the observations that they returned."""

    class Reused(fake):
        kept = None

        def _look(self):
            seen = super()._look()
            if self.kept is None:
                self.kept = seen
            for name, what in seen.items():
                self.kept[name][...] = what
            return self.kept

    lived = []
    for make in (fake, Reused):
        env, agent = make(), make_agent("camp", config())
        collector = Collector(env, agent)
        collector.loop.reset()
        lived.append(collector.collect(uniforms_of(0, 0, range(4), 20)))
    assert torch.equal(lived[0].log_probs, lived[1].log_probs)
    assert torch.equal(lived[0].final_values, lived[1].final_values)
    for name, what in lived[0].batch.observations.items():
        assert torch.equal(what, lived[1].batch.observations[name])


def test_random_numbers_are_those_of_the_environment_whatever_the_rank():
    whole = uniforms_of(3, 7, range(6), 5)
    assert whole.shape == (5, 6, 2)
    assert whole.dtype == torch.float32
    assert torch.equal(whole[:, 2:4], uniforms_of(3, 7, range(2, 4), 5))
    assert not torch.equal(whole, uniforms_of(3, 8, range(6), 5))
    assert not torch.equal(whole, uniforms_of(4, 7, range(6), 5))
    orders = orders_of(3, 7, 4, 6)
    assert all(sorted(order) == list(range(6)) for order in orders)
    assert len({tuple(order) for order in orders}) > 1


def test_draws_follow_their_distribution():
    """Inversion: a share of numbers as large as the chance; never what has none."""
    from internav_data.camp.networks import drawn

    chances = torch.tensor([0.0, 0.2, 0.0, 0.5, 0.3, 0.0])
    uniforms = torch.cat([torch.arange(0, 1, 1e-4), torch.tensor([0.0, 1 - 2.0**-24])])
    found = drawn(chances.log().expand(len(uniforms), 6), uniforms)
    shares = torch.bincount(found, minlength=6) / len(uniforms)
    torch.testing.assert_close(shares, chances, atol=1e-3, rtol=0)
    assert not torch.isin(found, torch.tensor([0, 2, 5])).any()
    assert (drawn(chances.log().expand(3, 6), None) == 3).all()


def test_a_real_environment_is_lived_in(houses, config):
    """The contract with `internav_data.envs`: copies or not, hand-backs, resets by mask."""
    from internav_data.envs.sensors import SENSORS
    from internav_data.envs.vector import InterNavVectorEnv

    lived = []
    for copied in (True, False):
        env = InterNavVectorEnv(
            4,
            houses,
            image_size=16,
            autoreset_mode="Disabled",
            copy=copied,
            max_steps=15,
            sensors=tuple(SENSORS),
        )
        for method in ("camp", "nie"):
            agent = make_agent(method, config(agent={"initial_interaction_probability": 0.3}))
            collector = Collector(env, agent, seed=5)
            collector.loop.reset(seed=5)
            rollout = collector.collect(uniforms_of(0, 0, range(4), 40))
            now = agent.evaluate(rollout.batch)
            torch.testing.assert_close(now.log_prob, rollout.log_probs, atol=1e-5, rtol=0)
            assert {"success", "spl", "pushes_tried"} <= set(rollout.finished[0].metrics)
            lived.append(rollout)
    assert torch.equal(lived[0].log_probs, lived[2].log_probs)
    assert torch.equal(lived[0].rewards, lived[2].rewards)


@pytest.mark.parametrize("overwrites", [False, True])
def test_observations_are_overwritten_where_that_was_asked_for_alone(fake, config, overwrites):
    """What is observed is the same, also where a rollout is longer than the one before."""
    agent = make_agent("ppo", config())
    collectors = [Collector(fake(), agent), Collector(fake(), agent, overwrites=overwrites)]
    places, earlier = [], []
    for collector in collectors:
        collector.loop.reset()
    for number, steps in enumerate((6, 6, 9)):
        fresh, rollout = (
            each.collect(uniforms_of(0, number, range(4), steps)) for each in collectors
        )
        for name, values in fresh.batch.observations.items():
            assert torch.equal(values, rollout.batch.observations[name])
        places.append(rollout.batch.observations["rgb"].data_ptr())
        earlier.append((rollout, fresh))
    first, same = earlier[0]
    kept = torch.equal(first.batch.observations["rgb"], same.batch.observations["rgb"])
    assert (places[0] == places[1], kept) == (overwrites, not overwrites)
