"""The agent beside a push: it matters only where something comes near it, and it is told so."""

import itertools

import pytest
from builders import UPRIGHT, crate

from internav_data.catalog import catalogue
from internav_data.geometry import footprint, yaw_quaternion
from internav_data.houses import HouseConfig, build_house
from internav_data.physics import Body, wall_body
from internav_data.physics.kdop import overlap
from internav_data.physics.pushing import count_movers
from internav_data.physics.sweep import extent_of
from internav_data.records import Pose, Wall
from internav_data.world import Action, HouseModel, World
from internav_data.world.house_model import MAX_TANGENT_GRAPHS
from internav_data.world.visibility import axis_distance

AHEAD = ((1, 0), (0, 1), (-1, 0), (0, -1))


CRATE = crate("Crate_0", (0.5, 0.4, 0.2), mass_kg=6.0, friction=0.5)
SMALL = crate("Crate_1", (0.3, 0.3, 0.2), mass_kg=2.0, friction=0.5)
SQUARE = crate("Crate_2", (0.4, 0.4, 0.2), mass_kg=6.0, friction=0.5)


def among(*bodies):
    extents = [extent_of(body.asset, body.pose).dop8 for body in bodies]

    def near(dop8):
        return [(k, bodies[k]) for k, extent in enumerate(extents) if overlap(extent, dop8)]

    return near


def scene(heading):
    """A crate, a thing that it runs into 0.3 m on, and a wall 1.5 m on that nothing reaches."""
    dx, dy = AHEAD[heading]
    other = Pose(3.0 + 0.7 * dx - 0.05 * dy, 4.0 + 0.7 * dy + 0.05 * dx, 0.001, UPRIGHT)
    wall = wall_body(Wall(5.5, 0.0, 5.6, 8.0, 0.0, 2.6))
    return Pose(3.0, 4.0, 0.001, yaw_quaternion(20)), among(Body.of(SMALL, other), wall)


@pytest.mark.parametrize("heading", range(4))
def test_a_push_that_never_comes_near_the_agent_is_the_same_without_it(heading, solved, push):
    pose, near = scene(heading)
    without = push(Body.of(CRATE, pose), heading, near)
    assert without.success
    assert without.moved
    solved.clear()
    dx, dy = AHEAD[heading]
    for back, aside in itertools.product((0.6, 0.9, 1.2), (-0.6, 0.0, 0.6)):
        agent = (3.0 - back * dx - aside * dy, 4.0 - back * dy + aside * dx)
        assert (
            push(Body.of(CRATE, pose), heading, near, agent=agent, agent_gap_m=back - 0.3)
            == without
        )
    assert solved == [], "no agent, no other scene"


def test_an_agent_that_something_comes_near_takes_part(solved, push):
    pose, near = scene(0)
    without = push(Body.of(CRATE, pose), 0, near)
    ((_, there),) = without.moved
    agent = (there.x + 0.3, there.y)  # what is run into would come to rest at its feet
    solved.clear()
    beside = push(Body.of(CRATE, pose), 0, near, agent=agent, agent_gap_m=0.22)
    assert all(scene.agent is not None for scene in solved)
    assert solved
    assert beside != without
    ends = [(CRATE, beside.pose), *((SMALL, there) for _, there in beside.moved)]
    assert all(axis_distance(*agent, footprint(*end)) > 0.2 for end in ends)


@pytest.mark.parametrize("heading", range(4))
def test_the_agent_is_named_where_it_alone_hinders(heading, push):
    dx, dy = AHEAD[heading]
    pose, agent = Pose(3.0, 4.0, 0.001, UPRIGHT), (3.0 + 0.405 * dx, 4.0 + 0.405 * dy)
    hindered = push(Body.of(SQUARE, pose), heading, among(), agent=agent, agent_gap_m=0.205)
    assert (hindered.success, hindered.reason) == (False, "the agent is in the way")
    assert hindered.displacement_m < 0.02
    assert push(Body.of(SQUARE, pose), heading, among()).success
    # A wall that hinders by itself is named though the agent stands there too, behind the thing.
    x, y = 3.0 + 0.265 * dx, 4.0 + 0.265 * dy
    wall = wall_body(Wall(x - 0.06, y - 0.06, x + 0.06, y + 0.06, 0.0, 2.6))
    behind = (3.0 - 0.405 * dx, 4.0 - 0.405 * dy)
    walled = push(Body.of(SQUARE, pose), heading, among(wall), agent=behind, agent_gap_m=0.205)
    assert walled.reason == "something is in the way"
    # And what cannot be moved at all is too heavy, whoever stands there.
    heavy = crate("Safe_0", (0.4, 0.4, 0.2), mass_kg=500.0, friction=0.5)
    assert (
        push(Body.of(heavy, pose), heading, among(wall), agent=agent, agent_gap_m=0.2).reason
        == "too heavy"
    )


