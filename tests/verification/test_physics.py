"""Settling, outcomes and experts are changed one at a time; playing them again must find it."""

import math
import struct
import subprocess
import sys
from dataclasses import replace
from functools import cache

import physical
import pytest
import scenery
from builders import UPRIGHT, asset, by_id, obstacle, part, scene_object, screen, yaw
from hypothesis import given, settings
from hypothesis import strategies as st
from scenery import ASSETS, Grid, brute_steps, write_dataset

import internav_data.world.world
from internav_data.navigation import Lattice
from internav_data.physics import Body, engines, wall_body
from internav_data.physics.fall_clearance import fall_clearance
from internav_data.physics.narrow_phase import joined_prisms, prisms_of
from internav_data.physics.result_cache import ResultCache
from internav_data.records import Pose
from internav_data.records.errors import CorruptDataError
from internav_data.verification import validate
from internav_data.verification.checked_config import CheckedConfig
from internav_data.verification.checked_layout import CheckedLayout
from internav_data.verification.checked_path import CheckedPath
from internav_data.verification.findings import FindingCollector
from internav_data.verification.interactions import check_interactions
from internav_data.verification.replay import CheckedScene, replay_episode, settling
from internav_data.verification.replay.outcomes import OutcomeCheck
from internav_data.verification.scenes import check_scene
from internav_data.verification.shapes import Shapes
from internav_data.world import MovableObject, World, WorldConfig

FORCE = CheckedConfig()


@pytest.fixture(scope="module")
def scenes():
    return physical.physical_scenes()


def judged(tmp_path, scenes, level="physics", assets=None, config=None, **options):
    write_dataset(tmp_path / "ds", scenes, assets, config)
    return validate(tmp_path / "ds", level, **options)


def test_nothing_that_is_kept_on_disk_is_believed(tmp_path, monkeypatch, scenes):
    def keep_in(held):
        monkeypatch.setattr("internav_data.physics.registry.result_cache", lambda: held)
        return held

    held = keep_in(ResultCache(tmp_path))
    assert physical.physical_scenes() == scenes
    assert held.count() > 10

    class Lying(ResultCache):
        def get(self, key):
            value = super().get(key)
            if value is None or len(value) < 120:  # a fall
                return value
            (seconds,) = struct.unpack_from("<d", value)
            return struct.pack("<d", seconds + 1.0) + value[8:]

    keep_in(Lying(tmp_path))
    assert physical.physical_scenes() != scenes  # who makes data does believe it
    for scene, (_, episodes) in enumerate(scenes):
        for index in range(len(episodes)):
            assert found_in(scenes, scene, index) == set()


def changed(scenes, scene, index, /, **changes):
    house, episodes = scenes[scene]
    episodes = list(episodes)
    episodes[index] = replace(episodes[index], **changes)
    return [*scenes[:scene], (house, episodes), *scenes[scene + 1 :]]


def found_in(scenes, scene, index, assets=None):
    """Predicates found in one episode, as read back: schema's interactions, geometry, physics."""
    house, episodes = scenes[scene]
    report = check_scene(house, episodes[index : index + 1], Shapes(assets or ASSETS), "", FORCE)
    check_interactions(episodes[index], report, solvable=True)
    assert {f.episode for f in report.found} <= {f"scene-{scene:06d}/{index:04d}"}
    return set(report.by_predicate)


def obstacle_changed(scenes, scene, index, number=0, **changes):
    """Change an obstacle, and the maxima that follow from it."""
    episode = scenes[scene][1][index]
    obstacles = list(episode.obstacles)
    obstacles[number] = replace(obstacles[number], **changes)
    physics = replace(
        episode.physics,
        settle_s=max(o.settle_s for o in obstacles),
        penetration_m=max(o.settle_penetration_m for o in obstacles),
    )
    return changed(scenes, scene, index, obstacles=tuple(obstacles), physics=physics)


def outcome_changed(scenes, scene, index, action, number=0, **changes):
    obstacle = scenes[scene][1][index].obstacles[number]
    outcomes = tuple(
        replace(one, **changes) if one.action == action else one for one in obstacle.outcomes
    )
    return obstacle_changed(scenes, scene, index, number, outcomes=outcomes)


