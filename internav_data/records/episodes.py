"""An episode: a start, a goal, and the obstacles between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from internav_data.records.houses import Split
from internav_data.records.physics import Dynamics
from internav_data.records.poses import Pose, Quaternion, Vec2

Mode = Literal["blocked", "lengthened"]
Redraw = Literal["no two nodes far enough apart", "condition not reached", "no expert"]
"""Why a start and goal were drawn again: none were found, spots or obstacles ran out before the
mode's condition held, or the expert found no plan."""


@dataclass(frozen=True, slots=True)
class Start:
    """Where the agent begins: lattice node (i, j) = (x, y) / 0.25 m and a quarter turn."""

    i: int
    j: int
    x: float
    y: float
    yaw_deg: int
    room: int


@dataclass(frozen=True, slots=True)
class Goal:
    """The lattice node to reach."""

    i: int
    j: int
    x: float
    y: float
    room: int


@dataclass(frozen=True, slots=True)
class NodePath:
    """Start, door centres and goal along one room path."""

    doors: tuple[int, ...]
    points: tuple[Vec2, ...]
    """len(doors) + 2 points: the start, each door's centre, the goal."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What one interaction with one obstacle would do, everything else as the episode starts."""

    action: str
    """push_east, push_north, push_west, push_south (world directions +x, +y, -x, -y) or pick."""
    success: bool
    displacement_m: float
    path_steps_after: int | None
    """Lattice distance to the goal afterwards; None when cut off."""
    path_m_after: float | None
    """Any-angle distance to the goal afterwards; None when cut off."""
    opened: bool
    seconds: float
    reason: str
    """Why it failed; empty on success."""


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A thing spawned on the way, where it came to rest."""

    asset_id: str
    type: str
    x: float
    y: float
    z: float
    quaternion: Quaternion
    mass_kg: float
    friction: float
    pushable: bool
    pickable: bool
    segment: int
    """Which segment of its node path it was spawned on (0 starts at the start)."""
    settle_s: float
    """Certificate of the settle check: simulated seconds until at rest."""
    settle_penetration_m: float
    """Certificate of the settle check: deepest contact at rest."""
    outcomes: tuple[Outcome, ...] | None

    @property
    def dynamics(self) -> Dynamics:
        """Dynamics of this obstacle, which may differ from those of its asset."""
        return Dynamics(self.mass_kg, self.friction, self.pushable, self.pickable)

    @property
    def pose(self) -> Pose:
        """The pose of the asset's frame."""
        return Pose(self.x, self.y, self.z, self.quaternion)


@dataclass(frozen=True, slots=True)
class Expert:
    """Actions that reach the goal, replayed before they were stored."""

    actions: tuple[int, ...]
    steps: int
    pushes: int
    picks: int
    path_m: float


@dataclass(frozen=True, slots=True)
class Physics:
    """Which engine answered the physical questions of an episode."""

    engine: str
    build: str
    settle_s: float
    """Longest settle time of the episode's obstacles, simulated seconds."""
    penetration_m: float
    """Deepest contact at rest."""


@dataclass(frozen=True, slots=True)
class Episode:
    """One task. Distances in metres or lattice steps of 0.25 m; None where the goal is cut off."""

    episode_id: str
    """`scene-000017/0003`."""
    scene_id: str
    split: Split
    index: int
    seed: int
    room_count: int
    mode: Mode
    sealed: bool
    """No way for the agent's disc, on the lattice or off it: `obstructed_path_m` is None."""
    rooms_on_path: int
    obstacle_count: int
    shortest_path_m: float
    shortest_path_steps: int
    obstructed_path_m: float | None
    obstructed_path_steps: int | None
    start: Start
    goal: Goal
    room_paths: tuple[tuple[int, ...], ...]
    """Simple room paths, shortest first (by number of rooms, then room ids), at most 64."""
    room_paths_truncated: bool
    """There were more than 64 room paths."""
    node_paths: tuple[NodePath, ...]
    """At most 64, in the order of `room_paths`."""
    node_paths_truncated: bool
    obstacles: tuple[Obstacle, ...]
    expert: Expert | None
    physics: Physics

    @property
    def interactive(self) -> bool:
        """Whether the grid way is blocked, so that only an interaction opens it."""
        return self.mode == "blocked"
