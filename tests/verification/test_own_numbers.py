"""The validator's own numbers are those of the generator, name by name."""

import re

import pytest

from internav_data.core.field_docs import descriptions
from internav_data.houses import standards
from internav_data.physics import fall_clearance
from internav_data.physics.solving import PUSH_LIMIT_S
from internav_data.records import PUSH_SPECS, Material, Part
from internav_data.verification import houses, interactions, objects, ranges
from internav_data.verification.ranges import EPISODE_RULES
from internav_data.verification.replay import settling
from internav_data.verification.replay.expert_replay import TURNS
from internav_data.world.actions import ACTION_COUNT, ACTIONS, PUSHES, Action


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


@pytest.mark.parametrize("action", ACTIONS, ids=lambda action: action.label)
def test_the_replay_of_experts_knows_what_every_action_does(action):
    own = interactions
    known = {
        "move": {own.MOVE},
        "turn": set(TURNS),
        "look": {Action.LOOK_DOWN, Action.LOOK_UP},  # no pose changes, so the replay ignores them
        "push": set(own.PUSHES),
        "pick": {own.PICK},
        "drop": {own.DROP},
        "done": {own.DONE},
    }
    assert action in known[action.kind]
    assert TURNS.get(action, 0) == (action.quarter_turns if action.kind == "turn" else 0)


def test_the_validator_accepts_every_action_and_no_other():
    rule = EPISODE_RULES["expert.actions.element"]
    assert (rule.low, rule.high) == (0, ACTION_COUNT - 1)


def test_a_push_may_take_as_long_as_the_slowest_one():
    slowest = max(spec.seconds for spec in PUSH_SPECS.values())
    assert slowest + PUSH_LIMIT_S == ranges.MAX_PUSH_S


def test_the_validators_lengths_are_those_of_houses():
    assert houses.HALF_WALL_M == objects.HALF_WALL_M == standards.HALF_WALL_CM / 100
    assert objects.DOOR_CLEAR_M == standards.DOOR_CLEAR_CM / 100


def test_the_validator_lets_obstacles_fall_from_where_settling_does():
    assert settling.FALL_M == fall_clearance.DROP_M


def test_the_validators_surfaces_are_those_of_the_records():
    """The records' docstrings list them: "plain, planks … or bricks"."""
    for record, name, own in (
        (Material, "pattern", ranges.PATTERNS),
        (Part, "material", ranges.PART_MATERIALS),
    ):
        note = descriptions(record)[name]
        assert tuple(re.findall(r"\w+", note.replace(" or ", " "))) == own
