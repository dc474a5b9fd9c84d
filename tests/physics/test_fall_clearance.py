"""Clearances of a fall against shapely, and the promise that they give to a settle."""

import itertools

import numpy as np
import pytest
from builders import UPRIGHT, asset, chair, crate, part, screen, table, yaw
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import MultiPoint

from internav_data.geometry import part_corners, transform
from internav_data.physics import Body, settle, wall_body
from internav_data.physics.fall_clearance import DROP_M, fall_clearance, touches
from internav_data.physics.narrow_phase import joined_prisms, prisms_of
from internav_data.records import Pose, Wall
from internav_data.verification.overlaps import hulls_overlap

THINGS = (
    chair(),
    screen(),
    table(),
    crate("Box_0", (0.3, 0.5, 0.02)),
    asset(
        "Tripod_0",
        part("cylinder", (0.0, 0.0, 0.4), (0.1, 0.1, 0.8)),
        part("box", (0.2, 0.0, 0.3), (0.04, 0.04, 0.7), (0.0, 0.38268343, 0.0, 0.92387953)),
        part("sphere", (0.0, 0.0, 0.9), (0.3, 0.3, 0.2)),
    ),
)
POSES = st.builds(
    lambda x, y, z, turn: Pose(x, y, z, yaw(15.0 * turn)),
    *(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
    *(st.sampled_from((0.0, 0.0, 0.019, 0.05, 0.4)), st.integers(0, 23)),
)


def corners_of(thing, pose):
    return [transform(part_corners(one), pose) for one in thing.parts]


def slow_clearance(falling, others, stop_at):
    """The least distance of plans whose heights the fall could bring together."""
    least = stop_at
    for own, other in itertools.product(falling, others):
        low, high = own[:, 2].min() - stop_at, own[:, 2].max() + DROP_M + stop_at
        if low <= other[:, 2].max() and high >= other[:, 2].min():
            plans = MultiPoint(own[:, :2]).convex_hull, MultiPoint(other[:, :2]).convex_hull
            least = min(least, plans[0].distance(plans[1]))
    return least


def boxes_meet(own, other):
    return (own.min(axis=0) < other.max(axis=0)).all() and (
        own.max(axis=0) > other.min(axis=0)
    ).all()


@settings(max_examples=60)
@given(
    st.sampled_from(THINGS),
    st.integers(0, 23),
    st.lists(st.tuples(st.sampled_from(THINGS), POSES), max_size=3),
    st.sampled_from((0.01, 0.3)),
)
def test_it_is_what_shapely_measures(thing, turn, others, stop_at):
    pose = Pose(0.0, 0.0, 0.0, yaw(15.0 * turn))
    here, around = prisms_of(thing, pose), joined_prisms([prisms_of(*other) for other in others])
    mine = corners_of(thing, pose)
    there = [corners for other in others for corners in corners_of(*other)]
    slow = slow_clearance(mine, there, stop_at)
    assert fall_clearance(here, around, stop_at) == pytest.approx(slow, abs=1e-9)
    # Conservative: bodies that share a ball of a millimetre touch, however they lean.
    pairs = [p for p in itertools.product(mine, there) if slow == 0.0 and boxes_meet(*p)]
    if any(hulls_overlap(*pair) for pair in pairs):
        assert touches(here, around)
    assert not touches(here, around) or slow < 1e-9


@pytest.mark.parametrize(
    ("height", "nearest"), [(0.0, 0.0), (0.027, 0.0), (0.04, 0.01), (0.5, 0.01)]
)
def test_the_fall_itself_takes_part(height, nearest):
    # The foot is 18 mm thick, falls from 10 mm, and may rise by less than 10 mm.
    above = crate("Shelf_0", (0.3, 0.3, 0.02))
    here = prisms_of(screen(), Pose(0.0, 0.0, 0.0, UPRIGHT))
    there = prisms_of(above, Pose(0.0, 0.19, height, UPRIGHT))
    assert fall_clearance(here, there, 0.01) == nearest


def test_nothing_is_as_far_as_can_be():
    here = prisms_of(screen(), Pose(0.0, 0.0, 0.0, UPRIGHT))
    assert fall_clearance(here, joined_prisms([]), 0.25) == 0.25
    assert not touches(here, joined_prisms([]))


def test_a_certificate_is_of_the_foot_in_the_wall():
    """The panel is 16 cm from the wall, the foot 2 cm inside: no free fall."""
    wall = wall_body(Wall(-2.0, 0.18, 2.0, 0.3, 0.0, 2.6))
    pose = Pose(0.0, 0.0, 0.0, UPRIGHT)
    clear = fall_clearance(prisms_of(screen(), pose), prisms_of(wall.asset, wall.pose), 0.01)
    alone = settle(Body.of(screen(), pose), 0.01, list)
    real = settle(Body.of(screen(), pose), clear, lambda: [wall])
    assert clear == 0.0
    assert not alone.refusal
    assert real.refusal or real != alone


@pytest.mark.parametrize("seed", range(3))
def test_a_fall_within_its_clearance_is_a_free_one(seed):
    """Solved among neighbours that are as near as the clearance says, nothing is different."""
    rng = np.random.default_rng(seed)
    pose = Pose(0.0, 0.0, 0.0, yaw(15.0 * int(rng.integers(24))))
    for thing in THINGS[:3]:
        bodies = []
        for _ in range(200):
            x, y = (round(v, 4) for v in rng.uniform(-0.9, 0.9, 2).tolist())
            other = Body.of(THINGS[int(rng.integers(3))], Pose(x, y, 0.0, UPRIGHT), moves=False)
            prisms = prisms_of(other.asset, other.pose)
            if fall_clearance(prisms_of(thing, pose), prisms, 0.1) >= 0.01:
                bodies.append(other)
        assert len(bodies) > 10
        near = bodies[:12]
        free = settle(Body.of(thing, pose), 0.01, list)
        assert free == settle(Body.of(thing, pose), 0.0, lambda near=near: near)
