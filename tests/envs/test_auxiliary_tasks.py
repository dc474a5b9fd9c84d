"""The auxiliary tasks: where they begin, what they pay, and that they can be built again."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from internav_data.dataset import load_dataset
from internav_data.envs import InterNavProcesses, InterNavVectorEnv
from internav_data.envs.slot import EpisodeSnapshot
from internav_data.envs.tasks import STEP, SUCCESS, TASKS, interaction_reward
from internav_data.records.errors import CorruptDataError, UsageError
from internav_data.world.actions import ACTIONS, Action

AHEAD, PUSH_AHEAD, PICKUP, DONE = 0, 5, 9, 11
NAMES = ("navigate", "navigate", "push", "push", "pick", "pick")


@pytest.fixture
def tasks(scenes):
    made = []

    def make(names=NAMES, seed=0, **arguments):
        data = load_dataset(scenes, "train")
        env = InterNavVectorEnv(
            len(names),
            data,
            16,
            autoreset_mode="Disabled",
            copy=False,
            max_steps=40,
            task=names,
            **arguments,
        )
        env.reset(seed=seed)
        made.append(env)
        return env

    yield make
    for each in made:
        each.close()


def plain(state):
    """Write a snapshot as JSON and read it: what a checkpoint does."""
    return json.loads(json.dumps(asdict(state)))


def runs(env):
    return [slot.run for slot in env.slots]


def test_each_begins_where_its_task_is(tasks):
    """Navigate without obstacles; Push and Pick before the very thing they are to move."""
    for seed in range(3):
        for name, play in zip(NAMES, runs(tasks(seed=seed)), strict=True):
            if name == "navigate":
                assert not play.world.obstacles
                assert play.start is None
            else:
                target = play.world.target(pick=name == "pick")
                assert target in play.world.obstacles
                assert play.start is not None


def test_a_success_pays_once_for_each_object_and_a_failure_costs(tasks):
    task = tasks(("pick",))
    (play,) = runs(task)
    before = play.world.lattice.distance((play.world.i, play.world.j), play.world.goal)
    _, reward, *_ = task.step(np.array([PICKUP]))
    after = play.world.lattice.distance((play.world.i, play.world.j), play.world.goal)
    assert reward[0] == pytest.approx(STEP + 0.1 + interaction_reward(before, after))
    _, reward, *_ = task.step(np.array([PICKUP]))  # the hands are full
    assert reward[0] == pytest.approx(STEP - 0.1)
    drop = task.step(np.array([10]))
    assert drop[4]["action_success"][0]
    goal, here = play.world.goal, (play.world.i, play.world.j)
    before = play.world.lattice.distance(here, goal)
    again = task.step(np.array([PICKUP]))
    assert again[4]["action_success"][0]
    assert again[4]["target"][0] == drop[4]["target"][0], "the same thing"
    after = play.world.lattice.distance(here, goal)
    assert again[1][0] == pytest.approx(STEP + interaction_reward(before, after))


def test_done_pays_where_the_obstacle_is_out_of_the_way_and_only_there(tasks):
    paid = set()
    for seed in range(6):
        for acts in ([], [PICKUP]):
            task = tasks(("pick",), seed)
            (play,) = runs(task)
            here = play.start[:2]
            before = play.world.lattice.distance(here, play.world.goal)
            for action in acts:
                task.step(np.array([action]))
            after = play.world.lattice.distance(here, play.world.goal)
            cleared = after is not None and (before is None or after < before)
            _, reward, ended, _, infos = task.step(np.array([DONE]))
            assert ended[0]
            assert reward[0] == pytest.approx(STEP + SUCCESS * cleared)
            told = infos["metrics"]
            assert bool(told["success"][0]) == bool(told["success_pick"][0]) == cleared
            assert told["_success_pick"][0]
            assert "success_push" not in told
            paid.add((bool(acts), cleared))
    assert {(False, False), (True, True)} <= paid


def test_done_with_full_hands_at_the_goal_is_paid_once(tasks):
    task = tasks(("pick",), hands="real")
    (play,) = runs(task)
    task.step(np.array([PICKUP]))
    assert play.world.carrying
    play.world.i, play.world.j = play.world.goal
    _, reward, ended, _, infos = task.step(np.array([DONE]))
    assert infos["reason"][0] == "hands are full"
    assert reward[0] == pytest.approx(STEP + SUCCESS)
    assert ended[0], "else the next Done would be paid again"


def test_each_task_has_a_success_of_its_own(tasks):
    *_, infos = tasks().step(np.full(len(NAMES), DONE))
    for name in ("navigate", "push", "pick"):
        own = np.array(NAMES) == name
        np.testing.assert_array_equal(infos["metrics"][f"_success_{name}"], own)


def test_what_they_are_can_be_told_and_built_again(tasks):
    rng = np.random.default_rng(0)
    task = tasks(seed=3)
    others = len(ACTIONS) - 1
    chances = [0.02 if action == Action.DONE else 0.98 / others for action in ACTIONS]

    def live(some, steps, rng):
        seen, sums = [], []
        for _ in range(steps):
            acts = rng.choice(ACTIONS, size=6, p=chances)
            look, reward, ended, cut, _ = some.step(acts)
            seen.append({name: array.copy() for name, array in look.items()})
            sums.append(reward.copy())
            if (ended | cut).any():
                some.reset(options={"reset_mask": ended | cut})
        return seen, sums

    live(task, 60, rng)
    seen = {name: array.copy() for name, array in task.step(np.full(6, -1))[0].items()}
    states, other = task.state(), tasks(seed=99)
    look, _ = other.restore([EpisodeSnapshot.from_json(plain(state)) for state in states])
    for name, array in seen.items():
        np.testing.assert_array_equal(look[name], array)
    assert other.state() == states
    one, two = (live(some, 60, np.random.default_rng(1)) for some in (task, other))
    for mine, theirs in zip(one[0], two[0], strict=True):
        for name, array in mine.items():
            np.testing.assert_array_equal(theirs[name], array)
    np.testing.assert_array_equal(one[1], two[1])
    with pytest.raises(UsageError, match="expected 6"):
        other.restore(states[:3])


@pytest.mark.parametrize(
    "damage", [{"actions": None}, {"start": [1]}, {"seed": "x"}, {"position": None}]
)
def test_a_damaged_snapshot_is_refused(tasks, damage):
    (state,) = tasks(("push",)).state()
    with pytest.raises(CorruptDataError, match="no state of an environment"):
        EpisodeSnapshot.from_json({**plain(state), **damage})
    with pytest.raises(CorruptDataError, match="no state of an environment"):
        EpisodeSnapshot.from_json({})


def test_processes_have_the_same_tasks(scenes, tasks):
    whole = tasks(seed=2)
    two = InterNavProcesses(
        6, load_dataset(scenes, "train"), 2, 16, autoreset_mode="Disabled", max_steps=40, task=NAMES
    )
    try:
        seen, _ = two.reset(seed=2)
        assert two.state() == whole.state()
        for acts in ([0, 1, 5, 6, 9, 9], [DONE] * 6):
            ours, theirs = whole.step(np.array(acts)), two.step(np.array(acts))
            np.testing.assert_array_equal(ours[1], theirs[1])
            own, other = (infos.get("metrics", {}) for infos in (ours[4], theirs[4]))
            assert own.keys() == other.keys()
            for name, value in own.items():
                np.testing.assert_array_equal(value, other[name])
        assert own, "all have ended"
        seen, *_ = theirs
        np.testing.assert_array_equal(seen["rgb"], ours[0]["rgb"])
    finally:
        two.close()


def test_every_task_has_its_name_and_an_unknown_one_is_refused(scenes):
    for name, task in TASKS.items():
        assert task.name == name
    with pytest.raises(UsageError, match="task: expected one of"):
        InterNavVectorEnv(2, scenes, 16, task="wander")
    with pytest.raises(UsageError, match="or 2 of them"):
        InterNavVectorEnv(2, scenes, 16, task=["push"])


def test_a_share_of_the_environments_is_that_part_of_all(tasks):
    """Another rank's environments are those that one process would have had."""
    whole, part = tasks(seed=5), tasks(NAMES[3:], seed=5 + 3)
    for mine, theirs in zip(runs(whole)[3:], runs(part), strict=True):
        assert mine.episode.episode_id == theirs.episode.episode_id
        assert mine.start == theirs.start
    assert whole.state()[3:] == part.state()
    ours, theirs = whole.step(np.full(6, -1))[0], part.step(np.full(3, -1))[0]
    for name, array in ours.items():
        np.testing.assert_array_equal(array[3:], theirs[name])


def test_a_dataset_without_an_obstacle_to_push_is_refused(scenes):
    data = load_dataset(scenes, "train")
    plain = [e.episode_id for e in data if not any(o.pushable for o in e.obstacles)]
    assert plain
    data = load_dataset(scenes, "train", [("episode_id", "in", plain)])
    with pytest.raises(UsageError, match="no obstacle to learn to push"):
        InterNavVectorEnv(1, data, 16, task="push").reset(seed=0)
