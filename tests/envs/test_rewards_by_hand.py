"""Rewards and metrics against arithmetic on paper."""

import pytest

from internav_data.envs.sensors import point_goal
from internav_data.envs.tasks import interaction_reward
from internav_data.records.errors import UsageError
from internav_data.world import ACTION_COUNT

AHEAD, LEFT, PICK, DROP, DONE, WAIT = 0, 1, 9, 10, 11, -1
PUSH_AHEAD = 5


@pytest.mark.parametrize(
    ("before", "after", "reward"),
    [
        (None, 12, 1.0),
        (12, None, -1.0),
        (None, None, 0.0),
        (20, 16, 1.0),
        (16, 20, -1.0),
        (7, 7, 0),
    ],
)
def test_interactions_pay_what_they_do_to_the_way(before, after, reward):
    assert interaction_reward(before, after) == reward


def test_a_crate_is_carried_out_of_a_door(hand_run):
    run = hand_run(divided=True)
    assert run.world.path_steps() is None
    assert run.step(AHEAD).reward == pytest.approx(0.24), "3.0 m to 2.75 m, less the step"
    assert run.step(PICK).reward == pytest.approx(0.99), "the way is open"
    for _ in range(11):
        assert run.step(AHEAD) == (pytest.approx(0.24), False, False)
    assert run.step(DONE) == (pytest.approx(9.99), True, False)
    said = run.task.metrics()
    assert said["return"] == pytest.approx(12 * 0.24 + 0.99 + 9.99)
    assert said["success"]
    assert said["spl"] == pytest.approx(1.0)
    assert (said["steps"], said["path_m"]) == (14, pytest.approx(3.0))
    assert said["sts"] == pytest.approx(12 / 14)
    assert said["distance_to_goal_m"] == pytest.approx(0.0)
    assert (said["openings"], said["closings"], said["interaction_reward_m"]) == (1, 0, 0.0)
    with pytest.raises(UsageError, match="over"):
        run.step(AHEAD)


def test_a_crate_that_is_heavier_than_its_asset_stays(hand_run):
    light, heavy = (hand_run(divided=True, pickable=False, mass_kg=kg) for kg in (5.0, 900.0))
    for run in (light, heavy):
        run.step(AHEAD)
        run.step(PUSH_AHEAD)
    assert light.last.success
    assert heavy.last.reason == "too heavy"
    assert heavy.task.metrics()["pushes_done"] == 0


def test_opening_and_closing_a_way_earns_nothing(hand_run):
    run = hand_run(divided=True)
    rewards = [run.step(action).reward for action in (PICK, DROP, PICK, DROP)]
    assert rewards == pytest.approx([0.99, -1.01, 0.99, -1.01])
    assert (run.task.statistics.openings, run.task.statistics.closings) == (2, 2)
    assert run.task.metrics()["picks_done"] == run.task.metrics()["drops_done"] == 2


def test_a_shorter_way_earns_its_metres(hand_run):
    run = hand_run(divided=False)
    assert run.world.path_steps() == 20, "16 straight on, two up and two down round the crate"
    assert run.step(PICK).reward == pytest.approx(1.0 - 0.01)
    assert run.task.metrics()["interaction_reward_m"] == pytest.approx(1.0)
    assert run.task.metrics()["openings"] == 0


def test_failures_cost_a_step_and_are_counted(hand_run):
    run = hand_run(divided=True)
    assert run.step(DROP).reward == -0.01, "nothing in hand"
    assert run.step(PUSH_AHEAD).reward == -0.01, "a thing to carry is not pushed"
    assert run.step(WAIT).reward == -0.01
    for _ in range(2):
        run.step(LEFT)
    assert run.step(PICK).reward == -0.01, "behind the agent's back"
    said = run.task.metrics()
    assert [said[f"{kind}_tried"] for kind in ("pushes", "picks", "drops")] == [1, 1, 1]
    assert [said[f"{kind}_done"] for kind in ("pushes", "picks", "drops")] == [0, 0, 0]
    assert said["steps"] == 6


@pytest.mark.parametrize("option", [0.0, -1.0])
def test_a_failed_done_ends_the_episode(hand_run, option):
    run = hand_run(divided=True, failed_done_reward=option)
    assert run.step(DONE) == (pytest.approx(option - 0.01), True, False)
    said = run.task.metrics()
    assert (said["success"], said["spl"], said["sts"]) == (False, 0.0, 0.0)
    assert said["distance_to_goal_m"] == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("steps", "spl"), [((DONE,), 1.0), ((LEFT, DONE), 1.0), ((AHEAD, LEFT, LEFT, AHEAD, DONE), 0.0)]
)
def test_spl_where_the_start_is_the_goal(hand_run, steps, spl):
    """0 / 0 is 1: nobody could do better. Moves away and back again make it 0."""
    run = hand_run(divided=False, start_i=20)
    for action in steps:
        run.step(action)
    said = run.task.metrics()
    assert (said["success"], said["spl"], said["sts"]) == (True, spl, 0.0)


def test_moves_on_a_loop_add_up_to_nothing(hand_run):
    run = hand_run(divided=False)
    steps = [AHEAD, LEFT, AHEAD, LEFT, AHEAD, LEFT, AHEAD, LEFT]
    total = sum(run.step(action).reward for action in steps)
    assert total == pytest.approx(-0.01 * len(steps))
    assert run.task.metrics()["path_m"] == pytest.approx(1.0)


def test_a_crate_is_pushed_through_a_door_and_onto_the_goal(hand_run):
    run = hand_run(divided=True, pickable=False)
    pushes = []
    for _ in range(4):
        pushes.append(run.step(PUSH_AHEAD).reward)
        assert run.last.success
        run.step(AHEAD)
    # Twice it stays close behind the door, then it is out of the way, then it lies on the goal.
    assert pushes == pytest.approx([-0.01, -0.01, 0.99, -1.01])
    assert (run.task.statistics.openings, run.task.statistics.closings) == (1, 1)
    pose = run.world.items[0].pose
    assert run.props.poses[0, 9:].tolist() == [pose.x, pose.y, pose.z]


def test_the_last_step_cuts_off(hand_run):
    run = hand_run(divided=True, max_steps=3)
    assert [run.step(LEFT).truncated for _ in range(3)] == [False, False, True]
    run = hand_run(divided=True, max_steps=1)
    assert run.step(DONE) == (pytest.approx(-0.01), True, False), "it ended by itself"


@pytest.mark.parametrize("action", [ACTION_COUNT, -2, 99])
def test_an_action_outside_the_table_is_refused(hand_run, action):
    with pytest.raises(UsageError, match=f"0 … {ACTION_COUNT - 1}"):
        hand_run(divided=True).step(action)


def test_the_goal_is_seen_from_the_agent(hand_run):
    run = hand_run(divided=True)
    bearings = []
    for _ in range(4):
        distance, bearing = point_goal(run.world)
        assert distance == pytest.approx(3.0)
        bearings.append(bearing)
        run.step(LEFT)
    half = 1.5707963267948966
    assert bearings == pytest.approx([0.0, -half, 2 * half, half]), "right is negative"


def test_the_camera_sees_what_is_carried_away(hand_run):
    run = hand_run(divided=True)
    run.step(PICK)
    assert run.props.present.tolist() == [0]
    run.step(DROP)
    assert run.props.present.tolist() == [1]
    pose = run.world.items[0].pose
    assert run.props.poses[0, 9:].tolist() == [pose.x, pose.y, pose.z]
