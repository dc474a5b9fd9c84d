"""Pushes against closed forms: Coulomb friction, walls, mirrors, energy."""

import itertools
import math
from contextlib import contextmanager

import numpy as np
import pytest
from builders import UPRIGHT, chair, crate

from internav_data.geometry import (
    asset_corners,
    footprint,
    rotation_matrix,
    transform,
    yaw_quaternion,
)
from internav_data.physics import ENGINES, Body, PhysicsScene, wall_body
from internav_data.physics.engines.protocol import Simulation
from internav_data.physics.kdop import overlap
from internav_data.physics.pushing import AGENT_MIN_M
from internav_data.physics.solving import solve_push
from internav_data.physics.sweep import extent_of
from internav_data.records import PUSH_SPECS, Pose, Wall
from internav_data.world.visibility import axis_distance

GRAVITY = 9.81


def low_box(mass_kg, friction, size=(0.6, 0.5, 0.1)):
    return crate("Crate_0", size, mass_kg=mass_kg, friction=friction)


CHAIR = chair(seat_m=0.22, mass_kg=6.0, friction=0.5)
"""Low enough that a push at its middle does not topple it."""


def alone(box):
    return ()


def among(*bodies):
    """Everything whose octagon overlaps one, as a world gathers it."""
    extents = [extent_of(body.asset, body.pose).dop8 for body in bodies]

    def near(dop8):
        return [(k, bodies[k]) for k, extent in enumerate(extents) if overlap(extent, dop8)]

    return near


STANDING = Pose(3.0, 4.0, 0.001, UPRIGHT)


@pytest.mark.parametrize("friction", [0.4, 0.6, 0.8])
@pytest.mark.parametrize("mass_kg", [0.3, 2.0, 12.0])
def test_free_slides_go_as_far_as_coulomb_says(mass_kg, friction, push):
    kicked = push(Body.of(low_box(mass_kg, friction), STANDING), 0, alone, PUSH_SPECS["kick"])
    assert kicked.displacement_m == pytest.approx(2.0**2 / (2 * friction * GRAVITY), rel=0.05)
    assert not kicked.toppled
    # Pushed by a force, it covers v^2 / 2a more until it is let go at v.
    acceleration = 200.0 / mass_kg - friction * GRAVITY
    speed = min(2.0, acceleration * PUSH_SPECS["force"].seconds)
    expected = speed**2 / (2 * acceleration) + speed**2 / (2 * friction * GRAVITY)
    forced = push(Body.of(low_box(mass_kg, friction), STANDING), 0, alone)
    if mass_kg > 1.0:  # lighter ones have their speed within one step: less than theory's way
        assert forced.displacement_m == pytest.approx(expected, rel=0.05)
    else:
        assert forced.displacement_m == pytest.approx(kicked.displacement_m, rel=0.05)


@pytest.mark.parametrize("friction", [0.3, 0.6, 0.8])
@pytest.mark.parametrize("mass_kg", [0.3, 2.0, 20.0])
def test_a_step_is_held_until_its_distance_and_slides_as_far_as_coulomb_says(
    mass_kg, friction, push
):
    spec = PUSH_SPECS["step"]
    stepped = push(Body.of(low_box(mass_kg, friction), STANDING), 0, alone, spec)
    slide = spec.speed_m_s**2 / (2 * friction * GRAVITY)
    # Let go up to one time step late, at the speed less what friction takes in a time step.
    assert stepped.displacement_m == pytest.approx(spec.distance_m + slide, abs=0.004)
    assert not stepped.toppled


