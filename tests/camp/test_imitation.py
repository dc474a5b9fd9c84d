"""Cloning: how experts' actions become options, and that they are learnt."""

import dataclasses
import itertools

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from internav_data.camp.agents import make_agent  # noqa: E402
from internav_data.camp.agents.options import (  # noqa: E402
    DONE,
    NAVIGATE,
    PICK,
    PUSH,
    STOP,
    WAIT,
    follow,
)
from internav_data.camp.cloning import Demonstrations, clone  # noqa: E402

AHEAD, LEFT, RIGHT, DOWN, PUSHED, UP, DROP = 0, 1, 2, 3, 5, 9, 10
N, P, I, S = NAVIGATE, PUSH, PICK, STOP


def rows_of(actions, keeps=True):
    label = follow(actions, keeps=keeps)
    return list(zip(label["option"], label["choice"], label["action"], strict=True))


def test_a_run_of_pushes_is_push_and_hands_back():
    assert rows_of([AHEAD, PUSHED, PUSHED, LEFT, DONE]) == [
        (N, AHEAD, AHEAD),
        (P, PUSHED, PUSHED),
        (P, PUSHED, PUSHED),
        (P, DONE, WAIT),
        (N, LEFT, LEFT),
        (S, DONE, DONE),
    ]


def test_pickup_rotations_and_drop_are_pick():
    assert rows_of([LEFT, UP, LEFT, RIGHT, DROP, RIGHT, DONE]) == [
        (N, LEFT, LEFT),
        (I, UP, UP),
        (I, LEFT, LEFT),
        (I, RIGHT, RIGHT),
        (I, DROP, DROP),
        (I, DONE, WAIT),
        (N, RIGHT, RIGHT),
        (S, DONE, DONE),
    ]


@pytest.mark.parametrize("between", [[AHEAD], [LEFT, AHEAD], [DOWN]])
def test_a_move_between_pickup_and_drop_makes_two_interactions(between):
    middle = [(N, action, action) for action in between]
    assert rows_of([UP, *between, DROP]) == [
        (I, UP, UP), (I, DONE, WAIT), *middle, (I, DROP, DROP), (I, DONE, WAIT)
    ]  # fmt: skip


def test_decisions_and_what_is_told_of_them():
    label = follow([PUSHED, PUSHED, AHEAD], keeps=True)
    assert label["decide"] == [1, 0, 0, 1]
    assert label["open"] == [0, P, P, 0]
    assert label["used"] == [0, 1, 2, 0]


@pytest.mark.parametrize("count", [10, 11, 12, 22, 23])
def test_the_eleventh_action_closes_without_a_hand_back(count):
    label = follow([PUSHED] * count, keeps=True)
    assert label["action"].count(WAIT) == (1 if count % 11 else 0)
    assert [k for k, decides in enumerate(label["decide"]) if decides] == list(range(0, count, 11))
    assert max(label["used"]) <= 10


def test_hrl_decides_at_every_step_and_never_waits():
    actions = [AHEAD, PUSHED, PUSHED, UP, LEFT, DROP, DONE]
    label = follow(actions, keeps=False)
    assert label["action"] == label["choice"] == actions
    assert label["option"] == [N, P, P, I, I, I, S]
    assert label["decide"] == [1] * 7
    assert not any(label["open"]) and not any(label["used"])  # noqa: PT018


def test_labels_are_what_the_model_could_have_done(config):
    """Played by the state machine of the agent, labels give the same open options."""
    from internav_data.camp.agents.options import option_step

    rng = np.random.default_rng(0)
    for _ in range(20):
        actions = [*rng.choice([0, 1, 5, 5, 5, 9, 10], 60).tolist(), DONE]
        label = follow(actions, keeps=True)
        opened = used = torch.zeros(1, dtype=torch.int64)
        for k, option in enumerate(label["option"]):
            assert (label["open"][k], label["used"][k]) == (opened.item(), used.item())
            assert label["decide"][k] == (opened.item() == 0)
            assert opened.item() in {0, option}
            opened, used, handed, _ = option_step(
                torch.tensor([option]), torch.tensor([label["choice"][k]]), used
            )
            assert bool(handed) == (label["action"][k] == WAIT)
        assert [a for a in label["action"] if a != WAIT] == actions


EXPERTS = {
    "a": [AHEAD, PUSHED, PUSHED, LEFT, DONE],
    "b": [LEFT, UP, LEFT, DROP, AHEAD, DONE],
    "c": [AHEAD] * 9 + [DONE],
}


@pytest.fixture
def experts(fake):
    """Make an environment that plays a, b and c in turn and shows which, and when."""

    class Told(fake):
        def reset(self, *, seed=None, options=None):
            mask = (options or {}).get("reset_mask", np.ones(self.num_envs, bool))
            if options is None:
                self._next, self._which = 0, np.zeros(self.num_envs, int)
            for k in np.flatnonzero(mask):
                self._which[k] = self._next % 3
                self._next += 1
            super().reset(seed=seed, options=options)
            return self._look(), {"episode_id": np.array([*"abc"], object)[self._which]}

        def _look(self):
            seen = super()._look()
            seen["goal"] = np.stack([self._which * 10.0, self._ages * 0.5], 1).astype(np.float32)
            return {name: what * (name in {"goal", "ids"}) for name, what in seen.items()}

    return lambda: Told(count=4, length=60)


