"""CaMP's model, point by point."""

import dataclasses

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from internav_data.camp.agents import AGENTS, make_agent  # noqa: E402
from internav_data.camp.agents.hierarchy import (  # noqa: E402
    ACTIONS_OF,
    DONE,
    NAVIGATE,
    PICK,
    PUSH,
    STOP,
    WAIT,
    AuxiliaryAgent,
    HierarchyRecord,
    initial_probabilities,
    option_inputs,
)
from internav_data.camp.agents.protocol import Agent  # noqa: E402
from internav_data.camp.rollout import Collector, uniforms_of  # noqa: E402
from internav_data.envs.sensors import DEFAULT_SENSORS, SENSORS  # noqa: E402
from internav_data.records.errors import UsageError  # noqa: E402
from internav_data.world.actions import ACTION_COUNT, Action  # noqa: E402

ALLOWED = torch.zeros(4, ACTION_COUNT, dtype=torch.bool)
for _option, _actions in enumerate(ACTIONS_OF):
    ALLOWED[_option, list(_actions)] = True


def with_intent(batch, intent):
    """Return the steps with another recorded intent, or none."""
    return dataclasses.replace(batch, record=dataclasses.replace(batch.record, intent=intent))


VARIANTS = ["integrated", "policy", "recursive", "none"]


def ran_of(agent, batch):
    """Run an agent over the steps; it works out P(i) once more."""
    return agent.run(with_intent(batch, None))


def insist(agent, option, choice=None):
    """Let global always open an option, and its policy always take one of its actions."""
    with torch.no_grad():
        for layer, wanted in (
            (agent.global_policy.actor, option),
            (agent.policies[option].actor, choice),
        ):
            if wanted is not None:
                layer.weight.zero_()
                layer.bias.fill_(-40.0)
                layer.bias[wanted] = 40.0
    return agent


@pytest.mark.parametrize("intent", VARIANTS)
@pytest.mark.parametrize("method", ["camp", "hrl"])
def test_mixtures_sum_to_one_and_masked_actions_have_no_chance(collected, method, intent):
    agent, _, (_, rollout) = collected(method, changes={"agent": {"intent": intent}})
    ran = ran_of(agent, rollout.batch)
    torch.testing.assert_close(ran.intent.sum(-1), torch.ones(8, 4))
    chances = ran.log_probs.exp()
    torch.testing.assert_close(chances.sum(-1), torch.ones(8, 4, 4))
    assert (chances[..., ~ALLOWED] == 0).all()
    acts = ALLOWED.clone()
    acts[[PUSH, PICK], DONE] = False  # their Done is no action: they end on arrival
    assert (chances[..., acts] > 0).all()
    assert (chances[..., [PUSH, PICK], DONE] == 0).all()
    record = rollout.batch.record
    assert ALLOWED[record.option, record.choice].all()


def test_the_mixture_is_equation_7_by_hand(collected):
    """Navigate's and Pick's rotations add; all four Dones are one entry."""
    agent, _, (_, rollout) = collected(
        "camp", changes={"agent": {"initial_interaction_probability": 0.3}}
    )
    batch = rollout.batch
    record = batch.record
    ran = ran_of(agent, batch)
    meant, acts = (
        record.intended_option_probs.double().numpy(),
        ran.log_probs.exp().detach().double().numpy(),
    )
    right = np.zeros((8, 4, ACTION_COUNT))
    for t in range(8):
        for k in range(4):
            for option, actions in enumerate(ACTIONS_OF):
                for action in actions:
                    right[t, k, action] += meant[t, k, option] * acts[t, k, option, action]
    assert record.intent.numpy() == pytest.approx(right, abs=1e-5)
    assert (meant[..., PICK] * acts[..., PICK, 1]).max() > 1e-3


def test_termination_is_as_probable_as_done_among_the_actions_of_an_option(collected, config):
    agent, _, (_, rollout) = collected("camp")
    with torch.no_grad():
        for policy in agent.policies:
            policy.actor.bias.copy_(torch.linspace(-1.0, 1.0, len(policy.actor.bias)))
    twin = make_agent("camp", config(agent={"hand_back_step": True}))
    twin.load_state_dict(agent.state_dict())
    for option in (PUSH, PICK):
        opened = torch.full_like(rollout.batch.record.open, option)
        record = dataclasses.replace(rollout.batch.record, open=opened)
        batch = dataclasses.replace(rollout.batch, record=record)
        beta = ran_of(agent, batch).ends[..., 0].exp()
        done = ran_of(twin, batch).log_probs[..., option, DONE].exp()
        torch.testing.assert_close(beta, done)