@pytest.mark.parametrize("model", ["force", "step"])
@pytest.mark.parametrize("depth_m", [0.24, 0.36])
@pytest.mark.parametrize("friction", [0.4, 0.6])
def test_what_is_pushed_topples_where_friction_exceeds_half_its_depth_over_its_middles_height(
    model, depth_m, friction, engine, push
):
    """About the middle, where the push acts, friction turns by its height, the floor by half the
    depth at most. Neither the push's size nor its speed counts."""
    tips_at_m = depth_m / friction
    # MuJoCo's rolling friction of 0.01 (1 + friction) metres holds as a deeper base would.
    rolls_m = 0.01 * (1.0 + friction)
    topples_at_m = {"bullet": 1.12 * tips_at_m, "mujoco": 1.03 * (depth_m + 2 * rolls_m) / friction}
    for height_m in (0.97 * tips_at_m, topples_at_m[engine]):
        box = crate("Crate_0", (depth_m, 0.5, height_m), mass_kg=6.0, friction=friction)
        pushed = push(Body.of(box, STANDING), 0, alone, PUSH_SPECS[model])
        assert pushed.success
        assert pushed.toppled == (height_m > tips_at_m)


def test_a_step_moves_the_heaviest_as_far_as_its_time_allows(push):
    friction, spec = 0.5, PUSH_SPECS["step"]
    heavy = low_box(round(200.0 / (friction * GRAVITY + 0.2), 2), friction)  # gains 0.2 m/s²
    stepped = push(Body.of(heavy, STANDING), 0, alone, spec)
    assert stepped.displacement_m == pytest.approx(0.5 * 0.2 * spec.seconds**2, abs=0.01)
    assert not push(Body.of(low_box(42.0, friction), STANDING), 0, alone, spec).success


def test_steps_of_whatever_does_not_topple_end_about_a_lattice_step_away(push):
    from internav_data.catalog import catalogue

    ends, toppled = [], 0
    for k, thing in enumerate(asset for asset in catalogue().spawnable[::9] if asset.pushable):
        pose = Pose(3.0, 4.0, 0.001, yaw_quaternion(15 * k))
        stepped = push(Body.of(thing, pose), k % 4, alone, PUSH_SPECS["step"])
        toppled += stepped.toppled
        if stepped.success and not stepped.toppled:
            ends.append(stepped.displacement_m)
    assert len(ends) > 15
    assert np.quantile(ends, 0.95) < 0.27
    assert np.median(ends) > 0.22
    assert toppled < len(ends)


@pytest.mark.parametrize("friction", [0.4, 0.6, 0.8])
def test_friction_decides_who_is_too_heavy(friction, push):
    threshold = 200.0 / (friction * GRAVITY)
    light = push(Body.of(low_box(round(0.8 * threshold, 1), friction), STANDING), 0, alone)
    heavy = push(Body.of(low_box(round(1.05 * threshold, 1), friction), STANDING), 0, alone)
    assert light.success
    assert not heavy.success
    assert heavy.reason == "too heavy"
    assert heavy.displacement_m <= 0.001


def test_a_thing_against_a_wall_stays(push):
    # Pushed at its middle, 5 mm before a wall as high as itself.
    wall = wall_body(Wall(3.305, 0.0, 3.425, 8.0, 0.0, 2.6))
    pushed = push(Body.of(low_box(10.0, 0.5), STANDING), 0, among(wall))
    assert not pushed.success
    assert pushed.reason == "something is in the way"
    assert pushed.displacement_m < 0.01
    assert push(Body.of(low_box(10.0, 0.5), STANDING), 2, among(wall)).success


def test_a_push_north_is_a_push_east_turned(push):
    for heading in range(4):
        pose = Pose(3.0, 4.0, 0.001, yaw_quaternion(90 * heading))
        there = push(Body.of(CHAIR, pose), heading, alone)
        east = push(Body.of(CHAIR, STANDING), 0, alone)
        assert there.displacement_m == pytest.approx(east.displacement_m, abs=2e-4)
        assert there.seconds == east.seconds
        far = (there.pose.x - 3.0, there.pose.y - 4.0)
        ahead = (math.cos(math.pi / 2 * heading), math.sin(math.pi / 2 * heading))
        assert far[0] * ahead[0] + far[1] * ahead[1] == pytest.approx(east.pose.x - 3.0, abs=2e-4)


