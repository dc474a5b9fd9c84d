"""Episodes in whole houses: each fault is made once, and the house that is built finds it."""

import math
from collections import Counter
from dataclasses import replace
from importlib import import_module

import builders
import physical
import pytest
from builders import UPRIGHT, asset, part, scene_object
from engines import bullet_only
from scenery import ASSETS

from internav_data.geometry import centre_of_mass
from internav_data.physics import ENGINES, cache_disabled, get_solver
from internav_data.physics.engines import mujoco_scene
from internav_data.records import MovedObject, Pose
from internav_data.verification.checked_config import CheckedConfig
from internav_data.verification.checked_layout import CheckedLayout
from internav_data.verification.findings import FindingCollector
from internav_data.verification.interactions import PICK
from internav_data.verification.replay import (
    CheckedScene,
    bullet_house,
    mujoco_house,
    replay_episode,
    whole_house,
)
from internav_data.verification.replay.standing import centre_of, turned_deg
from internav_data.verification.replay.whole_house import EVERY, check_whole_house, is_sampled
from internav_data.verification.scenes import check_scene
from internav_data.verification.shapes import Shapes
from internav_data.world import World

PLATE = asset(  # a box on a plate that is lower than any footprint and wider than the box
    "Plate_1",
    part("box", (0.0, 0.0, 0.005), (0.6, 0.6, 0.01)),
    part("box", (0.0, 0.0, 0.11), (0.3, 0.3, 0.2)),
    mass_kg=2.0,
)
KNOWN = {**ASSETS, "Plate_1": PLATE}


@pytest.fixture(scope="module", params=[pytest.param("bullet", marks=bullet_only), "mujoco"])
def engine(request):
    """Engine that makes an episode, and builds its house."""
    return request.param


@pytest.fixture(scope="module")
def crowded(engine):
    """A safe and a pot before a door, and a box behind the pot that a push to the north moves."""
    house, episodes = physical.crowded()
    return house, physical.played(house, episodes[0], engine=engine)


def found_in(house, episode, assets=KNOWN):
    report = FindingCollector()
    check_whole_house(
        house,
        Shapes(assets),
        episode,
        report.expect,
    )
    assert report.counts["predicates"] > 0
    return Counter(report.by_predicate), [f.expected for f in report.found]


def by(engine, episode):
    return replace(episode, physics=replace(episode.physics, engine=engine))


def with_obstacle(episode, number, **changes):
    obstacles = list(episode.obstacles)
    obstacles[number] = replace(obstacles[number], **changes)
    return replace(episode, obstacles=tuple(obstacles))


def with_outcome(episode, number, action, **changes):
    outcomes = tuple(
        replace(o, **changes) if o.action == action else o
        for o in episode.obstacles[number].outcomes
    )
    return with_obstacle(episode, number, outcomes=outcomes)


def push_of(episode, number, action):
    return next(o for o in episode.obstacles[number].outcomes if o.action == action)


def test_what_is_true_holds(crowded):
    assert found_in(*crowded) == (Counter(), [])


def test_a_users_handler_of_mujocos_warnings_stays(crowded):
    mujoco = mujoco_scene.mujoco
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        mine = mujoco.get_mju_user_warning()
        found_in(*crowded)
        assert mujoco.get_mju_user_warning() == mine
    finally:
        mujoco.set_mju_user_warning(None)


def test_a_house_that_is_built_changes_no_solution(crowded, engine):
    """Bullet has globals that all of a process's clients share."""
    house, episode = crowded

    def solved():
        with cache_disabled():
            get_solver(engine).forget()
            return physical.played(house, episode, engine=engine)

    before = solved()
    found_in(house, episode)
    assert solved() == before


def test_an_obstacle_in_the_air_does_not_hold(crowded):
    house, episode = crowded
    found, texts = found_in(house, with_obstacle(episode, 1, z=0.1, outcomes=()))
    assert found == {"physics.house-holds": 1}
    assert texts[0].startswith("obstacle 1 (Pot_1) at the start: within 5 mm and 1° of its pose")