@pytest.mark.parametrize("method", ["camp", "camp with a step", "hrl"])
def test_what_is_drawn_has_the_probability_of_its_parts(collected, method):
    """[open] (log beta or log(1 - beta)) + decide log pi_Omega + log pi_omega(a), by hand.

    Done by global has no action; with a hand-back step no beta is drawn.
    """
    step = method == "camp with a step"
    agent, _, lived = collected(
        method.split()[0],
        changes={"agent": {"initial_interaction_probability": 0.3, "hand_back_step": step}},
        rollouts=4,
    )

    def entropy_of(probs):
        return torch.distributions.Categorical(probs).entropy()

    kinds = set()
    for rollout in lived:
        record, ran = rollout.batch.record, ran_of(agent, rollout.batch)
        now = agent.evaluate(rollout.batch)
        for t in range(8):
            for k in range(4):
                option, choice = record.option[t, k], record.choice[t, k]
                opened, decided = record.open[t, k], bool(record.decide[t, k])
                right = entropy = torch.zeros(())
                if opened and not step:
                    beta = ran.ends[t, k, 0].exp()
                    right = right + (beta if decided else 1 - beta).log()
                    entropy = entropy + entropy_of(torch.stack([beta, 1 - beta]))
                if decided:
                    right = right + ran.option_log_probs[t, k, option]
                    entropy = entropy + entropy_of(ran.option_log_probs[t, k].exp())
                if option != STOP:
                    right = right + ran.log_probs[t, k, option, choice]
                    entropy = entropy + entropy_of(ran.log_probs[t, k, option].exp())
                assert rollout.log_probs[t, k] == pytest.approx(right.item(), abs=1e-5)
                assert now.entropy[t, k].item() == pytest.approx(entropy.item(), abs=1e-4)
                kinds.add((opened.item() > 0, decided))
    assert (False, True) in kinds
    assert ((True, False) in kinds) == (method != "hrl")
    assert ((True, True) in kinds) == (method == "camp")


@pytest.mark.parametrize("method", ["camp", "ppo-intent"])
def test_the_intent_policy_is_a_copy_made_at_synchronisation_only(collected, method):
    agent, _, (rollout, _) = collected(method)
    deciding = agent.global_policy if method == "camp" else agent.policy

    def pairs():
        for part in ("embed", "gru", "actor"):
            mine = dict(getattr(agent.intent, part).named_parameters())
            theirs = dict(getattr(deciding, part).named_parameters())
            assert mine.keys() == theirs.keys()
            yield from ((mine[name], theirs[name]) for name in sorted(mine))

    def as_bytes(parameters):
        return [parameter.detach().numpy().tobytes() for parameter in parameters]

    agent.synchronise()
    copied = as_bytes(mine for mine, _ in pairs())
    assert copied == as_bytes(theirs for _, theirs in pairs())
    optimiser = torch.optim.Adam(agent.optimised(), 0.01)
    agent.evaluate(rollout.batch).log_prob.sum().backward()
    optimiser.step()
    assert as_bytes(mine for mine, _ in pairs()) == copied
    now = as_bytes(theirs for _, theirs in pairs())
    assert all(one != other for one, other in zip(now, copied, strict=True))
    agent.synchronise()
    assert as_bytes(mine for mine, _ in pairs()) == now


@pytest.mark.parametrize(("shared", "count"), [(True, 1), (False, 3)])
def test_policies_share_an_encoder_or_have_one_each(config, shared, count):
    agent = make_agent("camp", config(network={"shared_encoder": shared}))
    assert len(agent.encoders) == count


def test_an_action_that_no_option_takes_cannot_be_cloned(config):
    agent = make_agent("camp", config())
    assert agent.labels([int(Action.MOVE_AHEAD), int(Action.DONE)])
    with pytest.raises(UsageError, match="cannot be cloned: option 'navigate' cannot take it"):
        agent.labels([int(Action.MOVE_AHEAD), int(Action.WAIT)])


