"""Cloning: how experts' actions become options, and that they are learnt."""

import dataclasses
import itertools

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from internav_data.camp.agents import AGENTS, make_agent  # noqa: E402
from internav_data.camp.agents.hierarchy import (  # noqa: E402
    DONE,
    NAVIGATE,
    OPTION_NAMES,
    PICK,
    PUSH,
    WAIT,
    option_labels,
)
from internav_data.camp.cloning import Demonstrations, update  # noqa: E402
from internav_data.camp.ppo import set_rate  # noqa: E402
from internav_data.physics import engines  # noqa: E402
from internav_data.records.errors import UsageError  # noqa: E402
from internav_data.world.actions import ACTIONS, actions_of_option  # noqa: E402

AHEAD, LEFT, RIGHT, DOWN, PUSHED, UP, DROP = 0, 1, 2, 3, 5, 9, 10
N, P, I = NAVIGATE, PUSH, PICK


def rows_of(actions, hand_back_step=False):
    taken, label = option_labels(actions, temporally_extended=True, hand_back_step=hand_back_step)
    return list(zip(label.option.tolist(), label.choice.tolist(), taken, strict=True))


def test_a_run_of_pushes_is_push():
    assert rows_of([AHEAD, PUSHED, PUSHED, LEFT, DONE]) == [
        (N, AHEAD, AHEAD),
        (P, PUSHED, PUSHED),
        (P, PUSHED, PUSHED),
        (N, LEFT, LEFT),
        (N, DONE, DONE),
    ]


def test_pickup_rotations_and_drop_are_pick():
    assert rows_of([LEFT, UP, LEFT, RIGHT, DROP, RIGHT, DONE]) == [
        (N, LEFT, LEFT),
        (I, UP, UP),
        (I, LEFT, LEFT),
        (I, RIGHT, RIGHT),
        (I, DROP, DROP),
        (N, RIGHT, RIGHT),
        (N, DONE, DONE),
    ]


def test_a_hand_back_may_be_a_step():
    assert rows_of([PUSHED, PUSHED, UP, DONE], hand_back_step=True) == [
        (P, PUSHED, PUSHED),
        (P, PUSHED, PUSHED),
        (P, DONE, WAIT),
        (I, UP, UP),
        (I, DONE, WAIT),
        (N, DONE, DONE),
    ]


@pytest.mark.parametrize("between", [[AHEAD], [LEFT, AHEAD], [DOWN]])
def test_a_move_between_pickup_and_drop_makes_two_interactions(between):
    _, label = option_labels([UP, *between, DROP], temporally_extended=True)
    assert label.option.tolist() == [I, *[N] * len(between), I]
    assert label.decide.all()
    assert label.open.tolist() == [N, I, *[N] * len(between)]


@pytest.mark.parametrize("action", ACTIONS, ids=lambda action: action.label)
def test_every_action_is_labelled_with_an_option_that_can_take_it(action):
    _, label = option_labels([action], temporally_extended=True)
    taken_by = OPTION_NAMES[label.option[0]]
    assert action in actions_of_option(taken_by)
    own = "navigate" if action == DONE else action.options[0]  # as its auxiliary task pays it
    assert taken_by == own, "its own option, not one that borrows it"


@pytest.mark.parametrize("before", [[], [AHEAD], [PUSHED], [UP]])
def test_an_action_that_no_option_takes_is_refused_by_name(before):
    with pytest.raises(UsageError, match="action Wait: cannot be cloned"):
        option_labels([*before, WAIT, DONE], temporally_extended=True)


def test_decisions_and_the_state_before_them():
    _, label = option_labels([PUSHED, PUSHED, AHEAD, PUSHED, UP], temporally_extended=True)
    assert label.decide.tolist() == [True, False, True, True, True]
    assert label.open.tolist() == [0, P, P, 0, P]
    assert label.used.tolist() == [0, 1, 2, 0, 1]


@pytest.mark.parametrize("count", [10, 11, 12, 22, 23])
@pytest.mark.parametrize("step", [False, True])
def test_the_eleventh_action_closes(count, step):
    taken, label = option_labels(
        [*[PUSHED] * count, AHEAD], temporally_extended=True, hand_back_step=step
    )
    assert taken.count(WAIT) == (1 if step and count % 11 else 0)
    last = len(taken) - 1
    assert label.decide.nonzero().flatten().tolist() == [*range(0, count, 11), last]
    assert label.used.max() <= 10
    assert label.open[last].item() == (P if not step and count % 11 else 0)


