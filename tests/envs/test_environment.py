"""The environment: spaces, order, states, and the ways of stepping many, all the same."""

import contextlib
import math
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import internav_data.envs
from internav_data.core.lru import LRUCache
from internav_data.dataset import load_dataset
from internav_data.envs import EpisodeSnapshot, InterNavVectorEnv
from internav_data.envs.order import EpisodeOrder
from internav_data.envs.sensors import SENSORS
from internav_data.envs.source import FIELDS_KEPT, open_source
from internav_data.generation import generate, load_config
from internav_data.navigation import TangentGraph
from internav_data.records.errors import CorruptDataError, UsageError
from internav_data.world import Action, HouseModel, World
from internav_data.world.actions import ACTION_COUNT, ACTIONS, INTERACTION_KINDS

EVERY = tuple(SENSORS)
WEIGHT_OF = {"move": 8, "turn": 1.5, "look": 0.3, "push": 1, "pick": 1.5, "drop": 1.5, "done": 0.4}
WEIGHTS = np.array([WEIGHT_OF[action.kind] for action in ACTIONS])


def actions(seed, *shape):
    rng = np.random.default_rng(seed)
    return rng.choice(ACTION_COUNT, size=shape, p=WEIGHTS / WEIGHTS.sum())


def make(dataset, **arguments):
    arguments.setdefault("image_size", 16)
    return gymnasium.make("internav_data.envs:InterNav-v0", dataset=dataset, **arguments)


def many(dataset, count, mode="vector_entry_point", **arguments):
    arguments.setdefault("image_size", 16)
    return gymnasium.make_vec(
        "InterNav-v0", num_envs=count, vectorization_mode=mode, dataset=dataset, **arguments
    )


def same(one, other):
    """Assert that two observations, infos or anything else are equal to the last bit."""
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            same(one[key], other[key])
    else:
        np.testing.assert_array_equal(one, other)
        assert np.asarray(one).dtype == np.asarray(other).dtype


def same_ends(one, other):
    """Compare infos of two vectors, metrics where an episode ended."""
    one, other = dict(one), dict(other)
    mine, mask = other.pop("metrics"), other.pop("_metrics")
    theirs = one.pop("metrics")
    assert one.pop("_metrics")[mask].all()
    same(one, other)
    for name in mine:
        same(np.asarray(theirs[name])[mask], np.asarray(mine[name])[mask])


def trajectory(env, seed, count=120):
    out = [env.reset(seed=seed)]
    for action in actions(seed, count).tolist():
        out.append(env.step(action))
        if out[-1][2] or out[-1][3]:
            out.append(env.reset())
    return out


