"""Outcomes and experts that cannot be, whatever physics says."""

from dataclasses import replace

import physical
import pytest
from builders import UPRIGHT
from scenery import write_dataset

from internav_data.records import MovedObject, Pose
from internav_data.verification import validate
from internav_data.verification.findings import FindingCollector
from internav_data.verification.interactions import check_interactions
from internav_data.world.actions import ACTION_COUNT


@pytest.fixture(scope="module")
def scenes():
    return physical.physical_scenes()


def judged(episode, *, solvable=False):
    report = FindingCollector()
    check_interactions(episode, report, solvable=solvable)
    return {name.removeprefix("schema.episodes.") for name in report.by_predicate}


def with_outcome(episode, shard_ref, number=0, /, **changes):
    obstacles = list(episode.obstacles)
    five = list(obstacles[number].outcomes)
    five[shard_ref] = replace(five[shard_ref], **changes)
    obstacles[number] = replace(obstacles[number], outcomes=tuple(five))
    return replace(episode, obstacles=tuple(obstacles))


def test_true_ones_pass(scenes):
    for _, episodes in scenes:
        for episode in episodes:
            assert judged(episode, solvable=True) == set()


SPOT = Pose(1.0, 1.0, 0.0, UPRIGHT)
# scene, episode, place among the five, obstacle, changes
OUTCOMES = {
    "order": ((0, 0, 0, 0, {"action": "push_south"}), "outcomes.order"),
    "reason of another kind": (
        (0, 0, 4, 0, {"reason": "something is in the way"}),
        "outcomes.reason",
    ),
    "no reason": ((2, 0, 0, 0, {"reason": ""}), "outcomes.success"),
    "a reason for success": ((0, 0, 0, 0, {"reason": "too heavy"}), "outcomes.success"),
    "pushable after all": (
        (2, 0, 0, 0, {"reason": "not pushable", "seconds": 0.0}),
        "outcomes.able",
    ),
    "not pickable after all": (
        (0, 0, 4, 0, {"success": True, "reason": ""}),
        "outcomes.able",
    ),
    "hardly moved": ((0, 0, 2, 0, {"displacement_m": 0.04}), "outcomes.displacement"),
    "moved though it failed": ((2, 0, 0, 0, {"displacement_m": 0.2}), "outcomes.displacement"),
    "picking moves": ((2, 0, 4, 1, {"displacement_m": 0.1}), "outcomes.displacement"),
    "picking takes time": ((2, 0, 4, 1, {"seconds": 0.1}), "outcomes.seconds"),
    "pushing takes none": ((0, 0, 2, 0, {"seconds": 0.0}), "outcomes.seconds"),
    "not opened": ((0, 0, 2, 0, {"opened": False}), "outcomes.opened"),
    "opened what was open": ((0, 1, 0, 0, {"opened": True}), "outcomes.opened"),
    "changed though it failed": ((2, 0, 0, 0, {"path_m_after": 6.5}), "outcomes.unchanged"),
    "steps though it failed": ((0, 1, 4, 0, {"path_steps_after": 27}), "outcomes.unchanged"),
    "longer than the lattice": ((0, 0, 2, 0, {"path_m_after": 8.1}), "outcomes.path_m_after"),
    "shorter than straight": ((0, 0, 2, 0, {"path_m_after": 5.9}), "outcomes.path_m_after"),
    "no way off the lattice": ((0, 0, 2, 0, {"path_m_after": None}), "outcomes.path_m_after"),
    "fewer steps than on clear ground": (
        (2, 0, 4, 1, {"path_steps_after": 22}),
        "outcomes.path_steps_after",
    ),
    "pushed nowhere": ((0, 0, 2, 0, {"pose": None}), "outcomes.pose"),
    "a pose though it failed": ((2, 0, 0, 0, {"pose": SPOT}), "outcomes.pose"),
    "a pose in the hand": ((2, 0, 4, 1, {"pose": SPOT}), "outcomes.pose"),
    "a pose and nothing about others": (
        (0, 0, 2, 0, {"moved": None, "at_rest": None}),
        "outcomes.pose",
    ),
    "no word on rest": ((0, 0, 2, 0, {"at_rest": None}), "outcomes.at_rest"),
    "restless though nobody pushed": ((2, 0, 4, 1, {"at_rest": False}), "outcomes.at_rest"),
    "others moved though it failed": (
        (2, 0, 0, 0, {"moved": (MovedObject(1, None, SPOT),)}),
        "outcomes.moved",
    ),
    "it is among the others": (
        (2, 0, 1, 1, {"moved": (MovedObject(1, None, SPOT),)}),
        "outcomes.moved",
    ),
    "no such obstacle": ((2, 0, 1, 1, {"moved": (MovedObject(2, None, SPOT),)}), "outcomes.moved"),
    "no object": ((2, 0, 1, 1, {"moved": (MovedObject(None, None, SPOT),)}), "outcomes.moved"),
    "two objects in one": ((2, 0, 1, 1, {"moved": (MovedObject(0, 1, SPOT),)}), "outcomes.moved"),
    "an object twice": (
        (2, 0, 1, 1, {"moved": (MovedObject(None, 1, SPOT),) * 2}),
        "outcomes.moved",
    ),
    "obstacles first": (
        (2, 0, 1, 1, {"moved": (MovedObject(0, None, SPOT), MovedObject(None, 1, SPOT))}),
        "outcomes.moved",
    ),
}