def test_frames_begin_where_episodes_do(experts, config):
    agent = make_agent("camp", config())
    shown = Demonstrations(experts(), agent, EXPERTS.__getitem__)
    shown.begin(0)
    batch = shown.collect(20, agent.initial_state(4))
    ages = batch.observations["goal"][..., 1] / 0.5
    assert torch.equal(batch.starts, ages == 0)
    assert batch.starts[1:].any()
    which = batch.observations["goal"][..., 0] / 10
    for k in range(4):
        labels = [follow(EXPERTS["abc"[int(w)]], keeps=True) for w in which[:, k]]
        right = [own["choice"][int(age)] for own, age in zip(labels, ages[:, k], strict=True)]
        assert batch.record["choice"][:, k].tolist() == right


@pytest.mark.parametrize("method", ["ppo", "ppo-intent", "nie", "hrl", "camp"])
def test_experts_are_learnt_by_every_learner(experts, config, method):
    agent = make_agent(method, config(network={"hidden": 32}))
    cloning = dataclasses.replace(
        config().cloning, frames=4 * 16 * 30, epochs=2, num_envs=4, num_steps=16,
        learning_rate=2e-2, sync_every=10,
    )  # fmt: skip
    optimiser = torch.optim.Adam(agent.optimised(), 1e-3)
    shown = Demonstrations(experts(), agent, EXPERTS.__getitem__)
    critic = [p.detach().clone() for p in agent.critics()]
    told = list(clone(agent, optimiser, shown, cloning, 0))
    assert len(told) == told[0]["updates"] == 60
    assert told[0]["loss"] > 1.0
    assert told[-1]["loss"] < 0.35 * told[0]["loss"]
    assert all(torch.equal(a, b) for a, b in zip(critic, agent.critics(), strict=True))


def test_each_update_goes_on_from_the_last_ones_hidden_states(experts, config, monkeypatch):
    agent = make_agent("camp", config())
    lived, evaluate = [], agent.evaluate

    def watched(batch):
        said = evaluate(batch)
        lived.append((batch.state["hidden"], said.state["hidden"].detach()))
        return said

    monkeypatch.setattr(agent, "evaluate", watched)
    cloning = dataclasses.replace(config().cloning, frames=96, epochs=1, num_envs=4, num_steps=8)
    shown = Demonstrations(experts(), agent, EXPERTS.__getitem__)
    list(clone(agent, torch.optim.Adam(agent.optimised()), shown, cloning, 0))
    assert len(lived) == 3
    assert not lived[0][0].any()
    for (_, after), (before, _) in itertools.pairwise(lived):
        assert torch.equal(after, before)
        assert not before.requires_grad
        assert before.any()


def test_hidden_states_go_on_between_updates(experts, config):
    """Two batches of 8 after one another are one of 16."""
    agent = make_agent("camp", config())
    state = agent.initial_state(4)
    shown = Demonstrations(experts(), agent, EXPERTS.__getitem__)
    shown.begin(0)
    parts = []
    for _ in range(2):
        now = agent.evaluate(shown.collect(8, state))
        state = now.state
        parts.append(now.log_prob)
    shown = Demonstrations(experts(), agent, EXPERTS.__getitem__)
    shown.begin(0)
    whole = agent.evaluate(shown.collect(16, agent.initial_state(4))).log_prob
    torch.testing.assert_close(torch.cat(parts), whole, atol=1e-5, rtol=0)


def test_the_datasets_experts_reach_their_goals_hand_backs_and_all(houses, config):
    from internav_data.camp.cloning import experts_of
    from internav_data.dataset import load_dataset
    from internav_data.envs.vector import InterNavVectorEnv

    env = InterNavVectorEnv(2, houses, image_size=16, autoreset=False)
    ends = []

    class Watched:
        num_envs = 2
        reset = env.reset

        def step(self, actions):
            said = env.step(actions)
            ends.extend(said[4]["metrics"]["success"][said[2]] if said[2].any() else [])
            assert not said[3].any()
            return said

    agent = make_agent("camp", config())
    shown = Demonstrations(Watched(), agent, experts_of(load_dataset(houses)))
    shown.begin(3)
    batch = shown.collect(150, agent.initial_state(2))
    assert len(ends) >= 2
    assert all(ends)
    option = batch.record["option"]
    assert ((option == PUSH) | (option == PICK)).any()
    assert (batch.record["action"] == WAIT).any()
    assert torch.isfinite(agent.evaluate(batch).log_prob).all()


def test_an_episode_without_expert_is_refused(houses, config, monkeypatch):
    from internav_data.camp.cloning import experts_of
    from internav_data.dataset import load_dataset
    from internav_data.envs.source import Source
    from internav_data.records.errors import UsageError

    dataset = load_dataset(houses)
    bare = dataclasses.replace(dataset[0], expert=None)
    monkeypatch.setattr(Source, "episode", lambda *_: bare)
    with pytest.raises(UsageError, match="has no expert to clone"):
        experts_of(dataset)(bare.episode_id)
