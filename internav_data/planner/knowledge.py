"""Knowledge that an agent has gained in the true world, for searches in a world of beliefs."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.records import Pose
    from internav_data.world import Action, World

ALIKE_M: Final = 0.05
"""Resolution at which two positions of an object count as the same, metres."""

Attempt = tuple[object, ...]
"""Interaction in a situation: kind, object, heading, the object's position, the agent's node."""


def coarse_position(pose: Pose | None) -> tuple[int, ...]:
    """Return an object's position in units of `ALIKE_M`; () for a held one."""
    return () if pose is None else (round(pose.x / ALIKE_M), round(pose.y / ALIKE_M))


@dataclass(frozen=True, slots=True)
class Knowledge:
    """Facts that the world of a search does not show."""

    immovable: frozenset[int] = frozenset()
    """Indices of objects that did not yield: they count as fixed."""
    failed: frozenset[Attempt] = frozenset()
    """Interactions that failed: none is proposed again."""
    risks: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({}))
    """Price added to that of moving an object, actions, by its index."""

    def excludes(self, world: World, action: Action, index: int) -> bool:
        """Return whether an interaction with an object is known to fail in a world."""
        return bool(self.failed) and any(
            attempt_of(world, action, index, anywhere=anywhere) in self.failed
            for anywhere in (True, False)
        )


NO_KNOWLEDGE: Final = Knowledge()
"""Knowledge of an agent that has not acted yet, and of one that knows everything anyway."""


def attempt_of(world: World, action: Action, index: int, *, anywhere: bool) -> Attempt:
    """Return an interaction with an object, given by its index, as it is remembered.

    Parameters
    ----------
    world
        World before the interaction.
    action
        Action of the interaction.
    index
        Index of the object.
    anywhere
        Whether it stands for the interaction from every pose of the agent.

    """
    heading = (world.quarter + action.quarter_turns) % 4 if action.kind == "push" else -1
    agent = None if anywhere else (world.i, world.j, world.quarter)
    return action.kind, index, heading, coarse_position(world.items[index].pose), agent
