"""The auxiliary tasks: where they begin, what they pay, and that they can be built again."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from internav_data.camp.agents.options import NAVIGATE, PICK, PUSH  # noqa: E402
from internav_data.camp.auxiliary_tasks import AuxiliaryTasks  # noqa: E402
from internav_data.dataset import load_dataset  # noqa: E402
from internav_data.envs.tasks import STEP, SUCCESS, interaction_reward  # noqa: E402
from internav_data.records.errors import CorruptDataError, UsageError  # noqa: E402

AHEAD, PUSH_AHEAD, PICKUP, DONE = 0, 5, 9, 11
TASKS = (NAVIGATE, NAVIGATE, PUSH, PUSH, PICK, PICK)


@pytest.fixture
def tasks(scenes):
    made = []

    def make(options=TASKS, seed=0, **arguments):
        data = load_dataset(scenes, "train")
        made.append(AuxiliaryTasks(data, options, image_size=16, max_steps=40, **arguments))
        made[-1].begin(seed)
        return made[-1]

    yield make
    for each in made:
        each.close()


def plays(task):
    return [slot.run for _, _, env in task._parts for slot in env.slots]


def test_each_begins_where_its_task_is(tasks):
    """Navigate without obstacles; Push and Pick before the very thing they are to move."""
    for seed in range(3):
        for option, play in zip(TASKS, plays(tasks(seed=seed)), strict=True):
            if option == NAVIGATE:
                assert not play.world.obstacles
                assert play.start is None
            else:
                target = play.world.target(pick=option == PICK)
                assert target in play.world.obstacles
                assert play.start is not None


def test_a_success_pays_once_for_each_object_and_a_failure_costs(tasks):
    task = tasks((PICK,))
    (play,) = plays(task)
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
    assert task._notes[0]["paid"] == [int(again[4]["target"][0])], "the same thing"
    after = play.world.lattice.distance(here, goal)
    assert again[1][0] == pytest.approx(STEP + interaction_reward(before, after))


def test_done_pays_where_the_obstacle_is_out_of_the_way_and_only_there(tasks):
    paid = set()
    for seed in range(6):
        for acts in ([], [PICKUP]):
            task = tasks((PICK,), seed)
            (play,) = plays(task)
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
            assert not told["_success_push"][0]
            paid.add((bool(acts), cleared))
    assert {(False, False), (True, True)} <= paid


def test_what_they_are_can_be_told_and_built_again(tasks):
    rng = np.random.default_rng(0)
    task = tasks(seed=3)

    def live(some, steps, rng):
        seen, sums = [], []
        for _ in range(steps):
            acts = rng.choice(12, size=6, p=np.r_[np.full(11, 0.98 / 11), 0.02])
            look, reward, ended, cut, _ = some.step(acts)
            seen.append({name: array.copy() for name, array in look.items()})
            sums.append(reward.copy())
            if (ended | cut).any():
                some.reset(options={"reset_mask": ended | cut})
        return seen, sums

    live(task, 60, rng)
    states, other = task.state(), tasks(seed=99)
    look = other.restore(states)
    for name, array in task._seen.items():
        np.testing.assert_array_equal(look[name], array)
    assert other.state() == states
    one, two = (live(some, 60, np.random.default_rng(1)) for some in (task, other))
    for mine, theirs in zip(one[0], two[0], strict=True):
        for name, array in mine.items():
            np.testing.assert_array_equal(theirs[name], array)
    np.testing.assert_array_equal(one[1], two[1])
    with pytest.raises(CorruptDataError, match="expected 6"):
        other.restore(states[:3])


def test_a_share_of_the_environments_is_that_part_of_all(tasks):
    """Another rank's environments are those that one process would have had."""
    whole, part = tasks(seed=5), tasks(TASKS[3:], seed=5 + 3)
    for mine, theirs in zip(plays(whole)[3:], plays(part), strict=True):
        assert mine.episode.episode_id == theirs.episode.episode_id
        assert mine.start == theirs.start
    for name, array in whole._seen.items():
        np.testing.assert_array_equal(array[3:], part._seen[name])
    kept = [{**state} for state in whole.state()[3:]]
    assert [state["order"] for state in kept] == [state["order"] for state in part.state()]


def test_who_has_nothing_to_learn_from_is_told(scenes):
    data = load_dataset(scenes, "train", [("obstacle_count", "<", 0)])
    with pytest.raises(UsageError):
        AuxiliaryTasks(data, (PUSH,), image_size=16).begin(0)