@pytest.mark.parametrize(("scene", "light"), [(0, True), (2, False)])
def test_an_obstacle_is_movable_unless_all_its_pushes_find_it_too_heavy(scenes, scene, light):
    episode = scenes[scene][1][0]
    first, *others = episode.obstacles
    for movable, predicates in ((light, set()), (None, set()), (not light, {"outcomes.movable"})):
        stated = (replace(first, movable=movable), *others)
        assert judged(replace(episode, obstacles=stated)) == predicates


@pytest.mark.parametrize("case", OUTCOMES)
def test_outcome_cannot_be(scenes, case):
    (scene, index, shard_ref, number, changes), predicate = OUTCOMES[case]
    episode = with_outcome(scenes[scene][1][index], shard_ref, number, **changes)
    assert predicate in judged(episode)


def test_outcomes_of_earlier_releases_say_nothing_about_poses(scenes):
    for _, episodes in scenes:
        for episode in episodes:
            bare = [
                replace(
                    obstacle,
                    outcomes=tuple(
                        replace(outcome, pose=None, moved=None, at_rest=None)
                        for outcome in obstacle.outcomes
                    ),
                )
                for obstacle in episode.obstacles
            ]
            assert judged(replace(episode, obstacles=tuple(bare)), solvable=True) == set()


def test_a_longer_way_once_something_is_gone(scenes):
    box = scenes[0][1][1].obstacles[0]
    gone = replace(
        box.outcomes[4],
        success=True,
        reason="",
        path_steps_after=30,
        path_m_after=6.4,
        displacement_m=0.0,
    )
    light = replace(box, pickable=True, outcomes=(*box.outcomes[:4], gone))
    episode = replace(scenes[0][1][1], obstacles=(light,))
    assert judged(episode) == {"outcomes.path_m_after", "outcomes.path_steps_after"}


def test_outcomes_of_some_obstacles_only(scenes):
    episode = scenes[2][1][0]
    some = (replace(episode.obstacles[0], outcomes=None), *episode.obstacles[1:])
    assert judged(replace(episode, obstacles=some)) == {"outcomes.all"}


@pytest.mark.parametrize("swept", [(1.0, 1.0, 1.0), (1.0,) * 5, ()])
def test_boxes_have_four_sides(scenes, swept):
    episode = scenes[0][1][0]
    pushed = next(k for k, o in enumerate(episode.obstacles[0].outcomes) if o.success)
    assert judged(with_outcome(episode, pushed, swept=swept)) == {"outcomes.swept"}
    pick = len(episode.obstacles[0].outcomes) - 1
    assert "outcomes.swept" in judged(with_outcome(episode, pick, swept=(1.0,) * 4))


REACHES = {
    "of another first push": ({"reach_m": (0.31, 0.5)}, "reach_m"),
    "of none": ({"reach_m": ()}, "reach_m"),
    "too many": ({"reach_m": (0.3,) * 5}, "reach_m"),
    "opened before": ({"reach_m": (0.3, 0.5), "reach_opened": 0}, "reach_opened"),
    "opened after": ({"reach_m": (0.3, 0.5), "reach_opened": 3}, "reach_opened"),
    "opened at once, or not": ({"reach_m": (0.3, 0.5), "reach_opened": 1}, "reach_opened"),
    "opened without a distance": ({"reach_opened": 2}, "reach_opened"),
}


@pytest.mark.parametrize("case", REACHES)
def test_pushes_in_a_row_cannot_be(scenes, case):
    changes, predicate = REACHES[case]
    episode = scenes[0][1][0]
    number = next(
        k for k, o in enumerate(episode.obstacles[0].outcomes) if o.success and not o.opened
    )
    right = {"displacement_m": 0.3, "reach_m": (0.3, 0.5), "reach_opened": 2}
    assert judged(with_outcome(episode, number, **right)) == set()
    wrong = {"displacement_m": 0.3, "reach_m": None, "reach_opened": None} | changes
    assert f"outcomes.{predicate}" in judged(with_outcome(episode, number, **wrong))


