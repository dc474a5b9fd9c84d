"""Outcomes that contradict their own poses are found at the level `geometry`, without physics."""

import sys
from dataclasses import replace

import numpy as np
import physical
import pytest
from scenery import ASSETS
from test_physics import outcome_changed

from internav_data.catalog import catalogue
from internav_data.geometry import centre_of_mass
from internav_data.records import MovedObject, Pose
from internav_data.verification.checked_layout import CheckedLayout
from internav_data.verification.findings import FindingCollector
from internav_data.verification.outcomes import check_outcomes
from internav_data.verification.scenes import check_scene
from internav_data.verification.shapes import Shapes


@pytest.fixture(scope="module")
def scenes():
    return physical.physical_scenes()


@pytest.fixture(scope="module")
def layouts(scenes):
    return [CheckedLayout(house, Shapes(ASSETS)) for house, _ in scenes]


def found_in(layout, episode, scope="all"):
    report = FindingCollector("episodes", episode.scene_id)
    check_outcomes(layout, episode, report, scope)
    return set(report.by_predicate)


def test_true_outcomes_hold_with_and_without_poses(scenes, layouts):
    for layout, (_, episodes) in zip(layouts, scenes, strict=True):
        for episode in episodes:
            bare = tuple(
                replace(
                    one,
                    outcomes=tuple(
                        replace(o, pose=None, moved=None, at_rest=None) for o in one.outcomes
                    ),
                )
                for one in episode.obstacles
            )
            for scope in ("poses", "sample", "all"):
                assert found_in(layout, episode, scope) == set()
                assert found_in(layout, replace(episode, obstacles=bare), scope) == set()


PUSHED = (2, 0, "push_north", 1)
"""A pot that is pushed into furniture, which moves."""
CHANGES = {
    "farther": ((0, 0, "push_west", 0, {"displacement_m": 0.7}), "displacement"),
    "half a millimetre": ((0, 1, "push_north", 0, {"displacement_m": 0.0005}), "displacement"),
    "more steps": ((0, 1, "push_north", 0, {"path_steps_after": 28}), "path-steps-after"),
    "still shut": ((0, 0, "push_west", 0, {"path_steps_after": None}), "path-steps-after"),
    "a longer way": ((0, 1, "push_north", 0, {"path_m_after": 6.03}), "path-m-after"),
    "no way where one is": ((0, 0, "push_north", 0, {"path_m_after": None}), "path-m-after"),
    "a way where none is": ((0, 0, "push_south", 0, {"path_m_after": 6.5}), "path-m-after"),
    "more steps once picked": ((2, 0, "pick", 1, {"path_steps_after": 26}), "path-steps-after"),
    "more steps round furniture": ((*PUSHED, {"path_steps_after": 28}), "path-steps-after"),
    "a longer way round it": ((*PUSHED, {"path_m_after": 6.03}), "path-m-after"),
    "a box around the start alone": ((*PUSHED, {"swept": (0.4, 0.4, 0.4, 0.4)}), "swept"),
    "a box without what it met": (
        (0, 1, "push_north", 0, {"swept": (9.0, 9.0, 9.0, 0.0)}),
        "swept",
    ),
    "furniture that never moves": ((*PUSHED, {"moved": (0, None)}), "moved"),
    "furniture that is not there": ((*PUSHED, {"moved": (7, None)}), "moved"),
    "an obstacle that is not there": ((*PUSHED, {"moved": (None, 5)}), "moved"),
}


@pytest.mark.parametrize("case", CHANGES)
def test_contradiction_is_found(scenes, layouts, case):
    (scene, index, action, number, changes), predicate = CHANGES[case]
    (outcome,) = (
        o for o in scenes[scene][1][index].obstacles[number].outcomes if o.action == action
    )
    if "moved" in changes:
        object_id, obstacle = changes["moved"]
        (other,) = outcome.moved
        changes = {"moved": (MovedObject(obstacle, object_id, other.pose),)}
    elif changes.get("displacement_m", 1.0) < 0.05:
        changes = {"displacement_m": outcome.displacement_m + changes["displacement_m"]}
    wrong = outcome_changed(scenes, scene, index, action, number, **changes)[scene][1][index]
    assert found_in(layouts[scene], wrong) == {f"outcome.{predicate}"}


def test_furniture_that_stayed_has_not_moved(scenes, layouts):
    (other,) = scenes[2][1][0].obstacles[1].outcomes[1].moved
    (placed,) = (p for p in scenes[2][0].objects if p.object_id == other.object_id)
    moved = (replace(other, pose=replace(placed.pose, x=placed.pose.x + 0.0004)),)
    episode = outcome_changed(scenes, *PUSHED, moved=moved)[2][1][0]
    assert "outcome.moved" in found_in(layouts[2], episode, "poses")


def test_a_fixed_obstacle_that_was_moved(scenes, layouts):
    (other,) = scenes[2][1][0].obstacles[1].outcomes[1].moved
    moved = (MovedObject(0, None, other.pose),)
    episode = outcome_changed(scenes, *PUSHED, moved=moved)[2][1][0]
    safe, pot = episode.obstacles
    assert "outcome.moved" not in found_in(layouts[2], episode)
    bolted = replace(safe, pushable=False, pickable=False)
    wrong = replace(episode, obstacles=(bolted, pot))
    assert found_in(layouts[2], wrong) == {"outcome.moved"}


def test_an_end_as_far_away_but_elsewhere(scenes, layouts):
    """The bar ends in the door again: only the stored pose tells that this shuts it."""
    bar = scenes[0][1][0].obstacles[0]
    west = bar.outcomes[2]
    assert west.opened
    end = Pose(bar.x, round(bar.y + west.displacement_m, 4), bar.z, bar.quaternion)
    changes = {"pose": end, "swept": (9.0,) * 4}
    wrong = outcome_changed(scenes, 0, 0, "push_west", 0, **changes)[0][1][0]
    assert (
        {"outcome.path-m-after"}
        <= found_in(layouts[0], wrong)
        <= {
            "outcome.path-m-after",
            "outcome.path-steps-after",
        }
    )


def test_a_scene_is_sampled_without_its_physics(scenes):
    """Of the middle episode each lattice distance is derived, of all episodes the displacements."""
    without_engine = set(sys.modules)
    for index, changes, found in (
        (1, {"path_steps_after": 28}, {"outcome.path-steps-after"}),
        (0, {"path_steps_after": 28}, set()),
        (0, {"displacement_m": 0.4}, {"outcome.displacement"}),
    ):
        house, episodes = outcome_changed(scenes, 0, index, "push_north", 0, **changes)[0]
        report = check_scene(house, episodes, Shapes(ASSETS))
        assert set(report.by_predicate) == found
    assert set(sys.modules) == without_engine


def test_centres_of_mass_are_those_of_physics():
    assets = catalogue().assets
    shapes = Shapes(assets)
    for asset_id, asset in list(assets.items())[::11]:
        apart = np.abs(shapes.centre_of_mass(asset_id) - centre_of_mass(asset)).max()
        assert apart <= 1.01e-4, asset_id