def expert_changed(scenes, scene, index, edit):
    """Edit an expert's actions; its counts are kept true."""
    expert = scenes[scene][1][index].expert
    actions = tuple(edit(list(expert.actions)))
    expert = replace(
        expert,
        actions=actions,
        steps=len(actions),
        pushes=sum(5 <= a <= 8 for a in actions),
        picks=actions.count(9),
        path_m=0.25 * actions.count(0),
    )
    return changed(scenes, scene, index, expert=expert)


def test_scenes_hold_what_the_tests_need(scenes):
    # 0: a bar in a door, opened by pushing; 2: a safe too heavy, a pot to pick up, furniture moved.
    reasons = {o.reason for _, es in scenes for e in es for b in e.obstacles for o in b.outcomes}
    assert reasons == {"", "too heavy", "not pickable"}
    assert scenes[0][1][0].obstacles[0].outcomes[2].opened
    assert scenes[2][1][0].obstacles[1].outcomes[4].opened
    assert scenes[2][1][0].expert.picks == 1
    assert scenes[0][1][0].expert.pushes > 0
    stage = physical.HouseModel.of(replace(scenes[2][0], assets=ASSETS))
    world = World.of_episode(stage, scenes[2][1][0], ASSETS)
    assert [k for k, _ in world.simulate_push(2, 1, agent=False).moved] == [0]
    assert stage.object_ids[0] == 1


def test_an_obstacle_is_replayed_with_its_stored_mass(scenes):
    """Geometry compares the mass with the asset's; physics plays the stored one."""
    house, (first, *_) = scenes[0]
    bar = replace(first.obstacles[0], mass_kg=900.0)
    heavier = replace(first, obstacles=(bar, *first.obstacles[1:]))
    played = physical.played(house, heavier)
    assert {o.reason for o in played.obstacles[0].outcomes[:4]} == {"too heavy"}
    assert played.expert is None

    def replayed(episode):
        report = FindingCollector("episodes", house.scene_id)
        replay_episode(CheckedScene(CheckedLayout(house, Shapes(ASSETS)), FORCE), episode, report)
        return set(report.by_predicate)

    assert replayed(first) == replayed(played) == set()
    assert replayed(heavier) >= {"physics.outcome-success", "physics.expert-action"}


def test_what_is_true_is_valid(tmp_path, scenes):
    findings = judged(tmp_path, scenes)
    assert findings.ok, findings.summary()
    assert findings.level == "physics"
    assert findings.checked["replayed"] == findings.checked["episodes"] == 6
    assert findings.notes == {}


def test_workers_and_sample_change_nothing(tmp_path, scenes, monkeypatch):
    wrong = outcome_changed(scenes, 2, 0, "push_east", number=1, seconds=1.0)
    told = []
    alone = judged(tmp_path, wrong, progress=lambda *step: told.append(step))
    assert set(alone.by_predicate) == {"physics.outcome-seconds"}
    assert told[-1] == ("physics", 3, 3)
    monkeypatch.setattr("internav_data.verification.levels.SCENES_A_UNIT", 1)
    assert validate(tmp_path / "ds", "physics", workers=2) == alone
    sample = validate(tmp_path / "ds", "physics", sample=1)
    assert sample.checked["scenes"] == 1
    assert sample.checked["replayed"] == 2
    assert sample == validate(tmp_path / "ds", "physics", sample=1)


SETTLING = {
    "higher": ({"z": 0.0021}, "physics.settle-pose"),
    "leaning": ({"quaternion": (0.001, 0.0, 0.707107, 0.707106)}, "physics.settle-pose"),
    "turned": ({"quaternion": (0.0, 0.0, 0.713251, 0.70091)}, "physics.settle-pose"),
    "later": ({"settle_s": 0.5}, "physics.settle-time"),
    "deeper": ({"settle_penetration_m": 0.001}, "physics.settle-depth"),
}
FROM_ANOTHER_START = {
    "leaning": {"outcome.displacement", "outcome.swept"},
    "turned": {"outcome.swept"},
}
"""What stored outcomes say that is not true of pushes from the changed pose."""


