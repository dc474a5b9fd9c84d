"""MuJoCo (Todorov, Erez and Tassa 2012; Google DeepMind) as physics engine.

One thread solves at a time, from the first number of a scene to the last pose: scenes of the same
shapes are written into one compiled model.
"""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data.core.locks import ThreadLock, once_per_process
from internav_data.physics.engines.mujoco_scene import (
    FAST,
    MARGIN_M,
    SUBSTEPS,
    ModelBuilder,
    mujoco,
    set_friction_solver,
    untimed,
    warnings_unlogged,
)
from internav_data.physics.engines.protocol import Simulation

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from internav_data.core.typing import Floats
    from internav_data.physics.engines.mujoco_scene import CompiledScene, MjData
    from internav_data.physics.scene import PhysicsScene
    from internav_data.records import Quaternion, Vec3

_ORDER = (0, 1, 2, 4, 5, 6, 3)
"""Numbers of a body in MuJoCo's order (centre of mass; w, x, y, z) in that of the protocol."""
ENGINE_LOCK = ThreadLock()
"""Held while a scene is built, stepped and read: by one thread of the process."""


@dataclass(slots=True, eq=False)
class MuJoCo:
    """Engine on MuJoCo's library, without graphics."""

    builder: ModelBuilder = field(default_factory=ModelBuilder)
    """Builder of scenes, with its compiled models."""
    name: str = "mujoco"
    libraries: tuple[str, ...] = ("mujoco-core",)
    contact_margin_m: float = MARGIN_M
    build: str = field(default_factory=lambda: f"mujoco {version('mujoco-core')}")

    @property
    def step_s(self) -> float:
        """Time step, seconds."""
        return self.builder.step_s

    @contextmanager
    def load(self, scene: PhysicsScene) -> Iterator[MuJoCoSimulation]:
        """Load a scene in place of the one before; the engine is locked meanwhile.

        Raises
        ------
        UsageError
            MuJoCo refuses a shape of the scene.
        RuntimeError
            MuJoCo lost the scene: it became unstable, had too many contacts, or too little memory
            for them.

        """
        with ENGINE_LOCK, warnings_unlogged(), untimed():
            try:
                made = self.builder.build(scene)
                yield MuJoCoSimulation(made)
            except mujoco.FatalError as error:
                line = " ".join(str(error).split())
                raise RuntimeError(f"MuJoCo lost a scene: {line}") from error
            _check(made.data)


