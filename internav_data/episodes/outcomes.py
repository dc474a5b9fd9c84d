"""Outcomes: what each interaction with each obstacle would do, everything else as it stands.

The counterfactual table of an episode: every obstacle, pushed in each of the four directions of
the house or picked up, without the agent in the way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from internav_data.records import Outcome
from internav_data.world.steps import carries

if TYPE_CHECKING:
    from collections.abc import Iterable

    from internav_data.records import Pose
    from internav_data.world import World

PUSHES: Final = ("push_east", "push_north", "push_west", "push_south")
"""Headings 0 to 3: along +x, +y, -x and -y of the house."""
PICK: Final = "pick"


def outcomes_of(world: World) -> tuple[tuple[Outcome, ...], ...]:
    """Return the outcomes of every obstacle of a world as it stands, in the obstacles' order.

    Five for each obstacle: `PUSHES` in order, then `PICK`. A failed one leaves the distances as
    they are; its reason says why: "not pushable", "not pickable", what `push` says, or "something
    rests on it".

    Parameters
    ----------
    world
        An episode at its start: distances are those from where its agent stands to its goal. It
        is not changed.
    """
    before = (world.steps(), world.way_m())
    return tuple(
        (
            *(_pushed(world, index, heading, before) for heading in range(4)),
            _picked(world, index, before),
        )
        for index in world.obstacles
    )


_Distances = tuple[int | None, float | None]


def _pushed(world: World, index: int, heading: int, before: _Distances) -> Outcome:
    if not world.items[index].asset.pushable:
        return _failed(PUSHES[heading], "not pushable", before)
    pushed = world.pushed(index, heading, agent=False)
    if not pushed.success:
        return _failed(PUSHES[heading], pushed.reason, before, pushed.seconds)
    changes = [(index, pushed.pose), *pushed.moved]
    steps, way_m = _after(world, changes)
    return Outcome(
        action=PUSHES[heading],
        success=True,
        displacement_m=pushed.displacement_m,
        steps=steps,
        way_m=way_m,
        opened=before[0] is None and steps is not None,
        seconds=pushed.seconds,
        reason="",
    )


def _picked(world: World, index: int, before: _Distances) -> Outcome:
    if not world.items[index].asset.pickable:
        return _failed(PICK, "not pickable", before)
    if carries(world, index):
        return _failed(PICK, "something rests on it", before)
    steps, way_m = _after(world, [(index, None)])
    opened = before[0] is None and steps is not None
    return Outcome(
        action=PICK,
        success=True,
        displacement_m=0.0,
        steps=steps,
        way_m=way_m,
        opened=opened,
        seconds=0.0,
        reason="",
    )


def _after(world: World, changes: Iterable[tuple[int, Pose | None]]) -> _Distances:
    there = world.copy()
    there.put(changes)
    return there.steps(), there.way_m()


def _failed(action: str, reason: str, before: _Distances, seconds: float = 0.0) -> Outcome:
    return Outcome(
        action=action,
        success=False,
        displacement_m=0.0,
        steps=before[0],
        way_m=before[1],
        opened=False,
        seconds=seconds,
        reason=reason,
    )