def test_without_arguments_it_is_over_the_dataset_that_ships(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    env = gymnasium.make("InterNav-v0")
    _, info = env.reset(seed=3)
    shipped = load_dataset("mini")
    assert info["episode_id"] in {episode.episode_id for episode in shipped}
    many = gymnasium.make_vec("InterNav-v0", num_envs=2)
    assert many.reset(seed=3)[1]["episode_id"][0] == info["episode_id"]
    monkeypatch.chdir("/")  # found from anywhere
    _, info = gymnasium.make(env.spec, split="val").reset(seed=0)
    assert info["episode_id"].startswith("scene-000000/")


def test_gymnasium_finds_nothing_wrong(small):
    env = make(small, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.reset(seed=0)
    assert env.render().shape == (300, 300, 3)


def test_stable_baselines_finds_nothing_wrong(small):
    """Depth in metres is no picture of bytes, which it says and a user knows; nothing else."""
    from stable_baselines3.common.env_checker import check_env as their_check

    from internav_data.envs import InterNavEnv

    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        their_check(InterNavEnv(small, 64))
    others = [str(w.message) for w in told if "depth" not in str(w.message)]
    assert not others


def test_observations_lie_in_their_space(small):
    env = make(small)
    for k, step in enumerate(trajectory(env, 5)):
        assert env.observation_space.contains(step[0]), k
    seen, _ = env.reset(options={"episode_id": load_dataset(small)[0].episode_id})
    episode = load_dataset(small)[0]
    start, goal = episode.start, episode.goal
    assert seen["goal"][0] == np.float32(math.hypot(goal.x - start.x, goal.y - start.y))
    absolute = math.atan2(goal.y - start.y, goal.x - start.x)
    turn = (absolute - math.radians(start.yaw_deg) - float(seen["goal"][1])) / (2 * math.pi)
    assert turn == pytest.approx(round(turn), abs=1e-6)
    assert (seen["held"], seen["horizon"]) == (0, 2)


def test_the_same_seed_the_same_trajectory(small):
    first = trajectory(make(small), 3)
    for one, other in zip(first, trajectory(make(small), 3), strict=True):
        for a, b in zip(one, other, strict=True):
            same(a, b)


def test_an_epoch_visits_everything_once(small):
    env = make(small, episodes_per_house=2)
    count = len(load_dataset(small))
    ids = [env.reset(seed=9 if k == 0 else None)[1]["episode_id"] for k in range(2 * count)]
    assert len(set(ids[:count])) == len(set(ids[count:])) == count
    assert ids[:count] != ids[count:], "another epoch, another order"
    plain = make(small, shuffle=False)
    assert [plain.reset()[1]["episode_id"] for _ in range(count)] == [
        episode.episode_id for episode in load_dataset(small)
    ]


@pytest.mark.parametrize("episodes_per_house", [1, 3, 50])
def test_an_order_is_a_permutation_that_stays(episodes_per_house):
    bounds = np.array([0, 5, 6, 20, 31])
    order = EpisodeOrder(bounds, 7, episodes_per_house=episodes_per_house)
    again = EpisodeOrder(bounds, 7, episodes_per_house=episodes_per_house)
    for epoch in range(3):
        numbers = [order.number(31 * epoch + k) for k in range(31)]
        assert sorted(numbers) == list(range(31))
        assert numbers == [again.number(31 * epoch + k) for k in range(31)]
        houses = np.searchsorted(bounds, numbers, side="right")
        runs = 1 + np.count_nonzero(np.diff(houses))
        assert runs <= sum(-(-c // episodes_per_house) for c in (5, 1, 14, 11))
    assert again.number(2) == order.number(2), "in any order of asking"


def test_a_state_is_an_episode_and_its_actions(small):
    env = make(small)
    env.reset(seed=1)
    for action in actions(4, 60).tolist():
        env.step(Action.MOVE_AHEAD if action == Action.DONE else action)
    env.unwrapped.wait()
    state = env.unwrapped.state()
    assert state.actions[-1] == -1
    assert len(state.actions) == 61
    other = make(small)
    other.reset(seed=2)
    seen, info = other.unwrapped.restore(state)
    assert info == {"episode_id": state.episode_id}
    by_options, _ = make(small).reset(
        options={"episode_id": state.episode_id, "actions": state.actions}
    )
    same(seen, by_options)
    assert other.unwrapped.state() == state
    for action in actions(6, 40).tolist():
        one, two = env.step(action), other.step(action)
        for a, b in zip(one, two, strict=True):
            same(a, b)
        if one[2] or one[3]:
            same(env.reset()[0], other.reset()[0])


def test_metrics_agree_with_another_count(small):
    dataset = load_dataset(small)
    episode = dataset[1]
    env = make(small)
    env.reset(options={"episode_id": episode.episode_id})
    house = dataset.scene(episode.scene_id)
    world = World.of_episode(HouseModel.of(house), episode, dataset.assets)
    ways, goal = TangentGraph.of(house), (episode.goal.x, episode.goal.y)
    path, drops, total, interactions = 0.0, 0.0, 0.0, 0
    chosen = [a for a in actions(11, 150).tolist() if a != Action.DONE]
    for action in chosen:
        spot, steps = world.position, world.path_steps()
        result = world.step(action)
        expected = -0.01
        if world.position != spot:
            path += math.dist(spot, world.position)
            expected += ways.distance(spot, goal) - ways.distance(world.position, goal)
        elif result.action.kind in INTERACTION_KINDS and result.success:
            now = world.path_steps()
            interactions += 1
            if steps is not None and now is not None:
                drops += 0.25 * (steps - now)
                expected += 0.25 * (steps - now)
            else:
                expected += (steps is None and now is not None) - (
                    steps is not None and now is None
                )
        _, reward, *_ = env.step(action)
        assert reward == pytest.approx(expected, abs=2e-4), Action(action).name
        total += reward
    *_, info = env.step(int(Action.DONE))
    assert interactions > 0
    assert path > 0.0
    said = info["metrics"]
    assert said["path_m"] == pytest.approx(path)
    assert said["interaction_reward_m"] == pytest.approx(drops)
    assert said["distance_to_goal_m"] == pytest.approx(
        ways.distance(world.position, goal), abs=1e-4
    )
    assert said["steps"] == len(chosen) + 1
    assert said["return"] == pytest.approx(total - 0.01 + 10.0 * said["success"])


def test_five_hundred_steps(small):
    env = make(small)
    env.reset(seed=0)
    ends = [env.step(1)[2:4] for _ in range(500)]
    assert ends == [(False, False)] * 499 + [(False, True)]
    with pytest.raises(UsageError, match="reset"):
        env.step(1)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"episode_id": "scene-000099/0000"}, "no episode 'scene-000099/0000'"),
        ({"episode": "scene-000000/0000"}, "no option 'episode'"),
        ({"actions": [0]}, "say of which episode"),
        ([1], "expected a dictionary"),
    ],
)
def test_options_that_cannot_be_meant(small, options, message):
    with pytest.raises(UsageError, match=message):
        make(small).unwrapped.reset(options=options)