@pytest.mark.parametrize("case", SETTLING)
def test_settled_otherwise(scenes, case):
    changes, predicate = SETTLING[case]
    found = found_in(obstacle_changed(scenes, 0, 0, **changes), 0, 0)
    assert predicate in found
    other = {name for name in found if not name.startswith("physics.")}
    assert other == FROM_ANOTHER_START.get(case, set())


@cache
def scene_with_screens():
    """A house whose gap is 0.2 m, and all that stands in it: walls, furniture, one screen."""
    assets = by_id(*ASSETS.values(), screen())
    house = replace(physical.crowded_house(), assets=assets)
    scene = CheckedScene(CheckedLayout(house, Shapes(assets)), CheckedConfig(gap_m=0.2))
    bodies = [wall_body(wall) for wall in house.walls]
    bodies += [Body.of(assets[o.asset_id], o.pose) for o in house.objects]
    return scene, [*bodies, Body.of(screen(), Pose(3.0, 2.0, 0.0, UPRIGHT))]


@settings(max_examples=40)
@given(st.integers(500, 7400), st.integers(300, 3700), st.integers(0, 23))
def test_a_falls_clearance_is_that_of_the_generator(x, y, turn):
    """Two codes, one distance: all parts count, those below 2 cm too."""
    scene, bodies = scene_with_screens()
    spot = Pose(x / 1000, y / 1000, 0.0, yaw(15 * turn))
    solid = joined_prisms([prisms_of(body.asset, body.pose) for body in bodies])
    theirs = fall_clearance(prisms_of(screen(), spot), solid, 0.2)
    mine = settling.clearance_m(scene, "Screen_0", spot, bodies[-1:])
    assert mine == pytest.approx(theirs, abs=settling.SPOT_M)


def test_a_foot_in_a_wall_does_not_fall_freely(scenes):
    """Its certificate would be that of a free fall if footprints alone were asked."""
    assets = by_id(*ASSETS.values(), screen())
    house, episodes = scenes[0]
    scene = CheckedScene(CheckedLayout(house, Shapes(assets)), FORCE)

    def fallen(y):
        one = obstacle(screen(), 2.9, y)
        return settling.fall_again(scene, replace(episodes[0], obstacles=(one,)), 0)

    free, inside = fallen(1.0), fallen(0.18)
    assert not free.refusal
    assert inside.refusal or inside.penetration_m != free.penetration_m


def test_what_topples_was_not_settled(scenes):
    # A tray on one leg in its corner covers what the box covers, and cannot stand.
    tray = part("box", (0.0, 0.0, 0.59), (0.3, 0.4, 0.02))
    leg = part("box", (0.14, 0.19, 0.29), (0.02, 0.02, 0.58))
    assets = {**ASSETS, "Box_2": asset("Box_2", tray, leg, mass_kg=8.0)}
    assert "physics.settle-refused" in found_in(scenes, 1, 1, assets)


FAILED = {
    "success": False,
    "displacement_m": 0.0,
    "opened": False,
    "pose": None,
    "swept": None,
}
OUTCOMES = {
    "another reason": (
        (2, 0, "push_east", 0, {"reason": "something is in the way"}),
        "physics.outcome-reason",
    ),
    "no success": (
        (0, 0, "push_north", 0, {**FAILED, "path_m_after": None, "reason": "too heavy"}),
        "physics.outcome-success",
    ),
    "no pick": (
        (
            2,
            0,
            "pick",
            1,
            {
                **FAILED,
                "path_steps_after": None,
                "path_m_after": None,
                "reason": "something rests on it",
            },
        ),
        "physics.outcome-success",
    ),
    "success": (
        (
            2,
            0,
            "push_east",
            0,
            {
                "success": True,
                "displacement_m": 0.1,
                "reason": "",
                "pose": Pose(3.5, 1.4, 0.001, UPRIGHT),
            },
        ),
        "physics.outcome-success",
    ),
    "farther": ((0, 0, "push_west", 0, {"displacement_m": 0.7}), "physics.outcome-displacement"),
    "longer": ((0, 0, "push_west", 0, {"seconds": 1.0}), "physics.outcome-seconds"),
    "more steps": (
        (0, 1, "push_north", 0, {"path_steps_after": 28}),
        "outcome.path-steps-after",
    ),
    "still shut": (
        (0, 0, "push_west", 0, {"path_steps_after": None, "opened": False}),
        "outcome.path-steps-after",
    ),
    "more steps round moved furniture": (
        (2, 0, "push_north", 1, {"path_steps_after": 28, "opened": True}),
        "outcome.path-steps-after",
    ),
    "a longer way": (
        (0, 1, "push_north", 0, {"path_m_after": 6.03}),
        "outcome.path-m-after",
    ),
    "a longer way round moved furniture": (
        (2, 0, "push_north", 1, {"path_m_after": 6.03}),
        "outcome.path-m-after",
    ),
    "a way where none is": (
        (0, 0, "push_south", 0, {"path_m_after": 6.5}),
        "outcome.path-m-after",
    ),
    "no way where one is": (
        (0, 0, "push_north", 0, {"path_m_after": None}),
        "outcome.path-m-after",
    ),
    "more steps once picked": (
        (2, 0, "pick", 1, {"path_steps_after": 26}),
        "outcome.path-steps-after",
    ),
    "never at rest": ((0, 0, "push_west", 0, {"at_rest": False}), "physics.outcome-at-rest"),
    "a box too wide": ((0, 0, "push_west", 0, {"swept": (9.0,) * 4}), "physics.outcome-swept"),
    "furniture stays": ((2, 0, "push_north", 1, {"moved": ()}), "physics.outcome-moved"),
}


