"""Turning, rounding and corners against scipy and by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders import asset, part
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from internav_data.geometry import (
    asset_corners,
    centre_of_mass,
    multiply,
    part_corners,
    rotation_matrix,
    round_m,
    round_quaternion,
    transform,
    yaw_quaternion,
)
from internav_data.records import Pose

quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(c * c for c in q) > 0.01)
metres = st.floats(-50, 50)


@given(quaternions)
def test_matrices_are_scipys(q):
    assert rotation_matrix(q) == pytest.approx(Rotation.from_quat(q).as_matrix(), abs=1e-12)


@given(quaternions, quaternions)
def test_products_turn_by_the_second_first(first, second):
    one, two = rotation_matrix(first), rotation_matrix(second)
    assert rotation_matrix(multiply(first, second)) == pytest.approx(one @ two, abs=1e-9)


@given(quaternions, st.tuples(metres, metres, metres), st.tuples(metres, metres, metres))
def test_transform_turns_then_shifts(q, at, point):
    found = transform(np.array([point]), Pose(*at, q))[0]
    assert found == pytest.approx(Rotation.from_quat(q).apply(point) + at, abs=1e-9)


@given(st.integers(-720, 720))
def test_yaw_is_read_back(degrees):
    x, y, z, w = yaw_quaternion(degrees)
    assert (x, y) == (0.0, 0.0)
    assert w >= 0
    found = math.degrees(2.0 * math.atan2(z, w))
    assert math.cos(math.radians(found - degrees)) == pytest.approx(1.0, abs=1e-9)


@given(quaternions)
def test_rounded_quaternions_are_the_same_turn_with_one_sign(q):
    found = round_quaternion(q)
    assert found[3] >= 0.0
    assert all(c == round(c, 6) for c in found)
    assert not any(c == 0.0 and math.copysign(1, c) < 0 for c in found)
    assert rotation_matrix(found) == pytest.approx(rotation_matrix(q), abs=1e-5)
    opposite = tuple(-c for c in q)
    assert round_quaternion(opposite) == found


@given(metres)
def test_rounded_lengths_are_within_half_of_a_tenth_of_a_millimetre(value):
    found = round_m(value)
    assert abs(found - value) <= 5.0001e-5
    assert found == round_m(found)
    assert not (found == 0.0 and math.copysign(1, found) < 0)


@pytest.mark.parametrize(("shape", "count"), [("box", 8), ("cylinder", 32), ("sphere", 50)])
def test_corners_fill_the_bounding_box(shape, count):
    corners = part_corners(part(shape, (1.0, 2.0, 3.0), (0.4, 0.6, 0.8)))
    assert corners.shape == (count, 3)
    assert corners.min(axis=0) == pytest.approx([0.8, 1.7, 2.6], abs=1e-9)
    assert corners.max(axis=0) == pytest.approx([1.2, 2.3, 3.4], abs=1e-9)


def test_hulls_bring_their_own_corners():
    own = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    corners = part_corners(part("hull", (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), corners=own))
    assert corners.tolist() == [[1, 1, 1], [2, 1, 1], [1, 2, 1], [1, 1, 2]]


def test_an_assets_corners_are_its_parts_behind_each_other():
    two = (part("box", (0, 0, 0.5), (1, 1, 1)), part("cylinder", (2, 0, 0.5), (1, 1, 1)))
    both = asset("Thing_0", *two)
    corners, starts = asset_corners(both)
    assert starts.tolist() == [0, 8, 40]
    assert np.array_equal(corners[8:], part_corners(two[1]))
    assert corners.min(axis=0) == pytest.approx([-0.5, -0.5, 0.0])
    assert corners.max(axis=0) == pytest.approx([2.5, 0.5, 1.0])
    with pytest.raises(ValueError, match="read-only"):
        corners[0, 0] = 1.0


def test_centre_of_mass_weighs_parts_by_their_volume():
    pair = (part("box", (0, 0, 0.5), (1, 1, 1)), part("box", (2, 0, 1.0), (0.5, 1, 2)))
    assert centre_of_mass(asset("Thing_0", *pair)) == (1.0, 0.0, 0.75)


def test_centre_of_mass_of_a_hull_is_that_of_its_tetrahedron():
    own = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    only = part("hull", (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), corners=own)
    assert centre_of_mass(asset("Thing_0", only)) == (1.25, 1.25, 1.25)
