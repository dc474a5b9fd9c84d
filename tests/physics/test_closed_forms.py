"""Motions whose end a formula knows, on every engine; slides are in `test_push`."""

import math

import numpy as np
import pytest
from builders import UPRIGHT, asset, crate, part

from internav_data.physics import ENGINES, Body, PhysicsScene
from internav_data.physics.displacement import tilt_deg
from internav_data.physics.solving import solve_push
from internav_data.records import PUSH_SPECS, Pose

GRAVITY = 9.81
STANDING = Pose(0.0, 0.0, 0.001, UPRIGHT)
KICK, FORCE = PUSH_SPECS["kick"], PUSH_SPECS["force"]


def solved(engine, spec, *bodies):
    return solve_push(ENGINES[engine](), PhysicsScene(bodies), spec)


def position(pose):
    return pose.x, pose.y, pose.z


def greatest_tilt_deg(solution):
    path = np.frombuffer(solution.paths[0], dtype=np.float32).reshape(-1, 7)
    return max(tilt_deg(UPRIGHT, tuple(turn)) for turn in path[:, 3:].tolist())


def greatest_height_m(solution):
    path = np.frombuffer(solution.paths[0], dtype=np.float32).reshape(-1, 7)
    return float(path[:, 2].max())


@pytest.mark.parametrize("side_m", [0.2, 0.4])
def test_a_box_that_friction_holds_tips_where_the_force_leaves_its_base(engine, side_m):
    """A force F at half the height h tips it if F h / 2 > m g b / 2."""
    mass_kg, friction = 30.0, 0.8
    threshold_m = side_m * mass_kg * GRAVITY / FORCE.force_n
    assert friction * mass_kg * GRAVITY > FORCE.force_n
    tilts = []
    for share in (0.9, 1.4, 2.0):
        box = crate("Box_0", (side_m, side_m, round(share * threshold_m, 4)), mass_kg=mass_kg)
        tilts.append(greatest_tilt_deg(solved(engine, FORCE, Body.of(box, STANDING))))
    assert tilts[0] < 1.0
    assert tilts[1] > 2.0
    assert tilts[2] > 20.0


def test_a_box_that_slides_tips_where_friction_leaves_its_base(engine):
    """Friction at the floor turns it over if the coefficient exceeds b / h."""
    size, threshold = (0.3, 0.3, 0.5), 0.3 / 0.5
    tilts = [
        greatest_tilt_deg(solved(engine, KICK, Body.of(box, STANDING)))
        for box in (crate("Box_0", size, friction=share * threshold) for share in (0.85, 1.3))
    ]
    assert tilts[0] < 1.5
    assert tilts[1] > 5.0


@pytest.mark.parametrize("friction", [0.4, 0.8])
def test_what_slides_stays_on_the_floor(engine, friction):
    """Solvers that lift what slides by its friction let a crate hop a centimetre high."""
    box = crate("Box_0", (0.6, 0.5, 0.1), friction=friction)
    assert greatest_height_m(solved(engine, KICK, Body.of(box, STANDING))) < 0.051 + 0.002


def test_a_sphere_rolls(engine):
    """Friction turns what slides until it rolls at v / (1 + I / m r²), 0.6 v for this inertia."""
    ball = asset("Ball_0", part("sphere", (0.0, 0.0, 0.12), (0.24, 0.24, 0.24)), mass_kg=0.6)
    solution = solved(engine, KICK, Body.of(ball, STANDING))
    slide = 2.0**2 / (2.0 * 0.6 * GRAVITY)
    # Rolling friction alone would stop it after 0.9 m; it has facets, too.
    assert 1.2 * slide < solution.poses[0].x < slide + 0.9
    path = np.frombuffer(solution.paths[0], dtype=np.float32).reshape(-1, 7)
    turns = 2.0 * np.arccos(np.clip(np.abs((path[1:, 3:] * path[:-1, 3:]).sum(axis=1)), 0.0, 1.0))
    assert turns.sum() > 0.5 * solution.poses[0].x / 0.12


@pytest.mark.parametrize("masses", [(2.0, 2.0), (10.0, 2.0), (2.0, 10.0)])
def test_a_collision_keeps_momentum_and_no_more_than_the_energy(engine, masses):
    first, second = (
        crate(f"Box_{k}", (0.3, 0.3, 0.3), mass_kg=masses[k], friction=0.0) for k in (0, 1)
    )
    bodies = (Body.of(first, STANDING), Body.of(second, Pose(0.4, 0.0, 0.001, UPRIGHT)))
    with ENGINES[engine]().load(PhysicsScene(bodies)) as simulation:
        simulation.set_velocity(0, (1.5, 0.0, 0.0), (0.0, 0.0, 0.0))
        simulation.step(48)
        speeds = [simulation.velocity(k)[0][0] for k in (0, 1)]
    assert np.dot(masses, speeds) == pytest.approx(1.5 * masses[0], rel=0.005)
    restitution = (speeds[1] - speeds[0]) / 1.5
    assert -0.02 < restitution < 0.35


@pytest.mark.parametrize("moves", [True, False])
def test_two_bodies_rub_by_the_product_of_their_coefficients(engine, moves):
    """A box kicked along a long slab, which is heavy or fixed: slide v² / 2 μ₁ μ₂ g."""
    slab = crate("Slab_0", (3.0, 1.0, 0.2), mass_kg=2000.0, friction=0.7)
    box = crate("Box_0", (0.4, 0.4, 0.1), mass_kg=3.0, friction=0.8)
    below = Body.of(slab, Pose(1.0, 0.0, 0.001, UPRIGHT), moves=moves)
    solution = solved(engine, KICK, Body.of(box, Pose(0.0, 0.0, 0.203, UPRIGHT)), below)
    expected = 2.0**2 / (2.0 * 0.8 * 0.7 * GRAVITY)
    assert solution.poses[0].x == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_glancing_collision_rubs_by_the_product_too(engine, friction):
    """In the air against a wall: the impulse along it is friction times the one across it."""
    block = crate("Block_0", (0.2, 4.0, 1.0), friction=0.6)
    round_part = part("cylinder", (0.0, 0.0, 0.05), (0.4, 0.4, 0.1))
    disc = asset("Disc_0", round_part, mass_kg=2.0, friction=friction)
    bodies = (
        Body.of(disc, Pose(0.0, 0.0, 0.5, UPRIGHT)),
        Body.of(block, Pose(0.35, 0.0, 0.001, UPRIGHT), moves=False),
    )
    with ENGINES[engine]().load(PhysicsScene(bodies)) as simulation:
        simulation.set_velocity(0, (1.0, 1.0, 0.0), (0.0, 0.0, 0.0))
        simulation.step(30)
        (across, along, _), _ = simulation.velocity(0)
    assert across < 0.02
    assert (1.0 - along) / (1.0 - across) == pytest.approx(0.6 * friction, abs=0.03)


def test_a_body_that_nothing_touches_stays_where_it_is(engine):
    """It may sleep, or be borne: what trembles would have moved after a push elsewhere."""
    box = crate("Box_0", (0.4, 0.4, 0.4), friction=0.6)
    far = Pose(0.0, 1.0, 0.001, UPRIGHT)
    solution = solved(engine, KICK, Body.of(box, STANDING), Body.of(box, far))
    assert math.dist(position(solution.poses[1]), position(far)) < 2e-5
    struck = solved(
        engine, KICK, Body.of(box, STANDING), Body.of(box, Pose(0.6, 0.0, 0.001, UPRIGHT))
    )
    assert struck.poses[1].x > 0.62