def test_an_obstacle_that_leans_on_nothing_does_not_hold(crowded):
    house, episode = crowded
    leaning = (math.sin(0.1), 0.0, 0.0, math.cos(0.1))
    found, _ = found_in(house, with_obstacle(episode, 1, quaternion=leaning, outcomes=()))
    assert found["physics.house-holds"] == 1


def test_an_end_that_nothing_holds_is_found(crowded):
    house, episode = crowded
    pushed = push_of(episode, 1, "push_west")
    lifted = replace(pushed.pose, z=pushed.pose.z + 0.02)
    found, texts = found_in(house, with_outcome(episode, 1, "push_west", pose=lifted))
    assert found == {"physics.house-holds": 1}
    assert texts[0].startswith("obstacle 1 (Pot_1) after push_west of obstacle 1: within 5 mm")
    cut_off = with_outcome(episode, 1, "push_west", pose=lifted, at_rest=False)
    assert found_in(house, cut_off) == (Counter(), []), "one that was not at rest need not hold"


def test_an_end_of_moved_furniture_that_nothing_holds_is_found(crowded):
    house, episode = crowded
    (other,) = push_of(episode, 1, "push_north").moved
    lifted = (replace(other, pose=replace(other.pose, z=0.05)),)
    found, texts = found_in(house, with_outcome(episode, 1, "push_north", moved=lifted))
    assert found["physics.house-holds"] == 1
    assert texts[0].startswith("object 1 (Box_2) after push_north of obstacle 1")


def test_an_obstacle_carries_what_a_push_has_put_on_it(crowded):
    """On top of the safe, a pot rests; on top of where it was, it does not."""
    house, episode = crowded
    safe = episode.obstacles[0]
    onto = Pose(safe.x, safe.y, safe.z + 0.901, UPRIGHT)
    assert found_in(house, with_outcome(episode, 1, "push_south", pose=onto)) == (Counter(), [])
    found, _ = found_in(house, with_outcome(episode, 1, "push_south", pose=replace(onto, x=4.5)))
    assert found["physics.house-holds"] == 1


def test_what_a_moved_object_leans_on_can_give_way(crowded):
    """A pot on the edge of a stand tips it over; in its middle it does not."""
    leg = part("box", (0.0, 0.0, 0.25), (0.2, 0.2, 0.5))
    stand = asset("Stand_1", leg, part("box", (0.0, 0.0, 0.51), (0.8, 0.8, 0.02)), mass_kg=2.0)
    house = builders.one_room(5.0, 4.0)
    pot = builders.obstacle(ASSETS["Pot_1"], 1.0, 2.0)
    obstacles = (pot, builders.obstacle(stand, 3.0, 2.0))
    episode = by(
        crowded[1].physics.engine,
        builders.episode(house, builders.start(2, 2), builders.goal(16, 4), obstacles),
    )
    pushed = push_of(crowded[1], 1, "push_west")
    for x, given in ((3.0, Counter()), (3.3, Counter({"physics.house-holds": 2}))):
        end = replace(pushed, pose=Pose(x, 2.0, 0.522, UPRIGHT), moved=())
        one = with_obstacle(episode, 0, outcomes=(end,))
        assert found_in(house, one, {**ASSETS, "Stand_1": stand})[0] == given


@pytest.mark.parametrize(
    ("x", "y", "other"),
    [(0.28, 3.0, "floor or wall"), (1.78, 1.77, "object 0 (Cupboard_1)"), (2.42, 3.0, "(Box_1)")],
)
def test_what_is_lower_than_footprints_is_inside(engine, x, y, other):
    """A plate of 1 cm reaches into a wall, furniture or a box where no footprint overlaps."""
    room = builders.one_room(5.0, 4.0)
    cupboard = scene_object(0, "Cupboard_1", 0, 1.0, 1.77)
    house = replace(room, objects=(cupboard,), assets=KNOWN)
    obstacles = (builders.obstacle(PLATE, x, y), builders.obstacle(ASSETS["Box_1"], 3.0, 3.0))
    episode = by(
        engine, builders.episode(house, builders.start(2, 2), builders.goal(16, 4), obstacles)
    )
    found, texts = found_in(house, episode)
    assert found["physics.house-inside"] == 1
    assert "Plate_1" in texts[0]
    assert other in texts[0]


