"""Plain data that a physics engine is asked about, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from internav_data.records import Asset, Part, Pose
from internav_data.records.agent import AGENT

if TYPE_CHECKING:
    from internav_data.physics.kdop import Dop8
    from internav_data.records import Quaternion, Wall

UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)
AGENT_LOW_M: Final = 0.022
"""What is lower than 2 cm is no obstacle (footprints leave it out), so the agent's body begins
above it: a column down to the floor would wedge under the feet of what it stands beside."""
AGENT_HEIGHT_M: Final = AGENT.height_m


@dataclass(frozen=True, slots=True)
class Body:
    """An asset at a pose; a body that does not move weighs nothing to the engine."""

    asset: Asset
    pose: Pose
    moves: bool


@dataclass(frozen=True, slots=True)
class AgentCollider:
    """The agent's body: a fixed upright cylinder from `AGENT_LOW_M` to `AGENT_HEIGHT_M`."""

    x: float
    y: float
    radius_m: float


@dataclass(frozen=True, slots=True)
class PhysicsScene:
    """A small scene: what can touch each other, everything else left out.

    Bodies enter the engine in this order, on a floor at z = 0.
    """

    bodies: tuple[Body, ...]
    agent: AgentCollider | None = None
    """The agent, where it takes part."""


def wall_body(wall: Wall) -> Body:
    """Turn a piece of wall into a fixed body."""
    size = (wall.x_max - wall.x_min, wall.y_max - wall.y_min, wall.z_max - wall.z_min)
    part = Part("box", (0.0, 0.0, size[2] / 2.0), size, UPRIGHT, (), (200, 200, 200), "stone")
    solid = Asset(
        # Assets are told apart by their ids first: one id for all would make every cache a list.
        asset_id=f"wall {size[0]:.4f} {size[1]:.4f} {size[2]:.4f}",
        type="wall",
        size=size,
        mass_kg=1.0,
        friction=1.0,
        pushable=False,
        pickable=False,
        spawnable=False,
        blocks=True,
        parts=(part,),
    )
    middle = ((wall.x_min + wall.x_max) / 2.0, (wall.y_min + wall.y_max) / 2.0)
    return Body(solid, Pose(*middle, wall.z_min, UPRIGHT), moves=False)


@dataclass(frozen=True, slots=True)
class SettleSolution:
    """How the first body of a setting came to rest."""

    pose: Pose
    """Not rounded: the caller moves it into place first."""
    seconds: float
    """Simulated time until at rest, or the time limit."""
    at_rest: bool
    penetration_m: float
    """Deepest contact at the end."""
    reach_m: float
    """Farthest that any of its corners ever was from where it began, in the plane."""


@dataclass(frozen=True, slots=True)
class PushSpec:
    """How the first body of a setting is pushed, along +x at its centre of mass.

    A constant force until the body has the speed (the last impulse is scaled so that it has
    exactly that) or the time is over; then it is let go. An infinite force gives the speed at once.
    """

    force_n: float
    speed_m_s: float
    seconds: float


@dataclass(frozen=True, slots=True)
class PushSolution:
    """Where a push led the moving bodies of a setting, in their order."""

    poses: tuple[Pose, ...]
    """Not rounded: the caller moves them into place first."""
    sweeps: tuple[Dop8, ...]
    """What each body's corners swept in the plane, its start included."""
    paths: tuple[bytes, ...]
    """Each body's poses on its way as float32 numbers, seven each: centre of mass, quaternion."""
    seconds: float
    """Simulated time from the first touch until at rest, or the time limit."""
    at_rest: bool


class Engine(Protocol):
    """A physics engine: pure functions from settings to plain data.

    Nothing lives in the engine between two calls: the same setting gives the same answer to the
    last bit, in any process and after any history.
    """

    @property
    def name(self) -> str:
        """Name of the engine, as stored in certificates."""

    @property
    def build(self) -> str:
        """Version and build of the engine, as stored in certificates."""

    def settle(self, scene: PhysicsScene) -> SettleSolution:
        """Let the first body of the setting fall until it rests; the others stay."""

    def push(self, scene: PhysicsScene, spec: PushSpec) -> PushSolution:
        """Push the first body along +x; bodies that move take part, the others stay."""

    def __hash__(self) -> int:
        """Engines are keys of caches of what they answered."""
