"""Heuristic of pushes: an estimate without physics of whether a push clears a path.

The object's footprint slides without turning over the floor, as far as Coulomb friction lets it or
until it meets another footprint. The search orders its candidates by this; the world decides.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from internav_data.geometry import Polygons, clearance
from internav_data.geometry.headings import HEADINGS
from internav_data.navigation import SPACING_M, grid
from internav_data.navigation.grid import EAST, NODE, NORTH
from internav_data.physics.kdop import dop8_of_rectangle, grown
from internav_data.records.agent import CLEARANCE_M

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.core.typing import Ints
    from internav_data.world import World

STEP_M: Final = 0.15
"""Step in which a slide is tested against other footprints, metres."""
MAX_REPEATS: Final = 6
"""Maximum number of pushes of one object in a row, from one pose, that are considered at once."""
GRAVITY: Final = 9.81
"""Acceleration of gravity, m/s²."""


def slide_m(world: World, index: int) -> float:
    """Return the distance that a pushed object slides on free ground, metres.

    By Coulomb friction: the force accelerates it at `gain` up to a speed v, over v² / 2 gain, then
    friction brakes it over v² / 2 brake. A push with a distance holds it at v in between.
    """
    dynamics, spec = world.items[index].dynamics, world.push_spec
    brake = dynamics.friction * GRAVITY
    gain = spec.force_n / dynamics.mass_kg - brake
    if gain <= 0.0:
        return 0.0
    speed = min(spec.speed_m_s, gain * spec.seconds)
    if spec.distance_m:
        longest = speed * (spec.seconds - speed / (2.0 * gain))
        held = min(spec.distance_m, longest)
        speed = min(speed, math.sqrt(2.0 * gain * held))
        return held + speed * speed / 2.0 / brake
    return speed * speed / 2.0 * (1.0 / gain + 1.0 / brake)


def path_marks(poses: Sequence[int], nodes: int) -> Ints:
    """Return the nodes and edges of a path, as ascending indices into a flat (3, nodes).

    Parameters
    ----------
    poses
        Successive poses, as numbers.
    nodes
        Number of nodes of the lattice.

    """
    here = np.array(poses, dtype=np.int64)
    place, quarter = here // 4, here[:-1] % 4
    steps = place[:-1] != place[1:]
    # An edge is stored at its western or southern node, the one with the smaller number.
    edge = np.minimum(place[:-1], place[1:])[steps]
    row = np.where(quarter[steps] % 2 == 0, EAST, NORTH)
    return np.unique(np.concatenate([NODE * nodes + place, row * nodes + edge]))


def pushes_to_clear(
    world: World, index: int, path: Ints, shape: tuple[int, int]
) -> tuple[int, ...]:
    """Return how many pushes along each of the four headings may clear a path of an object.

    0 where none are likely to. More than one in a row counts for pushes of a short distance only.

    Parameters
    ----------
    world
        World with the object and its surroundings.
    index
        Index of an object that can be pushed and is not held.
    path
        Nodes and edges of the path, indices into a flat (3, nx, ny), from `path_marks`.
    shape
        Nodes along x and y.

    """
    far = slide_m(world, index)
    most = MAX_REPEATS if world.push_spec.distance_m else 1
    footprint, farthest = world.items[index].footprint, most * far
    low, high = footprint.vertices.min(axis=0) - farthest, footprint.vertices.max(axis=0) + farthest
    round_it = grown(dop8_of_rectangle(*low.tolist(), *high.tolist()), 0.0)
    movable = [k for k, _ in world.near(round_it, index) if k < len(world.items)]
    solid = [world.model.footprints, *(world.items[k].footprint for k in movable)]
    return tuple(
        next(
            (
                count
                for count in range(1, most + 1)
                if _is_clear(_slid(footprint, ahead, count * far, solid), path, shape)
            ),
            0,
        )
        for ahead in HEADINGS[:4]
    )


def _is_clear(footprint: Polygons, path: Ints, shape: tuple[int, int]) -> bool:
    blockers = np.zeros((3, *shape), dtype=np.int32)
    grid.mark(blockers, footprint.vertices, footprint.offsets, SPACING_M, CLEARANCE_M, 1)
    return not blockers.reshape(-1)[path].any()


def _slid(
    footprint: Polygons, ahead: tuple[float, float], far: float, solid: Sequence[Polygons]
) -> Polygons:
    """Move a footprint along a heading, at most `far` metres, until it meets another one."""
    there, went = footprint, 0.0
    before = [clearance(footprint, other, 1.0) for other in solid]
    while went < far:
        went = min(far, went + STEP_M)
        moved = Polygons(footprint.vertices + went * np.array(ahead), footprint.offsets)
        # A footprint that is touched from the start does not hinder a push away from it.
        if any(
            clearance(moved, other, 1.0) <= 0.0 < gap
            for other, gap in zip(solid, before, strict=True)
        ):
            break
        there = moved
    return there