REFUSED_SEEDS = [(1.5, r"seed: .*got 1\.5"), (-3, "seed: .*got -3"), ("7", "seed: .*got '7'")]
REFUSED_STARTS = ["abc", 5, (1.0, 2.0, 0.0), (1, 2)]
REFUSED_ACTIONS = [5, "abc", ["x"], [0.5], [12]]


def test_one_environment_refuses_seeds_starts_and_actions_before_anything_begins(small):
    env = make(small).unwrapped
    env.reset(seed=np.int64(3))
    before, named = env.state(), {"episode_id": load_dataset(small)[0].episode_id}
    for seed, message in REFUSED_SEEDS:
        with pytest.raises(UsageError, match=message):
            env.reset(seed=seed)
    for start in REFUSED_STARTS:
        with pytest.raises(UsageError, match=r"options\['start'\]: expected \(i, j, quarter\)"):
            env.reset(seed=1, options={**named, "start": start})
    for actions in REFUSED_ACTIONS:
        with pytest.raises(UsageError, match=r"options\['actions'\]: expected a.* got"):
            env.reset(seed=1, options={**named, "actions": actions})
    assert env.state() == before


def test_many_refuse_seeds_starts_and_actions_before_anything_begins(small):
    episode_id = load_dataset(small)[0].episode_id
    for way in ({}, {"workers": 2}):
        env = many(small, 2, **way)
        with contextlib.closing(env):
            env.reset(seed=0)
            before = env.state()
            refused = [
                *(({"seed": seed}, message) for seed, message in REFUSED_SEEDS),
                *(({"seed": [1, seed]}, message) for seed, message in REFUSED_SEEDS),
                *(
                    ({"seed": 1, "options": {"episode_id": ids, name: given}}, message)
                    for ids, name, given, message in refused_options(episode_id)
                ),
            ]
            for given, message in refused:
                with pytest.raises(UsageError, match=message):
                    env.reset(**given)
            assert env.state() == before
            # What is asked of an environment that is not reset does not matter.
            mask = np.array([True, False])
            env.reset(options={"reset_mask": mask, "episode_id": episode_id, "actions": [[1], 5]})
            assert env.state()[1] == before[1]