def test_pulling_onto_the_agent_says_so_and_changes_nothing(hand_house):
    large = crate("Crate_3", (0.6, 0.6, 0.3), mass_kg=6.0, friction=0.5)
    world = World(
        HouseModel.of(hand_house),
        [Body.of(large, Pose(3.51, 1.0, 0.0, UPRIGHT))],
        (12, 4, 0),
        (1, 1),
    )
    before = world.digest()
    result = world.step(Action.PUSH_BACK)
    assert (result.success, result.reason) == (False, "the agent is in the way")
    assert result.target == world.obstacles[0]
    assert world.digest() == before
    assert world.step(Action.PUSH_AHEAD).success


LEVERED_S = {"bullet": 2.2, "mujoco": 3.3}
"""More than what is toppled against an agent takes to come to rest, less than what creeps does."""


@pytest.mark.parametrize("side", range(4))
@pytest.mark.parametrize("heading", range(4))
def test_the_agent_does_not_lever_what_has_low_feet(heading, side, engine, push):
    # Its feet begin below 2 cm, where footprints leave them out: a column down to the floor stood
    # on them, and the thing crept on top of it for up to five seconds.
    telly = catalogue().assets["Television_05"]
    pose = Pose(3.0, 4.0, 0.001, yaw_quaternion(45))
    plan = footprint(telly, pose)
    dx, dy = AHEAD[side]
    far = next(
        d for d in (0.2 + 0.001 * k for k in range(2000))
        if axis_distance(3.0 + d * dx, 4.0 + d * dy, plan) >= 0.205
    )  # fmt: skip
    agent = (3.0 + far * dx, 4.0 + far * dy)
    pushed = push(
        Body.of(telly, pose), heading, among(), agent=agent, agent_gap_m=axis_distance(*agent, plan)
    )
    assert pushed.at_rest
    assert pushed.seconds < LEVERED_S[engine]
    assert axis_distance(*agent, footprint(telly, pushed.pose)) > 0.2 - 2e-3


def test_a_crowd_is_what_may_be_moved():
    pose = Pose(3.0, 4.0, 0.001, UPRIGHT)
    row = [Body.of(SMALL, Pose(3.5, 3.7 + 0.31 * k, 0.001, UPRIGHT)) for k in range(3)]
    wall = wall_body(Wall(3.0, 4.3, 4.0, 4.4, 0.0, 2.6))
    assert crowd_of(pose, row, wall) == (3, 0)
    assert crowd_of(pose, row[:1], wall) == (1, 0)
    assert crowd_of(pose, [], wall) == (0, 0)
    # What the first one met is driven on to: the neighbour's neighbour counts, the far one not.
    behind = Body.of(SMALL, Pose(3.82, 4.0, 0.001, UPRIGHT))
    far = Body.of(SMALL, Pose(6.0, 4.0, 0.001, UPRIGHT))
    assert crowd_of(pose, [row[1], behind, far], wall) == (2, 0)
    # What is too heavy meets nothing.
    heavy = crate("Safe_1", (0.5, 0.4, 0.2), mass_kg=500.0, friction=0.5)
    assert crowd_of(pose, row, wall, heavy) == (0, 0)


def crowd_of(pose, loose, wall, asset=CRATE):
    """Crowds of a push east and of one west."""
    near = among(*loose, wall)
    body = Body.of(asset, pose)
    return count_movers(body, 0, near), count_movers(body, 2, near)


def test_the_graph_with_all_furniture_is_kept():
    model = HouseModel.of(build_house(0, 6, HouseConfig(), catalogue()))
    home = model.tangent_graph()
    sets = list(itertools.combinations(range(len(model.items)), 2))[:20]
    assert len(sets) == 20
    graphs = [model.tangent_graph(displaced) for displaced in sets]
    assert model.tangent_graph(()) is home
    # The latest are kept too, as many as there is room for beside it; older ones are built again.
    latest = list(zip(sets, graphs, strict=True))[1 - MAX_TANGENT_GRAPHS :]
    assert all(model.tangent_graph(displaced) is graph for displaced, graph in latest)
    assert model.tangent_graph(sets[0]) is not graphs[0]
