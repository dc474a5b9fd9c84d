"""Updates: what is stepped, what stops them, and that halves on two ranks are one whole."""

import copy
import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from internav_data.camp.agents import AGENTS, make_agent  # noqa: E402
from internav_data.camp.agents.hierarchy import AuxiliaryAgent  # noqa: E402
from internav_data.camp.ppo import explained_variance, set_rate, update  # noqa: E402
from internav_data.camp.rollout import (  # noqa: E402
    Collector,
    Rollout,
    orders_of,
    uniforms_of,
)
from internav_data.records.errors import NotFiniteError  # noqa: E402

MIDDLE = 3e-3


def adam(agent, rate=1e-3):
    return torch.optim.Adam(agent.optimised(), rate)


def learnt(agent, rollout, config, optimiser=None, rollout_number=0, **more):
    orders = orders_of(0, rollout_number, config.update_epochs, rollout.rewards.shape[1])
    return update(agent, optimiser or adam(agent), rollout, config, orders, **more)


def parameters(agent):
    return {name: p.detach().clone() for name, p in agent.named_parameters()}


@pytest.mark.parametrize("method", AGENTS)
def test_the_first_ratio_is_one_and_an_update_changes_what_is_optimised(collected, config, method):
    agent, _, (_, rollout) = collected(method, steps=16)
    before = parameters(agent)
    said = learnt(agent, rollout, dataclasses.replace(config().ppo, target_kl=None))
    assert said["ratio_error"] < 1e-5
    assert said["updates"] == 6
    assert all(np.isfinite(list(said.values())))
    mine = {id(p) for p in agent.optimised()}
    for name, p in agent.named_parameters():
        assert (not torch.equal(p, before[name])) == (id(p) in mine), name
    assert (said["extra_loss"] > 0) == (method == "nie")


def test_auxiliary_tasks_learn_with_critics_of_their_own(collected, config):
    hierarchy = make_agent("camp", config())
    agent = AuxiliaryAgent(hierarchy, ["navigate", "push", "pick", "push"])
    _, _, (rollout,) = collected("", rollouts=1, agent=agent)
    before = parameters(hierarchy)
    assert learnt(agent, rollout, config().ppo)["ratio_error"] < 1e-5
    changed = {n for n, p in hierarchy.named_parameters() if not torch.equal(p, before[n])}
    assert {name.split(".")[0] for name in changed} == {"encoders", "navigate", "push", "pick"}
    assert {f"{policy}.critic.weight" for policy in ("navigate", "push", "pick")} <= changed


def test_a_new_critic_is_trained_alone(collected, config):
    agent, _, (_, rollout) = collected("camp")
    before = parameters(agent)
    said = learnt(agent, rollout, config().ppo, critic_only=True)
    changed = {n for n, p in agent.named_parameters() if not torch.equal(p, before[n])}
    assert changed == {"global_policy.critic.weight", "global_policy.critic.bias"}
    assert said["kl"] == pytest.approx(0.0, abs=1e-6)
    torch.testing.assert_close(
        agent.evaluate(rollout.batch).log_prob, rollout.log_probs, atol=1e-5, rtol=0
    )


def test_the_documentations_own_agent_is_trained(collected, config):
    """Its critic alone at first, then all of it; replayed exactly."""
    text = (Path(__file__).parents[2] / "docs" / "training.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(import torch\n.*?)# Every agent must", text, re.DOTALL)
    names = {"__name__": "own"}
    exec(compile(code, "docs/training.md", "exec"), names)  # noqa: S102 - our own page
    agent, _, (_, rollout) = collected("", agent=names["Mine"](config()), steps=16)
    before = parameters(agent)
    learnt(agent, rollout, config().ppo, critic_only=True)
    changed = {n for n, p in agent.named_parameters() if not torch.equal(p, before[n])}
    assert changed == {"policy.critic.weight", "policy.critic.bias"}
    assert learnt(agent, rollout, config().ppo)["ratio_error"] < 1e-5


@pytest.mark.parametrize("method", AGENTS)
def test_a_new_critic_is_fitted_to_the_returns(collected, config, method):
    """One update explains them; gradient steps alone, at a rate of a last layer, do not."""
    agent, _, (_, rollout) = collected(method, steps=32)
    returns = rollout.advantages(config().ppo) + rollout.values
    learnt(agent, rollout, config().ppo, adam(agent, 1e-6), critic_only=True)
    with torch.no_grad():
        values = agent.evaluate(rollout.batch).value
    before = explained_variance(rollout.values, returns)
    assert explained_variance(values, returns) > max(before, 0.0) + 0.05


