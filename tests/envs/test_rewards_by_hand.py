"""Rewards and metrics against arithmetic on paper."""

import pytest

from internav_data.envs.tasks import interaction_reward
from internav_data.records.errors import UsageError

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


def test_a_crate_is_carried_out_of_a_door(hand_play):
    play = hand_play(divided=True)
    assert play.world.steps() is None
    assert play.step(AHEAD).reward == pytest.approx(0.24), "3.0 m to 2.75 m, less the step"
    assert play.step(PICK).reward == pytest.approx(0.99), "the way is open"
    for _ in range(11):
        assert play.step(AHEAD) == (pytest.approx(0.24), False, False)
    assert play.step(DONE) == (pytest.approx(9.99), True, False)
    said = play.metrics()
    assert said["return"] == pytest.approx(12 * 0.24 + 0.99 + 9.99)
    assert said["success"]
    assert said["spl"] == pytest.approx(1.0)
    assert (said["steps"], said["path_m"]) == (14, pytest.approx(3.0))
    assert said["sts"] == pytest.approx(12 / 14)
    assert said["distance_to_goal_m"] == pytest.approx(0.0)
    assert (said["openings"], said["closings"], said["interaction_reward_m"]) == (1, 0, 0.0)
    with pytest.raises(UsageError, match="over"):
        play.step(AHEAD)


def test_opening_and_closing_a_way_earns_nothing(hand_play):
    play = hand_play(divided=True)
    rewards = [play.step(action).reward for action in (PICK, DROP, PICK, DROP)]
    assert rewards == pytest.approx([0.99, -1.01, 0.99, -1.01])
    assert (play.tally.openings, play.tally.closings) == (2, 2)
    assert play.metrics()["picks_done"] == play.metrics()["drops_done"] == 2


def test_a_shorter_way_earns_its_metres(hand_play):
    play = hand_play(divided=False)
    assert play.world.steps() == 20, "16 straight on, two up and two down round the crate"
    assert play.step(PICK).reward == pytest.approx(1.0 - 0.01)
    assert play.metrics()["interaction_reward_m"] == pytest.approx(1.0)
    assert play.metrics()["openings"] == 0


def test_failures_cost_a_step_and_are_counted(hand_play):
    play = hand_play(divided=True)
    assert play.step(DROP).reward == -0.01, "nothing in hand"
    assert play.step(PUSH_AHEAD).reward == -0.01, "a thing to carry is not pushed"
    assert play.step(WAIT).reward == -0.01
    for _ in range(2):
        play.step(LEFT)
    assert play.step(PICK).reward == -0.01, "behind the agent's back"
    said = play.metrics()
    assert [said[f"{kind}_tried"] for kind in ("pushes", "picks", "drops")] == [1, 1, 1]
    assert [said[f"{kind}_done"] for kind in ("pushes", "picks", "drops")] == [0, 0, 0]
    assert said["steps"] == 6


@pytest.mark.parametrize("option", [0.0, -1.0])
def test_a_failed_done_ends_the_episode(hand_play, option):
    play = hand_play(divided=True, failed_done_reward=option)
    assert play.step(DONE) == (pytest.approx(option - 0.01), True, False)
    said = play.metrics()
    assert (said["success"], said["spl"], said["sts"]) == (False, 0.0, 0.0)
    assert said["distance_to_goal_m"] == pytest.approx(3.0)


def test_moves_on_a_loop_add_up_to_nothing(hand_play):
    play = hand_play(divided=False)
    steps = [AHEAD, LEFT, AHEAD, LEFT, AHEAD, LEFT, AHEAD, LEFT]
    total = sum(play.step(action).reward for action in steps)
    assert total == pytest.approx(-0.01 * len(steps))
    assert play.metrics()["path_m"] == pytest.approx(1.0)


def test_a_crate_is_pushed_through_a_door_and_onto_the_goal(hand_play):
    play = hand_play(divided=True, pickable=False)
    pushes = []
    for _ in range(4):
        pushes.append(play.step(PUSH_AHEAD).reward)
        assert play.last.success
        play.step(AHEAD)
    # Twice it stays close behind the door, then it is out of the way, then it lies on the goal.
    assert pushes == pytest.approx([-0.01, -0.01, 0.99, -1.01])
    assert (play.tally.openings, play.tally.closings) == (1, 1)
    pose = play.world.items[0].pose
    assert play.props.poses[0, 9:].tolist() == [pose.x, pose.y, pose.z]


def test_the_last_step_cuts_off(hand_play):
    play = hand_play(divided=True, max_steps=3)
    assert [play.step(LEFT).truncated for _ in range(3)] == [False, False, True]
    play = hand_play(divided=True, max_steps=1)
    assert play.step(DONE) == (pytest.approx(-0.01), True, False), "it ended by itself"


@pytest.mark.parametrize("action", [12, -2, 99])
def test_there_are_twelve_actions(hand_play, action):
    with pytest.raises(UsageError, match="0 … 11"):
        hand_play(divided=True).step(action)


def test_the_goal_is_seen_from_the_agent(hand_play):
    play = hand_play(divided=True)
    bearings = []
    for _ in range(4):
        distance, bearing = play.polar()
        assert distance == pytest.approx(3.0)
        bearings.append(bearing)
        play.step(LEFT)
    half = 1.5707963267948966
    assert bearings == pytest.approx([0.0, -half, 2 * half, half]), "right is negative"


def test_the_camera_sees_what_is_carried_away(hand_play):
    play = hand_play(divided=True)
    play.step(PICK)
    assert play.props.present.tolist() == [0]
    play.step(DROP)
    assert play.props.present.tolist() == [1]
    pose = play.world.items[0].pose
    assert play.props.poses[0, 9:].tolist() == [pose.x, pose.y, pose.z]
