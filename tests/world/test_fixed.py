"""An object that can neither be pushed nor picked up stays where it is, whatever strikes it."""

from dataclasses import replace

import pytest
from builders import UPRIGHT, crate

from internav_data.episodes.outcomes import outcomes_of
from internav_data.physics import Body
from internav_data.planner.search import solve
from internav_data.records import Pose
from internav_data.world import Action, HouseModel, World

CRATE = crate("Crate_0", (0.3, 0.3, 0.3), mass_kg=4.0, friction=0.4)
LIGHT = CRATE.dynamics
BOLTED = replace(LIGHT, pushable=False)
HERE, AHEAD = Pose(3.75, 1.0, 0.001, UPRIGHT), Pose(4.25, 1.0, 0.001, UPRIGHT)


def world(hand_house, ahead):
    bodies = [Body(CRATE, HERE, LIGHT), Body(CRATE, AHEAD, ahead)]
    return World(HouseModel.of(hand_house), bodies, (12, 4, 0), (28, 4))


@pytest.fixture
def loose(hand_house):
    return world(hand_house, LIGHT)


@pytest.fixture
def bolted(hand_house):
    return world(hand_house, BOLTED)


def test_a_bolted_obstacle_in_the_way_of_a_push_never_moves(loose, bolted):
    first, second = bolted.obstacles
    for agent in (True, False):
        stopped = bolted.simulate_push(first, 0, agent=agent)
        assert stopped.moved == ()
        assert stopped.pose.x + 0.15 < AHEAD.x - 0.15 + 0.002, "it ends before the bolted one"
        assert loose.simulate_push(first, 0, agent=agent).moved != ()
    assert bolted.count_movers(first, 0) == 0 < loose.count_movers(first, 0)
    result = bolted.step(Action.PUSH_AHEAD)
    assert result.success
    assert [key for key, _ in result.moved] == [first]
    assert bolted.items[second].pose == AHEAD


def test_a_push_at_a_bolted_obstacle_itself_moves_nothing(bolted):
    _, second = bolted.obstacles
    refused = bolted.simulate_push(second, 0)
    assert (refused.success, refused.reason, refused.pose) == (False, "too heavy", AHEAD)
    assert bolted.count_movers(second, 0) == 0


def test_no_outcome_and_no_expert_moves_a_bolted_obstacle(bolted):
    _, second = bolted.obstacles
    outcomes = outcomes_of(bolted)
    assert all(o.moved in {None, ()} for of_one in outcomes for o in of_one)
    assert {o.reason for o in outcomes[1]} == {"not pushable", "not pickable"}
    plan = solve(bolted)
    assert plan is not None
    there = bolted.copy()
    for action in plan.actions:
        assert there.step(action).success
        assert there.items[second].pose == AHEAD


def test_what_can_be_picked_up_alone_is_struck_aside(hand_house):
    pickable = replace(LIGHT, pushable=False, pickable=True)
    struck = world(hand_house, pickable)
    assert [k for k, _ in struck.simulate_push(struck.obstacles[0], 0).moved] == [
        struck.obstacles[1]
    ]