@pytest.mark.parametrize(("friction", "slides"), [(0.5, True), (0.9, False)])
def test_frictions_of_two_objects_are_multiplied(engine, friction, slides):
    """On a slope of 20 degrees (0.36) and of friction 0.5, a larger coefficient counts half."""
    angle = math.radians(20.0)
    up, length = math.tan(angle), 1.2
    sides = [
        (x, y, z) for y in (-0.4, 0.4) for x, z in ((0, 0), (length, 0), (length, length * up))
    ]
    wedge = part("hull", (0.0,) * 3, (length, 0.8, length * up), corners=sides)
    slope = asset("Slope_1", wedge, friction=0.5)
    house = replace(builders.one_room(5.0, 4.0), objects=(scene_object(0, "Slope_1", 0, 2.0, 2.0),))
    turn = (0.0, -math.sin(angle / 2.0), 0.0, math.cos(angle / 2.0))
    box = builders.obstacle(ASSETS["Box_1"], 2.6 - 0.001 * math.sin(angle), 2.0)
    box = replace(box, z=0.6 * up + 0.001 * math.cos(angle), quaternion=turn, friction=friction)
    episode = builders.episode(house, builders.start(2, 2), builders.goal(16, 4), (box,))
    found, _ = found_in(house, by(engine, episode), {**ASSETS, "Slope_1": slope})
    assert found == (Counter({"physics.house-holds": 1}) if slides else Counter())


def test_a_rug_is_floor(engine):
    rug = replace(builders.rug(), asset_id="Rug_1")
    house = replace(builders.one_room(5.0, 4.0), objects=(scene_object(0, "Rug_1", 0, 2.0, 2.0),))
    box = builders.obstacle(ASSETS["Box_1"], 2.0, 2.0)
    episode = builders.episode(house, builders.start(2, 2), builders.goal(16, 4), (box,))
    assert found_in(house, by(engine, episode), {**ASSETS, "Rug_1": rug}) == (Counter(), [])


def test_houses_are_built_for_a_sample_and_for_data_of_this_engine_alone(crowded, monkeypatch):
    house, episode = crowded
    asked = []
    monkeypatch.setattr(
        "internav_data.verification.replay.episodes.check_whole_house",
        lambda *arguments: asked.append(arguments[2].episode_id),
    )
    scene = CheckedScene(CheckedLayout(house, Shapes(ASSETS)), CheckedConfig())

    def counted(*episodes):
        asked.clear()
        report = FindingCollector("episodes", house.scene_id)
        for one in episodes:
            replay_episode(scene, one, report)
        assert len(asked) == report.counts["whole houses"]
        return asked, report.notes

    number = int(house.scene_id[-6:])
    ids = [f"{house.scene_id}/{k:04d}" for k in (EVERY - number, EVERY - number + 1)]
    taken, left = (replace(episode, episode_id=one) for one in ids)
    assert counted(taken, left) == (ids[:1], {})
    older = replace(taken, physics=replace(taken.physics, build="pybullet 3.2.7, rules 1"))
    asked, notes = counted(older)
    assert asked == []
    assert len(notes) == 1


def test_one_of_so_many_episodes_is_sampled_whatever_a_scene_holds(crowded):
    _, episode = crowded
    for per_scene in (5, 50):
        sampled = [
            is_sampled(replace(episode, episode_id=f"scene-{scene:06d}/{k:04d}"))
            for scene in range(4 * EVERY)
            for k in range(per_scene)
        ]
        assert sum(sampled) * EVERY == len(sampled)


def test_a_fault_is_found_by_the_level_of_physics(crowded):
    house, episode = crowded
    number = int(house.scene_id[-6:])
    one = replace(episode, episode_id=f"{house.scene_id}/{EVERY - number:04d}")
    assert is_sampled(one)
    pushed = push_of(one, 1, "push_west")
    wrong = with_outcome(one, 1, "push_west", pose=replace(pushed.pose, z=0.02))
    report = check_scene(house, [wrong], Shapes(ASSETS), "", CheckedConfig())
    assert {"physics.house-holds"} <= set(report.by_predicate)
    (found,) = [f for f in report.found if f.predicate == "physics.house-holds"]
    assert found.episode == one.episode_id


