"""Outcomes: the effect of each interaction with each obstacle, all other objects as they stand.

They are the potential outcomes (Rubin 1974) of five interventions at the start of an episode: each
obstacle pushed in one of the four directions of the house, or picked up, without the agent in the
way.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Final

from internav_data.geometry import round_m
from internav_data.navigation import keeps_clear
from internav_data.physics.displacement import shift_m
from internav_data.records import MovedObject, Outcome
from internav_data.world.world import carries

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from internav_data.physics.pushing import PushResult
    from internav_data.records import Pose
    from internav_data.world import World

PUSH_DIRECTIONS: Final = ("push_east", "push_north", "push_west", "push_south")
"""Actions of outcomes by heading 0 to 3: along +x, +y, -x and -y of the house."""
MAX_REACH: Final = 4
"""Maximum number of pushes in a row of an outcome."""
PICK: Final = "pick"
"""Action of outcomes in which the obstacle is picked up."""

Distances = tuple[int | None, float | None]
"""Lattice distance to the goal in steps and Euclidean path length in metres; None if cut off."""


def outcomes_of(
    world: World, before: Distances | None = None, other_engine: str | None = None
) -> tuple[tuple[Outcome, ...], ...]:
    """Return the outcomes of every obstacle of a world, in the obstacles' order.

    There are five for each obstacle: `PUSH_DIRECTIONS` in order, then `PICK`. A failed one leaves
    the distances as they are; its reason is "not pushable", "not pickable", a reason of
    `PushResult` or "something rests on it".

    Parameters
    ----------
    world
        World of an episode at its start; it is not changed. Distances are those from its agent
        to its goal.
    before
        Those distances before any interaction, if they are known already.
    other_engine
        Name of a physics engine that is asked for a second opinion on each push; None for none.

    """
    before = before or (world.path_steps(), world.obstructed_path_m())
    other = None if other_engine is None else world.asking(other_engine)

    def pushed(index: int, heading: int, lifted: _Lifted) -> Outcome:
        outcome = _pushed(world, index, heading, before, lifted)
        if other is None or not world.items[index].dynamics.pushable:
            return outcome
        return _compared(outcome, other, index, heading, blocked=before[0] is None)

    return tuple(
        (
            *(pushed(index, heading, lifted) for heading in range(4)),
            _picked(world, index, before, lifted),
        )
        for index in world.obstacles
        for lifted in [_Lifted(world, index)]
    )


class _Lifted:
    """A world without one of its objects, from which distances after its pushes are derived.

    No push that moves this object alone can give shorter distances. Where the path of this world
    keeps clear of the pushed object, it still is the shortest: most outcomes need no new path.
    """

    def __init__(self, world: World, index: int) -> None:
        self._world, self._index = world, index

    @cached_property
    def distances(self) -> Distances:
        """Distances to the goal without the object."""
        there = self._there
        return there.path_steps(), None if self._path is None else self._path[0]

    @cached_property
    def _there(self) -> World:
        there = self._world.copy()
        there.put([(self._index, None)])
        return there

    @cached_property
    def _path(self) -> tuple[float, NDArray[np.float64]] | None:
        return self._there.path()

    def laid(self, pose: Pose) -> Distances:
        """Return the distances with the object at a pose and all others as before."""
        # Cut off without the object, cut off with it.
        best_steps, best_path_m = self.distances
        if best_steps is None and best_path_m is None:
            return None, None
        there = self._there.copy()
        there.put([(self._index, pose)])
        steps = None if best_steps is None else there.path_steps()
        # A path that the object leaves free is still the shortest one.
        if self._path is None or keeps_clear(self._path[1], there.items[self._index].footprint):
            return steps, best_path_m
        return steps, there.obstructed_path_m()


def _pushed(world: World, index: int, heading: int, before: Distances, lifted: _Lifted) -> Outcome:
    if not world.items[index].dynamics.pushable:
        return _failed(PUSH_DIRECTIONS[heading], "not pushable", before)
    # Without the agent: an outcome is a fact about the object, wherever an agent may stand.
    pushed = world.simulate_push(index, heading, agent=False)
    if not pushed.success:
        return replace(
            _failed(PUSH_DIRECTIONS[heading], pushed.reason, before),
            seconds=pushed.seconds,
            at_rest=pushed.at_rest,
        )
    if pushed.moved:
        # Other objects moved too: the world without this one says nothing about their new poses.
        there = world.copy()
        there.put([(index, pushed.pose), *pushed.moved])
        steps, obstructed_path_m = there.path_steps(), there.obstructed_path_m()
    else:
        steps, obstructed_path_m = lifted.laid(pushed.pose)
    reach_m, reach_opened = _reach(world, index, heading, pushed, opens=before[0] is None)
    return Outcome(
        action=PUSH_DIRECTIONS[heading],
        success=True,
        displacement_m=pushed.displacement_m,
        path_steps_after=steps,
        path_m_after=obstructed_path_m,
        opened=before[0] is None and steps is not None,
        seconds=pushed.seconds,
        reason="",
        pose=pushed.pose,
        moved=tuple(_moved(world, key, pose) for key, pose in pushed.moved),
        at_rest=pushed.at_rest,
        reach_m=reach_m,
        reach_opened=reach_opened,
        swept=_swept(world, index, pushed),
    )


def _compared(
    outcome: Outcome, other: World, index: int, heading: int, *, blocked: bool
) -> Outcome:
    """Return the outcome of a push with the second opinion of another engine.

    `blocked` says whether there is anything to open.
    """
    pushed = other.simulate_push(index, heading, agent=False)
    opened = False
    if blocked and pushed.success:
        there = other.copy()
        there.put([(index, pushed.pose), *pushed.moved])
        opened = there.path_steps() is not None
    return replace(
        outcome,
        agrees=(pushed.success, opened) == (outcome.success, outcome.opened),
        other_pose=pushed.pose if pushed.success else None,
    )


def _swept(world: World, index: int, pushed: PushResult) -> tuple[float, ...] | None:
    """Return the distances of the sides of a push's box from the object, rounded up to 1 cm."""
    if pushed.swept is None:
        return None
    start, (x_min, y_min, x_max, y_max) = world.body(index).pose, pushed.swept
    sides = (start.x - x_min, start.y - y_min, x_max - start.x, y_max - start.y)
    # 10 nm beyond a centimetre are of the arithmetic, not of the push.
    return tuple(math.ceil(100.0 * side - 1e-6) / 100.0 for side in sides)


