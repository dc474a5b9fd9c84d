"""Protocol of a physics engine: it loads a scene, steps, is read, and applies forces.

What is done with these is the same for every engine and stands above them: the pusher and the rule
of rest in `internav_data.physics.solving`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence
    from contextlib import AbstractContextManager

    from internav_data.core.typing import Floats
    from internav_data.physics.scene import PhysicsScene
    from internav_data.records import Quaternion, Vec3

    PlacementRow = Any
    """Centres of mass and orientations of the bodies that move, as an engine keeps them."""


class Simulation(Protocol):
    """A loaded scene in motion. Bodies go by their index in the scene; only those that move count.

    Bodies that move and are not the first may sleep until something touches them. A class that
    inherits from this one advances by single steps, and looks at how far bodies move in them.
    """

    def step(self, count: int = 1) -> None:
        """Advance by a number of time steps."""

    def row(self, bodies: Sequence[int]) -> PlacementRow:
        """Return where the bodies are, as this engine keeps it; `placements` reads it."""
        return [self.placement(body) for body in bodies]

    def advance(
        self,
        bodies: Sequence[int],
        rows: list[PlacementRow],
        count: int,
        slow_m: float,
        slow_rad: float,  # noqa: ARG002 - asking for a speed costs time
    ) -> None:
        """Advance by time steps until the bodies may be slow, noting where they are after each.

        Parameters
        ----------
        bodies
            All bodies that move, ascending.
        rows
            Rows of the start and of each step since; those of the new steps join it.
        count
            Number of steps at most; it makes one at least.
        slow_m
            Distance that a slow body moves in a step at most, metres.
        slow_rad
            Speed with which a slow body turns at most, rad/s. In all steps but the last some body
            is not slow: an engine looks at what it can tell cheaply.

        """
        before = rows[-1]
        for _ in range(count):
            self.step()
            now = self.row(bodies)
            rows.append(now)
            for (here, _turn), (there, _turned) in zip(now, before, strict=True):
                if math.dist(here, there) >= slow_m:
                    break
            else:
                return
            before = now

    def placements(self, rows: Sequence[PlacementRow]) -> Floats:
        """Return centres of mass and orientations from rows, (rows, bodies, 7)."""
        return np.array([[(*middle, *turn) for middle, turn in row] for row in rows])

    def placement(self, body: int) -> tuple[Vec3, Quaternion]:
        """Return a body's centre of mass, metres, and its orientation."""

    def velocity(self, body: int) -> tuple[Vec3, Vec3]:
        """Return the velocity of a body's centre of mass, m/s, and its spin, rad/s."""

    def set_velocity(self, body: int, linear: Vec3, angular: Vec3) -> None:
        """Give a body a velocity, m/s, and a spin, rad/s."""

    def apply_force(self, body: int, force: Vec3) -> None:
        """Apply a force, newtons, at a body's centre of mass during the next step."""

    def penetration_m(self, body: int) -> float:
        """Return the depth of a body's deepest contact, metres; 0 without any."""


class Engine(Protocol):
    """A physics engine: it sets scenes in motion.

    No state remains between two scenes: the same scene and the same calls give the same motion to
    the last bit, in any process and after any history.
    """

    @property
    def name(self) -> str:
        """Name of the engine, as stored in certificates."""

    @property
    def build(self) -> str:
        """Version of the engine, as stored in certificates."""

    @property
    def libraries(self) -> tuple[str, ...]:
        """Installed distributions that results come from, besides numpy and numba."""

    @property
    def contact_margin_m(self) -> float:
        """Distance at which two bodies of this engine may already touch, metres."""

    @property
    def step_s(self) -> float:
        """Time step, seconds."""

    def load(self, scene: PhysicsScene) -> AbstractContextManager[Simulation]:
        """Load a scene, its first body at its pose and at rest like all others.

        One thread of the process simulates at a time: the context holds the engine's lock.
        """

    def __hash__(self) -> int:
        """Return a hash: engines are part of the keys of cached solutions."""