@pytest.mark.parametrize("method", ["ppo", "camp"])
def test_a_success_does_not_take_the_policys_share_of_the_gradient(collected, config, method):
    """With values in units of the returns' deviation, ten times the reward is the same loss."""
    agent, _, (_, rollout) = collected(method, steps=16)
    ppo = dataclasses.replace(config().ppo, update_epochs=1, num_minibatches=1, ent_coef=0.0)

    def norms(factor, scale_values):
        one = copy.deepcopy(agent)
        head = one.critics()[0]
        with torch.no_grad():
            for parameter in head.parameters():
                parameter.zero_()
        of = dataclasses.replace(
            rollout, rewards=rollout.rewards * factor,
            values=rollout.values * 0, last_value=rollout.last_value * 0,
            final_values=rollout.final_values * 0,
        )  # fmt: skip
        settings = dataclasses.replace(ppo, scale_values=scale_values)
        if scale_values:
            returns = of.advantages(ppo)
            head.scale.copy_(returns.std())
        return learnt(one, of, settings, adam(one, 1e-9))["grad_norm"]

    assert norms(10.0, True) == pytest.approx(norms(1.0, True), rel=1e-3)
    assert norms(10.0, False) > 3.0 * norms(1.0, False)


def test_the_kl_stops_updates_before_the_step_that_offends(collected, config):
    """Parameters are those after the steps that were within the limit, not one more."""
    agent, _, (_, rollout) = collected("ppo", steps=16)
    start = copy.deepcopy(agent)
    loose = dataclasses.replace(config().ppo, target_kl=None, ent_coef=0.0, scale_values=False)
    counts = {}
    for limit in (1e-12, MIDDLE, None):
        one = copy.deepcopy(start)
        strict = dataclasses.replace(loose, target_kl=limit)
        said = learnt(one, rollout, strict, adam(one, 3e-3))
        counts[limit] = int(said["updates"])
        assert said["stopped"] == (limit is not None)
        two, optimiser = copy.deepcopy(start), None
        optimiser = adam(two, 3e-3)
        orders = orders_of(0, 0, 3, 4)
        batches = [half for order in orders for half in (order[:2], order[2:])]
        for columns in batches[: counts[limit]]:
            single = dataclasses.replace(loose, num_minibatches=1)
            _part(two, optimiser, rollout, single, columns)
        assert all(
            torch.equal(a, b) for a, b in zip(one.parameters(), two.parameters(), strict=True)
        )
    assert counts[1e-12] < counts[MIDDLE] < counts[None] == 6


def _part(agent, optimiser, rollout, config, columns):
    """Step on some environments, advantages normalised over all of them: by another way."""
    advantages = rollout.advantages(config)
    returns = (advantages + rollout.values)[:, columns]
    advantages = (advantages - advantages.mean()) / (advantages.std(correction=0) + 1e-8)
    advantages = advantages[:, columns]
    now = agent.evaluate(rollout.batch.chunked(torch.tensor(columns), [rollout.batch.state]))
    ratio = (now.log_prob - rollout.log_probs[:, columns]).exp()
    gain = torch.minimum(ratio * advantages, ratio.clamp(0.8, 1.2) * advantages)
    loss = -gain.mean() + 0.25 * (now.value - returns).square().mean()
    optimiser.zero_grad()
    loss.backward()
    torch.nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
    optimiser.step()


def test_a_step_is_that_of_the_textbook(monkeypatch, collected, config):
    monkeypatch.setitem(globals(), "adam", _gradient_step)
    agent, _, (_, rollout) = collected("ppo")
    other = copy.deepcopy(agent)
    ppo = dataclasses.replace(
        config().ppo, update_epochs=1, num_minibatches=1, ent_coef=0.0, scale_values=False
    )
    learnt(agent, rollout, ppo)
    _part(other, adam(other), rollout, ppo, [0, 1, 2, 3])
    for one, two in zip(agent.parameters(), other.parameters(), strict=True):
        torch.testing.assert_close(one, two, atol=1e-6, rtol=0)


def test_clipped_values_are_the_larger_error(collected, config):
    agent, _, (_, rollout) = collected("ppo")
    with torch.no_grad():
        agent.policy.critic.bias += 3.0
    ppo = dataclasses.replace(
        config().ppo, update_epochs=1, num_minibatches=1, clip_vloss=True, clip_coef=0.1
    )
    returns = rollout.advantages(ppo) + rollout.values
    now = agent.evaluate(rollout.batch).value.detach()
    near = rollout.values + (now - rollout.values).clamp(-0.1, 0.1)
    right = torch.maximum((now - returns) ** 2, (near - returns) ** 2).mean() / 2
    assert learnt(agent, rollout, ppo)["value_loss"] == pytest.approx(float(right), rel=1e-5)