@pytest.mark.parametrize("case", OUTCOMES)
def test_outcome_says_something_untrue(scenes, case):
    (scene, index, action, number, changes), predicate = OUTCOMES[case]
    wrong = outcome_changed(scenes, scene, index, action, number, **changes)
    found = found_in(wrong, scene, index)
    assert predicate in found
    assert all(name.startswith(("outcome.", "physics.outcome")) for name in found)


def without(action):
    def edit(actions):
        actions.remove(action)
        return actions

    return edit


EXPERTS = {
    "a step less": (0, 0, without(0)),
    "a turn less": (0, 1, lambda actions: [a for a in actions if a not in {1, 2}]),
    "no push": (0, 0, lambda actions: [a for a in actions if not 5 <= a <= 8]),
    "another push": (0, 0, lambda actions: [6 if a == 8 else a for a in actions]),
    "no pick": (2, 0, without(9)),
    "a look too far": (2, 1, lambda actions: [3, 3, 3, *actions]),
}


@pytest.mark.parametrize("case", EXPERTS)
def test_expert_does_not_get_there(scenes, case):
    scene, index, edit = EXPERTS[case]
    found = found_in(expert_changed(scenes, scene, index, edit), scene, index)
    assert found == {"physics.expert-action"}


@pytest.mark.parametrize("case", EXPERTS)
def test_blind_expert_does_not_get_there(scenes, case):
    scene, index, edit = EXPERTS[case]
    episode = scenes[scene][1][index]
    edited = expert_changed(scenes, scene, index, edit)[scene][1][index].expert
    seeing = changed(scenes, scene, index, blind_expert=episode.expert)
    assert not found_in(seeing, scene, index)
    wrong = changed(scenes, scene, index, blind_expert=edited)
    found = found_in(wrong, scene, index)
    # A push that moves nothing may be: what shows is that the way stays closed.
    assert found
    assert found <= {"physics.blind-expert-action", "physics.blind-expert-goal"}


def test_a_failed_interaction_of_a_blind_expert_is_no_untruth(scenes):
    expert = scenes[0][1][0].expert
    assert 9 not in expert.actions
    failing = replace(expert, actions=(9, *expert.actions), steps=expert.steps + 1, picks=1)
    assert not found_in(changed(scenes, 0, 0, blind_expert=failing), 0, 0)
    assert found_in(changed(scenes, 0, 0, expert=failing), 0, 0) == {"physics.expert-action"}


