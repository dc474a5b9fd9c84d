"""Objects of one asset share its geometry and have dynamics of their own."""

import ast
from dataclasses import replace
from pathlib import Path

import pytest
from builders import UPRIGHT, crate

import internav_data
from internav_data.catalog import catalogue
from internav_data.episodes import build_episodes
from internav_data.episodes.outcomes import outcomes_of
from internav_data.geometry import asset_corners
from internav_data.houses import HouseConfig, build_house
from internav_data.physics import Body, push, settle
from internav_data.physics.sweep import bounding_radius_m, centred_corners
from internav_data.planner.push_heuristic import slide_m
from internav_data.records import Dynamics, Pose
from internav_data.world import Action, HouseModel, World

CRATE = crate("Crate_0", (0.5, 0.4, 0.3), mass_kg=6.0, friction=0.5)
SAFE = Dynamics(mass_kg=500.0, friction=0.5, pushable=True, pickable=False)
"""Too heavy for 200 N."""


def alone(dop8):
    return ()


def test_a_heavier_object_of_the_same_asset_does_not_move():
    pose = Pose(2.0, 3.0, 0.001, UPRIGHT)
    light = push(Body.of(CRATE, pose), 0, alone)
    heavy = push(Body(CRATE, pose, SAFE), 0, alone)
    assert light.success
    assert (heavy.success, heavy.reason) == (False, "too heavy")
    assert push(Body.of(CRATE, pose), 0, alone) == light, "not the cached push of the heavy one"


def test_a_heavy_neighbour_stops_what_a_light_one_would_not():
    pose = Pose(2.0, 3.0, 0.001, UPRIGHT)
    ends = []
    for dynamics in (CRATE.dynamics, SAFE):
        other = Body(CRATE, Pose(2.7, 3.0, 0.001, UPRIGHT), dynamics)
        pushed = push(Body.of(CRATE, pose), 0, lambda _, other=other: [(0, other)])
        ends.append((pushed.pose.x, bool(pushed.moved)))
    assert ends[0][1]
    assert not ends[1][1]
    assert ends[1][0] < ends[0][0] - 0.05


def test_friction_is_the_objects_own():
    smooth = replace(CRATE.dynamics, friction=0.25)
    pose = Pose(2.0, 3.0, 0.001, UPRIGHT)
    far = [
        push(Body(CRATE, pose, own), 0, alone).displacement_m for own in (CRATE.dynamics, smooth)
    ]
    assert far[1] == pytest.approx(2.0 * far[0], rel=0.15)


def test_geometry_is_shared_by_objects_of_one_asset():
    pose = Pose(2.0, 3.0, 0.0, UPRIGHT)
    push(Body.of(CRATE, pose), 1, alone)
    settle(Body.of(CRATE, pose), 0.0, tuple)
    caches = (asset_corners, centred_corners, bounding_radius_m)
    before = [cache.cache_info().currsize for cache in caches]
    push(Body(CRATE, pose, SAFE), 1, alone)
    settle(Body(CRATE, pose, SAFE), 0.0, tuple)
    assert [cache.cache_info().currsize for cache in caches] == before


def test_an_episodes_stored_dynamics_decide_what_a_world_does(hand_house):
    chair = hand_house.assets["Chair_0"]
    model = HouseModel.of(hand_house)
    spot = Pose(3.75, 1.0, 0.0, UPRIGHT)
    worlds = [
        World(model, [Body(chair, spot, own)], (12, 4, 0), (28, 4))
        for own in (chair.dynamics, SAFE, replace(chair.dynamics, pushable=False, pickable=True))
    ]
    light, heavy, pickable = worlds
    assert len({world.digest() for world in worlds}) == 3
    assert slide_m(light, light.obstacles[0]) > 0.0 == slide_m(heavy, heavy.obstacles[0])
    assert light.step(Action.PUSH_AHEAD).success
    assert heavy.step(Action.PUSH_AHEAD).reason == "too heavy"
    assert pickable.step(Action.PUSH_AHEAD).reason == "nothing to push in sight and reach"
    picked = pickable.step(Action.PICKUP)
    assert picked.success
    assert pickable.step(Action.DROP).success
    assert pickable.body(picked.target).dynamics.pickable, "kept while it is carried"


def test_outcomes_of_an_episode_follow_its_stored_values():
    house = build_house(0, 0, HouseConfig(), catalogue())
    episodes = build_episodes(house, 4, catalogue().spawnable)
    model, assets = HouseModel.of(house), catalogue().assets
    episode, number = next(
        (episode, k) for episode in episodes for k, o in enumerate(episode.obstacles) if o.pushable
    )

    def outcomes(**changes):
        obstacles = list(episode.obstacles)
        obstacles[number] = replace(obstacles[number], **changes)
        changed = replace(episode, obstacles=tuple(obstacles))
        return outcomes_of(World.of_episode(model, changed, assets))

    assert outcomes() == tuple(o.outcomes for o in episode.obstacles)
    assert {o.reason for o in outcomes(mass_kg=5000.0)[number][:4]} == {"too heavy"}
    assert {o.reason for o in outcomes(pushable=False)[number][:4]} == {"not pushable"}
    assert outcomes(pushable=False, pickable=True)[number][4].reason != "not pickable"


ROOMS = (
    *("physics", "world", "planner", "episodes", "envs", "views", "evaluation", "camp"),
    "verification/replay",
)
"""Rooms in which objects have dynamics of their own."""
OWN = {"mass_kg", "friction", "pushable", "pickable"}


def last_name(node):
    """The `c` of a.b.c and of a.b.c[d]."""
    if isinstance(node, ast.Subscript):
        node = node.value
    return getattr(node, "attr", getattr(node, "id", ""))


def readers_of_assets(folder):
    """Return the lines that read mass, friction or abilities of an asset, as file:line and code."""
    return [
        f"{file.relative_to(folder)}:{node.lineno} {ast.unparse(node)}"
        for file in folder.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.Attribute)
        and (
            (node.attr in OWN and last_name(node.value) in {"asset", "assets"})
            or (node.attr == "dynamics" and ast.unparse(node.value).endswith(".asset"))
        )
    ]


@pytest.mark.parametrize("room", ROOMS)
def test_nobody_reads_the_dynamics_of_an_asset_beside_an_object(room):
    folder = Path(internav_data.__file__).parent / room
    assert list(folder.rglob("*.py"))
    assert readers_of_assets(folder) == []


@pytest.mark.parametrize(
    "code", ["assets[o.asset_id].mass_kg", "self.items[k].asset.friction", "item.asset.dynamics"]
)
def test_a_reader_of_an_assets_dynamics_is_found(tmp_path, code):
    (tmp_path / "room.py").write_text(f"print({code})\n")
    assert readers_of_assets(tmp_path) == [f"room.py:1 {code}"]