def test_hrl_decides_at_every_step_and_never_waits():
    actions = [AHEAD, PUSHED, PUSHED, UP, LEFT, DROP, DONE]
    taken, label = option_labels(actions, temporally_extended=False)
    assert taken == label.choice.tolist() == actions
    assert label.option.tolist() == [N, P, P, I, I, I, N]
    assert label.decide.all()
    assert not label.open.any()
    assert not label.used.any()


@pytest.mark.parametrize("step", [False, True])
def test_labels_are_what_the_model_could_have_done(step):
    """Played by the state machine of the agent, labels give the same open options."""
    from internav_data.camp.agents.hierarchy import option_step

    rng = np.random.default_rng(0)
    for _ in range(20):
        actions = [*rng.choice([0, 1, 5, 5, 5, 9, 10], 60).tolist(), DONE]
        taken, label = option_labels(actions, temporally_extended=True, hand_back_step=step)
        opened = used = torch.zeros(1, dtype=torch.int64)
        for k, option in enumerate(label.option.tolist()):
            assert (label.open[k], label.used[k]) == (opened.item(), used.item())
            assert label.decide[k] or opened.item() == option
            assert label.decide[k] == (opened.item() == 0) or not step
            opened, used, handed_back, _ = option_step(
                label.option[k : k + 1],
                label.choice[k : k + 1],
                used.masked_fill(label.decide[k], 0),
            )
            assert bool(handed_back) == (taken[k] == WAIT)
        assert [action for action in taken if action != WAIT] == actions


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
    shown.loop.reset(seed=0)
    batch = shown.collect(20)
    ages = batch.observations["goal"][..., 1] / 0.5
    assert torch.equal(batch.episode_starts, ages == 0)
    assert batch.episode_starts[1:].any()
    which = batch.observations["goal"][..., 0] / 10
    for k in range(4):
        labels = [agent.labels(EXPERTS["abc"[int(w)]])[1] for w in which[:, k]]
        right = [own.choice[int(age)] for own, age in zip(labels, ages[:, k], strict=True)]
        assert batch.record.choice[:, k].tolist() == right


@pytest.mark.parametrize("method", AGENTS)
def test_experts_are_learnt_by_every_learner(experts, config, method):
    agent = make_agent(method, config(network={"hidden": 32}))
    optimiser = torch.optim.Adam(agent.optimised(), 1e-3)
    shown = Demonstrations(experts(), agent, EXPERTS.__getitem__)
    critic = [p.detach().clone() for head in agent.critics() for p in head.parameters()]
    losses = []
    for number in range(60):
        if number % 30 == 0:
            shown.loop.reset(seed=0)
        set_rate(optimiser, 2e-2, number / 60)
        losses.append(update(agent, optimiser, shown, 16)["loss"])
        if (number + 1) % 10 == 0:
            agent.synchronise()
    assert losses[0] > 1.0
    assert losses[-1] < 0.35 * losses[0]
    after = [p for head in agent.critics() for p in head.parameters()]
    assert all(torch.equal(a, b) for a, b in zip(critic, after, strict=True))


def test_each_update_goes_on_from_the_last_ones_hidden_states(experts, config, monkeypatch):
    agent = make_agent("camp", config())
    lived, evaluate = [], agent.evaluate

    def watched(batch):
        said = evaluate(batch)
        lived.append((batch.state["hidden"], said.state["hidden"].detach()))
        return said

    monkeypatch.setattr(agent, "evaluate", watched)
    shown = Demonstrations(experts(), agent, EXPERTS.__getitem__)
    shown.loop.reset(seed=0)
    optimiser = torch.optim.Adam(agent.optimised())
    for _ in range(3):
        update(agent, optimiser, shown, 8)
    assert len(lived) == 3
    assert not lived[0][0].any()
    for (_, after), (before, _) in itertools.pairwise(lived):
        assert torch.equal(after, before)
        assert not before.requires_grad
        assert before.any()


