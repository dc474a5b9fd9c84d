from __future__ import annotations

import dataclasses
import sys
import types

import numpy as np
import pytest

from internav_data.camp.policy import AgentPolicy, candidate, reference_policies_beside
from internav_data.evaluation.evaluator import EvaluationConfig, episode_generator, evaluate
from internav_data.evaluation.tables import row_name
from internav_data.records.errors import UsageError
from internav_data.world.actions import ACTION_COUNT, Action

torch = pytest.importorskip("torch")
agents = pytest.importorskip("internav_data.camp.agents")

SHORT = EvaluationConfig(batch=3, max_steps=12, limit=6)


@pytest.fixture(scope="module")
def make():
    """Make an untrained agent whose ends are frequent, so that episodes differ in length."""
    from internav_data.camp.config import CampConfig

    base = CampConfig()
    config = dataclasses.replace(
        base,
        network=dataclasses.replace(base.network, image_size=16, hidden=8),
        agent=dataclasses.replace(
            base.agent, initial_done_probability=0.1, initial_interaction_probability=0.2
        ),
    )

    def made(method, **changes):
        own = dataclasses.replace(config, agent=dataclasses.replace(config.agent, **changes))
        agent = agents.make_agent(method, own)
        agent.method, agent.config = method, own
        return agent

    return made


def policy(agent, *, greedy=False):
    return AgentPolicy("someone", agent, 16, greedy=greedy)


@pytest.mark.parametrize("method", agents.AGENTS)
def test_agents_play_the_same_in_any_batch(played_data, make, method):
    agent = make(method)
    results = {
        batch: evaluate(
            policy(agent), played_data, EvaluationConfig(batch=batch, max_steps=12, limit=6)
        )
        for batch in (1, 4)
    }
    assert results[1] == results[4]
    assert len({r.steps for r in results[1]}) > 1
    assert evaluate(policy(agent), played_data, dataclasses.replace(SHORT, seed=1)) != results[1]


def test_greedy_draws_nothing(played_data, make):
    agent = make("camp")
    first = evaluate(policy(agent, greedy=True), played_data, SHORT)
    other = evaluate(policy(agent, greedy=True), played_data, dataclasses.replace(SHORT, seed=9))
    assert first == other


class Recorder:
    """Notes what it is asked; always turns left, and ends where its state has grown to four."""

    def __init__(self):
        self.episode_starts, self.uniforms, self.seen = [], [], []

    def parameters(self):
        return iter(())

    def eval(self):
        return self

    def initial_state(self, count):
        return {"age": torch.zeros(count)}

    def act(self, seen, state, episode_starts, uniforms):
        self.episode_starts.append(episode_starts.clone().tolist())
        self.uniforms.append(None if uniforms is None else uniforms.clone())
        self.seen.append({name: what.clone() for name, what in seen.items()})
        age = torch.where(episode_starts, torch.zeros(()), state["age"]) + 1
        action = torch.where(age >= 4, int(Action.DONE), int(Action.ROTATE_LEFT))
        record = types.SimpleNamespace(
            option_probs=torch.tensor([[0.7, 0.1, 0.1, 0.1]]).repeat(len(age), 1),
            option=torch.zeros(len(age), dtype=torch.int64),
        )
        return types.SimpleNamespace(action=action, state={"age": age}, record=record)


def test_state_begins_anew_with_each_episode_and_numbers_are_the_episodes(played_data):
    agent = Recorder()
    results = evaluate(policy(agent), played_data, EvaluationConfig(seed=5, batch=1, limit=3))
    assert [r.steps for r in results] == [4, 4, 4], "a state that leaked would end at once"
    assert agent.episode_starts == [[k % 4 == 0] for k in range(12)]
    drawn = torch.cat(agent.uniforms).numpy()
    by_id = {e.episode_id: e for e in played_data}
    for k, result in enumerate(results):
        own = episode_generator(5, by_id[result.episode_id])
        expected = np.stack([own.random(2, np.float32) for _ in range(4)])
        assert (drawn[4 * k : 4 * k + 4] == expected).all()
    assert ((drawn >= 0) & (drawn < 1)).all()
    assert agent.seen[0]["rgb"].shape == (1, 16, 16, 3)
    assert not torch.equal(agent.seen[0]["rgb"], agent.seen[1]["rgb"]), "it turned"