def refused_options(episode_id):
    """Return episode ids, an option's name and value for two environments, and the error."""
    for start in REFUSED_STARTS:
        yield episode_id, "start", [None, start], r"\['start'\]: expected \(i, j, quarter\)"
    for actions in REFUSED_ACTIONS:
        yield episode_id, "actions", [[], actions], r"\['actions'\]: expected a.* got"
    yield [episode_id, None], "start", [None, (1, 1, 0)], r"\['start'\]: say of which episode"
    for name in ("start", "actions"):
        for given in ("abc", 5, None):
            yield episode_id, name, given, rf"\['{name}'\]: expected a list, .*got {given!r}"
    yield 5, "reset_mask", [True, True], r"\['episode_id'\]: expected a list"
    yield episode_id, "reset_mask", [[True], [True, False]], r"\['reset_mask'\]: expected 2"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"split": "tran"}, "split"),
        ({"max_steps": 0}, "max_steps"),
        ({"image_size": 0}, "image_size"),
        ({"colour": 1}, "no argument 'colour'"),
        ({"imagesize": 32}, "no argument 'imagesize'; .*'image_size'.*'sensors'.*'task'"),
        ({"filters": [("room_count", ">", 99)]}, r"no episodes .* by split: train \d+, val \d+"),
        ({"push_model": "shove"}, "push_model"),
        ({"episodes_per_house": 0}, "episodes_per_house"),
    ],
)
def test_arguments_that_cannot_be_meant(small, arguments, message):
    with pytest.raises(UsageError, match=message):
        make(small, **arguments)


@pytest.mark.parametrize("model", ["force", "kick"])
def test_experts_reach_the_goal_by_the_push_model_of_their_dataset(tmp_path, model):
    out = tmp_path / "d"
    overrides = ["episodes_per_scene=3", "house.rooms=1-2", f"world.push_model={model}"]
    # Chairs alone: they can be pushed, not picked up.
    overrides += ["episodes.asset_weights.Chair=1000"]
    generate(out, load_config(overrides=overrides), 3, workers=1)
    env = make(out)
    assert open_source(out).world_config.push_model == model
    pushed = None
    for episode in load_dataset(out):
        if episode.expert.pushes:
            pushed = episode
        env.reset(options={"episode_id": episode.episode_id})
        for action in episode.expert.actions:
            *_, terminated, _, info = env.step(action)
            assert info["action_success"]
        assert terminated
        assert info["metrics"]["success"]
        assert info["metrics"]["steps"] == episode.expert.steps
        assert info["metrics"]["path_m"] == episode.expert.path_m
    other = "kick" if model == "force" else "force"
    seen = [depths(make(out, **by), pushed) for by in ({}, {"push_model": model})]
    assert np.array_equal(*seen)
    assert not np.array_equal(seen[0], depths(make(out, push_model=other), pushed))


def depths(env, episode):
    """Depth images along an expert's way: they show how far things were pushed."""
    env.reset(options={"episode_id": episode.episode_id})
    return np.array([env.step(action)[0]["depth"] for action in episode.expert.actions])


def test_no_dataset(tmp_path):
    with pytest.raises(CorruptDataError):
        make(tmp_path / "nothing")


def steps_of(env, seed, count, options=None):
    yield env.reset(seed=seed, options=options)
    for row in actions(seed, count, env.num_envs):
        yield env.step(row)


def test_many_are_the_same_as_each_alone(small):
    alone = gymnasium.vector.SyncVectorEnv([lambda: make(small, max_steps=40)] * 3)
    together = many(small, 3, max_steps=40)
    assert together.single_observation_space == alone.single_observation_space
    assert together.observation_space == alone.observation_space
    assert together.action_space == alone.action_space
    assert together.metadata["autoreset_mode"] == alone.metadata["autoreset_mode"]
    # Episodes end by Done or are cut off, the latter however the actions are drawn.
    ended = 0
    for one, other in zip(steps_of(alone, 8, 150), steps_of(together, 8, 150), strict=True):
        # One environment has metrics at every step, as any may be the last under a wrapper.
        if len(one) > 2 and not (one[2] | one[3]).any():
            del one[4]["metrics"], one[4]["_metrics"]
        for a, b in zip(one, other, strict=True):
            same(a, b) if not isinstance(a, dict) or "metrics" not in a else same_ends(a, b)
        ended += "metrics" in other[-1]
    assert ended >= 3, "episodes ended and began again"


def test_instance_ids_are_seen_by_who_asks_for_them(small):
    plain, told = many(small, 2), many(small, 2, sensors=EVERY)
    (seen, _), (more, _) = plain.reset(seed=3), told.reset(seed=3)
    assert "ids" not in seen
    assert told.single_observation_space.contains({name: v[0] for name, v in more.items()})
    ids, _ = more.pop("ids"), more.pop("map")
    same(seen, more)
    assert ids.shape == (2, 16, 16)
    assert {-1, -3} <= set(ids.ravel().tolist()), "floor and walls"
    assert ids.max() > 0, "and things"
    alone = make(small, sensors=EVERY, image_size=16)
    same(alone.reset(seed=3)[0]["ids"], ids[0])
    processes = many(small, 2, sensors=EVERY, workers=2)
    try:
        same(processes.reset(seed=3)[0]["ids"], ids)
    finally:
        processes.close()


