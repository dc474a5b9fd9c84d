"""Plain data that a physics engine is asked about, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from internav_data.records import Asset, Part, Pose
from internav_data.records.agent import AGENT

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.physics.kdop import Dop8
    from internav_data.records import Dynamics, Obstacle, PushSpec, Quaternion, Wall

UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)
AGENT_LOW_M: Final = 0.022
"""What is lower than 2 cm is no obstacle (footprints leave it out), so the agent's body begins
above it: a column down to the floor would wedge under the feet of what it stands beside."""
AGENT_HEIGHT_M: Final = AGENT.height_m


@dataclass(frozen=True, slots=True)
class Body:
    """An object in a scene: its geometry, its pose and its own dynamics."""

    asset: Asset
    """Source of the geometry alone; the mass and friction that count are those of `dynamics`."""
    pose: Pose
    dynamics: Dynamics
    moves: bool = True
    """False for a body that stays where it is, whatever hits it."""

    @staticmethod
    def of(asset: Asset, pose: Pose, *, moves: bool = True) -> Body:
        """Return an object with the dynamics of its asset: furniture, or a new obstacle."""
        return Body(asset, pose, asset.dynamics, moves)

    @staticmethod
    def of_obstacle(obstacle: Obstacle, assets: Mapping[str, Asset], *, moves: bool = True) -> Body:
        """Return an episode's obstacle with the dynamics that are stored in the episode."""
        return Body(assets[obstacle.asset_id], obstacle.pose, obstacle.dynamics, moves)


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
    return Body.of(solid, Pose(*middle, wall.z_min, UPRIGHT), moves=False)


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
        """Version of the engine and number of its rules, as stored in certificates."""

    @property
    def rules(self) -> int:
        """Number of the rules by which scenes are built and solved; part of `build`.

        Raised with every change of results, so that datasets made by other rules are told from
        wrong ones and no cached result outlives its rules.
        """

    @property
    def libraries(self) -> tuple[str, ...]:
        """Installed distributions that results come from, besides numpy and numba."""

    @property
    def contact_margin_m(self) -> float:
        """Distance at which two bodies of this engine may already touch, metres."""

    def settle(self, scene: PhysicsScene) -> SettleSolution:
        """Let the first body of the setting fall until it rests; the others stay."""

    def push(self, scene: PhysicsScene, spec: PushSpec) -> PushSolution:
        """Push the first body along +x; bodies that move take part, the others stay."""

    def __hash__(self) -> int:
        """Engines are keys of caches of what they answered."""
