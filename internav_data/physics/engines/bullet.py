"""Bullet (Coumans, pybullet) as physics engine: one client per process, one scene at a time.

One thread solves at a time, from the first body of a scene to the last pose. Two threads in one
world take each other's bodies away, and clients of their own would share Bullet's globals. A lock
costs nothing that threads could gain: pybullet holds the interpreter while it steps.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from internav_data.core.locks import ThreadLock, once_per_process
from internav_data.core.temporary import process_folder
from internav_data.physics.engines.bullet_scene import HULL_MARGIN_M, Builder, pybullet
from internav_data.physics.engines.protocol import Simulation

if TYPE_CHECKING:
    from collections.abc import Iterator

    from internav_data.physics.scene import PhysicsScene
    from internav_data.records import Quaternion, Vec3

ENGINE_LOCK = ThreadLock()
"""Held while a scene is built, stepped and read: by one thread of the process. The validator holds
it too, while it uses a client of its own."""
_ASLEEP = (
    pybullet.ACTIVATION_STATE_ENABLE_SLEEPING
    | pybullet.ACTIVATION_STATE_ENABLE_WAKEUP
    | pybullet.ACTIVATION_STATE_SLEEP
)


@dataclass(slots=True, eq=False)
class Bullet:
    """Engine on one client of pybullet in DIRECT mode (without graphics)."""

    builder: Builder
    """Builder of scenes on the engine's client."""
    name: str = "bullet"
    libraries: tuple[str, ...] = ("pybullet",)
    contact_margin_m: float = HULL_MARGIN_M
    build: str = field(default_factory=lambda: f"pybullet {version('pybullet')}")

    @property
    def step_s(self) -> float:
        """Time step, seconds."""
        return self.builder.step_s

    @contextmanager
    def load(self, scene: PhysicsScene) -> Iterator[BulletSimulation]:
        """Load a scene in place of the one before; the engine is locked meanwhile."""
        with ENGINE_LOCK:
            ids, client = self.builder.build(scene), self.builder.client
            for identity, body in zip(ids[1:], scene.bodies[1:], strict=True):
                if body.moves:
                    # Asleep, a body that is not touched neither trembles nor costs time; a touch
                    # wakes it.
                    pybullet.changeDynamics(
                        identity, -1, activationState=_ASLEEP, physicsClientId=client
                    )
            yield BulletSimulation(ids, client)


@dataclass(frozen=True, slots=True)
class BulletSimulation(Simulation):
    """A scene in a world of Bullet. Bodies go by their index in the scene."""

    ids: list[int]
    """Bullet's numbers of the bodies."""
    client: int

    def step(self, count: int = 1) -> None:
        """Advance by a number of time steps."""
        for _ in range(count):
            pybullet.stepSimulation(self.client)

    def placement(self, body: int) -> tuple[Vec3, Quaternion]:
        """Return a body's centre of mass, metres, and its orientation."""
        found: tuple[Vec3, Quaternion] = pybullet.getBasePositionAndOrientation(
            self.ids[body], self.client
        )
        return found

    def velocity(self, body: int) -> tuple[Vec3, Vec3]:
        """Return the velocity of a body's centre of mass, m/s, and its spin, rad/s."""
        found: tuple[Vec3, Vec3] = pybullet.getBaseVelocity(self.ids[body], self.client)
        return found

    def set_velocity(self, body: int, linear: Vec3, angular: Vec3) -> None:
        """Give a body a velocity, m/s, and a spin, rad/s."""
        pybullet.resetBaseVelocity(self.ids[body], linear, angular, self.client)

    def apply_force(self, body: int, force: Vec3) -> None:
        """Apply a force, newtons, at a body's centre of mass during the next step."""
        middle, _ = self.placement(body)
        pybullet.applyExternalForce(
            self.ids[body], -1, force, middle, pybullet.WORLD_FRAME, self.client
        )

    def penetration_m(self, body: int) -> float:
        """Return the depth of a body's deepest contact, metres; 0 without any."""
        contacts: Any = pybullet.getContactPoints(bodyA=self.ids[body], physicsClientId=self.client)
        # Column 8 of a contact point is the distance, negative where bodies overlap.
        return max([0.0, *(-contact[8] for contact in contacts)])


@once_per_process  # forked ones would overwrite each other's files
def bullet() -> Bullet:
    """Return this process's Bullet, connected at first use; its files are removed at exit."""
    return Bullet(Builder(pybullet.connect(pybullet.DIRECT), process_folder()))
