"""A small world of made-up pictures, and agents small enough for it."""

from importlib.util import find_spec

import numpy as np
import pytest

from internav_data.world.actions import ACTION_COUNT, Action


@pytest.fixture(autouse=True)
def _one_thread():
    if find_spec("torch") is None:
        yield
        return
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


class FakeEnvironments:
    """Noise to look at; episodes of fixed lengths, ended by Done or cut off; it notes actions."""

    def __init__(self, count=4, size=16, length=7, seed=0, done_ends=True, shown=None):
        self.num_envs, self._size, self._seed = count, size, seed
        self._lengths = [length + 3 * k for k in range(count)]
        self._ages = np.zeros(count, int)
        self._rng = np.random.default_rng(seed)
        self._done_ends, self._map = done_ends, shown
        self.actions = []

    def _look(self):
        n, s = self.num_envs, self._size
        return {
            "rgb": self._rng.integers(0, 256, (n, s, s, 3), np.uint8),
            "depth": self._rng.random((n, s, s, 1), np.float32) * 5,
            "goal": self._rng.random((n, 2), np.float32),
            "held": self._rng.integers(0, 2, n),
            "horizon": self._rng.integers(0, 4, n),
            "ids": self._rng.integers(-3, 6, (n, s, s)).astype(np.int32),
            **({"map": self._rng.integers(0, 256, (n, *self._map), np.uint8)} if self._map else {}),
        }

    def reset(self, *, seed=None, options=None):
        mask = (options or {}).get("reset_mask", np.ones(self.num_envs, bool))
        assert mask.any()
        self.seed = seed
        self._ages[mask] = 0
        return self._look(), {}

    def step(self, actions):
        assert actions.shape == (self.num_envs,)
        assert ((actions >= -1) & (actions < ACTION_COUNT)).all()
        self.actions.append(actions.copy())
        self._ages += 1
        ended = (actions == Action.DONE) & self._done_ends
        cut = (self._ages >= self._lengths) & ~ended
        infos = {}
        if (ended | cut).any():
            infos["metrics"] = {"success": ended.copy(), "_success": ended | cut}
        return self._look(), self._rng.random(self.num_envs), ended, cut, infos


@pytest.fixture(scope="session")
def houses(tmp_path_factory):
    """A generated dataset: two houses, two episodes each."""
    from internav_data.generation import generate, load_config

    out = tmp_path_factory.mktemp("camp") / "d"
    generate(out, load_config(overrides=["episodes_per_scene=2", "house.rooms=1-2"]), 2, workers=1)
    return out


@pytest.fixture(scope="session")
def scenes(tmp_path_factory):
    """Six houses of a single room, four of them to train on."""
    from internav_data.generation import generate, load_config

    out = tmp_path_factory.mktemp("train") / "d"
    generate(out, load_config(overrides=["episodes_per_scene=4", "house.rooms=1"]), 6, workers=1)
    return out


@pytest.fixture
def fake():
    return FakeEnvironments


@pytest.fixture
def config():
    """Make a tiny config: `config(agent={"intent": "none"}, ppo=…)`."""
    from internav_data.camp.config import from_mapping, preset

    def make(**changes):
        # Goals of noise are a small input: what is compared to 1e-6 is not to be amplified by it.
        sizes = {
            "network": {"image_size": 16, "hidden": 12, "goal_scale_m": 10.0},
            "ppo": {"num_envs": 4, "num_minibatches": 2, "num_steps": 8},
        }
        tiny = from_mapping(preset("small"), sizes, "test")
        return from_mapping(tiny, changes, "test")

    return make


def lively(agent):
    """Blow weights up, so that intents and values differ visibly from step to step."""
    import torch

    with torch.no_grad():
        for name, parameter in agent.named_parameters():
            if "actor.weight" in name or "embed.weight" in name:
                parameter.mul_(30.0)
    agent.synchronise()
    return agent


@pytest.fixture
def collected(fake, config):
    """Return agent, collector and some successive rollouts."""
    from internav_data.camp.agents import make_agent
    from internav_data.camp.rollout import Collector, uniforms_of

    def make(method, rollouts=2, env=None, steps=8, changes=None, agent=None, chunk_steps=0):
        agent = agent or lively(make_agent(method, config(**(changes or {}))))
        env = env or fake()
        collector = Collector(env, agent)
        collector.loop.reset(seed=0)
        lived = [
            collector.collect(uniforms_of(0, r, range(env.num_envs), steps), chunk_steps)
            for r in range(rollouts)
        ]
        return agent, collector, lived

    return make