EXPERTS = {
    "unknown action": (
        lambda e: {"actions": (ACTION_COUNT, *e.actions), "steps": e.steps + 1},
        "actions",
    ),
    "nothing done": (lambda _: {"actions": (), "steps": 0, "pushes": 0, "path_m": 0.0}, "actions"),
    "too much done": (
        lambda e: {"actions": (1, 1) * 250 + e.actions, "steps": e.steps + 500},
        "actions",
    ),
    "not done": (lambda e: {"actions": e.actions[:-1], "steps": e.steps - 1}, "done"),
    "done twice": (lambda e: {"actions": (11, *e.actions), "steps": e.steps + 1}, "done"),
    "steps": (lambda e: {"steps": e.steps + 1}, "steps"),
    "pushes": (lambda e: {"pushes": e.pushes + 1}, "pushes"),
    "picks": (lambda e: {"picks": e.picks + 1}, "picks"),
    "path": (lambda e: {"path_m": e.path_m + 0.25}, "path_m"),
    "dropped unpicked": (lambda e: {"actions": (10, *e.actions), "steps": e.steps + 1}, "hands"),
}


@pytest.mark.parametrize("case", EXPERTS)
def test_expert_cannot_be(scenes, case):
    change, predicate = EXPERTS[case]
    expert = scenes[0][1][0].expert
    episode = replace(scenes[0][1][0], expert=replace(expert, **change(expert)))
    assert f"expert.{predicate}" in judged(episode)


@pytest.mark.parametrize("case", [name for name in EXPERTS if name != "dropped unpicked"])
def test_blind_expert_cannot_be(scenes, case):
    change, predicate = EXPERTS[case]
    expert = scenes[0][1][0].expert
    blind = replace(scenes[0][1][0], blind_expert=expert)
    assert judged(blind) == set()
    episode = replace(blind, blind_expert=replace(expert, **change(expert)))
    assert f"blind_expert.{predicate}" in judged(episode)


def test_a_blind_expert_may_fail_to_drop(scenes):
    expert = scenes[0][1][0].expert
    failing = replace(expert, actions=(10, *expert.actions), steps=expert.steps + 1)
    assert judged(replace(scenes[0][1][0], blind_expert=failing)) == set()


def test_two_picks_without_a_drop(scenes):
    expert = scenes[2][1][0].expert
    twice = replace(expert, actions=(9, *expert.actions), steps=expert.steps + 1, picks=2)
    assert judged(replace(scenes[2][1][0], expert=twice)) == {"expert.hands"}


def test_a_missing_expert_is_untrue_where_one_was_promised(tmp_path, scenes):
    house, episodes = scenes[0]
    bare = [(house, [replace(episodes[0], expert=None), episodes[1]]), *scenes[1:]]
    for keep, untrue in ((False, {"schema.episodes.expert.present"}), (True, set())):
        root = tmp_path / str(keep)
        write_dataset(root, bare, config={"episodes": {"keep_unsolvable": keep}})
        assert set(validate(root, "schema").by_predicate) == untrue


RANGES = {
    "reason": (lambda e: with_outcome(e, 0, reason="no luck"), "outcomes.element.reason"),
    "action": (lambda e: with_outcome(e, 0, action="kick_east"), "outcomes.element.action"),
    "seconds": (lambda e: with_outcome(e, 0, seconds=11.1), "outcomes.element.seconds"),
    "unrounded": (
        lambda e: with_outcome(e, 0, path_m_after=6.12345678),
        "outcomes.element.path_m_after",
    ),
    "an unrounded pose": (
        lambda e: with_outcome(e, 0, pose=replace(SPOT, x=1.00004)),
        "outcomes.element.pose.x",
    ),
    "a pose far away": (
        lambda e: with_outcome(e, 0, pose=replace(SPOT, y=251.0)),
        "outcomes.element.pose.y",
    ),
    "no rotation": (
        lambda e: with_outcome(e, 0, pose=replace(SPOT, quaternion=(0.0, 0.0, 0.5, 0.5))),
        "outcomes.element.pose.quaternion",
    ),
    "another's no rotation": (
        lambda e: with_outcome(
            e,
            0,
            moved=(MovedObject(None, 1, replace(SPOT, quaternion=(0.0, 0.0, 0.0, 0.9))),),
        ),
        "outcomes.element.moved.element.pose.quaternion",
    ),
}


@pytest.mark.parametrize("case", RANGES)
def test_value_out_of_its_range(tmp_path, scenes, case):
    change, column = RANGES[case]
    house, episodes = scenes[0]
    write_dataset(tmp_path, [(house, [change(episodes[0]), episodes[1]]), *scenes[1:]])
    found = validate(tmp_path, "schema").by_predicate
    assert f"schema.episodes.obstacles.element.{column}" in found
