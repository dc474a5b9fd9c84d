"""Guess which pushes clear a way, by sliding plans over the floor: a screen, not the truth."""

from __future__ import annotations

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
"""How finely a slide is tried for what stands in its way."""
GRAVITY: Final = 9.81


def slide_m(world: World, thing: int) -> float:
    """How far a thing slides on free ground when pushed, metres: Coulomb's law."""
    dynamics, spec = world.items[thing].dynamics, world.push_spec
    brake = dynamics.friction * GRAVITY
    gain = spec.force_n / dynamics.mass_kg - brake
    if gain <= 0.0:
        return 0.0
    speed = min(spec.speed_m_s, gain * spec.seconds)
    return speed * speed / 2.0 * (1.0 / gain + 1.0 / brake)


def path_marks(poses: Sequence[int], nodes: int) -> Ints:
    """Nodes and edges that a way of poses uses, as indices into a flat (3, nodes)."""
    here = np.array(poses, dtype=np.int64)
    place, quarter = here // 4, here[:-1] % 4
    steps = place[:-1] != place[1:]
    edge = np.minimum(place[:-1], place[1:])[steps]
    row = np.where(quarter[steps] % 2 == 0, EAST, NORTH)
    return np.unique(np.concatenate([NODE * nodes + place, row * nodes + edge]))


def clearing_pushes(
    world: World, thing: int, path: Ints, shape: tuple[int, int]
) -> tuple[bool, ...]:
    """Whether a push along each of the four headings of the house may clear a way of a thing.

    Parameters
    ----------
    world
        As things lie.
    thing
        An item that can be pushed and is not held.
    way
        Indices into a flat (3, nx, ny), from `path_marks`.
    shape
        nx, ny.
    """
    far = slide_m(world, thing)
    footprint = world.items[thing].footprint
    low, high = footprint.vertices.min(axis=0) - far, footprint.vertices.max(axis=0) + far
    round_it = grown(dop8_of_rectangle(*low.tolist(), *high.tolist()), 0.0)
    movable = [k for k, _ in world.near(round_it, thing) if k < len(world.items)]
    solid = [world.model.footprints, *(world.items[k].footprint for k in movable)]
    out = []
    for heading in range(4):
        there = _slid(footprint, HEADINGS[heading], far, solid)
        blockers = np.zeros((3, *shape), dtype=np.int32)
        grid.mark(blockers, there.vertices, there.offsets, SPACING_M, CLEARANCE_M, 1)
        out.append(not blockers.reshape(-1)[path].any())
    return tuple(out)


def _slid(
    footprint: Polygons, ahead: tuple[float, float], far: float, solid: Sequence[Polygons]
) -> Polygons:
    """Move a plan as far along a heading as it goes before it runs into something."""
    there, went = footprint, 0.0
    before = [clearance(footprint, other, 1.0) for other in solid]
    while went < far:
        went = min(far, went + STEP_M)
        moved = Polygons(footprint.vertices + went * np.array(ahead), footprint.offsets)
        # What touches from the start does not hinder a push away from it.
        if any(
            clearance(moved, other, 1.0) <= 0.0 < gap
            for other, gap in zip(solid, before, strict=True)
        ):
            break
        there = moved
    return there
