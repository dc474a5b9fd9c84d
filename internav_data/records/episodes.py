"""Episodes: a start, a goal, and the obstacles between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from internav_data.records.display import displayed
from internav_data.records.houses import Split
from internav_data.records.physics import Affordance, Dynamics
from internav_data.records.poses import Pose, Quaternion, Vec2

if TYPE_CHECKING:
    from collections.abc import Iterator

Mode = Literal["blocked", "lengthened"]
"""Effect of an episode's obstacles on the lattice: no path to the goal, or a longer one."""
Redraw = Literal[
    "no two nodes far enough apart",
    "condition not reached",
    "no expert",
    "start faces a wall",
    "start in a pocket",
    "too few interactions",
    "other rest without idle obstacles",
]
"""Reasons to draw a start and goal again: no nodes were found, tries or obstacles ran out before
the mode's condition held, the expert found no plan, or a setting refuses the draw. The last is an
obstacle that touched a dropped one as it settled."""


@dataclass(frozen=True, slots=True)
class Start:
    """Pose at which the agent begins: lattice node (i, j) = (x, y) / 0.25 m and a quarter turn."""

    i: int
    """Index of the node along x."""
    j: int
    """Index of the node along y."""
    x: float
    """Position, metres."""
    y: float
    """Position, metres."""
    yaw_deg: int
    """Heading, 0, 90, 180 or 270 degrees: 0 looks along +x, counter-clockwise."""
    room: int
    """Id of the room."""
    faces_wall: bool | None = None
    """Whether a wall or furniture blocks the first step ahead; null in datasets of earlier
    releases."""
    reachable_nodes: int | None = None
    """Number of nodes within reach before any interaction, its own included; null in datasets of
    earlier releases."""


@dataclass(frozen=True, slots=True)
class Goal:
    """Lattice node to reach."""

    i: int
    """Index of the node along x."""
    j: int
    """Index of the node along y."""
    x: float
    """Position, metres."""
    y: float
    """Position, metres."""
    room: int
    """Id of the room."""


@dataclass(frozen=True, slots=True)
class NodePath:
    """Start, door centres and goal along one room path."""

    doors: tuple[int, ...]
    """Ids of the doors that are passed, in order."""
    points: tuple[Vec2, ...]
    """Start, centre of each door, goal: len(doors) + 2 points, metres."""