def test_a_free_push_is_the_one_in_a_scene_that_nothing_touches(push):
    wall = wall_body(Wall(3.0, 5.2, 6.0, 5.32, 0.0, 2.6))
    free = push(Body.of(CHAIR, STANDING), 0, alone)
    # The wall is gathered by hand though it is out of reach: Bullet must say the same.
    beside = push(Body.of(CHAIR, STANDING), 0, lambda _: [(0, wall)])
    assert beside.displacement_m == pytest.approx(free.displacement_m, abs=1e-3)
    assert push(Body.of(CHAIR, STANDING), 0, among(wall)) == free


def test_what_is_met_is_pushed_too(push):
    other = Body.of(low_box(2.0, 0.5), Pose(3.8, 4.1, 0.001, UPRIGHT))
    pushed = push(Body.of(low_box(12.0, 0.5), STANDING), 0, among(other))
    assert pushed.success
    ((key, pose),) = pushed.moved
    assert key == 0
    assert pose.x > 3.85
    # The same thing fixed ends the way at its face.
    stuck = push(
        Body.of(low_box(12.0, 0.5), STANDING),
        0,
        among(Body.of(other.asset, other.pose, moves=False)),
    )
    assert stuck.pose.x < 3.0 + 0.2 + 0.01
    assert stuck.moved == ()


def test_what_a_neighbour_runs_into_takes_part(push):
    # A row of three: the wall behind the last one lies far outside the first one's own reach.
    row = [Body.of(low_box(3.0, 0.4), Pose(3.62 + 0.62 * k, 4.0, 0.001, UPRIGHT)) for k in range(3)]
    wall = wall_body(Wall(5.2, 0.0, 5.32, 8.0, 0.0, 2.6))
    pushed = push(Body.of(low_box(3.0, 0.4), STANDING), 0, among(*row, wall))
    for k, pose in pushed.moved:
        assert extent_of(row[k].asset, pose).dop8[0] <= 5.2 + 0.002


def test_what_only_a_neighbour_reaches_takes_part_too(push):
    # Neither the first one's way nor what lies round the second one reaches the wall.
    other = Body.of(low_box(1.0, 0.4), Pose(3.62, 4.0, 0.001, UPRIGHT))
    wall = wall_body(Wall(4.2, 0.0, 4.32, 8.0, 0.0, 2.6))
    free = push(Body.of(low_box(12.0, 0.4), STANDING), 0, alone)
    assert free.pose.x + 0.3 < 4.1
    ((_, pose),) = push(Body.of(low_box(12.0, 0.4), STANDING), 0, among(other)).moved
    assert pose.x + 0.3 > 4.25
    ((_, pose),) = push(Body.of(low_box(12.0, 0.4), STANDING), 0, among(other, wall)).moved
    assert pose.x + 0.3 < 4.2 + 0.002


@pytest.mark.parametrize("distance", [0.2005, 0.21, 0.3])
def test_nothing_pulled_ends_inside_the_agent(distance, push):
    thing = low_box(5.0, 0.5)
    agent = (3.0 - 0.3 - distance, 4.0)
    pulled = push(Body.of(thing, STANDING), 2, alone, agent=agent, agent_gap_m=distance)
    assert axis_distance(*agent, footprint(thing, pulled.pose)) >= min(distance, AGENT_MIN_M) - 2e-3
    assert pulled.pose.x >= 3.0 - (distance - 0.2) - 2e-3


@pytest.mark.parametrize("yaw", [0, 15, 40, 75])
def test_slides_in_a_mirrored_house_are_mirrored(yaw, push):
    def scene(sign):
        wall = wall_body(
            Wall(3.2, min(sign * 4.6, sign * 4.72), 4.6, max(sign * 4.6, sign * 4.72), 0.0, 2.6)
        )
        other = Body.of(
            low_box(3.0, 0.5), Pose(3.75, sign * 4.25, 0.001, yaw_quaternion(sign * 20))
        )
        pose = Pose(3.0, sign * 4.0, 0.001, yaw_quaternion(sign * yaw))
        return push(Body.of(low_box(6.0, 0.5), pose), 0, among(wall, other))

    left, right = scene(1), scene(-1)
    assert not left.toppled
    assert left.pose.x == pytest.approx(right.pose.x, abs=0.01)
    assert left.pose.y == pytest.approx(-right.pose.y, abs=0.01)
    for (_, a), (_, b) in zip(left.moved, right.moved, strict=True):
        assert a.x == pytest.approx(b.x, abs=0.01)
        assert a.y == pytest.approx(-b.y, abs=0.01)