def test_hidden_states_go_on_between_updates(experts, config):
    """Two batches of 8 after one another are one of 16."""
    agent = make_agent("camp", config())
    shown = Demonstrations(experts(), agent, EXPERTS.__getitem__)
    shown.loop.reset(seed=0)
    parts = []
    for _ in range(2):
        now = agent.evaluate(shown.collect(8))
        shown.state = now.state
        parts.append(now.log_prob)
    shown = Demonstrations(experts(), agent, EXPERTS.__getitem__)
    shown.loop.reset(seed=0)
    whole = agent.evaluate(shown.collect(16)).log_prob
    torch.testing.assert_close(torch.cat(parts), whole, atol=1e-5, rtol=0)


@pytest.mark.parametrize("step", [False, True])
def test_the_datasets_experts_reach_their_goals_hand_backs_and_all(houses, config, step):
    from internav_data.camp.cloning import experts_of
    from internav_data.dataset import load_dataset
    from internav_data.envs.vector import InterNavVectorEnv

    env = InterNavVectorEnv(2, houses, image_size=16, autoreset_mode="Disabled")
    ends, waits = [], []

    class Watched:
        num_envs = 2
        reset = env.reset

        def step(self, actions):
            waits.extend(actions == WAIT)
            said = env.step(actions)
            ends.extend(said[4]["metrics"]["success"][said[2]] if said[2].any() else [])
            assert not said[3].any()
            return said

    agent = make_agent("camp", config(agent={"hand_back_step": step}))
    shown = Demonstrations(Watched(), agent, experts_of(load_dataset(houses)))
    shown.loop.reset(seed=3)
    batch = shown.collect(150)
    assert len(ends) >= 2
    assert all(ends)
    option = batch.record.option
    assert ((option == PUSH) | (option == PICK)).any()
    assert any(waits) == step
    assert torch.isfinite(agent.evaluate(batch).log_prob).all()


def test_the_blind_experts_are_cloned_where_they_are_asked_for(houses, monkeypatch):
    from internav_data.camp.cloning import experts_of
    from internav_data.dataset import load_dataset
    from internav_data.envs.source import Source

    dataset = load_dataset(houses)
    blind = dataclasses.replace(dataset[0], expert=None, blind_expert=dataset[0].expert)
    monkeypatch.setattr(Source, "episode", lambda *_: blind)
    assert experts_of(dataset, "blind_expert")(blind.episode_id) == blind.blind_expert.actions


def test_episodes_without_an_expert_are_skipped_and_counted(houses, config, tmp_path):
    """One of a house's two episodes has none, as `--keep-unsolvable` leaves them."""
    from internav_data.camp.data import TrainingData
    from internav_data.camp.logging import ProgressReporter
    from internav_data.camp.run import begin
    from internav_data.camp.train import Request
    from internav_data.dataset import Identity, assemble, load_dataset, open_staging, stage_scene

    given = load_dataset(houses)
    whole = [dataclasses.replace(each, split="train") for each in given]
    bare = [whole[0], *(dataclasses.replace(each, expert=None) for each in whole[1:])]

    def clone(name, episodes):
        folder = tmp_path / name
        identity = Identity(
            "made by hand", "1", 0, 1, "0" * 64, {"physics": {"engine": engines.DEFAULT_ENGINE}}
        )
        store = open_staging(folder, identity)
        for number, scene in enumerate(given.scene_ids):
            own = [each for each in episodes if each.scene_id == scene]
            house = dataclasses.replace(given.scene(scene), split="train")
            stage_scene(store, number, house, own, redraws={})
        assemble(folder, identity, tuple(given.assets.values()), len(given.scene_ids))
        sizes = {"frames": 16, "epochs": 1, "num_envs": 2, "num_steps": 8}
        settings_of = config(cloning=sizes, run={"tensorboard": False, "max_steps": 200})
        rows, reporter = [], ProgressReporter()
        request = Request(
            folder, tmp_path / "run" / name, "ppo", settings_of, (), clones=True,
            callback=lambda row: (rows.append(row), reporter(row)),
        )  # fmt: skip
        begin(request)
        return rows[-1]["cloning"], reporter.line()

    row, line = clone("some", bare)
    assert row["without_expert"] == len(bare) - 1
    assert f"{len(bare) - 1} episodes without an expert skipped" in line
    with pytest.raises(UsageError, match=r"column blind_expert\); generate some with --blind-exp"):
        TrainingData(tmp_path / "some", expert="blind_expert").demonstrated  # noqa: B018
    with pytest.raises(UsageError, match=r"none of .* training episodes has an expert"):
        clone("none", [dataclasses.replace(each, expert=None) for each in bare])
