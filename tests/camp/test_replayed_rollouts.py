"""A replayed rollout has the probabilities that it was drawn with, for every agent."""

import dataclasses

import pytest

torch = pytest.importorskip("torch")

from internav_data.camp.agents import AGENTS, make_agent  # noqa: E402
from internav_data.camp.agents.hierarchy import AuxiliaryAgent  # noqa: E402
from internav_data.camp.agents.protocol import Batch  # noqa: E402
from internav_data.camp.networks import EpisodeSegments  # noqa: E402
from internav_data.camp.ppo import replayed  # noqa: E402
from internav_data.envs.house_map import MAP_SIZE  # noqa: E402
from internav_data.envs.sensors import sensor_names  # noqa: E402

VARIANTS = [
    *((method, {}) for method in AGENTS),
    ("ppo-intent", {"intent": "recursive"}),
    ("ppo-intent", {"intent": "none"}),
    ("camp", {"intent": "policy"}),
    ("camp", {"intent": "recursive"}),
    ("camp", {"intent": "none"}),
    ("camp", {"hand_back_step": True}),
    ("camp", {"forbidden": ["pick"]}),
]


@pytest.fixture
def curious(config):
    """Let interactions be likely, so that rollouts begin and end within them."""
    return {"agent": {"initial_interaction_probability": 0.3}}


@pytest.mark.parametrize(("method", "condition"), VARIANTS)
@pytest.mark.parametrize("shared", [True, False])
def test_log_probabilities_and_values_are_those_of_the_rollout(
    collected, curious, method, condition, shared
):
    """Across ends of episodes, and ends of rollouts in mid-interaction."""
    changes = {"agent": {**curious["agent"], **condition}, "network": {"shared_encoder": shared}}
    agent, _, lived = collected(method, rollouts=4, changes=changes)
    for rollout in lived:
        now = agent.evaluate(rollout.batch)
        torch.testing.assert_close(now.log_prob, rollout.log_probs, atol=1e-5, rtol=0)
        torch.testing.assert_close(now.value, rollout.values, atol=1e-5, rtol=0)
        parts = rollout.batch.chunked(torch.tensor([2, 0]), [rollout.batch.state])
        mine = agent.evaluate(parts).log_prob
        torch.testing.assert_close(mine, rollout.log_probs[:, [2, 0]], atol=1e-5, rtol=0)
    assert any(rollout.batch.episode_starts[1:].any() for rollout in lived)
    if method == "camp":
        assert any(rollout.batch.state["open"].any() for rollout in lived[1:])


@pytest.mark.parametrize(("method", "condition"), VARIANTS)
@pytest.mark.parametrize("shared", [True, False])
def test_chunks_replay_the_rollout(collected, curious, method, condition, shared):
    """Interactions and episodes begin and end within chunks, and go on from one to the next."""
    changes = {"agent": {**curious["agent"], **condition}, "network": {"shared_encoder": shared}}
    agent, _, lived = collected(method, rollouts=2, steps=12, changes=changes, chunk_steps=4)
    for rollout in lived:
        assert len(rollout.states) == 3
        for columns in ([2, 0], [0, 1, 2, 3]):
            now = replayed(agent, rollout, torch.tensor(columns))
            expected = rollout.log_probs[:, columns]
            torch.testing.assert_close(now.log_prob, expected, atol=1e-5, rtol=0)
            expected = rollout.values[:, columns]
            torch.testing.assert_close(now.value, expected, atol=1e-5, rtol=0)
    assert any(rollout.batch.episode_starts[1:].any() for rollout in lived)


def test_chunks_of_auxiliary_tasks_replay_the_rollout(collected, config):
    agent = AuxiliaryAgent(make_agent("camp", config()), ["navigate", "push", "pick", "push"])
    _, _, lived = collected("", rollouts=2, agent=agent, steps=16, chunk_steps=4)
    for rollout in lived:
        now = replayed(agent, rollout, torch.tensor([3, 1, 0]))
        expected = rollout.log_probs[:, [3, 1, 0]]
        torch.testing.assert_close(now.log_prob, expected, atol=1e-5, rtol=0)
        torch.testing.assert_close(now.value, rollout.values[:, [3, 1, 0]], atol=1e-5, rtol=0)


