"""Starts of the auxiliary tasks of Push and Pick: beside an obstacle, opposite to the goal.

The starts are a pure function of the episode; only the choice among them is drawn. The paper's
section 5.2 describes them, the released code has the rule for the poses.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np

from internav_data.navigation import SPACING_M
from internav_data.records import Purpose, TrainingStream, generator
from internav_data.records.errors import UsageError
from internav_data.world import HouseModel, World
from internav_data.world.visibility import REACH_M

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from internav_data.envs.order import EpisodeOrder
    from internav_data.envs.source import Source
    from internav_data.records import Asset, Episode, Pose, Vec2

InteractionKind = Literal["push", "pick"]
"""Interaction that an auxiliary task teaches."""
CLEARED_STEPS: Final = 1
"""Drop of the path, in steps of 0.25 m, from which on an obstacle that did not block is cleared."""


class AuxiliaryStart(NamedTuple):
    """Pose of the agent from which Push or Pick acts on a certain obstacle."""

    i: int
    """Index of the node along x."""
    j: int
    """Index of the node along y."""
    quarter: int
    """Quarter turns counter-clockwise from +x."""
    obstacle: int
    """Index among the episode's obstacles."""


def auxiliary_starts(
    model: HouseModel, episode: Episode, assets: Mapping[str, Asset], kind: InteractionKind
) -> tuple[AuxiliaryStart, ...]:
    """Return all starts of an episode: obstacle after obstacle, the nearest to its node first.

    The agent sees the obstacle within reach, it is the closest of its kind, and agent and goal lie
    on opposite sides of it along x and along y; where no pose does that, on opposite sides of the
    line across the path to the goal (the released code gives up there). Nearest means nearest to
    the next node of the first node path after the obstacle; ties go by i, j and quarter.

    Parameters
    ----------
    model
        Model of the episode's house.
    episode
        Episode whose obstacles are considered.
    assets
        Assets of its obstacles, by id.
    kind
        "push" or "pick".
    """
    world = World.of_episode(model, episode, assets)
    starts: list[AuxiliaryStart] = []
    for number, index in enumerate(world.obstacles):
        # Where attributes are hidden, a start must not tell them: that of a fixed obstacle is one.
        if world.items[index].affords(kind):
            poses = list(_poses(world, episode, number, kind))
            strict = [start for opposite, start in poses if opposite]
            starts += strict or [start for _, start in poses]
    return tuple(starts)


def next_start(
    source: Source, order: EpisodeOrder, seed: int, position: int, kind: InteractionKind
) -> tuple[int, AuxiliaryStart, int]:
    """Return the next episode that has a start, one of its starts, and the position after it.

    The obstacle is drawn uniformly; the start is the first beside it.

    Parameters
    ----------
    source
        Episodes of a dataset.
    order
        Order of the episodes.
    seed
        Seed of the environment.
    position
        Position in the order to begin at.
    kind
        "push" or "pick".

    Raises
    ------
    UsageError
        No episode has a start.
    """
    for _ in range(len(source.dataset)):
        number = order.number(position)
        position += 1
        starts = source.auxiliary_starts(number, kind)
        if starts:
            obstacles = sorted({start.obstacle for start in starts})
            rng = generator(seed, Purpose.TRAINING, attempt=TrainingStream.AUXILIARY, draw=position)
            obstacle = obstacles[int(rng.integers(len(obstacles)))]
            return number, next(s for s in starts if s.obstacle == obstacle), position
    raise UsageError(
        f"{source.dataset!r}: no obstacle to learn to {kind} in scenes of a single room; "
        "generate more of them, or train --stages single,all"
    )


def world_at(
    model: HouseModel, episode: Episode, assets: Mapping[str, Asset], start: AuxiliaryStart
) -> World:
    """Return the world of an episode with its agent at an auxiliary start."""
    world = World.of_episode(model, episode, assets)
    world.i, world.j, world.quarter = start.i, start.j, start.quarter
    return world


def is_cleared(before: int | None, after: int | None) -> bool:
    """Return whether an obstacle is out of the way.

    Parameters
    ----------
    before, after
        Lattice distance in steps from one and the same node to the goal; None where cut off.
    """
    if after is None:
        return False
    return before is None or before - after >= CLEARED_STEPS


def _poses(
    world: World, episode: Episode, number: int, kind: InteractionKind
) -> Iterator[tuple[bool, AuxiliaryStart]]:
    """Yield poses, best first, and whether agent and goal are opposite along both axes."""
    index = world.obstacles[number]
    pose = world.items[index].pose
    if pose is None:
        return
    there = world.copy()
    # A pocket of furniture that is cut off from the goal even without obstacles teaches nothing.
    joined = world.model.lattice.distances(episode.goal.i, episode.goal.j) >= 0
    for i, j in _nodes_near(world, index, pose, _next_node(episode, number)):
        if not joined[i, j]:
            continue
        there.i, there.j = i, j
        x, y = there.position
        # Products of the offsets from the obstacle, along each axis; their sum, the scalar product,
        # is below zero on the side of the obstacle that is turned away from the goal.
        across = (x - pose.x) * (episode.goal.x - pose.x)
        along = (y - pose.y) * (episode.goal.y - pose.y)
        if across + along >= 0.0:
            continue
        for quarter in range(4):
            there.quarter = quarter
            if there.target(pick=kind == "pick") == index:
                yield across < 0.0 and along < 0.0, AuxiliaryStart(i, j, quarter, number)


def _next_node(episode: Episode, number: int) -> Vec2:
    goal = (episode.goal.x, episode.goal.y)
    if not episode.node_paths:
        return goal
    points = episode.node_paths[0].points
    return points[min(episode.obstacles[number].node_path_segment + 1, len(points) - 1)]


def _nodes_near(world: World, index: int, pose: Pose, node: Vec2) -> list[tuple[int, int]]:
    """Return the free nodes within reach of an object, the nearest to a point first."""
    size = world.items[index].asset.size
    reach = REACH_M + math.hypot(*size)
    free = np.argwhere(world.lattice.free)
    away = np.hypot(SPACING_M * free[:, 0] - pose.x, SPACING_M * free[:, 1] - pose.y)
    near = free[away <= reach]
    far = np.hypot(SPACING_M * near[:, 0] - node[0], SPACING_M * near[:, 1] - node[1])
    # Ties by i, then j, as argwhere has them; rounding keeps mirrored nodes equal.
    order = np.argsort(np.round(far, 9), kind="stable")
    return [(int(i), int(j)) for i, j in near[order]]
