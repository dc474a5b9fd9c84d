"""That learners learn: minutes on one thread, so not among the quick tests."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from internav_data.camp.agents import make_agent  # noqa: E402
from internav_data.camp.collect import Collector, orders_of, uniforms_of  # noqa: E402
from internav_data.camp.ppo import set_rate, update  # noqa: E402

AHEAD, LEFT, RIGHT, PUSH, DONE = 0, 1, 2, 5, 11


class Corridor:
    """Turn to the goal, walk, push the box that is seen in the way, say Done: 40 steps at most."""

    def __init__(self, count=16, size=16):
        self.num_envs, self._size = count, size
        self._rng = np.random.default_rng(0)
        self._far, self._turns, self._box, self._age = np.zeros((4, count), int)

    def _look(self):
        shape = (self.num_envs, self._size, self._size)
        rgb, depth = np.full((*shape, 3), 60, np.uint8), np.full((*shape, 1), 5, np.float32)
        near = self._blocked & (self._turns == 0)
        rgb[near, 4:12, 4:12] = (220, 40, 40)
        depth[near, 4:12, 4:12] = 0.5
        bearing = np.array([0, np.pi / 2, np.pi, -np.pi / 2])[self._turns] * (self._far > 0)
        goal = np.stack([0.25 * self._far, bearing], 1).astype(np.float32)
        nothing = np.zeros(self.num_envs, np.int64)
        return {"rgb": rgb, "depth": depth, "goal": goal, "held": nothing, "horizon": nothing + 1}

    @property
    def _blocked(self):
        return (self._box > 0) & (self._far - 1 == self._box)

    def reset(self, *, seed=None, options=None):
        mask = (options or {}).get("reset_mask", np.ones(self.num_envs, bool))
        count = int(mask.sum())
        self._far[mask] = self._rng.integers(2, 7, count)
        self._turns[mask] = self._rng.integers(0, 4, count)
        self._box[mask] = np.maximum(self._far[mask] - 1 - self._rng.integers(0, 3, count), 0)
        self._age[mask] = 0
        return self._look(), {"seed": seed}

    def step(self, actions):
        reached = (actions == DONE) & (self._far == 0)
        pushed = (actions == PUSH) & self._blocked & (self._turns == 0)
        towards = (actions == AHEAD) & (self._turns == 0) & (self._far > 0) & ~self._blocked
        away = (actions == AHEAD) & (self._turns == 2) & (self._far < 8)
        rewards = 10.0 * reached + 1.0 * pushed + 0.25 * towards - 0.25 * away - 0.01
        self._far += away.astype(int) - towards
        self._box[pushed] = 0
        self._turns = (self._turns + (actions == RIGHT) - (actions == LEFT)) % 4
        self._age += 1
        ended = actions == DONE
        cut = (self._age >= 40) & ~ended
        infos = {"metrics": {"success": reached}} if (ended | cut).any() else {}
        return self._look(), rewards, ended, cut, infos


@pytest.mark.slow
@pytest.mark.parametrize("method", ["ppo", "camp"])
def test_a_box_in_a_corridor_is_pushed(method, config):
    """From scratch: nine of ten episodes succeed within 150,000 steps."""
    sizes = {"network": {"hidden": 64}, "ppo": {"environments": 16, "minibatches": 4, "steps": 64}}
    settings = config(**sizes)
    agent, env = make_agent(method, settings), Corridor()
    collector = Collector(env, agent)
    collector.begin(env.reset()[0])
    optimiser = torch.optim.Adam(agent.optimised(), 1e-3)
    ended, rollouts = [], 150
    for number in range(rollouts):
        set_rate(optimiser, 1e-3, number / rollouts)
        rollout = collector.collect(uniforms_of(0, number, range(16), 64))
        ended += [episode.metrics["success"] for episode in rollout.finished]
        update(
            agent, optimiser, rollout, settings.ppo, orders_of(0, number, 3, 16),
            critic_only=number < settings.ppo.critic_rollouts,
        )  # fmt: skip
        if (number + 1) % settings.agent.sync_every == 0:
            agent.synchronise()
        if len(ended) > 500 and np.mean(ended[-300:]) >= 0.9:
            return
    pytest.fail(f"success of the last 300 episodes: {np.mean(ended[-300:])}")
