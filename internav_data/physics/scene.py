"""Problems of physics and their solutions as plain data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from internav_data.records import Asset, Part, Pose
from internav_data.records.agent import AGENT

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.physics.kdop import Dop8
    from internav_data.records import Dynamics, Obstacle, Quaternion, SceneObject, Wall

UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)
AGENT_LOW_M: Final = 0.022
"""Bottom of the agent's collider. Footprints leave out parts below 2 cm, so the agent may stand
over them: a cylinder down to the floor would wedge under the feet of the furniture beside it."""
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
        """Return an object with the dynamics of its asset."""
        return Body(asset, pose, asset.dynamics, moves)

    @staticmethod
    def of_object(placed: SceneObject, assets: Mapping[str, Asset], *, moves: bool = True) -> Body:
        """Return a piece of furniture with its own dynamics, or else those of its asset."""
        asset = assets[placed.asset_id]
        return Body(asset, placed.pose, placed.dynamics or asset.dynamics, moves)

    @staticmethod
    def of_obstacle(obstacle: Obstacle, assets: Mapping[str, Asset], *, moves: bool = True) -> Body:
        """Return an episode's obstacle with the dynamics that are stored in the episode."""
        return Body(assets[obstacle.asset_id], obstacle.pose, obstacle.dynamics, moves)


@dataclass(frozen=True, slots=True)
class AgentCollider:
    """The agent's body: a fixed upright cylinder from `AGENT_LOW_M` to `AGENT_HEIGHT_M`.

    Its axis stands at (x, y) of the scene, metres.
    """

    x: float
    y: float
    radius_m: float


@dataclass(frozen=True, slots=True)
class PhysicsScene:
    """A problem of physics: the few bodies that can touch each other, on a floor at z = 0."""

    bodies: tuple[Body, ...]
    """Bodies in the order in which they enter the engine; the first one falls or is pushed."""
    agent: AgentCollider | None = None
    """Collider of the agent; None if it takes no part."""


def wall_body(wall: Wall) -> Body:
    """Return a fixed body in the shape of a piece of wall."""
    size = (wall.x_max - wall.x_min, wall.y_max - wall.y_min, wall.z_max - wall.z_min)
    part = Part("box", (0.0, 0.0, size[2] / 2.0), size, UPRIGHT, (), (200, 200, 200), "stone")
    solid = Asset(
        # An asset's hash is that of its id: one id for all walls would make every cache a list.
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
    """Solution of a settle, in the frame of its scene."""

    pose: Pose
    """Final pose of the first body, unrounded."""
    seconds: float
    """Simulated time until at rest, or the time limit."""
    at_rest: bool
    penetration_m: float
    """Deepest contact at the end, metres."""
    reach_m: float
    """Bound of the distance in the plane that any of its corners moved at any time, metres."""


@dataclass(frozen=True, slots=True)
class PushSolution:
    """Solution of a push, in the frame of its scene: one entry per moving body."""

    poses: tuple[Pose, ...]
    """Final poses, unrounded."""
    sweeps: tuple[Dop8, ...]
    """8-DOP of the area that each body's corners swept, the start included."""
    paths: tuple[bytes, ...]
    """Recorded poses of each body, (n, 7) float32 as bytes: centre of mass, quaternion."""
    seconds: float
    """Simulated time from the first touch until at rest, or the time limit."""
    at_rest: bool
