"""The narrow phase against shapely, and the bodies that it keeps out of a push."""

import itertools
import math

import numpy as np
import pytest
from builders import UPRIGHT, asset, box, table
from shapely.geometry import MultiPoint, Point

from internav_data.geometry import part_corners, rotation_matrix, yaw_quaternion
from internav_data.physics import Body, push
from internav_data.physics.frames import Frame
from internav_data.physics.kdop import overlap
from internav_data.physics.narrow_phase import met_on_path, prisms_of, prisms_of_collider
from internav_data.physics.sweep import KEPT_M, centred_corners, extent_of, sweep_of
from internav_data.records import Pose

MARGIN = 0.01


CHAIR = asset(
    "Chair_0",
    box((0.0, 0.0, 0.22), (0.45, 0.45, 0.44)),
    box((0.21, 0.0, 0.6), (0.03, 0.45, 0.3)),
    mass_kg=6.0,
    friction=0.5,
)
TABLE = table(size=(1.2, 0.8, 0.74), leg_m=0.05, mass_kg=20.0, friction=0.5)


def hulls(thing, middle, turn):
    """Plan and heights of each part, its body's centre of mass and orientation given."""
    matrix, corners = rotation_matrix(turn), centred_corners(thing)
    placed, first = corners @ matrix.T + np.array(middle), 0
    for part in thing.parts:
        count = len(part_corners(part))
        own = placed[first : first + count]
        first += count
        yield MultiPoint(own[:, :2]).convex_hull, own[:, 2].min(), own[:, 2].max()


def gap(one, other):
    """Distance by which heights or plans keep apart, at least."""
    return max(other[1] - one[2], one[1] - other[2], one[0].distance(other[0]))


def placed(thing, pose):
    middle = -centred_corners(thing)[0] + np.array(part_corners(thing.parts[0]))[0]
    matrix = rotation_matrix(pose.quaternion)
    return list(hulls(thing, matrix @ middle + np.array((pose.x, pose.y, pose.z)), pose.quaternion))


def walk(rng):
    """A wild way: a step of 3 mm and a turn of half a degree about any axis, again and again."""
    middle, turn = np.array([0.0, 0.0, 0.3]), np.array(yaw_quaternion(int(rng.integers(360))))
    axis, ahead = rng.normal(size=3), rng.normal(size=3) * (1.0, 1.0, 0.1)
    for k in range(150):
        yield tuple(middle + 0.003 * k * ahead / np.linalg.norm(ahead)), tuple(turn)
        turn = turn + 0.004 * np.array([*axis, 0.0])
        turn /= np.linalg.norm(turn)


@pytest.mark.parametrize("seed", range(6))
def test_what_is_met_is_what_shapely_says(seed):
    rng = np.random.default_rng(seed)
    frame = Frame(3.0, 4.0, int(rng.integers(4)))
    others = [
        Pose(*rng.uniform(-1.2, 1.2, 2), 0.0, yaw_quaternion(int(rng.integers(360))))
        for _ in range(12)
    ]
    motion, nearest = [], [math.inf] * len(others)
    bodies = [placed(TABLE, pose) for pose in others]
    for middle, turn in walk(rng):
        motion.append((*middle, *turn))
        here = list(hulls(CHAIR, middle, turn))
        for k, body in enumerate(bodies):
            least = min(gap(one, other) for one, other in itertools.product(here, body))
            nearest[k] = min(nearest[k], least)
    prisms = [prisms_of(TABLE, frame.leave(pose)) for pose in others]
    met = met_on_path(CHAIR, sweep_of(CHAIR, np.array(motion))[1], frame, prisms, MARGIN)
    for hit, least in zip(met, nearest, strict=True):
        # Poses are kept every 4 mm; 32 directions round a corner off by half a percent.
        assert not hit or least < MARGIN + 0.004
        assert hit or least > MARGIN - KEPT_M
    assert any(met)
    assert not all(met)


def test_a_path_keeps_its_ends_and_leaves_out_what_stands_still():
    motion = np.array([(0.0, 0.0, min(k, 10) * 0.001, *UPRIGHT) for k in range(1000)])
    path = np.frombuffer(sweep_of(CHAIR, motion)[1], dtype=np.float32).reshape(-1, 7)
    assert path[:, 2] == pytest.approx([0.0, 0.004, 0.008, 0.01], abs=1e-6)


@pytest.mark.parametrize("distance", [0.4, 0.5])
def test_a_column_is_round(distance):
    _, path = sweep_of(CHAIR, np.array([(0.0, 0.0, 0.3, *UPRIGHT)]))
    ((plan, *_), _) = hulls(CHAIR, (0.0, 0.0, 0.3), UPRIGHT)
    for angle in np.linspace(0.0, 2.0 * math.pi, 25):
        x, y = distance * math.cos(angle), distance * math.sin(angle)
        collider = prisms_of_collider(x, y, 0.15, 0.022, 1.8)
        (met,) = met_on_path(CHAIR, path, Frame(0.0, 0.0, 0), [collider], MARGIN)
        between = plan.distance(Point(x, y)) - 0.15
        assert abs(between - MARGIN) < 0.002 or met == (between < MARGIN)


def near_to(*bodies):
    extents = [extent_of(body.asset, body.pose).dop8 for body in bodies]
    return lambda dop8: [(k, body) for k, body in enumerate(bodies) if overlap(extents[k], dop8)]


def test_a_chair_pulled_out_from_under_a_table_leaves_the_table_out(solved):
    table = Body.of(TABLE, Pose(3.0, 4.0, 0.001, UPRIGHT))
    seat = Pose(3.5, 4.0, 0.001, UPRIGHT)
    free = push(Body.of(CHAIR, seat), 0, near_to())
    assert push(Body.of(CHAIR, seat), 0, near_to(table)) == free
    assert [len(scene.bodies) for scene in solved] == [1]
    # Pushed on under it, its back runs into the top.
    assert push(Body.of(CHAIR, seat), 2, near_to(table)).moved
    assert [len(scene.bodies) for scene in solved] == [1, 1, 2]