@pytest.mark.parametrize("method", ["ppo", "camp"])
def test_no_gradient_leaves_a_chunk(collected, method):
    """The gradient of a loss over chunks is the sum of those over each chunk for itself."""
    agent, _, (rollout,) = collected(method, rollouts=1, steps=12, chunk_steps=4)
    now = replayed(agent, rollout, torch.arange(4))
    parameters = agent.optimised()
    found = torch.autograd.grad(loss_of(now), parameters, allow_unused=True)
    apart = 0.0
    for number, state in enumerate(rollout.states):
        rows = slice(4 * number, 4 * number + 4)
        batch = rollout.batch
        alone = Batch(
            {name: values[rows] for name, values in batch.observations.items()},
            batch.episode_starts[rows],
            state,
            batch.record.map(lambda values, rows=rows: values[rows]),
        )
        apart = apart + loss_of(agent.evaluate(alone))
    expected = torch.autograd.grad(apart, parameters, allow_unused=True)
    whole = torch.autograd.grad(
        loss_of(agent.evaluate(rollout.batch)), parameters, allow_unused=True
    )
    for one, other in zip(found, expected, strict=True):
        assert (one is None) == (other is None)
        if one is not None:
            torch.testing.assert_close(one, other, atol=1e-4, rtol=1e-4)
    differs = [
        not torch.allclose(a, b, 1e-2) for a, b in zip(found, whole, strict=True) if a is not None
    ]
    assert any(differs)


def loss_of(found):
    """Return a scalar that depends on all outputs."""
    return (found.log_prob + found.value.square() + found.entropy).sum()


@pytest.mark.parametrize("method", ["ppo", "ppo-intent", "camp", "hrl"])
def test_maps_are_replayed_too(collected, fake, method):
    network = {"observation": "map", "map_occlusion": True, "privileged": ["mass"]}
    env, changes = fake(shown=(6, MAP_SIZE, MAP_SIZE)), {"network": network}
    agent, _, lived = collected(method, rollouts=2, env=env, changes=changes)
    assert "map" in sensor_names(agent.sensors)
    for rollout in lived:
        now = agent.evaluate(rollout.batch)
        torch.testing.assert_close(now.log_prob, rollout.log_probs, atol=1e-5, rtol=0)
        torch.testing.assert_close(now.value, rollout.values, atol=1e-5, rtol=0)
    assert lived[0].log_probs.std() > 0.01


@pytest.mark.parametrize("shared", [True, False])
def test_auxiliary_tasks_are_replayed_too(collected, config, shared):
    hierarchy = make_agent("camp", config(network={"shared_encoder": shared}))
    agent, _, lived = collected(
        "",
        rollouts=3,
        agent=AuxiliaryAgent(hierarchy, ["navigate", "push", "pick", "push"]),
        steps=16,
    )
    for rollout in lived:
        now = agent.evaluate(rollout.batch)
        torch.testing.assert_close(now.log_prob, rollout.log_probs, atol=1e-5, rtol=0)
        torch.testing.assert_close(now.value, rollout.values, atol=1e-5, rtol=0)
    assert lived[0].batch.record.used.max() > 1


@pytest.mark.parametrize("method", ["ppo-intent", "camp"])
@pytest.mark.parametrize("intent", ["integrated", "recursive"])
def test_intents_worked_out_again_are_those_recorded(collected, curious, method, intent):
    agent, _, lived = collected(
        method, rollouts=3, changes={"agent": {**curious["agent"], "intent": intent}}
    )
    for rollout in lived:
        batch = rollout.batch
        recorded = batch.record.intent
        record = dataclasses.replace(batch.record, intent=None)
        unknown = dataclasses.replace(batch, record=record)
        again = agent.evaluate(unknown)
        ran = agent.run(unknown)
        intent = ran.intent if method == "camp" else ran.recorded["intent"]
        torch.testing.assert_close(intent, recorded, atol=1e-5, rtol=0)
        torch.testing.assert_close(again.log_prob, rollout.log_probs, atol=1e-5, rtol=0)
        assert recorded.std(0).max() > 1e-3  # intents differ from step to step


