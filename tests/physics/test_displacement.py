"""Rest and movement by stored poses, whose quaternions are rounded to 1e-6."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from internav_data.geometry import round_quaternion
from internav_data.physics.displacement import is_still
from internav_data.records import Pose


def turned(by_rad, seed):
    """Poses with stored quaternions, one turned from the other by an angle about any axis."""
    rng = np.random.default_rng(seed)
    before, axis = Rotation.random(random_state=seed), rng.standard_normal(3)
    after = Rotation.from_rotvec(by_rad * axis / np.linalg.norm(axis)) * before
    return [
        Pose(1.0, 2.0, 0.3, round_quaternion(tuple(map(float, rotation.as_quat()))))
        for rotation in (before, after)
    ]


@pytest.mark.parametrize("by_rad", [0.0, 0.0005, 0.0009])
def test_rounding_is_no_turn(by_rad):
    assert all(is_still(*turned(by_rad, seed)) for seed in range(300))


@pytest.mark.parametrize("by_rad", [0.0011, 0.01, 3.0])
def test_rounding_hides_no_turn(by_rad):
    assert not any(is_still(*turned(by_rad, seed)) for seed in range(300))


def test_a_quaternion_and_its_negative_are_one_orientation():
    here, _ = turned(0.0, 1)
    other = Pose(here.x, here.y, here.z, tuple(-q for q in here.quaternion))
    assert is_still(here, other)


def test_a_shift_is_no_rest():
    here, _ = turned(0.0, 2)
    assert is_still(here, Pose(here.x + 0.0004, here.y, here.z, here.quaternion))
    assert not is_still(here, Pose(here.x, here.y, here.z + 0.0006, here.quaternion))
