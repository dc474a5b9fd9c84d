"""The eight defects of the released trainer: one test each, by number."""

import inspect

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from internav_data.camp.agents import AGENTS, make_agent  # noqa: E402
from internav_data.camp.agents.hierarchy import NAVIGATE, PICK, PUSH, option_inputs, option_step  # noqa: E402
from internav_data.camp.agents.protocol import Agent  # noqa: E402
from internav_data.camp.ppo import update  # noqa: E402
from internav_data.camp.rollout import Collector, orders_of, uniforms_of  # noqa: E402
from internav_data.records.errors import NotFiniteError  # noqa: E402


def test_defect_1_no_option_lives_on_a_module(collected):
    """Replayed log-probabilities are the rollout's, and a time-out ends an interaction."""
    agent, _, lived = collected(
        "camp", rollouts=4, changes={"agent": {"initial_interaction_probability": 0.4}}
    )
    buffers = {name for name, _ in agent.named_buffers() if not name.endswith("critic.scale")}
    assert buffers == {"mask"}
    before = {k: v for k, v in vars(agent).items() if not k.startswith("_")}
    inside = False
    for rollout in lived:
        now = agent.evaluate(rollout.batch)
        torch.testing.assert_close(now.log_prob, rollout.log_probs, atol=1e-5, rtol=0)
        record, episode_starts = rollout.batch.record, rollout.batch.episode_starts
        assert not record.open[episode_starts].any()
        assert not record.used[episode_starts].any()
        assert record.decide[episode_starts].all()
        acting = (record.option == PUSH) | (record.option == PICK)
        inside |= bool((rollout.truncated & acting).any())
    assert inside, "a time-out hit an interaction"
    assert {k: v for k, v in vars(agent).items() if not k.startswith("_")} == before


def test_defect_2_the_mixture_is_a_distribution(collected):
    """Pick's rotations are added to Navigate's, and Navigate's Done and Look keep their mass."""
    agent, _, (_, rollout) = collected("camp")
    batch = rollout.batch
    ran = agent.run(batch)
    torch.testing.assert_close(ran.intent.sum(-1), torch.ones(8, 4))
    acts, meant = ran.log_probs.exp(), batch.record.intended_option_probs
    for look in (3, 4):
        right = meant[..., NAVIGATE] * acts[..., NAVIGATE, look]
        torch.testing.assert_close(ran.intent[..., look], right)
    turns = sum(meant[..., option] * acts[..., option, 1] for option in (NAVIGATE, PICK))
    torch.testing.assert_close(ran.intent[..., 1], turns)


def test_defect_3_cut_off_from_the_goal_is_a_failure_that_counts(fake, config):
    """Whatever an environment says at an end is kept, an infinite distance included."""

    class CutOff(fake):
        def step(self, actions):
            *rest, infos = super().step(actions)
            if "metrics" in infos:
                infos["metrics"]["distance_to_goal_m"] = np.full(self.num_envs, np.inf)
            return *rest, infos

    agent = make_agent("ppo", config())
    env = CutOff()
    collector = Collector(env, agent)
    collector.loop.reset()
    rollout = collector.collect(uniforms_of(0, 0, range(4), 40))
    over = rollout.terminated | rollout.truncated
    assert len(rollout.finished) == int(over.sum()) > 4
    assert {(f.step, f.environment) for f in rollout.finished} == {
        (t, k) for t, k in over.nonzero().tolist()
    }
    assert all(f.metrics["distance_to_goal_m"] == np.inf for f in rollout.finished)


def test_defect_4_a_move_counts_once(houses):
    """Pushes, turns and looks after a move add nothing to the path."""
    from internav_data.envs import InterNavEnv

    env, moves = InterNavEnv(houses, 16, sensors=()), 0
    env.reset(seed=0)
    for action in np.random.default_rng(0).choice([0, 0, 1, 2, 3, 4, 5, 9], 400).tolist():
        *_, info = env.step(action)
        moves += action == 0 and info["action_success"]
    *_, info = env.step(11)
    assert moves > 5
    assert info["metrics"]["path_m"] == 0.25 * moves


def test_defect_5_no_synchronisation_within_an_update(collected, config, monkeypatch):
    agent, _, (_, rollout) = collected("camp")
    calls = []
    monkeypatch.setattr(agent, "synchronise", lambda: calls.append(1))
    before = [p.detach().clone() for p in agent.intent.parameters()]
    ppo = config().ppo
    update(
        agent, torch.optim.Adam(agent.optimised(), 1e-2), rollout, ppo,
        orders_of(0, 0, ppo.update_epochs, 4),
    )  # fmt: skip
    assert not calls
    after = list(agent.intent.parameters())
    assert all(torch.equal(a, b) for a, b in zip(before, after, strict=True))


@pytest.mark.parametrize("method", list(AGENTS))
def test_defect_6_every_agent_is_called_as_the_protocol_says(config, method):
    """One way to act, in training and in validation."""
    agent = make_agent(method, config())
    for name in ("act", "value", "evaluate", "initial_state"):
        mine = list(inspect.signature(getattr(type(agent), name)).parameters)
        assert mine == list(inspect.signature(getattr(Agent, name)).parameters), name


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["depth", "goal", "reward"])
def test_defect_7_what_is_no_number_stops_and_is_named(fake, config, wrong, where):
    class Broken(fake):
        def step(self, actions):
            seen, rewards, *rest = super().step(actions)
            if self._ages[2] == 3:
                target = rewards if where == "reward" else seen[where].reshape(4, -1)[:, 0]
                target[2] = wrong
            return seen, rewards, *rest

    env = Broken(done_ends=False)
    collector = Collector(env, make_agent("camp", config()), seed=40)
    collector.loop.reset()
    with pytest.raises(NotFiniteError, match=rf"environment 2 \(seed 42\): {where}"):
        collector.collect(uniforms_of(0, 0, range(4), 8))


def test_defect_8_a_forced_end_is_told_to_the_networks(config):
    """The inputs of the step after the cap say that nothing is open."""
    opened = used = torch.zeros(1, dtype=torch.int64)
    told = []
    for _ in range(12):
        told.append(option_inputs(opened, used)[0].tolist())
        opened, used, _, forced = option_step(torch.tensor([PUSH]), torch.tensor([5]), used)
    assert told[0] == told[11] == [0.0, 0.0, 0.0]
    assert told[10] == [1.0, 0.0, pytest.approx(10 / 11)]
    assert not forced