@dataclass(frozen=True, slots=True)
class MovedObject:
    """Object that an interaction with another one moved, and its pose afterwards."""

    obstacle: int | None
    """Index of the episode's obstacle; null for an object of the scene."""
    object_id: int | None
    """Id of the scene's object; null for an obstacle."""
    pose: Pose
    """Pose of the asset's frame afterwards."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of one interaction with one obstacle, all other objects as the episode starts."""

    action: str
    """push_east, push_north, push_west, push_south (world directions +x, +y, -x, -y) or pick."""
    success: bool
    """Whether a push moved the obstacle by 5 cm or more, or the pick took it."""
    displacement_m: float
    """Distance by which the obstacle moved, metres."""
    path_steps_after: int | None
    """Lattice distance from start to goal afterwards, steps of 0.25 m; null when cut off."""
    path_m_after: float | None
    """Euclidean distance from start to goal afterwards, metres; null when cut off."""
    opened: bool
    """Whether the lattice was cut off before and is no more."""
    seconds: float
    """Simulated seconds until everything is at rest."""
    reason: str
    """Reason of the failure; empty on success."""
    pose: Pose | None = None
    """Pose of the obstacle's asset afterwards; null where it stays, or is in the agent's hand."""
    moved: tuple[MovedObject, ...] | None = None
    """Other objects that moved; empty where none did, null in datasets of earlier releases."""
    at_rest: bool | None = None
    """Whether all were at rest in the end, or time ran out; null in datasets of earlier releases.
    """
    reach_m: tuple[float, ...] | None = None
    """Distances of the obstacle from where it began after one to four such pushes in a row, metres,
    up to the first that fails; null unless it was pushed, and pushes end after a step
    (`world.push_model`)."""
    reach_opened: int | None = None
    """Number of these pushes after which the lattice is cut off no more; null where none does that,
    or it was not before."""
    agrees: bool | None = None
    """Whether another physics engine (`physics.other_engine`) gives the same `success` and
    `opened`; null where none was asked: of a pick, of an obstacle that is not pushable, and in
    datasets without `physics.cross_check`."""
    other_pose: Pose | None = None
    """Pose of the obstacle's asset afterwards by the other engine; null where it stays there, or
    none was asked."""
    swept: tuple[float, ...] | None = None
    """Box in the plane of all that moved in a successful push, wherever it was on the way: how far
    its sides are to the west (-x), south (-y), east and north of the obstacle's position before,
    metres, rounded up to 1 cm; null of other interactions, and in datasets of earlier releases."""


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Object spawned on the path of an episode, where it came to rest."""

    asset_id: str
    """Asset, as `Chair_17`."""
    type: str
    """Type of the asset, as `Chair`."""
    x: float
    """Position of the asset's frame at rest, metres."""
    y: float
    """Position of the asset's frame at rest, metres."""
    z: float
    """Position of the asset's frame at rest, metres above the floor."""
    quaternion: Quaternion
    """Rotation of the asset's frame at rest: (x, y, z, w), w >= 0."""
    mass_kg: float
    """Mass, kilograms."""
    friction: float
    """Coefficient of sliding friction."""
    pushable: bool
    """Whether the agent's push can act on it."""
    pickable: bool
    """Whether the agent can pick it up."""
    node_path_segment: int
    """Segment of its node path on which it was spawned; segment 0 begins at the start."""
    settle_s: float
    """Certificate of the settle check: simulated seconds until at rest."""
    settle_penetration_m: float
    """Certificate of the settle check: deepest contact at rest, metres."""
    outcomes: tuple[Outcome, ...] | None
    """Outcomes of the four pushes and of pick; null where none were computed."""
    relevant: bool | None = None
    """Whether some smallest set of obstacles without which the goal is nearer on the lattice
    includes it (docs/dataset.md); null in datasets of earlier releases."""
    movable: bool | None = None
    """Whether the agent's push moves it by 5 cm or more where nothing is near, in one of the four
    directions at least; null in datasets of earlier releases."""
    affordance: Affordance | None = None
    """Interaction of which it can be the target whatever comes of it: that of its type, where
    attributes are hidden; null where `pushable` and `pickable` decide."""

    @property
    def dynamics(self) -> Dynamics:
        """Dynamics of this obstacle, which may differ from those of its asset."""
        return Dynamics(self.mass_kg, self.friction, self.pushable, self.pickable)

    @property
    def pose(self) -> Pose:
        """Pose of the asset's frame at rest."""
        return Pose(self.x, self.y, self.z, self.quaternion)


@dataclass(frozen=True, slots=True)
class Expert:
    """Demonstration: actions that reach the goal, replayed before they were stored.

    All actions of `Episode.expert` succeed; of `Episode.blind_expert` interactions may fail.
    """

    actions: tuple[int, ...]
    """Numbers of the actions, the last one Done."""
    steps: int
    """Number of actions."""
    pushes: int
    """Number of pushes among them."""
    picks: int
    """Number of pickups among them."""
    path_m: float
    """Length walked, metres: 0.25 m for each MoveAhead."""

    @property
    def summary(self) -> str:
        """Numbers of actions, pushes and pickups in words."""
        return (
            f"{_counted(self.steps, 'action')}: {_counted(self.pushes, 'push', 'pushes')}, "
            f"{_counted(self.picks, 'pick')}"
        )


def _counted(number: int, one: str, many: str = "") -> str:
    return f"{number} {one if number == 1 else many or one + 's'}"


@dataclass(frozen=True, slots=True)
class Physics:
    """Engine of an episode's physics, and a summary of its settle checks."""

    engine: str
    """Name of the engine."""
    build: str
    """Version of the engine with which settling, pushes and outcomes were computed."""
    settle_s: float
    """Longest settle time of the episode's obstacles, simulated seconds."""
    penetration_m: float
    """Deepest contact of the episode's obstacles at rest, metres."""
    other_engine: str | None = None
    """Name of the engine that was asked for a second opinion on outcomes; null where none was."""
    other_build: str | None = None
    """Version of that engine; null where none was asked."""