def test_processes_are_the_same_as_one(small):
    options = {"episode_id": [None, load_dataset(small)[2].episode_id, None]}
    one, two = many(small, 3), many(small, 3, workers=2)
    try:
        for a, b in zip(
            steps_of(one, 4, 60, dict(options)), steps_of(two, 4, 60, dict(options)), strict=True
        ):
            for x, y in zip(a, b, strict=True):
                same(x, y)
        assert one.state() == two.state()
        same(one.restore(one.state())[0], two.restore(one.state())[0])
        with pytest.raises(UsageError, match="no episode"):
            two.reset(options={"episode_id": "nowhere"})
        same(one.reset(seed=1)[0], two.reset(seed=1)[0])
    finally:
        two.close()


def test_gymnasiums_own_processes(small):
    env = many(small, 2, "async", vector_kwargs={"context": "spawn"})
    try:
        same(env.reset(seed=8)[0], many(small, 2).reset(seed=8)[0])
    finally:
        env.close()


def test_a_vector_without_autoreset_waits(small):
    env = many(small, 2, autoreset_mode="Disabled")
    env.reset(seed=0)
    *_, terminated, _, infos = env.step([Action.DONE, Action.WAIT])
    assert terminated.tolist() == [True, False]
    assert infos["_metrics"].tolist() == [True, False]
    with pytest.raises(UsageError, match="reset_mask"):
        env.step([0, 0])
    before = env.state()
    env.reset(options={"reset_mask": np.array([True, False])})
    assert env.state()[1] == before[1]
    assert env.state()[0].actions == ()


def test_vector_states(small):
    env = many(small, 2)
    for _ in steps_of(env, 2, 25):
        pass
    states = env.state()
    assert all(isinstance(state, EpisodeSnapshot) for state in states)
    other = InterNavVectorEnv(2, small, 16)
    other.restore(states)
    for row in actions(5, 30, 2):
        for a, b in zip(env.step(row), other.step(row), strict=True):
            same(a, b)


def test_registered_once():
    internav_data.envs.register()
    assert "InterNav-v0" in gymnasium.registry


def test_houses_and_distance_fields_are_kept_within_bounds(small, monkeypatch):
    held = LRUCache(2)
    monkeypatch.setattr("internav_data.envs.source.LOADED_HOUSES", held)
    source = open_source(small)
    first = source.episode(0)
    loaded_house = source.loaded_house(first)
    assert source.loaded_house(first) is loaded_house
    for number in source.bounds[1:-1].tolist():
        source.loaded_house(source.episode(number))
        assert len(held) <= 2
    assert source.loaded_house(first) is not loaded_house
    field = loaded_house.distance_field((0, 5))
    for i in range(1, FIELDS_KEPT):
        loaded_house.distance_field((i, 5))
    assert loaded_house.distance_field((0, 5)) is field
    for i in range(1, FIELDS_KEPT + 1):
        loaded_house.distance_field((i, 5))
    assert loaded_house.distance_field((0, 5)) is not field


@pytest.mark.slow
def test_memory_stays_flat(small):
    import psutil

    env = make(small, episodes_per_house=1)
    rng = np.random.default_rng(0)
    sizes = []
    for k in range(10_000):
        env.reset(seed=0 if k == 0 else None)
        for action in rng.choice([0, 0, 1, 3, 4, 9, 10], size=4).tolist():
            env.step(action)
        if k % 1000 == 999:
            sizes.append(psutil.Process().memory_info().rss / 2**20)
    assert sizes[-1] - sizes[2] < 10.0, sizes


@pytest.mark.parametrize("wrapped", [False, True])
def test_a_time_limit_keeps_the_metrics_in_the_last_info(small, wrapped):
    limit = {} if wrapped else {"max_episode_steps": 5}
    env = make(small, **limit)
    if wrapped:
        env = gymnasium.wrappers.TimeLimit(env, 5)
    env.reset(seed=0)
    *_, truncated, info = [env.step(1) for _ in range(5)][-1]
    assert truncated
    assert info["metrics"]["steps"] == 5
    assert info["metrics"]["success"] is False