def test_chunks_of_a_gru_are_its_steps():
    torch.manual_seed(0)
    gru = torch.nn.GRU(5, 7)
    inputs, hidden = torch.randn(13, 4, 5), torch.randn(4, 7)
    episode_starts = torch.rand(13, 4) < 0.15
    assert episode_starts.any()
    out, after = EpisodeSegments(episode_starts).run(gru, inputs, hidden)
    h = hidden
    for t in range(13):
        h = h * (~episode_starts[t]).unsqueeze(-1)
        row, h = gru(inputs[t : t + 1], h.unsqueeze(0))
        h = h.squeeze(0)
        torch.testing.assert_close(out[t], row[0], atol=1e-5, rtol=0)
    torch.testing.assert_close(after, h, atol=1e-5, rtol=0)


@pytest.mark.parametrize("steps", [1, 13])
def test_gradients_and_outputs_of_stacked_grus_are_those_of_pytorchs(steps):
    """Each of them run for itself, with episodes that begin in between."""
    torch.manual_seed(0)
    grus = [torch.nn.GRU(size, 7) for size in (5, 8, 6)]
    inputs = [torch.randn(steps, 4, gru.input_size, requires_grad=True) for gru in grus]
    hidden = [torch.randn(4, 7, requires_grad=True) for _ in grus]
    episode_starts = torch.rand(steps, 4) < 0.15
    episode_starts[0, 1] = True
    segments = EpisodeSegments(episode_starts)
    apart = [segments.run(*each) for each in zip(grus, inputs, hidden, strict=True)]
    outs, after = segments.run_together(grus, inputs, hidden)
    weights = torch.randn(3, steps, 4, 7)
    leaves = [*inputs, *hidden, *(p for gru in grus for p in gru.parameters())]
    gradients = []
    for ran in (apart, list(zip(outs, after, strict=True))):
        loss = sum(
            (w * out).sum() + last.sum() for w, (out, last) in zip(weights, ran, strict=True)
        )
        gradients.append(torch.autograd.grad(loss, leaves))
    for one, (out, last) in zip(zip(outs, after, strict=True), apart, strict=True):
        torch.testing.assert_close(one[0], out, atol=1e-6, rtol=0)
        torch.testing.assert_close(one[1], last, atol=1e-6, rtol=0)
    for one, other in zip(*gradients, strict=True):
        torch.testing.assert_close(one, other, atol=1e-5, rtol=1e-5)


def test_a_chunk_is_one_call():
    """Boundaries are only where an episode begins."""
    episode_starts = torch.zeros(10, 3, dtype=torch.bool)
    episode_starts[4, 1] = episode_starts[4, 2] = episode_starts[7, 0] = True
    assert EpisodeSegments(episode_starts).bounds == [0, 4, 7, 10]
    assert EpisodeSegments(torch.zeros(10, 3, dtype=torch.bool)).bounds == [0, 10]


def test_a_rollout_goes_on_where_the_last_one_stopped(collected):
    """Two rollouts of 8 are one of 16."""
    from internav_data.camp.rollout import uniforms_of

    agent, collector, short = collected("camp", rollouts=2, steps=8)
    env = type(collector.loop.env)()
    uniforms = torch.cat([uniforms_of(0, r, range(4), 8) for r in range(2)])
    whole = type(collector)(env, agent)
    whole.loop.reset()
    long = whole.collect(uniforms)
    torch.testing.assert_close(long.log_probs, torch.cat([r.log_probs for r in short]))
    torch.testing.assert_close(long.last_value, short[1].last_value)