def test_who_is_optimised():
    from internav_data.camp.config import preset

    agent = make_agent("camp", preset("small"))
    mine = {id(parameter) for parameter in agent.optimised()}
    named = {name for name, parameter in agent.named_parameters() if id(parameter) in mine}
    left = {name for name, _ in agent.named_parameters()} - named
    assert {name.split(".")[0] for name in named} == {
        "encoders", "global_policy", "navigate", "push", "pick"
    }  # fmt: skip
    critics = {f"{p}.critic.{w}" for p in ("navigate", "push", "pick") for w in ("weight", "bias")}
    assert {name for name in left if not name.startswith("intent.")} == critics


def test_no_gradient_flows_from_intents_to_action_policies(collected):
    """Through what global decides nothing is learnt by those whose intents it was told."""
    agent, _, (rollout, _) = collected("camp")
    for again in (False, True):
        batch = with_intent(rollout.batch, None) if again else rollout.batch
        agent.zero_grad()
        agent.evaluate(batch).value.sum().backward()
        for policy in agent.policies:
            for parameter in (*policy.gru.parameters(), *policy.actor.parameters()):
                assert parameter.grad is None or not parameter.grad.any()
        assert agent.global_policy.embed.weight.grad.any()


@pytest.mark.parametrize("method", ["camp", "hrl"])
def test_who_does_not_execute_gets_no_gradient(collected, method):
    """Other advantages for Push's actions change no gradient of Navigate's or Pick's actor.

    An option that was open has drawn whether it ends, so it has executed too.
    """
    agent, _, (_, rollout) = collected(
        method, changes={"agent": {"initial_interaction_probability": 0.3}}
    )
    option, opened = rollout.batch.record.option, rollout.batch.record.open
    assert set(option.unique().tolist()) >= {NAVIGATE, PUSH, PICK}

    def gradients(weights):
        agent.zero_grad()
        (agent.evaluate(rollout.batch).log_prob * weights).sum().backward()
        return [policy.actor.weight.grad.clone() for policy in agent.policies]

    torch.manual_seed(1)
    weights = torch.randn(8, 4)
    before = gradients(weights)
    for changed in (NAVIGATE, PUSH, PICK):
        took_part = (option == changed) | ((opened == changed) & (opened != 0))
        alone = ~((option != opened) & (opened != 0))  # no other one has drawn its end
        after = gradients(torch.where(took_part & alone, weights * 5, weights))
        for policy in (NAVIGATE, PUSH, PICK):
            assert torch.equal(before[policy], after[policy]) == (policy != changed)


@torch.no_grad()
def acted(agent, count=1, steps=14, starts_at=()):
    """Act on noise; return (option, choice, action, decide, open before, used before) a step."""
    torch.manual_seed(3)
    state, rows = agent.initial_state(count), []
    for t in range(steps):
        seen = {
            "rgb": torch.randint(0, 256, (count, 16, 16, 3), dtype=torch.uint8),
            "depth": torch.rand(count, 16, 16, 1),
            "goal": torch.rand(count, 2),
            "held": torch.zeros(count, dtype=torch.int64),
            "horizon": torch.ones(count, dtype=torch.int64),
        }
        episode_starts = torch.full((count,), t == 0 or t in starts_at)
        step = agent.act(seen, state, episode_starts, torch.rand(count, 2))
        state, record = step.state, step.record
        names = ("option", "choice", "decide", "open", "used")
        rows.append({name: getattr(record, name)[0].item() for name in names})
        rows[-1]["action"] = step.action[0].item()
        rows[-1]["forced"] = record.map(lambda values: values[:1]).statistics().get("forced_share")
    return rows


@pytest.mark.parametrize("option", [PUSH, PICK])
def test_an_interaction_that_never_hands_back_has_eleven_actions_then_global_decides(
    config, option
):
    rows = acted(insist(make_agent("camp", config()), option, 1), steps=25)
    assert [row["decide"] for row in rows] == [t % 11 == 0 for t in range(25)]
    assert [row["used"] for row in rows] == [t % 11 for t in range(25)]
    assert [row["forced"] for row in rows] == [1.0 if t % 11 == 10 else None for t in range(25)]
    assert [row["action"] for row in rows] == [ACTIONS_OF[option][1]] * 25  # none is replaced


def always_ending(config, option, **agent):
    made = insist(make_agent("camp", config(agent=agent)), option)
    with torch.no_grad():
        made.policies[option].actor.weight.zero_()
        made.policies[option].actor.bias[-1] = 40.0
    return made