def test_what_an_expert_holds_is_in_nothing_and_put_down(scenes, monkeypatch):
    """A world of real hands that lets things through walls, and lets a full hand be done."""
    world = internav_data.world.world
    real = WorldConfig(hands="real")
    house, (shut, _) = physical.crowded()
    shut = physical.played(house, shut, real)
    assert shut.expert.actions.count(9) == shut.expert.actions.count(10) == 1
    strict = replace(FORCE, hands="real")

    def found(actions):
        counts = {
            "steps": len(actions),
            "picks": actions.count(9),
            "path_m": 0.25 * actions.count(0),
        }
        expert = replace(shut.expert, actions=tuple(actions), **counts)
        report = FindingCollector("episodes", house.scene_id)
        scene = CheckedScene(CheckedLayout(house, Shapes(ASSETS)), strict)
        replay_episode(scene, replace(shut, expert=expert), report)
        return set(report.by_predicate)

    actions = list(shut.expert.actions)
    assert found(actions) == set()
    for name in ("has_room", "can_step", "can_turn"):
        monkeypatch.setattr(world, name, lambda *_: True)
    assert found(actions) == set(), "still nothing met"
    at = actions.index(9) + 1
    assert "physics.expert-hands" in found([*actions[:at], 1, *[0] * 16])
    # Nor does the world mind full hands at the goal: the drop is left out.
    monkeypatch.setattr(World, "carrying", False)
    kept = [action for action in actions if action != 10]
    assert "physics.expert-hands" in found(kept)


def test_a_detour_is_no_untruth(scenes):
    assert not found_in(expert_changed(scenes, 2, 1, lambda actions: [1, 2, *actions]), 2, 1)


def test_another_end_than_the_stored_one(scenes):
    pushed = scenes[2][1][0].obstacles[1].outcomes[1]
    (other,) = pushed.moved
    assert (other.object_id, other.obstacle) == (1, None)
    nudged = replace(other.pose, x=other.pose.x + 0.0001)
    for changes, predicate in (
        ({"pose": replace(pushed.pose, y=pushed.pose.y - 0.0001)}, "physics.outcome-pose"),
        ({"moved": (replace(other, pose=nudged),)}, "physics.outcome-moved"),
    ):
        wrong = outcome_changed(scenes, 2, 0, "push_north", 1, **changes)
        assert predicate in found_in(wrong, 2, 0)


# the world itself is wrong: what the validator derives by its own means must say so


def test_world_that_calls_any_place_the_goal(scenes, monkeypatch):
    monkeypatch.setattr(internav_data.world.world, "GOAL_M", 99.0)
    there = expert_changed(scenes, 2, 1, lambda _: [1, 11])
    assert found_in(there, 2, 1) == {"physics.expert-goal"}


def test_world_that_lets_the_agent_through_things(scenes, monkeypatch):
    monkeypatch.setattr(Lattice, "edge_free", lambda *_: True)
    straight = expert_changed(scenes, 2, 1, lambda _: [2, *[0] * 24, 11])
    assert found_in(straight, 2, 1) == {"physics.expert-clear"}


def test_world_that_reaches_everything(scenes, monkeypatch):
    monkeypatch.setattr(World, "target", lambda world, **_: world.obstacles[-1])
    early = expert_changed(scenes, 2, 0, lambda actions: [9, *without(9)(actions)])
    assert found_in(early, 2, 0) == {"physics.expert-reach"}


@pytest.mark.parametrize(
    "into", [{"z": -0.02}, {"x": 3.7, "y": 1.0}, {"x": 1.67, "y": 0.97}, {"x": 6.5, "y": 0.5}]
)
def test_world_that_pushes_into_floor_wall_or_furniture(scenes, monkeypatch, into):
    push = World.simulate_push

    def sinking(world, *args, **options):
        pushed = push(world, *args, **options)
        return replace(pushed, pose=replace(pushed.pose, **into))

    monkeypatch.setattr(World, "simulate_push", sinking)
    assert "physics.outcome-sunk" in found_in(scenes, 1, 1)


def test_what_leans_through_a_window_is_not_in_the_wall(scenes):
    """Above a sill and below a lintel there is no wall; a board across the sill itself is in it."""
    house, _ = scenes[1]
    wall = next(w for w in house.walls if w.z_min == 0.0)
    sill, lintel = replace(wall, z_max=0.9), replace(wall, z_min=2.1)
    walls = tuple(w for w in house.walls if w is not wall)
    x, y = (wall.x_min + wall.x_max) / 2, (wall.y_min + wall.y_max) / 2
    board = asset("Board", part("box", (0.0,) * 3, (0.4, 0.4, 0.04)))
    item = MovableObject.of(Body.of(board, Pose(1.0, 1.0, 0.0, UPRIGHT)))
    assets = {**ASSETS, "Board": board}
    for through, sills in ((house, 0), (replace(house, walls=(*walls, sill, lintel)), 1)):
        scene = CheckedScene(CheckedLayout(through, Shapes(assets)), FORCE)
        for z, inside in ((0.5, True), (0.925, False), (1.5, False), (2.2, True)):
            pose = Pose(x, y, z, UPRIGHT)
            items = (*scene.model.items, item)
            found = scene.intrusions(items, {len(items) - 1: pose}, 0.01)
            expected = [(len(items) - 1, "a wall")]
            assert found == (expected if inside or not sills else [])