@pytest.fixture(scope="module")
def same_step_vectors(small):
    """Three environments in this process, and in two others."""
    arguments = {"autoreset_mode": "SameStep", "max_episode_steps": 7, "render_mode": "rgb_array"}
    envs = [many(small, 3, max_steps=9, workers=n, **arguments) for n in (0, 2)]
    yield envs
    for env in envs:
        env.close()


def test_same_step_autoreset_is_gymnasiums_own(small, same_step_vectors):
    same_step = gymnasium.vector.AutoresetMode.SAME_STEP
    theirs = many(small, 3, "sync", vector_kwargs={"autoreset_mode": same_step}, max_steps=7)
    ours = same_step_vectors
    assert {env.metadata["autoreset_mode"] for env in ours} == {same_step}
    first = [env.reset(seed=6)[0] for env in (theirs, *ours)]
    same(first[0], first[1])
    same(first[0], first[2])
    ends = 0
    for row in actions(3, 20, 3):
        one, *others = [env.step(row) for env in (theirs, *ours)]
        ended = np.flatnonzero(one[2] | one[3])
        ends += len(ended)
        for other in others:
            for a, b in zip(one[:4], other[:4], strict=True):
                same(a, b)
            for k in ended:
                same(one[4]["episode_id"][k], other[4]["episode_id"][k])
                same(one[4]["final_obs"][k], other[4]["final_obs"][k])
                for name, values in one[4]["final_info"]["metrics"].items():
                    assert values[k] == other[4]["final_info"]["metrics"][name][k]
                assert other[4]["final_info"]["metrics"]["steps"][k] <= 7, "max_episode_steps"
    assert ends > 3
    with pytest.raises(UsageError, match="autoreset_mode"):
        many(small, 2, autoreset_mode="never")
    with pytest.raises(UsageError, match="no argument 'autoreset'"):
        many(small, 2, autoreset=False)


def test_no_action_of_a_batch_is_taken_unless_all_can_be(small, same_step_vectors):
    for env in same_step_vectors:
        env.reset(seed=0)
        before = env.state()
        for batch in ([0, 0, 12], [0, -2, 0], [0, 0, 1.5], [0], [0, 0, np.nan]):
            with pytest.raises(UsageError, match="step: expected"):
                env.step(batch)
        assert env.state() == before
    env = make(small)
    env.reset(seed=0)
    for action in (12, 1.7, "0", None):
        with pytest.raises(UsageError, match="step: expected"):
            env.unwrapped.step(action)
    waiting = many(small, 2, autoreset_mode="Disabled")
    waiting.reset(seed=0)
    waiting.step([1, Action.DONE])
    before = waiting.state()
    with pytest.raises(UsageError, match="environment 1 is done"):
        waiting.step([0, 1])
    assert waiting.state() == before


def test_a_vector_renders_and_masks_as_each_alone(small, same_step_vectors):
    alone = [make(small, render_mode="rgb_array") for _ in range(3)]
    for k, env in enumerate(alone):
        env.reset(seed=3 + k)
    for env in same_step_vectors:
        env.reset(seed=3)
        pictures, masks = env.render(), env.action_masks()
        assert masks.shape == (3, ACTION_COUNT)
        for k, one in enumerate(alone):
            same(pictures[k], one.render())
            same(masks[k], one.unwrapped.action_masks())
    assert many(small, 1).render() is None
    with pytest.raises(UsageError, match="render_mode"):
        many(small, 1, render_mode="human")


def test_a_vector_passes_gymnasiums_checks_of_its_parts(small):
    env = many(small, 2, render_mode="rgb_array")
    seen, _ = env.reset(seed=0)
    assert env.observation_space.contains(seen)
    assert env.action_space.contains(env.action_space.sample())
    wrapped = gymnasium.wrappers.vector.RecordEpisodeStatistics(env)
    wrapped.reset(seed=0)
    for row in actions(1, 30, 2):
        seen, *_ = wrapped.step(row)
    assert env.observation_space.contains(seen)