@pytest.mark.parametrize("option", [PUSH, PICK])
def test_termination_is_drawn_on_arrival_and_costs_no_step(config, option):
    """The option ends after each of its actions and is chosen again: it acts at every step."""
    rows = acted(always_ending(config, option), steps=5)
    assert all(row["decide"] and row["option"] == option for row in rows)
    assert all(row["action"] in ACTIONS_OF[option][:-1] for row in rows)
    assert [row["open"] for row in rows] == [0, *[option] * 4]
    assert [row["used"] for row in rows] == [0, *[1] * 4]


@pytest.mark.parametrize("option", [PUSH, PICK])
def test_a_hand_back_is_one_step_of_waiting_and_ends_nothing(config, option, fake):
    agent = always_ending(config, option, hand_back_step=True)
    rows = acted(agent, steps=5)
    assert all(row["action"] == WAIT and row["choice"] == DONE for row in rows)
    assert all(row["decide"] and row["forced"] == 0.0 for row in rows)
    env = fake(length=50)
    collector = Collector(env, agent)
    collector.loop.reset()
    rollout = collector.collect(uniforms_of(0, 0, range(4), 6))
    assert not rollout.terminated.any()
    assert (np.stack(env.actions) == WAIT).all()


def test_navigate_takes_one_step_and_done_ends(config):
    rows = acted(insist(make_agent("camp", config()), NAVIGATE, 0), steps=4)
    assert all(row["decide"] and row["action"] == 0 for row in rows)
    last = ACTIONS_OF[NAVIGATE].index(DONE)
    by_navigate = acted(insist(make_agent("camp", config()), NAVIGATE, last), steps=1)[0]
    assert by_navigate["action"] == DONE
    agent = make_agent("camp", config())
    with torch.no_grad():
        agent.global_policy.actor.bias[STOP] = 60.0
    by_global = acted(agent, steps=1)[0]
    assert (by_global["option"], by_global["action"]) == (STOP, DONE)


def test_a_time_out_in_an_interaction_clears_the_option(config):
    rows = acted(insist(make_agent("camp", config()), PUSH, 1), steps=9, starts_at=(4,))
    assert [row["used"] for row in rows] == [0, 1, 2, 3, 0, 1, 2, 3, 4]
    assert [row["open"] for row in rows] == [0, PUSH, PUSH, PUSH, 0, PUSH, PUSH, PUSH, PUSH]
    assert rows[4]["decide"]


def test_with_push_and_pick_forbidden_it_is_navigate(config, fake):
    """The same actions as Navigate alone, by the same numbers."""
    camp = make_agent("camp", config(agent={"forbidden": ["push", "pick"]}))
    with torch.no_grad():
        camp.global_policy.actor.bias[STOP] = -60.0
    actions = []
    for agent in (camp, AuxiliaryAgent(camp, ["navigate"] * 4)):
        env = fake()
        collector = Collector(env, agent)
        collector.loop.reset()
        for rollout in range(3):
            collector.collect(uniforms_of(5, rollout, range(4), 20))
        actions.append(np.stack(env.actions))
    assert (actions[0] == actions[1]).all()
    assert len(np.unique(actions[0])) > 4


def test_forbidden_options_are_never_opened_nor_meant(collected):
    _, _, lived = collected("camp", changes={"agent": {"forbidden": ["push"]}}, rollouts=3)
    for rollout in lived:
        assert (rollout.batch.record.option != PUSH).all()
        assert (rollout.batch.record.option_probs[..., PUSH] == 0).all()
        assert (rollout.batch.record.intended_option_probs[..., PUSH] == 0).all()


def test_hrl_decides_at_every_step_and_its_interactions_never_hand_back(collected):
    agent, _, lived = collected(
        "hrl", rollouts=4, changes={"agent": {"initial_interaction_probability": 0.3}}
    )
    assert not hasattr(agent, "intent")
    options = torch.cat([rollout.batch.record.option for rollout in lived])
    assert {PUSH, PICK} <= set(options.unique().tolist())
    for rollout in lived:
        record = rollout.batch.record
        assert record.decide.all()
        assert not record.open.any()
        assert not record.used.any()
        acting = (record.option == PUSH) | (record.option == PICK)
        assert (record.choice[acting] != DONE).all()