def test_what_carries_something_is_not_picked_up(scenes):
    house, episodes = scenes[2]
    tall = part("box", (0.0, 0.0, 0.602), (0.3, 0.4, 0.396))
    assets = {**ASSETS, "Bar_1": asset("Bar_1", tall, size=(0.3, 0.4, 0.6), mass_kg=8.0)}

    def at(asset_id, x):
        return MovableObject.of(Body.of(assets[asset_id], Pose(x, 2.0, 0.0, UPRIGHT)))

    outcome = episodes[0].obstacles[0].outcomes[4]
    scene = CheckedScene(CheckedLayout(house, Shapes(assets)), FORCE)
    check = OutcomeCheck(scene, episodes[0], outcome, "", lambda *_: True)
    under, over = at("Pot_1", 3.0), at("Bar_1", 3.1)
    assert check.carries([under, over], 0)
    assert not check.carries([under, over], 1)
    assert not check.carries([under, at("Bar_1", 3.6)], 0)


def test_furniture_that_was_moved_is_no_longer_where_it_stood():
    bar = scene_object(0, "Bar_1", 0, 3.5, 1.94, yaw_deg=90.0)
    house = Grid(2, 1).house(2, (bar, scene_object(1, "Table_1", 0, 1.0, 0.6)))
    scene = CheckedScene(CheckedLayout(house, Shapes(ASSETS)), FORCE)
    items = scene.model.items
    assert [item.asset.asset_id for item in items] == ["Bar_1"]
    there = scenery.obstacle("Bar_1", 2.0, 2.0, yaw_deg=90.0)
    for changes, things, obstacles in (
        ({}, house.objects, []),
        ({0: there.pose}, house.objects[1:], [there]),
        ({0: None}, house.objects[1:], []),
    ):
        found = scene.rearranged(items, changes)
        lattice = found.layout.lattice
        free = lattice.with_obstacles(found.obstacles)
        steps = lattice.distances(lattice.node(28, 8), free)[lattice.node(4, 8)]
        wanted = brute_steps(replace(house, objects=things), (4, 8), (28, 8), obstacles)
        assert steps == (math.inf if wanted is None else wanted)
        path = CheckedPath(found.layout, (1.0, 2.0), (7.0, 2.0), found.obstacles)
        assert path.connected(stated=True) == (changes != {})


# what cannot be judged is said


def test_null_columns_are_counted(tmp_path, scenes):
    house, episodes = scenes[0]
    bare = replace(
        episodes[0],
        expert=None,
        obstacles=tuple(replace(o, outcomes=None) for o in episodes[0].obstacles),
    )
    findings = judged(tmp_path, [(house, [bare, replace(episodes[1], expert=None)]), *scenes[1:]])
    assert findings.ok, findings.summary()
    assert findings.notes == {
        "no expert stored: not checked": 2,
        "no outcomes stored: not checked": 1,
    }
    assert "note: 2 x no expert stored" in findings.summary()


def test_another_build_is_noted(tmp_path, scenes):
    physics = replace(scenes[0][1][0].physics, build="pybullet 9.9.9")
    findings = judged(tmp_path, changed(scenes, 0, 0, physics=physics))
    assert findings.ok
    (note,) = findings.notes
    engine = engines.DEFAULT_ENGINE
    assert f"made by {engine} of pybullet 9.9.9, checked by {engine} of " in note
    assert findings.notes[note] == 1