@pytest.mark.parametrize("method", AGENTS)
def test_two_ranks_of_half_the_batch_are_one_rank(monkeypatch, collected, config, method):
    """Every sum is over all ranks: here they take turns, each knowing the other's share.

    A step of SGD is the gradient itself. Adam's first step divides by |g| + 1e-8, so that the last
    bits of tiny gradients would decide.
    """
    monkeypatch.setitem(globals(), "adam", _gradient_step)
    agent, _, (_, rollout) = collected(method)
    ppo = dataclasses.replace(config().ppo, update_epochs=1, num_minibatches=1)
    whole = copy.deepcopy(agent)
    said = learnt(whole, rollout, ppo)
    halves = [_columns(rollout, part) for part in ([0, 1], [2, 3])]
    ranks = [copy.deepcopy(agent) for _ in halves]
    told = _in_step(ranks, halves, ppo)
    for rank in ranks:
        for one, two in zip(whole.parameters(), rank.parameters(), strict=True):
            torch.testing.assert_close(one, two, atol=1e-6, rtol=0)
    for name in ("policy_loss", "value_loss", "entropy", "grad_norm", "explained_variance"):
        assert told[0][name] == told[1][name] == pytest.approx(said[name], abs=1e-5)


def _gradient_step(agent):
    return torch.optim.SGD(agent.optimised(), lr=1.0)


def _columns(rollout, part):
    tensors = {
        f.name: getattr(rollout, f.name)[:, part]
        for f in dataclasses.fields(Rollout)
        if f.name not in {"batch", "states", "last_value", "finished"}
    }
    batch = rollout.batch.chunked(torch.tensor(part), [rollout.batch.state])
    states = [{name: values[part] for name, values in each.items()} for each in rollout.states]
    return Rollout(batch, states, last_value=rollout.last_value[part], **tensors)


def _in_step(ranks, halves, ppo):
    """Run updates in threads that meet wherever they add."""
    import threading

    meet, shares, told = threading.Barrier(len(ranks)), {}, {}

    def reduced(rank, tensor):
        shares[rank] = tensor.detach().clone()
        meet.wait(120)
        whole = sum(shares[k] for k in range(len(ranks)))
        meet.wait(120)
        return whole

    def run(rank):
        order = [list(range(2))]
        optimiser = adam(ranks[rank])
        told[rank] = update(
            ranks[rank], optimiser, halves[rank], ppo, order, reduce=lambda x: reduced(rank, x)
        )

    threads = [threading.Thread(target=run, args=(rank,)) for rank in range(len(ranks))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(300)
    return [told[rank] for rank in range(len(ranks))]


def test_learning_rates_fall_in_a_straight_line(collected):
    agent, *_ = collected("ppo", rollouts=0)
    optimiser = adam(agent)
    for progress, rate in ((0.0, 3e-4), (0.25, 2.25e-4), (1.0, 0.0), (1.5, 0.0)):
        set_rate(optimiser, 3e-4, progress)
        assert optimiser.param_groups[0]["lr"] == pytest.approx(rate)


def test_explained_variance():
    returns = torch.tensor([1.0, 2.0, 3.0, 4.0])
    assert explained_variance(returns, returns) == pytest.approx(1.0)
    assert explained_variance(torch.full((4,), 2.5), returns) == pytest.approx(0.0, abs=1e-6)


def test_a_loss_that_is_no_number_stops_and_names_the_environment(collected, config):
    agent, _, (_, rollout) = collected("camp")
    rollout.batch.observations["goal"][3, 2] = torch.nan
    # A single minibatch: none without environment 2 is learnt from before it.
    ppo = dataclasses.replace(config().ppo, num_minibatches=1)
    before = parameters(agent)
    with pytest.raises(NotFiniteError, match="environment 2"):
        learnt(agent, rollout, ppo)
    for name, parameter in agent.named_parameters():
        assert torch.equal(parameter, before[name]), name


def test_a_critic_learns_what_is_paid(config, fake):
    """Rewards of 1 for 4 steps, ends: values become 4, 3, 2, 1 (gamma 1)."""

    class Paying(fake):
        def step(self, actions):
            seen, _, _, _, infos = super().step(actions)
            ended = self._ages >= 4
            infos.pop("metrics", None)
            return self._timed(seen), np.ones(self.num_envs), ended, ~ended & False, infos

        def reset(self, **given):
            seen, infos = super().reset(**given)
            return self._timed(seen), infos

        def _timed(self, seen):
            seen = {name: what * 0 for name, what in seen.items()}
            seen["goal"][:, 0] = self._ages * 10
            return seen

    env = Paying(done_ends=False)
    agent = make_agent("ppo", config())
    collector = Collector(env, agent)
    collector.loop.reset()
    ppo = dataclasses.replace(config().ppo, gamma=1.0, clip_coef=0.2, ent_coef=0.0)
    optimiser = adam(agent, 1e-2)
    for number in range(30):
        rollout = collector.collect(uniforms_of(0, number, range(4), 16))
        learnt(agent, rollout, ppo, optimiser, number)
    worth = 4.0 - rollout.batch.observations["goal"][..., 0] / 10
    assert (rollout.values - worth).abs().mean() < 0.3
