"""What the expert's search is made of: worlds after some actions, and what to ask of them next."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from internav_data.world.actions import HORIZONS_DEG, Action

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from internav_data.records import Pose
    from internav_data.world import World

    Costs = NDArray[np.int32]
    Ints = NDArray[np.int64]

ALIKE_M: Final = 0.05
"""Worlds whose things lie this near count as one."""


@dataclass(slots=True, eq=False)
class State:
    """A world after some actions. The world is never changed."""

    world: World
    actions: tuple[int, ...]
    masks: Ints
    prices: Ints
    last: tuple[int, int] = (-1, -1)
    """The thing pushed last, and along which heading of the house."""
    doubt: int = 0
    """What was added to its promises because its pushes looked unlikely to lead on."""
    proposed: int = 0
    """Bits of the things whose interactions were proposed."""
    visited: set[int] = field(default_factory=set)

    @property
    def spent(self) -> int:
        """Count the actions so far."""
        return len(self.actions)


@dataclass(frozen=True, slots=True, eq=False)
class Visit:
    """A world to look at, some things taken as fixed (bits), and the field of costs for that."""

    state: State
    banned: int
    costs: Costs


@dataclass(frozen=True, slots=True, eq=False)
class Try:
    """An interaction to ask of the world, from a pose, and what its world would begin with."""

    state: State
    pose: int
    horizon: int
    """Index into HORIZONS_DEG."""
    action: Action
    back: Costs
    spare: Try | None = None
    """The same from another node, where the agent may be less in the way."""
    promise: int = 0
    last: tuple[int, int] = (-1, -1)
    doubt: int = 0


def roughly(pose: Pose | None) -> tuple[int, ...]:
    """Return where a thing lies, coarsely; () for a held one."""
    return () if pose is None else (round(pose.x / ALIKE_M), round(pose.y / ALIKE_M))


def bits_in_order(entered: Iterable[int]) -> tuple[int, ...]:
    """Bits of masks in the order in which they first appear, low ones first."""
    bits: dict[int, None] = {}
    for mask in entered:
        left = mask
        while left:
            low = left & -left
            bits[low.bit_length() - 1] = None
            left ^= low
    return tuple(bits)


def moves(poses: Sequence[int]) -> tuple[int, ...]:
    """Actions that lead through poses, each of which is one action from the last."""
    actions = []
    for before, after in pairwise(poses):
        if before // 4 != after // 4:
            actions.append(int(Action.MOVE_AHEAD))
        elif (after - before) % 4 == 1:
            actions.append(int(Action.ROTATE_LEFT))
        else:
            actions.append(int(Action.ROTATE_RIGHT))
    return tuple(actions)


def looks_between(horizon_deg: int, horizon: int) -> tuple[int, ...]:
    """Actions that turn the camera from one horizon to another."""
    steps = horizon - HORIZONS_DEG.index(horizon_deg)
    action = Action.LOOK_DOWN if steps > 0 else Action.LOOK_UP
    return (int(action),) * abs(steps)