def test_a_step_ends_the_episode_by_the_global_policys_done_or_by_navigates(collected):
    """An open interaction has to end first."""
    agent, _, lived = collected(
        "camp", changes={"agent": {"initial_interaction_probability": 0.3}}, rollouts=2
    )
    for rollout in lived:
        record, ran = rollout.batch.record, ran_of(agent, rollout.batch)
        closed = torch.where(record.open != 0, ran.ends[..., 0].exp(), 1.0)
        options = ran.option_log_probs.exp()
        done = ran.log_probs[..., NAVIGATE, DONE].exp()
        right = closed * (options[..., STOP] + options[..., NAVIGATE] * done)
        torch.testing.assert_close(record.done_probability, right, atol=1e-6, rtol=1e-4)
    assert record.open.any()


def test_options_are_at_first_in_the_stated_proportions():
    actions, options = initial_probabilities(end=0.1, interact=0.2)
    navigate, push, pick, stop = options
    assert sum(options) == sum(actions) == pytest.approx(1.0)
    assert (push / navigate, pick / navigate) == pytest.approx((2 / 5, 2 / 5))  # 1 - 2 * .2 - .1
    assert (stop, navigate * actions[-1]) == pytest.approx((0.05, 0.05))
    assert actions[:-1] == pytest.approx([actions[0]] * (len(ACTIONS_OF[NAVIGATE]) - 1))


def test_networks_are_given_which_option_is_open_and_the_elevenths_used():
    inputs = option_inputs(torch.tensor([0, PUSH, PICK]), torch.tensor([0, 3, 10]))
    torch.testing.assert_close(
        inputs, torch.tensor([[0.0, 0.0, 0.0], [1.0, 0.0, 3 / 11], [0.0, 1.0, 10 / 11]])
    )


def decisions(**fields):
    """Return five steps: Navigate, a push of two actions, a pickup's first and 11th."""
    columns = {
        "choice": [0, *[ACTIONS_OF[PUSH][0]] * 2, *[ACTIONS_OF[PICK][0]] * 2],
        "option": [NAVIGATE, PUSH, PUSH, PICK, PICK],
        "open": [0, 0, PUSH, PUSH, PICK],
        "used": [0, 0, 1, 2, 10],
    }
    decide = torch.tensor([True, True, False, True, False])
    record = {name: torch.tensor(column) for name, column in columns.items()}
    return HierarchyRecord(**(record | {"decide": decide} | fields))


def test_a_rollout_is_logged_by_its_options_and_decisions():
    record = decisions(
        done_probability=torch.tensor([0.1, 0.2, 9.0, 0.3, 9.0]),
        option_probs=torch.tensor([[0.5, 0.5, 0.0, 0.0]] * 5),
        intended_option_probs=torch.tensor([[0.25, 0.75, 0.0, 0.0]] * 5),
    )
    assert record.statistics() == pytest.approx({
        "share_navigate": 0.2,
        "share_push": 0.4,
        "share_pick": 0.4,
        "share_done": 0.0,
        "done_probability": 0.2,  # where it was decided
        "interactions": 2,
        "interaction_length": 2.0,
        "forced_share": 0.5,  # the push was handed back at the fourth step
        "intent_kl": 0.5 * np.log(0.5 / 0.25) + 0.5 * np.log(0.5 / 0.75),
    })  # fmt: skip


def test_what_a_rollout_lacks_is_not_logged():
    """Labels of an expert have no probabilities; a rollout may have no decision."""
    found = decisions().statistics()
    assert found["done_probability"] == 0.0
    assert "intent_kl" not in found
    undecided = decisions(
        decide=torch.zeros(5, dtype=torch.bool),
        open=torch.zeros(5, dtype=torch.int64),
        used=torch.zeros(5, dtype=torch.int64),
        done_probability=torch.full((5,), 0.5),
        option_probs=torch.full((5, 4), 0.25),
        intended_option_probs=torch.full((5, 4), 0.25),
    ).statistics()
    assert (undecided["done_probability"], undecided["interactions"]) == (0.0, 0)
    assert not {"interaction_length", "forced_share", "intent_kl"} & undecided.keys()