def test_untrue_geometry_is_not_played(tmp_path, scenes):
    findings = judged(tmp_path, changed(scenes, 0, 1, shortest_path_steps=26))
    assert "episode.shortest-path-steps" in findings.by_predicate
    assert findings.notes == {"geometry not as stated: physics not checked": 1}
    assert findings.checked["replayed"] == 5


def test_untrue_house_is_not_played(tmp_path, scenes):
    house, episodes = scenes[0]
    findings = judged(tmp_path, [(replace(house, area_m2=1.0), episodes), *scenes[1:]])
    assert findings.notes == {"geometry not as stated: physics not checked": 2}


def test_untrue_schema_is_not_played(tmp_path, scenes):
    findings = judged(tmp_path, changed(scenes, 0, 1, index=3))
    assert findings.notes == {"schema not as stated: physics not checked": 6}
    assert "replayed" not in findings.checked


# how the data were made


def test_kicks_are_judged_as_kicks(tmp_path, scenes):
    kicked = physical.physical_scenes(WorldConfig("kick"))
    assert kicked != scenes
    kick = {"episodes": {"push_model": "kick"}}
    assert judged(tmp_path / "a", kicked, config=kick).ok
    untrue = judged(tmp_path / "b", kicked).by_predicate
    assert "physics.outcome-success" in untrue  # a kick moves the safe


def test_weak_pushes_are_judged_as_weak(tmp_path, scenes):
    weak = physical.physical_scenes(WorldConfig(force_n=20.0))
    assert weak != scenes
    config = {"world": {"force_n": 20.0}}
    assert judged(tmp_path / "a", weak, config=config).ok
    assert not judged(tmp_path / "b", weak).ok


def test_steps_are_judged_as_steps_and_further_pushes_again(tmp_path):
    stepped = physical.physical_scenes(WorldConfig("step"))
    reaches = [o for b in stepped[0][1][0].obstacles for o in b.outcomes if o.reach_m]
    assert {len(o.reach_m) for o in reaches} >= {4}
    assert any(o.reach_opened for o in reaches)
    assert all(o.reach_m[0] == o.displacement_m for o in reaches)
    assert judged(tmp_path / "a", stepped, config={"world": {"push_model": "step"}}).ok
    house, episodes = stepped[0]
    step = replace(FORCE, push_model="step")

    def found(episode, config=step):
        report = FindingCollector("episodes", house.scene_id)
        replay_episode(CheckedScene(CheckedLayout(house, Shapes(ASSETS)), config), episode, report)
        return set(report.by_predicate)

    def changed_reach(**changes):
        (bar, *rest) = episodes[0].obstacles
        at = next(k for k, o in enumerate(bar.outcomes) if o.reach_opened)
        five = list(bar.outcomes)
        values = {name: change(five[at]) for name, change in changes.items()}
        five[at] = replace(five[at], **values)
        return replace(episodes[0], obstacles=(replace(bar, outcomes=tuple(five)), *rest))

    assert found(episodes[0]) == set()
    for wrong in (
        changed_reach(reach_m=lambda o: (*o.reach_m[:-1], o.reach_m[-1] + 0.001)),
        changed_reach(reach_m=lambda o: o.reach_m[:-1]),
        changed_reach(reach_m=lambda _: None),
    ):
        assert found(wrong) == {"physics.outcome-reach"}
    late = changed_reach(reach_opened=lambda o: o.reach_opened + 1)
    assert found(late) == {"physics.outcome-reach-opened"}


@pytest.mark.parametrize(
    "world", [{"push_model": "shove"}, {"force_n": 0}, {"force_n": "much"}, {"force_n": True}]
)
def test_unknown_pushes(tmp_path, scenes, world):
    (name,) = world
    with pytest.raises(CorruptDataError, match=f"config.world.{name}: expected"):
        judged(tmp_path, scenes, config={"world": world})


def test_geometry_needs_no_engine(tmp_path, scenes):
    write_dataset(tmp_path / "ds", scenes)
    script = (
        "import sys\nfrom pathlib import Path\nfrom internav_data.verification import validate\n"
        "assert validate(Path(sys.argv[1])).ok\n"
        "assert not {'pybullet', 'internav_data.world', 'internav_data.navigation'} & {\n"
        "    *sys.modules\n}\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, tmp_path / "ds"], capture_output=True, check=False, text=True
    )
    assert done.returncode == 0, done.stderr