@dataclass(frozen=True, slots=True)
class Episode:
    """One task in one house: start, goal, obstacles, distances and an expert's actions.

    Distances are metres or lattice steps of 0.25 m; null where the goal is cut off.
    """

    episode_id: str
    """Scene and index, as `scene-000017/0003`."""
    scene_id: str
    """House of the episode, as `scene-000017`."""
    split: Split
    """Split of the scene."""
    index: int
    """Number of the episode within its scene, from 0."""
    seed: int
    """Seed of the dataset."""
    room_count: int
    """Number of rooms of the house."""
    mode: Mode
    """Effect of the obstacles on the lattice: blocked (no path) or lengthened."""
    sealed: bool
    """Whether the disc has no path on or off the lattice: `obstructed_path_m` is null."""
    rooms_on_path: int
    """Number of rooms on the shortest room path."""
    obstacle_count: int
    """Number of obstacles."""
    shortest_path_m: float
    """Euclidean distance from start to goal with every obstacle absent, metres: L of SPL."""
    shortest_path_steps: int
    """Lattice distance from start to goal with every obstacle absent, steps of 0.25 m."""
    obstructed_path_m: float | None
    """Euclidean distance from start to goal among the obstacles, metres; null when cut off."""
    obstructed_path_steps: int | None
    """Lattice distance from start to goal among the obstacles, steps; null when cut off."""
    start: Start
    """Pose at which the agent begins."""
    goal: Goal
    """Node to reach."""
    room_paths: tuple[tuple[int, ...], ...]
    """Simple room paths, shortest first (by number of rooms, then room ids), at most 64."""
    room_paths_truncated: bool
    """Whether there are more than 64 room paths."""
    node_paths: tuple[NodePath, ...]
    """Node paths in the order of `room_paths`, at most 64."""
    node_paths_truncated: bool
    """Whether there are more than 64 node paths."""
    obstacles: tuple[Obstacle, ...]
    """Spawned obstacles, in the order of spawning."""
    expert: Expert | None
    """Actions that reach the goal; null where none were found."""
    physics: Physics
    """Engine and settle certificates."""
    blind_expert: Expert | None = None
    """Actions of an agent that knows no object's mass, friction or fixedness and learns by failing,
    its failed interactions among them; null where none was asked for, or it missed the goal."""
    agreed: bool | None = None
    """Whether the two engines agree on all outcomes (`agrees`); null where one alone was asked."""

    def __repr__(self) -> str:
        return "\n".join(_lines(self))

    def _repr_html_(self) -> str | None:
        """Return a map and the obstacles for a notebook."""
        shown: str | None = displayed(self, "html")
        return shown

    @property
    def interactive(self) -> bool:
        """Whether the lattice is blocked, so that only an interaction opens a path."""
        return self.mode == "blocked"


def _lines(episode: Episode) -> Iterator[str]:
    """Yield the lines of an episode's `repr`: one screen, where all fields would fill ten."""
    start, goal, expert = episode.start, episode.goal, episode.expert
    yield (
        f"Episode {episode.episode_id} ({episode.split}, seed {episode.seed}): {episode.mode}"
        f"{', sealed' if episode.sealed else ''}, {_counted(episode.room_count, 'room')}, "
        f"{episode.rooms_on_path} on the path"
    )
    yield f"  start    ({start.x:g}, {start.y:g}) m, yaw {start.yaw_deg} deg, room {start.room}"
    yield f"  goal     ({goal.x:g}, {goal.y:g}) m, room {goal.room}"
    yield (
        f"  path     {_path(episode.shortest_path_m, episode.shortest_path_steps)} without "
        f"obstacles, {_path(episode.obstructed_path_m, episode.obstructed_path_steps)} with them"
    )
    for number, obstacle in enumerate(episode.obstacles):
        label = "  obstacles" if number == 0 else ""
        yield f"{label:<11}{number:>2} {_obstacle_line(obstacle)}"
    if expert is None:
        yield "  expert   none"
    else:
        yield f"  expert   {expert.summary}, {expert.path_m:g} m walked"
    yield f"  physics  {episode.physics.build}"


def _path(metres: float | None, steps: int | None) -> str:
    one = "cut off" if metres is None else f"{metres:g} m"
    other = "no lattice path" if steps is None else f"{steps} steps"
    return f"{one} ({other})"


def _obstacle_line(obstacle: Obstacle) -> str:
    opened = [each.action for each in obstacle.outcomes or () if each.opened]
    abilities = [name for name in ("pushable", "pickable") if getattr(obstacle, name)]
    words = ", ".join(abilities) or "fixed"
    return (
        f"{obstacle.asset_id} at ({obstacle.x:g}, {obstacle.y:g}), {obstacle.mass_kg:g} kg, {words}"
        + (f"; opened by {', '.join(opened)}" if opened else "")
    )