@pytest.mark.parametrize("method", AGENTS)
@pytest.mark.parametrize("chance", [0.01, 0.05])
def test_every_learner_ends_an_episode_with_the_same_chance(fake, config, method, chance):
    env = fake()
    agent = make_agent(
        method,
        config(
            agent={"initial_done_probability": chance, "initial_interaction_probability": 0.045}
        ),
    )
    collector = Collector(env, agent)
    collector.loop.reset()
    record = collector.collect(uniforms_of(0, 0, range(4), 1)).batch.record
    assert record.statistics()["done_probability"] == pytest.approx(chance, rel=0.03)
    if method in {"hrl", "camp"} and chance == 0.01:
        plan = record.option_probs[0, 0].tolist()
        assert plan[:3] == pytest.approx([0.9, 0.045, 0.045], rel=0.03)


@pytest.mark.parametrize("method", ["camp", "ppo-intent"])
def test_without_intent_the_trained_model_is_fed_the_plane(collected, method):
    agent, _, (rollout, _) = collected(method)
    plain = agent.without_intent()
    assert agent.uses_intent
    assert {id(p) for p in plain.parameters()} == {id(p) for p in agent.parameters()}
    batch = rollout.batch
    batch = with_intent(batch, torch.full((8, 4, ACTION_COUNT), 1.0 / ACTION_COUNT))
    right = agent.evaluate(batch).value
    torch.testing.assert_close(plain.evaluate(batch).value, right)
    batch = with_intent(batch, torch.eye(ACTION_COUNT)[torch.zeros(8, 4, dtype=torch.int64)])
    torch.testing.assert_close(plain.evaluate(batch).value, right)
    assert not torch.allclose(agent.evaluate(batch).value, right)


def test_agents_without_intent_are_not_to_be_evaluated_without(config):
    for method in ("ppo", "hrl"):
        with pytest.raises(UsageError, match="no intent"):
            make_agent(method, config()).without_intent()


def test_recursive_intent_is_the_intent_policy_run_on_its_own_first_intent(collected):
    agent, _, (rollout, _) = collected("camp", changes={"agent": {"intent": "recursive"}})
    record, batch = rollout.batch.record, rollout.batch
    at = {name: what[:1] for name, what in batch.observations.items()}
    inputs = torch.cat([agent.encoders[0](at), torch.zeros(1, 4, 3)], -1)
    mind, intent = agent.intent, torch.full((1, 4, ACTION_COUNT), 1.0 / ACTION_COUNT)
    acts = ran_of(agent, batch).log_probs[:1].exp()
    for _ in range(2):
        out, _ = mind.gru(torch.cat([inputs, mind.embed(intent)], -1))  # from zeros, twice
        meant = torch.softmax(mind.actor(out), -1)
        intent = (meant.unsqueeze(-1) * acts).sum(-2)
    torch.testing.assert_close(intent[0], record.intent[0], atol=1e-5, rtol=0)


@pytest.mark.parametrize("method", AGENTS)
def test_the_table_of_methods_states_every_privileged_sensor(config, method):
    taken = set(make_agent(method, config()).sensors)
    privileged = taken & {s.name for s in SENSORS.values() if "privileged" in s.description}
    stated = AGENTS[method].privileged
    assert (stated != "none") == bool(privileged), f"{method}: stated {stated}, takes {privileged}"


def test_the_sensors_of_every_environment_are_not_privileged():
    assert "privileged" in SENSORS["ids"].description
    assert not any("privileged" in SENSORS[name].description for name in DEFAULT_SENSORS)


def test_unknown_methods_and_unfit_variants_are_refused(config):
    with pytest.raises(UsageError, match=", ".join(AGENTS)):
        make_agent("dqn", config())
    with pytest.raises(UsageError, match="'policy'"):
        make_agent("ppo-intent", config(agent={"intent": "policy"}))


def test_ones_own_agent_joins_by_entry_point(config, monkeypatch):
    from importlib.metadata import EntryPoint

    from internav_data.camp import agents

    point = EntryPoint("mine", "internav_data.camp.agents.flat:PPOAgent", agents.GROUP)
    monkeypatch.setattr(agents, "entry_points", lambda **_: [point])
    assert isinstance(make_agent("mine", config()), Agent)
    assert agents.agent_names()[-1] == "mine"


def test_parameters_are_a_function_of_name_and_config(config):
    one, two = (make_agent("camp", config()).state_dict() for _ in range(2))
    assert all(torch.equal(one[name], two[name]) for name in one)
    other = make_agent("camp", config(seed=1)).state_dict()
    assert not torch.equal(
        one["global_policy.gru.weight_ih_l0"], other["global_policy.gru.weight_ih_l0"]
    )