# fixed is fixed: what can be neither pushed nor picked up


def replayed(house, episode, assets):
    report = FindingCollector("episodes", house.scene_id)
    replay_episode(
        CheckedScene(CheckedLayout(house, Shapes(assets)), CheckedConfig()), episode, report
    )
    return set(report.by_predicate)


def test_a_fixed_thing_that_moved_is_found(crowded):
    house, episode = crowded
    (other,) = push_of(episode, 1, "push_north").moved
    assert "physics.outcome-fixed" not in replayed(house, episode, ASSETS)
    # Bolted down since: the safe, and the furniture that the push moves.
    bolted = with_obstacle(episode, 0, pushable=False)
    safe = MovedObject(0, None, other.pose)
    moved = with_outcome(bolted, 1, "push_north", moved=(other, safe))
    assert "physics.outcome-fixed" in replayed(house, moved, ASSETS)
    assets = {**ASSETS, "Box_2": replace(ASSETS["Box_2"], spawnable=False)}
    assert "physics.outcome-fixed" in replayed(house, episode, assets)


def test_an_expert_that_moves_a_fixed_thing_is_found(crowded, monkeypatch):
    house, episode = crowded
    step = World.step

    def shoving(world, action):
        result = step(world, action)
        safe = world.obstacles[0]
        if action == PICK:
            item = world.items[safe]
            moved = item.moved(replace(item.pose, x=item.pose.x + 0.05))
            world.items = (*world.items[:safe], moved, *world.items[safe + 1 :])
        return result

    monkeypatch.setattr(World, "step", shoving)
    bolted = with_obstacle(episode, 0, pushable=False)
    assert "physics.expert-fixed" in replayed(house, bolted, ASSETS)
    assert "physics.expert-fixed" not in replayed(house, episode, ASSETS)


# the builder's own numbers and geometry


@bullet_only
def test_numbers_are_those_of_bullet():
    scene = import_module("internav_data.physics.engines.bullet_scene")
    for name in ("STEP_S", "GRAVITY", "ROLLING_FRICTION", "CONTACT_BREAKS_M"):
        assert getattr(bullet_house, name) == getattr(scene, name)
    assert bullet_house.SOLID_FRICTION == scene.FLOOR_FRICTION


def test_numbers_are_those_of_mujoco():
    assert mujoco_house.STEP_S == mujoco_scene.STEP_S / mujoco_scene.SUBSTEPS
    assert mujoco_house.GRAVITY == mujoco_scene.GRAVITY
    assert mujoco_house.ROLLING_FRICTION == mujoco_scene.ROLLING_FRICTION
    assert mujoco_house.THICKNESS_M == mujoco_scene.MARGIN_M


def test_houses_of_every_engine_are_built():
    assert set(whole_house.ENGINES) == set(ENGINES)


def test_centre_of_mass_is_that_of_the_generator():
    corners = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    tetrahedron = part("hull", (0.0,) * 3, (1.0,) * 3, corners=corners)
    shapes = Shapes({"One_1": asset("One_1", tetrahedron)})
    assert centre_of(shapes.solids("One_1")) == pytest.approx((0.25,) * 3)
    for one in (*ASSETS.values(), builders.chair(), builders.bed(), builders.apple()):
        own = centre_of(Shapes({one.asset_id: one}).solids(one.asset_id))
        # Prisms of 16 sides hold 2.6 % less than the round parts that they stand for.
        assert own == pytest.approx(centre_of_mass(one), abs=4e-3)


def test_angles_between_orientations():
    assert turned_deg(UPRIGHT, UPRIGHT) == 0.0
    assert turned_deg(UPRIGHT, builders.yaw(30.0)) == pytest.approx(30.0)
    assert turned_deg(UPRIGHT, tuple(-q for q in builders.yaw(30.0))) == pytest.approx(30.0)
