"""Start poses of the tasks of Push and Pick, judged by their definition."""

import pytest

from internav_data.dataset import load_dataset
from internav_data.envs import InterNavEnv, InterNavVectorEnv
from internav_data.envs.auxiliary import auxiliary_starts, is_cleared, world_at
from internav_data.records.errors import UsageError
from internav_data.world import Action, HouseModel


@pytest.mark.parametrize("kind", ["push", "pick"])
def test_agents_stand_opposite_to_the_goal_and_can_act(small, kind):
    dataset = load_dataset(small)
    seen = 0
    for episode in dataset:
        stage = HouseModel.of(dataset.scene(episode.scene_id))
        starts = auxiliary_starts(stage, episode, dataset.assets, kind)
        assert starts == auxiliary_starts(stage, episode, dataset.assets, kind)
        assert len(set(starts)) == len(starts)
        for start in starts[:: max(1, len(starts) // 8)]:
            world = world_at(stage, episode, dataset.assets, start)
            obstacle = episode.obstacles[start.obstacle]
            x, y = world.position
            dot = (x - obstacle.x) * (episode.goal.x - obstacle.x)
            dot += (y - obstacle.y) * (episode.goal.y - obstacle.y)
            assert dot < 0.0
            assert world.lattice.free[start.i, start.j]
            action = Action.PICKUP if kind == "pick" else Action.PUSH_AHEAD
            assert world.step(action).target == world.obstacles[start.obstacle]
            seen += 1
    assert seen


def test_no_start_is_in_a_pocket_that_nothing_leads_out_of(small, monkeypatch):
    """No distance is finite where the goal stays out of reach with every obstacle gone."""
    dataset = load_dataset(small)
    episode = next(e for e in dataset if any(o.pickable for o in e.obstacles))
    stage = HouseModel.of(dataset.scene(episode.scene_id))
    starts = auxiliary_starts(stage, episode, dataset.assets, "pick")
    for start in starts:
        assert stage.shortest_path_m((start.i / 4, start.j / 4), (episode.goal.x, episode.goal.y))
    pocket = starts[0][:2]
    real = type(stage.lattice).distances

    def cut(lattice, i, j):
        steps = real(lattice, i, j)
        steps[pocket] = -1
        return steps

    monkeypatch.setattr(type(stage.lattice), "distances", cut)
    left = auxiliary_starts(stage, episode, dataset.assets, "pick")
    assert left
    assert all(start[:2] != pocket for start in left)


@pytest.mark.parametrize(
    ("before", "after", "cleared"),
    [(None, 9, True), (9, 8, True), (9, 9, False), (8, 9, False), (9, None, False)],
)
def test_what_cleared_means(before, after, cleared):
    assert is_cleared(before, after) == cleared


def test_an_environment_begins_at_a_start(small):
    dataset = load_dataset(small)
    episode = next(e for e in dataset if any(o.pickable for o in e.obstacles))
    stage = HouseModel.of(dataset.scene(episode.scene_id))
    start = auxiliary_starts(stage, episode, dataset.assets, "pick")[0]
    env = InterNavEnv(small, 16)
    options = {"episode_id": episode.episode_id, "start": start[:3]}
    env.reset(seed=0, options=options)
    seen, *_, info = env.step(Action.PICKUP)
    assert info["action_success"]
    state = env.state()
    assert state.start == start[:3]
    other = InterNavEnv(small, 16)
    again, _ = other.restore(state)
    assert (again["rgb"] == seen["rgb"]).all()
    assert other.state() == state
    many = InterNavVectorEnv(2, small, 16)
    many.reset(seed=0, options={"episode_id": episode.episode_id, "start": [start[:3], None]})
    assert [s.start for s in many.state()] == [start[:3], None]
    with pytest.raises(UsageError, match="free node"):
        env.reset(options={"episode_id": episode.episode_id, "start": (0, 0, 0)})
