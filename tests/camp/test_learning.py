"""Agents learn from scratch, by the project's own PPO: `make test-learning`.

Hyperparameters are those of the preset `small`, but for sizes and the learning rate. On seeds
0 and 1 every learner needed 45 to 80 rollouts; they have 300.
"""

import dataclasses
import itertools

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from small_worlds import SIZE, Cue, Mixed  # noqa: E402

from internav_data.camp.agents import AGENTS, make_agent  # noqa: E402
from internav_data.camp.agents.flat import PPOAgent  # noqa: E402
from internav_data.camp.ppo import set_rate, update  # noqa: E402
from internav_data.camp.rollout import Collector, orders_of, uniforms_of  # noqa: E402

pytestmark = pytest.mark.learning

ENVIRONMENTS, STEPS, RATE, ROLLOUTS = 32, 32, 1e-3, 300
LAST, ENOUGH = 300, 0.9


@pytest.fixture
def settings(config):
    sizes = {"num_envs": ENVIRONMENTS, "num_steps": STEPS, "num_minibatches": 4}
    return config(network={"image_size": SIZE, "hidden": 64}, ppo=sizes)


def lives(agent, env, settings):
    """Train an agent; yield the share of successes among its last episodes after each rollout."""
    collector = Collector(env, agent)
    collector.loop.reset()
    optimiser = torch.optim.Adam(agent.optimised(), RATE)
    ended = [False] * LAST
    for number in range(ROLLOUTS):
        set_rate(optimiser, RATE, number / ROLLOUTS)
        rollout = collector.collect(uniforms_of(settings.seed, number, range(env.num_envs), STEPS))
        ended += [episode.metrics["success"] for episode in rollout.finished]
        orders = orders_of(settings.seed, number, settings.ppo.update_epochs, env.num_envs)
        new = number < settings.ppo.critic_warmup_rollouts
        update(agent, optimiser, rollout, settings.ppo, orders, critic_only=new)
        if (number + 1) % settings.agent.sync_every == 0:
            agent.synchronise()
        yield float(np.mean(ended[-LAST:]))


def rollouts_needed(agent, env, settings):
    """Train an agent until it succeeds often enough; return how many rollouts that took."""
    shares = []
    for share in lives(agent, env, settings):
        shares.append(share)
        if share >= ENOUGH:
            return len(shares)
    return pytest.fail(f"success never reached {ENOUGH}; every 20th rollout: {shares[::20]}")


@pytest.mark.parametrize("method", AGENTS)
def test_a_box_is_pushed_a_thing_picked_up_and_a_block_gone_round(method, settings):
    """Nine of ten of the last 300 episodes: no kind can be left out, each is a third of them."""
    agent = make_agent(method, settings)
    rollouts_needed(agent, Mixed(ENVIRONMENTS, ids="ids" in agent.sensors), settings)


class Forgetful(PPOAgent):
    """`ppo` whose hidden state is zeroed at every step: the same networks, feed-forward."""

    def act(self, seen, state, episode_starts, uniforms):
        return super().act(seen, state, torch.ones_like(episode_starts), uniforms)

    def value(self, seen, state):
        return super().value(seen, {name: torch.zeros_like(kept) for name, kept in state.items()})

    def evaluate(self, batch):
        return super().evaluate(
            dataclasses.replace(batch, episode_starts=torch.ones_like(batch.episode_starts))
        )


def test_memory_is_used_where_it_is_needed_and_a_feed_forward_copy_fails(settings):
    agent, copy = make_agent("ppo", settings), Forgetful(settings)
    copy.load_state_dict(agent.state_dict())
    needed = rollouts_needed(agent, Cue(ENVIRONMENTS), settings)
    shares = list(itertools.islice(lives(copy, Cue(ENVIRONMENTS), settings), needed))
    assert shares[-1] > 0.3, "it should guess"
    assert max(shares) < 0.65