def _reach(
    world: World, index: int, heading: int, pushed: PushResult, *, opens: bool
) -> tuple[tuple[float, ...] | None, int | None]:
    """Push on after a first push; return the distances, and how many pushes open the lattice.

    `opens` says whether there is anything to open. (None, None) where a push ends by itself: to
    push on is a matter of steps.
    """
    if not world.push_spec.distance_m:
        return None, None
    there, asset, begin = world.copy(), world.items[index].asset, world.body(index).pose
    reach_m, opened = [pushed.displacement_m], None
    while True:
        there.put([(index, pushed.pose), *pushed.moved])
        if opens and opened is None and there.path_steps() is not None:
            opened = len(reach_m)
        if len(reach_m) == MAX_REACH:
            break
        pushed = there.simulate_push(index, heading, agent=False)
        if not pushed.success:
            break
        reach_m.append(round_m(shift_m(asset, begin, pushed.pose)))
    return tuple(reach_m), opened


def _moved(world: World, index: int, pose: Pose) -> MovedObject:
    """Name an item of a world as its episode does: obstacles by index, furniture by object id."""
    furniture = world.model.object_ids
    if index < len(furniture):
        return MovedObject(obstacle=None, object_id=furniture[index], pose=pose)
    return MovedObject(obstacle=index - len(furniture), object_id=None, pose=pose)


def _picked(world: World, index: int, before: Distances, lifted: _Lifted) -> Outcome:
    if not world.items[index].dynamics.pickable:
        return _failed(PICK, "not pickable", before)
    if carries(world, index):
        return _failed(PICK, "something rests on it", before)
    # A held object blocks nothing, so these are the distances while it is carried.
    steps, obstructed_path_m = lifted.distances
    opened = before[0] is None and steps is not None
    return Outcome(
        action=PICK,
        success=True,
        displacement_m=0.0,
        path_steps_after=steps,
        path_m_after=obstructed_path_m,
        opened=opened,
        seconds=0.0,
        reason="",
        moved=(),
        at_rest=True,
    )


def _failed(action: str, reason: str, before: Distances) -> Outcome:
    return Outcome(
        action=action,
        success=False,
        displacement_m=0.0,
        path_steps_after=before[0],
        path_m_after=before[1],
        opened=False,
        seconds=0.0,
        reason=reason,
        moved=(),
        at_rest=True,
    )
