"""Visibility against rays sampled point by point through scipy's hulls."""

import math

import numpy as np
import pytest
from builders import UPRIGHT, asset, crate, part
from scipy.spatial import Delaunay

from internav_data.geometry import part_corners, transform, yaw_quaternion
from internav_data.geometry.headings import HEADINGS
from internav_data.records import Pose
from internav_data.world.occlusion import MAX_POINTS, occlusion_shape, placed_occlusion_shape
from internav_data.world.visibility import CAMERA_M, REACH_M, Occluders, camera_pose, is_hidden

SHAPES = ("box", "cylinder", "sphere")


def some_asset(rng, name):
    parts = [
        part(
            SHAPES[int(rng.integers(3))],
            tuple(rng.uniform((-0.3, -0.3, 0.2), (0.3, 0.3, 0.8))),
            tuple(rng.uniform(0.1, 0.5, 3)),
            yaw_quaternion(float(rng.uniform(0, 360))),
        )
        for _ in range(int(rng.integers(1, 6)))
    ]
    return asset(name, *parts)


def cube(side=0.3):
    return crate("Cube_0", (side, side, side))


def lies_inside(hull, points, tol=0.0):
    """Return whether some of the points (n, 3) lie inside a hull; those outside its box do not."""
    low, high = hull.points.min(axis=0) - tol, hull.points.max(axis=0) + tol
    near = points[((points >= low) & (points <= high)).all(axis=1)]
    return len(near) > 0 and (hull.find_simplex(near, tol=tol or None) >= 0).any()


def test_rays_are_obstructed_where_samples_lie_inside_a_hull():
    rng = np.random.default_rng(5)
    checked = hidden = 0
    for trial in range(40):
        thing = some_asset(rng, f"thing {trial}")
        pose = Pose(*rng.uniform(-0.2, 0.2, 3), yaw_quaternion(float(rng.uniform(0, 360))))
        shell = placed_occlusion_shape(thing, pose)
        hulls = [Delaunay(transform(part_corners(p), pose)) for p in thing.parts]
        for _ in range(5):
            eye, end = rng.uniform(-1.5, 1.5, 3), rng.uniform((-0.4, -0.4, 0), (0.4, 0.4, 1))
            samples = eye + np.linspace(0.0, 1.0, 400)[:, None] * (end - eye)
            inside = any(lies_inside(hull, samples) for hull in hulls)
            answer = is_hidden(eye, end, shell.planes, shell.starts, -1)
            if answer and not inside:
                # Samples 6 mm apart may step over an edge: it must be thin.
                samples = eye + np.linspace(0.0, 1.0, 80_000)[:, None] * (end - eye)
                inside = any(lies_inside(hull, samples, tol=1e-6) for hull in hulls)
            assert answer == inside
            hidden += inside
            checked += 1
    assert checked == 200
    assert 30 < hidden < 170


def test_points_are_few_and_belong_to_their_parts():
    rng = np.random.default_rng(1)
    for trial in range(20):
        thing = some_asset(rng, f"points {trial}")
        shell = occlusion_shape(thing)
        assert len(thing.parts) < len(shell.points) <= MAX_POINTS
        for point, owner in zip(shell.points, shell.owners, strict=True):
            planes = shell.planes[shell.starts[owner] : shell.starts[owner + 1]]
            assert (planes[:, :3] @ point - planes[:, 3] <= 1e-6).all()


def sees(placed, place=0, *, heading=0, horizon=30, eye=(0.0, 0.0)):
    occluders = Occluders([placed_occlusion_shape(thing, pose) for thing, pose in placed])
    return occluders.seen(camera_pose(*eye, HEADINGS[heading], horizon), place)


@pytest.mark.parametrize("heading", range(4))
def test_only_what_is_ahead_is_seen(heading):
    x, y = HEADINGS[heading]
    there = Pose(0.9 * x, 0.9 * y, 0.0, UPRIGHT)
    for looking in range(4):
        assert sees([(cube(), there)], heading=looking) == (looking == heading)


def test_reach_is_measured_in_the_plane():
    edge = math.sqrt(REACH_M**2 - 0.15**2) + 0.15  # its nearest corners lie 0.15 m aside
    near, far = edge - 0.001, edge + 0.001
    assert sees([(cube(), Pose(near, 0.0, 0.0, UPRIGHT))])
    assert not sees([(cube(), Pose(far, 0.0, 0.0, UPRIGHT))])


def test_the_horizon_decides_what_is_seen_of_the_floor():
    flat = crate("Flat_0", (0.02, 0.02, 0.02))
    # Depression d is in view while |d - horizon| <= 45 degrees.
    for horizon in (-30, 0, 30, 60):
        for x in (0.35, 0.5, 0.8, 1.1, 1.2):
            down = [
                math.degrees(math.atan2(CAMERA_M - z, x + dx))
                for z in (0.0, 0.02)
                for dx in (-0.01, 0.01)
            ]
            expected = any(abs(d - horizon) <= 45 for d in down)
            assert sees([(flat, Pose(x, 0.0, 0.0, UPRIGHT))], horizon=horizon) == expected


def test_what_stands_between_hides():
    occluders = crate("Screen_0", (0.05, 2.0, 1.8))
    behind = (cube(), Pose(1.0, 0.0, 0.0, UPRIGHT))
    assert sees([behind])
    assert not sees([behind, (occluders, Pose(0.5, 0.0, 0.0, UPRIGHT))])
    assert sees([behind, (occluders, Pose(1.4, 0.0, 0.0, UPRIGHT))])
    low = crate("Low_0", (0.05, 2.0, 0.1))
    assert sees([behind, (low, Pose(0.5, 0.0, 0.0, UPRIGHT))])


def test_a_part_does_not_hide_its_own_centre():
    # All corners are out of reach: only the centre, inside the part, tells that it is there.
    bench = crate("Bench_0", (3.0, 0.4, 0.4))
    across = Pose(0.9, 0.0, 0.0, yaw_quaternion(90))
    assert sees([(bench, across)])
    assert not sees([(bench, Pose(1.3, 0.0, 0.0, yaw_quaternion(90)))])
