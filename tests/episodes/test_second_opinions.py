"""Second opinions on outcomes are what the other engine would have made of the same world."""

import pytest
from builders import UPRIGHT, crate

from internav_data.episodes.outcomes import PICK, PUSH_DIRECTIONS, outcomes_of
from internav_data.physics import Body
from internav_data.physics.config import PhysicsConfig
from internav_data.physics.engines import ENGINES, second_engine
from internav_data.records import Pose
from internav_data.records.errors import UsageError
from internav_data.world import HouseModel, World


@pytest.fixture(params=["bullet", "mujoco"])
def world(request, hand_house):
    """A chair in the door that shuts off the goal, a heavy box beside it, and a bolted one."""
    pytest.importorskip("pybullet")
    heavy = crate("Safe_0", (0.5, 0.5, 0.6), mass_kg=400.0)
    bolted = crate("Box_0", (0.4, 0.4, 0.4), pushable=False)
    chair = hand_house.assets["Chair_0"]
    at = ((chair, 5.0, 2.0), (heavy, 4.2, 2.9), (bolted, 3.0, 3.0))
    bodies = [Body.of(asset, Pose(x, y, 0.001, UPRIGHT)) for asset, x, y in at]
    return World(HouseModel.of(hand_house), bodies, (12, 4, 0), (28, 4), engine=request.param)


def test_they_are_the_other_engines_own_outcomes(world):
    other = second_engine(world.engine)
    both, theirs = outcomes_of(world, other_engine=other), outcomes_of(world.asking(other))
    asked = []
    for mine, yours in zip(both, theirs, strict=True):
        for one, two in zip(mine, yours, strict=True):
            if one.agrees is None:
                assert one.reason == "not pushable" or one.action == PICK
                assert one.other_pose is None
                continue
            asked.append(one.action)
            assert one.agrees == ((one.success, one.opened) == (two.success, two.opened))
            assert one.other_pose == two.pose
    assert sorted(asked) == sorted([*PUSH_DIRECTIONS, *PUSH_DIRECTIONS])
    assert any(o.opened for outcomes in (both, theirs) for five in outcomes for o in five)
    assert {o.agrees for five in both for o in five} == {None, True, False}
    assert world.engine != other, "the world itself is as it was"


def test_nothing_else_of_an_outcome_changes(world):
    def without(outcomes):
        return [
            [
                tuple(
                    getattr(o, name) for name in o.__slots__ if name not in {"agrees", "other_pose"}
                )
                for o in five
            ]
            for five in outcomes
        ]

    alone = outcomes_of(world)
    assert all(o.agrees is None and o.other_pose is None for five in alone for o in five)
    assert without(outcomes_of(world, other_engine=second_engine(world.engine))) == without(alone)


def test_a_second_engine_is_asked_where_the_settings_say_so(monkeypatch):
    assert PhysicsConfig("bullet").other_engine is None
    assert PhysicsConfig("bullet", cross_check=True).other_engine == "mujoco"
    assert PhysicsConfig("mujoco", cross_check=True).other_engine == "bullet"
    monkeypatch.delitem(ENGINES, "mujoco")
    with pytest.raises(UsageError, match=r"physics.cross_check: there is no second engine beside"):
        PhysicsConfig("bullet", cross_check=True).check()