class MuJoCoSimulation(Simulation):
    """A scene in motion in MuJoCo. Bodies go by their index in the scene."""

    __slots__ = (
        "_fast",
        "_forces",
        "_gain",
        "_geoms",
        "_masses",
        "_model_and_data",
        "_places",
        "_positions",
        "_pushed",
        "_speeds",
        "_step_s",
        "_top",
        "_velocities",
    )

    def __init__(self, made: CompiledScene) -> None:
        data = made.data
        self._model_and_data, self._geoms = (made.model, data), made.geoms
        self._positions = {k: data.qpos[7 * n : 7 * n + 7] for k, n in made.movers.items()}
        self._velocities = {k: data.qvel[6 * n : 6 * n + 6] for k, n in made.movers.items()}
        self._forces = {k: data.qfrc_applied[6 * n : 6 * n + 3] for k, n in made.movers.items()}
        self._places, self._speeds = data.qpos, data.qvel
        self._top = 0.0
        """Greatest component of the velocities of all bodies, m/s or rad/s."""
        self._fast: bool | None = None
        """Whether something was fast before the last step; None before the first."""
        self._masses = {k: float(made.model.body_mass[made.rows[k]]) for k in made.movers}
        self._step_s = SUBSTEPS * float(made.model.opt.timestep)
        self._gain = 0.0
        """Highest speed that a force of the next step alone would give a body, m/s."""
        self._pushed: list[int] = []
        """Bodies on which a force acts during the next step."""

    def step(self, count: int = 1) -> None:
        """Advance by a number of time steps."""
        for _ in range(count):
            self._step()

    def row(self, bodies: Sequence[int]) -> bytes:  # noqa: ARG002 - all that move
        """Return where the bodies are, as MuJoCo keeps it."""
        return self._places.tobytes()

    def advance(
        self,
        bodies: Sequence[int],  # noqa: ARG002 - all that move
        rows: list[bytes],
        count: int,
        slow_m: float,
        slow_rad: float,
    ) -> None:
        """Advance by time steps until the bodies may be slow, noting where they are after each.

        Parameters as of `Simulation.advance`.
        """
        places, slow = self._places, max(slow_m / self._step_s, slow_rad)
        for _ in range(count):
            self._step()
            rows.append(places.tobytes())
            if self._top < slow:
                break

    def placements(self, rows: Sequence[bytes]) -> Floats:
        """Return centres of mass and orientations from rows, (rows, bodies, 7)."""
        numbers = np.frombuffer(b"".join(rows)).reshape(len(rows), -1, len(_ORDER))
        return numbers[..., _ORDER]

    def _step(self) -> None:
        model, data = self._model_and_data
        fast = self._top + self._gain > FAST
        if fast is not self._fast:
            set_friction_solver(model, fast=fast)
            self._fast = fast
        mujoco.mj_step(model, data, SUBSTEPS)
        if self._pushed:
            for body in self._pushed:
                self._forces[body][:] = 0.0
            self._pushed.clear()
            self._gain = 0.0
        speeds = self._speeds.tolist()
        self._top = max(*speeds, -min(speeds))

    def placement(self, body: int) -> tuple[Vec3, Quaternion]:
        """Return a body's centre of mass, metres, and its orientation."""
        x, y, z, w, a, b, c = self._positions[body].tolist()
        return (x, y, z), (a, b, c, w)

    def velocity(self, body: int) -> tuple[Vec3, Vec3]:
        """Return the velocity of a body's centre of mass, m/s, and its spin, rad/s."""
        x, y, z, *own = self._velocities[body].tolist()
        # MuJoCo's spin is in the body's own axes.
        return (x, y, z), _turned(self.placement(body)[1], (own[0], own[1], own[2]))

    def set_velocity(self, body: int, linear: Vec3, angular: Vec3) -> None:
        """Give a body a velocity, m/s, and a spin, rad/s."""
        x, y, z, w = self.placement(body)[1]
        self._velocities[body][:] = (*linear, *_turned((-x, -y, -z, w), angular))
        self._top = max(map(abs, self._speeds.tolist()))

    def apply_force(self, body: int, force: Vec3) -> None:
        """Apply a force, newtons, at a body's centre of mass during the next step."""
        self._forces[body][:] = force
        self._pushed.append(body)
        gain = math.hypot(*force) / self._masses[body] * self._step_s
        self._gain = max(self._gain, gain)

    def penetration_m(self, body: int) -> float:
        """Return the depth of a body's deepest contact, metres; 0 without any."""
        model, data = self._model_and_data
        mujoco.mj_fwdPosition(model, data)  # a step leaves the contacts of its beginning
        geoms = self._geoms[body]
        touched = (data.contact.geom >= geoms.start) & (data.contact.geom < geoms.stop)
        distances: Any = data.contact.dist[touched.any(axis=1)]
        return max([0.0, *(MARGIN_M - distances).tolist()])


def _check(data: MjData) -> None:
    """Check that MuJoCo simulated a scene to its end without a warning.

    Raises
    ------
    RuntimeError
        It gave one.
    """
    counts = data.warning.number
    if counts.any():
        kinds = [str(mujoco.mjtWarning(k).name) for k in counts.nonzero()[0].tolist()]
        raise RuntimeError(f"MuJoCo lost a scene: {', '.join(kinds)}")


def _turned(turn: Quaternion, vector: Vec3) -> Vec3:
    """Return a vector turned by a unit quaternion."""
    (x, y, z, w), (a, b, c) = turn, vector
    # With q for (x, y, z) it is v + 2 q x (q x v + w v).
    i, j, k = y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c
    return a + 2.0 * (y * k - z * j), b + 2.0 * (z * i - x * k), c + 2.0 * (x * j - y * i)


@once_per_process  # a forked one would wait for a lock whose holder stayed behind
def mujoco_engine() -> MuJoCo:
    """Return this process's MuJoCo."""
    return MuJoCo()