def test_what_led_to_an_action_can_be_shown(played_data, make):
    from internav_data.camp.agents.hierarchy import OPTION_NAMES

    agent = policy(make("camp"))
    agent.begin(2, 0)
    for slot in range(2):
        agent.start(slot, played_data[slot])
    rng = np.random.default_rng(0)
    seen = {
        "rgb": rng.integers(0, 256, (2, 16, 16, 3), np.uint8),
        "depth": rng.random((2, 16, 16, 1), np.float32),
        "goal": rng.random((2, 2), np.float32),
        "held": np.zeros(2, np.int64),
        "horizon": np.full(2, 2),
    }
    actions = agent.act(seen)
    assert actions.shape == (2,)
    titles = {}
    for title, names, shares, chosen in agent.notes(1):
        titles[title] = names, chosen
        assert sum(shares) == pytest.approx(1.0, abs=1e-5)
        assert len(names) == len(shares) in {len(OPTION_NAMES), ACTION_COUNT}
    assert {"option", "intent"} <= set(titles)
    assert titles["option"][1] >= 0
    assert titles["intent"][1] == -1


@pytest.fixture
def stored(monkeypatch, make, tmp_path):
    """A run's folder whose checkpoint holds an agent."""

    def store(method, agent=None, **changes):
        agent = agent or make(method, **changes)
        agent.progress = {"environment_steps": 300, "cloned_frames": 0, "training_s": 2.5}
        module = types.ModuleType("internav_data.camp.checkpoint")
        module.load_agent = lambda _: agent
        monkeypatch.setitem(sys.modules, "internav_data.camp.checkpoint", module)
        return tmp_path

    return store


def test_a_runs_facts_are_told(played_data, stored):
    run = stored("camp", intent="none")
    found = candidate(str(run), played_data, SHORT, greedy=True).about
    assert (found.name, found.method, found.intent) == ("camp --intent none", "camp", "none")
    assert (found.greedy, found.is_reference, found.split) == (True, False, "all")
    assert (found.environment_steps, found.training_s, found.training_seed) == (300, 2.5, 0)
    assert found.parameters > 0
    assert found.dataset == played_data.fingerprint


def test_an_agents_map_and_what_it_is_told_stand_in_its_name(played_data, stored, make):
    network = dataclasses.replace(make("ppo").config.network, observation="map")
    config = dataclasses.replace(make("ppo").config, network=network)
    oracle = dataclasses.replace(network, map_occlusion=True, privileged=("mass", "movable"))
    names = []
    for own in (network, oracle):
        agent = agents.make_agent("ppo", dataclasses.replace(config, network=own))
        agent.config, agent.method = dataclasses.replace(config, network=own), "ppo"
        found = candidate(str(stored("ppo", agent=agent)), played_data, SHORT)
        names.append(found.about.name)
        assert len(evaluate(found.policy, played_data, SHORT)) == 6
    assert names == ["ppo (map)", "ppo (map as seen; privileged: mass, movable)"]


def test_the_intent_can_be_left_out_where_there_is_one(played_data, stored):
    run = stored("camp")
    with_it = candidate(str(run), played_data, SHORT)
    without = candidate(str(run), played_data, SHORT, without_intent=True)
    assert without.about.name == "camp --without-intent"
    both = [evaluate(each.policy, played_data, SHORT) for each in (with_it, without)]
    assert len(both[0]) == len(both[1]) == 6
    with pytest.raises(UsageError, match="no intent"):
        candidate(str(stored("ppo")), played_data, SHORT, without_intent=True)


def test_an_agent_plays_on_as_many_threads_as_it_was_trained_with(played_data, stored):
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        candidate(str(stored("ppo")), played_data, SHORT)
        assert torch.get_num_threads() == 1
    finally:
        torch.set_num_threads(before)


def test_names_of_rows(played_data):
    about = candidate("shortest_path", played_data, SHORT).about
    assert (about.name, about.is_reference) == ("shortest_path", True)
    ppo = dataclasses.replace(about, method="ppo-intent", intent="integrated", sync_every=5)
    assert row_name(ppo) == "ppo-intent --sync-every 5"
    cloned = dataclasses.replace(about, method="ppo", cloned_frames=9, environment_steps=0)
    assert row_name(cloned) == "ppo (cloned only)"
    assert reference_policies_beside(played_data) == ["expert", "shortest_path"]


def test_who_is_neither_run_nor_reference_policy_is_told_so(played_data):
    with pytest.raises(UsageError, match=r"no-such-run.*expert, blind, shortest_path, random"):
        candidate("no-such-run", played_data, SHORT)
