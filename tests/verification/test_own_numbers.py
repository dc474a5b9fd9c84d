"""The validator's own numbers are those of the generator, name by name."""

import pytest

from internav_data.houses import standards
from internav_data.verification import houses, interactions, objects
from internav_data.verification.ranges import EPISODE_RULES
from internav_data.world.actions import ACTION_COUNT, PUSHES, Action


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("MOVE", Action.MOVE_AHEAD),
        ("ROTATE_LEFT", Action.ROTATE_LEFT),
        ("ROTATE_RIGHT", Action.ROTATE_RIGHT),
        ("PUSHES", PUSHES),
        ("PICK", Action.PICKUP),
        ("DROP", Action.DROP),
        ("DONE", Action.DONE),
        ("ACTIONS", ACTION_COUNT),
    ],
)
def test_the_validators_actions_are_those_of_the_world(name, number):
    assert getattr(interactions, name) == number


def test_the_validator_accepts_every_action_and_no_other():
    rule = EPISODE_RULES["expert.actions.element"]
    assert (rule.low, rule.high) == (0, ACTION_COUNT - 1)


def test_the_validators_lengths_are_those_of_houses():
    assert houses.HALF_WALL_M == objects.HALF_WALL_M == standards.HALF_WALL_CM / 100
    assert objects.DOOR_CLEAR_M == standards.DOOR_CLEAR_CM / 100
