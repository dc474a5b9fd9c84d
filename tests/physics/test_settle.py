"""Settling is a pure function, and what it says is what the engine says in the whole scene."""

import math
import subprocess
import sys

import pytest
from builders import UPRIGHT, asset, box, chair, crate

from internav_data.geometry import asset_corners, transform, yaw_quaternion
from internav_data.physics import Body, PhysicsScene, get_solver, wall_body
from internav_data.physics.settling import MAX_PENETRATION_M
from internav_data.records import Pose, Wall


def nothing():
    return ()


def never():
    raise AssertionError("neighbours were asked for")


def test_a_chair_stays_where_it_was_put(settle):
    there = settle(Body.of(chair(), Pose(3.0, 4.0, 0.0, yaw_quaternion(30))), 0.01, never)
    assert there.refusal == ""
    assert math.dist((there.pose.x, there.pose.y), (3.0, 4.0)) <= 1e-3
    assert 0.0 <= there.pose.z <= 0.002
    assert there.pose.quaternion[3] == pytest.approx(math.cos(math.radians(15)), abs=1e-4)
    assert 0.04 < there.seconds < 1.0
    assert 0.0 <= there.penetration_m <= MAX_PENETRATION_M


def test_free_fall_takes_as_long_as_physics_says(engine):
    # 1 cm falls in sqrt(2 h / g) = 45 ms = 11 steps; then ten calm steps follow.
    cube = crate("Crate_0", (0.4, 0.4, 0.4))
    scene = PhysicsScene((Body.of(cube, Pose(0.0, 0.0, 0.01, UPRIGHT)),))
    rest = get_solver(engine).settle(scene)
    assert rest.seconds >= math.sqrt(2 * 0.01 / 9.81) + 9 / 240


def test_what_leans_over_is_refused(settle):
    leaning = asset(
        "Lamp_0",
        box((0.0, 0.0, 0.05), (0.1, 0.1, 0.1)),
        box((0.3, 0.0, 0.6), (0.6, 0.2, 0.2)),
        box((0.0, 0.0, 0.35), (0.05, 0.05, 0.5)),
    )
    assert settle(Body.of(leaning, Pose(1.0, 1.0, 0.0, UPRIGHT)), 0.01, nothing).refusal


def test_what_sinks_into_a_wall_is_pushed_out_and_refused(settle):
    wall = wall_body(Wall(3.2, 0.0, 3.32, 8.0, 0.0, 2.6))
    there = settle(Body.of(chair(), Pose(3.0, 4.0, 0.0, UPRIGHT)), 0.0, lambda: (wall,))
    assert there.refusal


def test_a_neighbour_out_of_reach_changes_nothing(settle):
    pose = Pose(3.0, 4.0, 0.0, yaw_quaternion(45))
    wall = wall_body(Wall(3.5, 0.0, 3.62, 8.0, 0.0, 2.6))
    alone = settle(Body.of(chair(), pose), 0.01, never)
    beside = settle(Body.of(chair(), pose), 0.0, lambda: (wall,))
    assert alone == beside


def test_same_answer_in_a_fresh_process_and_after_any_history(engine):
    script = (
        "import sys; sys.path[:0] = ['tests', 'tests/physics']; from test_settle import *\n"
        "n, e = int(sys.argv[1]), get_solver(sys.argv[2])\n"
        "for k in range(n): e.settle(PhysicsScene((Body.of(crate(f'Crate_{k}', "
        "(.2, .3, .2 + k / 25)), Pose(0, 0, .01, UPRIGHT)),)))\n"
        "print(repr(e.settle(PhysicsScene((Body.of(chair(), Pose(0, 0, .01, UPRIGHT)),)))))"
    )
    answers = {
        subprocess.run(
            [sys.executable, "-c", script, str(n), engine],
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for n in (0, 0, 7)
    }
    assert len(answers) == 1
    assert "SettleSolution(" in answers.pop()


def test_nothing_is_printed_by_importing_the_engine(engine):
    done = subprocess.run(
        [sys.executable, "-c", f"import internav_data.physics.engines.{engine}"],
        check=True,
        capture_output=True,
    )
    assert done.stdout == b""
    assert done.stderr == b""


def test_assets_of_more_than_sixteen_parts_keep_them_all(settle):
    # Bullet's shape arrays drop the seventeenth: here it alone carries the rest.
    parts = [box((0.0, 0.0, 0.5 + 0.01 * k), (0.2, 0.2, 0.01)) for k in range(20)]
    stack = asset("Stack_0", *parts, box((0.0, 0.0, 0.1), (0.5, 0.5, 0.2)))
    there = settle(Body.of(stack, Pose(0.0, 0.0, 0.0, UPRIGHT)), 0.01, nothing)
    assert there.refusal == ""
    corners, _ = asset_corners(stack)
    assert transform(corners, there.pose)[:, 2].min() == pytest.approx(0.001, abs=0.0011)