class Watched:
    """An engine whose simulations add up the energy of all that moves after each step, joules."""

    row, advance, placements = Simulation.row, Simulation.advance, Simulation.placements

    def __init__(self, engine):
        self.engine, self.step_s, self.energies = engine, engine.step_s, []

    @contextmanager
    def load(self, scene):
        with self.engine.load(scene) as simulation:
            self.simulation, self.scene = simulation, scene
            yield self

    def __getattr__(self, name):
        return getattr(self.simulation, name)

    def step(self, count=1):
        self.simulation.step(count)
        total = 0.0
        for k, body in enumerate(self.scene.bodies):
            if not body.moves:
                continue
            mass = body.dynamics.mass_kg
            (*_, height), (x, y, z, w) = self.simulation.placement(k)
            speed, spin = self.simulation.velocity(k)
            own = rotation_matrix((x, y, z, w)).T @ np.array(spin)
            # Both engines take the solid box round the object, 2 mm wider at each side.
            sides = np.ptp(asset_corners(body.asset)[0], axis=0) + 0.004
            inertia = mass / 12.0 * (np.sum(sides**2) - sides**2)
            total += 0.5 * mass * np.dot(speed, speed) + 0.5 * np.dot(inertia, own**2)
            total += mass * GRAVITY * height
        self.energies.append(total)


def test_energy_never_appears_from_nothing(engine):
    """After letting go, kinetic plus potential energy of all that moves only falls."""
    tall = crate("Pillar_0", (0.25, 0.25, 1.2), mass_kg=8.0, friction=0.6)
    wall = wall_body(Wall(1.2, -4.0, 1.32, 4.0, 0.0, 2.6))
    other = Body.of(low_box(3.0, 0.5), Pose(0.7, 0.0, 0.001, UPRIGHT))
    start = Pose(0.0, 0.0, 0.001, UPRIGHT)
    for thing, around in itertools.product((low_box(5.0, 0.5), CHAIR, tall), ((), (other, wall))):
        watched = Watched(ENGINES[engine]())
        solve_push(watched, PhysicsScene((Body.of(thing, start), *around)), PUSH_SPECS["kick"])
        run, kinetic = watched.energies, 0.5 * thing.mass_kg * 2.0**2
        # Never more than there was when it was let go; what sank in by a step's way when it
        # hit something is pushed apart again, which gives back a part of what was lost.
        assert max(run) <= run[0] + 0.001 * kinetic
        rises = [b - a for a, b in itertools.pairwise(run)]
        assert max(rises) < (0.10 if thing is tall else 0.02) * kinetic


def test_a_tall_thing_topples_and_lies_on_the_floor(push):
    tall = crate("Pillar_0", (0.25, 0.25, 1.2), mass_kg=8.0, friction=0.8)
    pushed = push(Body.of(tall, STANDING), 0, alone, PUSH_SPECS["kick"])
    assert pushed.toppled
    corners, _ = asset_corners(tall)
    heights = transform(corners, pushed.pose)[:, 2]
    assert heights.min() == pytest.approx(0.001, abs=0.003)
    assert heights.max() < 0.3


def test_what_slides_free_slides_straight(push):
    """Solvers that let things drift and turn (Bullet's maximal coordinates do) fail here."""
    from internav_data.catalog import catalogue

    turned, aside = [], []
    for thing in catalogue().spawnable[::9]:
        if not thing.pushable:
            continue
        done = push(Body.of(thing, STANDING), 0, alone)
        if done.toppled or done.displacement_m < 0.2:
            continue
        x, y, z, w = done.pose.quaternion
        yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        turned.append(abs(math.degrees(yaw)))
        aside.append(abs(done.pose.y - STANDING.y) / done.displacement_m)
    assert len(turned) > 15
    assert np.mean(turned) < 0.1
    assert max(turned) < 1.0
    assert max(aside) < 0.01
