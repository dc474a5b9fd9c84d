"""The world: state of an episode being played, and the effect of each action on it.

A world holds the agent, the movable objects, the hand and the goal; the house is shared
(`HouseModel`). `World.step` looks up the behaviour of an action's kind in `BEHAVIOURS`. Objects are
addressed by index: the house's movable furniture first, then the obstacles.
"""

from __future__ import annotations

import hashlib
import math
import struct
from typing import TYPE_CHECKING, Final

from internav_data.geometry import Polygons, clearance, footprint, round_m
from internav_data.geometry.headings import HEADINGS
from internav_data.navigation import CLEARANCE_M, SPACING_M
from internav_data.physics.engines import DEFAULT_ENGINE
from internav_data.physics.kdop import dop8_of_square, grown, touching
from internav_data.physics.pushing import AGENT_M, count_movers, moves_alone, push
from internav_data.physics.scene import Body
from internav_data.records.errors import UsageError
from internav_data.world.actions import (
    HORIZONS_DEG,
    START_HORIZON_DEG,
    Action,
    ActionKind,
    Reason,
    StepResult,
)
from internav_data.world.carrying import can_step, can_turn, has_room
from internav_data.world.config import DEFAULT_WORLD
from internav_data.world.drop import DropObstructions, drop
from internav_data.world.house_model import HouseModel, MovableObject, dop8_rows
from internav_data.world.occlusion import placed_occlusion_shape
from internav_data.world.stored_pushes import StoredPushes
from internav_data.world.visibility import REACH_M, Occluders, axis_distance, camera_pose

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from internav_data.navigation import Lattice, TangentGraph
    from internav_data.physics.kdop import Dop8
    from internav_data.physics.pushing import PushResult
    from internav_data.records import Affordance, Asset, Episode, Pose, PushSpec, Vec2
    from internav_data.world.actions import Cause, Interaction
    from internav_data.world.config import WorldConfig


GOAL_M: Final = 0.2
"""Maximum distance from the goal at which Done succeeds, metres."""
REST_M: Final = 0.01
"""A rests on B if A's bottom is at least this far above B's bottom, and not above B's top (m)."""
TOUCH_M: Final = 0.005
"""Distance within which two objects count as touching, metres."""
MAX_DROP_M: Final = 2.5
"""Bound of a drop's reach, metres: the widest gap, the largest pickable object, and room."""

# Moves are most of all actions and have one result each: made once.
_STEPPED: Final = StepResult(Action.MOVE_AHEAD, success=True)
_BLOCKED: Final = StepResult(Action.MOVE_AHEAD, success=False, reason="something is in the way")
AHEAD: Final = ((1, 0), (0, 1), (-1, 0), (0, -1))
"""Lattice step ahead (di, dj) by the agent's quarter turns."""


def _known(action: int) -> Action:
    try:
        return Action(action)
    except ValueError:
        names = ", ".join(f"{int(a)} {a.name}" for a in Action)
        raise UsageError(f"World.step: no action is called {action!r}; expected {names}") from None


def _move(world: World, _: Action) -> StepResult:
    di, dj = AHEAD[world.quarter]
    if not world.lattice.edge_free(world.i, world.j, di, dj):
        return _BLOCKED
    if world.carrying and not can_step(world, (di, dj)):
        return _failed(Action.MOVE_AHEAD, "no room for what is held")
    world.i += di
    world.j += dj
    return _STEPPED


def _rotate(world: World, action: Action) -> StepResult:
    if world.carrying and not can_turn(world, action.quarter_turns):
        return _failed(action, "no room for what is held")
    world.quarter = (world.quarter + action.quarter_turns) % 4
    return StepResult(action, success=True)


def _look(world: World, action: Action) -> StepResult:
    place = HORIZONS_DEG.index(world.horizon_deg) + (1 if action == Action.LOOK_DOWN else -1)
    if not 0 <= place < len(HORIZONS_DEG):
        return _failed(action, "cannot look further")
    world.horizon_deg = HORIZONS_DEG[place]
    return StepResult(action, success=True)


def _push(world: World, action: Action) -> StepResult:
    target = world.target(pick=False)
    if target < 0:
        return _failed(action, "nothing to push in sight and reach")
    if not world.items[target].dynamics.pushable:
        return _refused(world, action, target, "not pushable")
    # The four pushes are relative to the agent's heading, physics knows those of the house.
    heading = (world.quarter + action.quarter_turns) % 4
    stored = world.stored_pushes and world.stored_pushes.result(world, target, heading)
    pushed = stored or world.simulate_push(target, heading)
    if not pushed.success:
        return _refused(world, action, target, pushed.reason, pushed.seconds)
    # An object may fall over the agent's collider, or come to rest over its disc after rounding.
    moved = tuple(sorted([(target, pushed.pose), *pushed.moved]))
    if _lies_on_agent(world, moved):
        return _refused(world, action, target, "would come to lie on the agent", pushed.seconds)
    world.put(moved)
    return StepResult(
        action,
        success=True,
        target=target,
        displacement_m=pushed.displacement_m,
        seconds=pushed.seconds,
        toppled=pushed.toppled,
        moved=moved,
    )


def _lies_on_agent(world: World, moved: tuple[tuple[int, Pose], ...]) -> bool:
    x, y = world.position
    return any(
        axis_distance(x, y, footprint(world.items[k].asset, pose)) < CLEARANCE_M
        for k, pose in moved
    )


def _pick(world: World, action: Action) -> StepResult:
    if world.held >= 0:
        return _failed(action, "hands are full")
    target = world.target(pick=True)
    if target < 0:
        return _failed(action, "nothing to pick up in sight and reach")
    if carries(world, target):
        return StepResult(action, success=False, reason="something rests on it", target=target)
    if not world.items[target].dynamics.pickable:
        return _refused(world, action, target, "not pickable")
    if world.config.hands == "real" and not has_room(world, target, world.position, world.quarter):
        return StepResult(action, success=False, reason="no room for what is held", target=target)
    world.put([(target, None)])
    world.held = target
    return StepResult(action, success=True, target=target)


def _refused(
    world: World, action: Action, target: int, cause: Cause, seconds: float = 0.0
) -> StepResult:
    """Return the failure to move a target; its true cause is told where nothing is hidden."""
    hidden = world.items[target].affordance is not None
    told: Reason = "did not move"
    # What can be neither pushed nor picked up is a target only where attributes are hidden.
    if not hidden and cause != "not pushable" and cause != "not pickable":  # noqa: PLR1714 - narrows
        told = cause
    return StepResult(
        action, success=False, reason=told, target=target, seconds=seconds, cause=cause
    )


def carries(world: World, index: int) -> bool:
    """Return whether another movable object rests on an object, given by its index."""
    below = world.items[index]
    for key, _ in world.near(grown(below.dop8, TOUCH_M), index):
        if key >= len(world.items):
            break  # from here on fixed bodies
        above = world.items[key]
        if (
            below.low_m + REST_M < above.low_m <= below.high_m + TOUCH_M
            and clearance(above.footprint, below.footprint, 1.0) < TOUCH_M
        ):
            return True
    return False


def _drop(world: World, action: Action) -> StepResult:
    if world.held < 0:
        return _failed(action, "hands are empty")
    target, (x, y) = world.held, world.position
    around = world.near(dop8_of_square(x, y, MAX_DROP_M))
    solid: list[Polygons] = [world.model.footprints]
    solid += [world.items[k].footprint for k, _ in around if k < len(world.items)]

    def bodies(dop8: Dop8) -> Sequence[Body]:
        return [body for _, body in world.near(dop8)]

    obstructions = DropObstructions(world.model.walls, solid, bodies)
    settled = drop(world.items[target], world.position, world.quarter, obstructions, world.engine)
    if settled is None:
        return StepResult(action, success=False, reason="no room to drop it", target=target)
    moved = ((target, settled.pose),)
    world.put(moved)
    world.held = -1
    return StepResult(action, success=True, target=target, seconds=settled.seconds, moved=moved)


def _done(world: World, action: Action) -> StepResult:
    if math.dist(world.position, world.goal_point) > GOAL_M:
        return _failed(action, "not at the goal")
    if world.carrying:
        return _failed(action, "hands are full")
    return StepResult(action, success=True)


def _wait(_: World, action: Action) -> StepResult:
    return StepResult(action, success=True)


def _failed(action: Action, reason: Reason) -> StepResult:
    return StepResult(action, success=False, reason=reason)


BEHAVIOURS: Final[dict[ActionKind, Callable[[World, Action], StepResult]]] = {
    "move": _move,
    "turn": _rotate,
    "look": _look,
    "push": _push,
    "pick": _pick,
    "drop": _drop,
    "done": _done,
    "wait": _wait,
}
"""Function by kind of action that carries an action out; a failure leaves the world as it was."""


class World:
    """State of a house being acted in: the agent, the movable objects, the hand.

    `step` is a function of the state and the action alone, to the last bit.

    Items are numbered: the house's movable furniture first (`model.items`), then obstacles.

    Attributes
    ----------
    model : HouseModel
        Parts of the house that never change, shared by all its worlds.
    i, j, quarter, horizon_deg : int
        The agent's lattice node, quarter turns counter-clockwise from +x, and the camera's angle
        below the horizontal.
    held : int
        Index of the item in the hand, or -1.
    items : tuple of MovableObject
        All objects that can move; replaced, never changed.
    lattice : Lattice
        Lattice among all objects at their present poses; replaced, never changed.
    goal : (int, int)
        Lattice node to reach.
    config : WorldConfig
        Settings of pushes and hands.
    engine : str
        Name of the physics engine.
    stored_pushes : StoredPushes or None
        Pushes whose results are known from the episode; None to solve them all.
    interaction : Interaction or None
        Interaction in progress, begun by an earlier step and not yet ended. All of today's
        actions end in the step that begins them.
    """

    __slots__ = (
        "_dop8s",
        "_handles",
        "config",
        "engine",
        "goal",
        "held",
        "horizon_deg",
        "i",
        "interaction",
        "items",
        "j",
        "lattice",
        "model",
        "quarter",
        "stored_pushes",
    )

    model: HouseModel
    items: tuple[MovableObject, ...]
    lattice: Lattice
    _dop8s: NDArray[np.float64]
    _handles: tuple[int, ...]

    def __init__(
        self,
        model: HouseModel,
        obstacles: Iterable[Body],
        start: tuple[int, int, int],
        goal: tuple[int, int],
        config: WorldConfig = DEFAULT_WORLD,
        engine: str = DEFAULT_ENGINE,
        affordances: Sequence[Affordance | None] = (),
    ) -> None:
        """Put obstacles and an agent into a house.

        Parameters
        ----------
        model
            Model of the house.
        obstacles
            Obstacles at their poses, with their own dynamics.
        start
            The agent's lattice node i, j and quarter turns counter-clockwise from +x.
        goal
            Lattice node to reach.
        config
            Settings of the world.
        engine
            Name of the physics engine.
        affordances
            Affordance of each obstacle, where attributes are hidden; else ().

        """
        bodies = tuple(obstacles)
        extra = list(map(MovableObject.of, bodies, affordances or (None,) * len(bodies)))
        self.model = model
        self.lattice = model.lattice.copy()
        self._handles = model.handles + tuple(self.lattice.add(e.footprint) for e in extra)
        self.items = model.items + tuple(extra)
        self._dop8s = dop8_rows(self.items)
        self.i, self.j, self.quarter = start[0], start[1], start[2] % 4
        self.horizon_deg = START_HORIZON_DEG
        self.held = -1
        self.goal = goal
        self.config = config
        self.engine = engine
        self.stored_pushes: StoredPushes | None = None
        self.interaction: Interaction | None = None

    @staticmethod
    def of_episode(
        model: HouseModel,
        episode: Episode,
        assets: Mapping[str, Asset],
        config: WorldConfig = DEFAULT_WORLD,
        engine: str | None = None,
        *,
        stored_outcomes: bool = False,
    ) -> World:
        """Set up an episode at its start, its obstacles with their stored dynamics.

        Parameters
        ----------
        model
            Model of the episode's house.
        episode
            Episode to set up.
        assets
            Assets by id, those of the obstacles among them.
        config
            Settings of the world.
        engine
            Name of the physics engine; None for the one that the episode was made with.
        stored_outcomes
            Whether the episode's outcomes may stand for solving its first push. They must have been
            made with this config and this machine's arithmetic; engine and rules are compared here.

        Raises
        ------
        UsageError
            The model is of another house.

        """
        if model.house.scene_id != episode.scene_id:
            raise UsageError(
                f"World.of_episode: episode {episode.episode_id} belongs to {episode.scene_id}, "
                f"got the house {model.house.scene_id}; build the model of its own house"
            )
        start, goal = episode.start, episode.goal
        world = World(
            model,
            [Body.of_obstacle(obstacle, assets) for obstacle in episode.obstacles],
            (start.i, start.j, start.yaw_deg // 90),
            (goal.i, goal.j),
            config,
            engine or episode.physics.engine,
            [obstacle.affordance for obstacle in episode.obstacles],
        )
        if stored_outcomes:
            world.stored_pushes = StoredPushes.of(world, episode)
        return world

    def copy(self) -> World:
        """Return an independent world in the same state.

        It costs little: objects and lattices are replaced, never changed, so both worlds share
        them.
        """
        other = object.__new__(World)
        for name in World.__slots__:
            setattr(other, name, getattr(self, name))
        return other

    def asking(self, engine: str) -> World:
        """Return a copy whose physics is that of another engine, of the given name."""
        other = self.copy()
        other.engine, other.stored_pushes = engine, None
        return other

    def step(self, action: int) -> StepResult:
        """Carry out an action. One that fails changes nothing; its result gives the reason.

        Parameters
        ----------
        action
            Number of an `Action`.

        Raises
        ------
        UsageError
            No action has this number.
        NotImplementedError
            The action's kind has no row in `BEHAVIOURS`.
        """
        known = _known(action)
        behaviour = BEHAVIOURS.get(known.kind)
        if behaviour is None:
            raise NotImplementedError(
                f"World.step: {known.name} has no behaviour: add {known.kind!r} to BEHAVIOURS"
            )
        return behaviour(self, known)

    @property
    def position(self) -> Vec2:
        """Position of the agent's axis, metres."""
        return SPACING_M * self.i, SPACING_M * self.j

    @property
    def obstacles(self) -> range:
        """Indices of the obstacles among `items`."""
        return range(len(self.model.items), len(self.items))

    def path_steps(self) -> int | None:
        """Return the lattice distance to the goal, objects as they lie; None when cut off."""
        return self.lattice.distance((self.i, self.j), self.goal)

    def obstructed_path_m(self) -> float | None:
        """Return the Euclidean path length to the goal, metres, objects as they lie.

        None when cut off.
        """
        return self.path_m_between(self.position, self.goal_point)

    def path_m_between(self, here: Vec2, there: Vec2) -> float | None:
        """Return the Euclidean path length between two points, metres, objects as they lie.

        None if they are cut off from each other.
        """
        graph, loose = self._loose()
        path = graph.distance(here, there, loose)
        return None if path is None else round_m(path)

    def path(self) -> tuple[float, NDArray[np.float64]] | None:
        """Return the shortest path to the goal: its length, metres, and its points (n, 2) float64.

        None when cut off.
        """
        graph, loose = self._loose()
        found = graph.length_and_path(self.position, self.goal_point, loose)
        return None if found is None else (round_m(found[0]), found[1])

    def _loose(self) -> tuple[TangentGraph, Polygons]:
        """Return the tangent graph among furniture that has not moved, and all other footprints."""
        home = self.model.items
        # Identity suffices: `put` gives furniture that is put back the model's own object again.
        displaced = tuple(k for k, item in enumerate(home) if self.items[k] is not item)
        loose = [self.items[k].footprint for k in (*displaced, *self.obstacles)]
        return self.model.tangent_graph(displaced), Polygons.joined(loose)

    def shortest_path_m(self) -> float | None:
        """Return the Euclidean path length to the goal without obstacles, metres.

        All furniture is in its place. None when cut off.
        """
        path = self.model.shortest_path_m(self.position, self.goal_point)
        return None if path is None else round_m(path)

    def target(self, *, pick: bool) -> int:
        """Return the index of the closest visible object to pick up, or to push; -1 without one."""
        x, y = self.position
        round_here = dop8_of_square(x, y, REACH_M)
        near = touching(self._dop8s, round_here)
        wanted = [
            (self.distance_to(k, x, y), k)
            for k in near
            if self.items[k].affords("pick" if pick else "push")
        ]
        if not wanted:
            return -1
        shapes = [placed_occlusion_shape(body.asset, body.pose) for body in map(self.body, near)]
        # Objects beyond reach cannot hide a point within it.
        fixed = [self.model.fixed[k] for k in touching(self.model.dop8s, round_here)]
        occluders = Occluders(
            shapes + [placed_occlusion_shape(body.asset, body.pose) for body in fixed]
        )
        view = camera_pose(x, y, HEADINGS[self.quarter], self.horizon_deg)
        # Nearest first, ties by index: visibility is asked only until the first one is seen.
        for _, k in sorted(wanted):
            if occluders.seen(view, near.index(k)):
                return k
        return -1

    def simulate_push(self, index: int, heading: int, *, agent: bool = True) -> PushResult:
        """Return the result of a push without carrying it out.

        Parameters
        ----------
        index
            Index of the object to push.
        heading
            0, 1, 2, 3: along +x, +y, -x, -y of the house.
        agent
            Whether the agent's collider takes part.

        """
        gap = math.inf
        if agent:
            # An object may stand closer than the collider's radius: the collider must not begin
            # inside it.
            x, y = self.position
            near = touching(self._dop8s, dop8_of_square(x, y, AGENT_M))
            loose = (k for k in near if not self.items[k].dynamics.fixed)
            gap = min((self.distance_to(k, x, y) for k in loose), default=math.inf)
        return push(
            self.body(index),
            heading,
            lambda dop8: self.near(dop8, index),
            self.push_spec,
            self.position if agent else None,
            agent_gap_m=gap,
            engine=self.engine,
        )

    def moves_alone(self, index: int) -> bool:
        """Return whether a push moves an object 5 cm or more where nothing is near it."""
        return moves_alone(self.body(index), self.push_spec, self.engine)

    def count_movers(self, index: int, heading: int) -> int:
        """Estimate how many objects a push along a heading may move besides the pushed one."""
        return count_movers(
            self.body(index),
            heading,
            lambda dop8: self.near(dop8, index),
            self.push_spec,
            self.engine,
        )

    def put(self, changes: Iterable[tuple[int, Pose | None]]) -> None:
        """Move objects to other poses, or (pose None) off the floor, without any check."""
        lattice = self.lattice.copy()
        items, handles = list(self.items), list(self._handles)
        dop8s = self._dop8s.copy()
        for k, pose in changes:
            if items[k].pose is not None:
                lattice.remove(handles[k])
            # Furniture put back in its place is the model's own object again: paths need no graph
            # without it.
            home = self.model.items[k] if k < len(self.model.items) else None
            back = home is not None and home.pose == pose
            items[k] = home if back and home is not None else items[k].moved(pose)
            dop8s[k] = items[k].dop8
            handles[k] = -1 if pose is None else lattice.add(items[k].footprint)
        self.lattice, self.items = lattice, tuple(items)
        self._handles, self._dop8s = tuple(handles), dop8s

    @property
    def carrying(self) -> bool:
        """Whether the agent holds something that can block (`world.hands = "real"`)."""
        return self.held >= 0 and self.config.hands == "real"

    @property
    def push_spec(self) -> PushSpec:
        """Parameters of a push by the agent."""
        return self.config.push_spec

    def digest(self) -> str:
        """Return the SHA-256 (hex) of the state: equal worlds have equal digests."""
        # Each part is preceded by its length, so that no two states give the same bytes.
        node = (self.i, self.j, self.quarter, self.horizon_deg, self.held, *self.goal)
        texts = (self.model.house.scene_id, repr(self.config), self.engine)
        parts = [text.encode() for text in texts]
        parts += [struct.pack("<7i", *node), repr(self.interaction).encode()]
        for item in self.items:
            own = item.dynamics
            parts.append(item.asset.asset_id.encode())
            parts.append(
                struct.pack("<2d2?", own.mass_kg, own.friction, own.pushable, own.pickable)
            )
            if item.affordance is not None:
                parts.append(item.affordance.encode())
            if item.pose is not None:
                p = item.pose
                parts.append(struct.pack("<7d", p.x, p.y, p.z, *p.quaternion))
        return hashlib.sha256(b"".join(struct.pack("<i", len(p)) + p for p in parts)).hexdigest()

    def __eq__(self, other: object) -> bool:
        """Return whether another world is in the same state."""
        return isinstance(other, World) and self.digest() == other.digest()

    __hash__ = None  # type: ignore[assignment] # a world changes

    @property
    def goal_point(self) -> Vec2:
        """Position of the goal, metres."""
        return SPACING_M * self.goal[0], SPACING_M * self.goal[1]

    def body(self, index: int) -> Body:
        """Return an object as a body of physics: geometry, pose, dynamics, and whether it moves.

        Raises
        ------
        UsageError
            The object is held.

        """
        item = self.items[index]
        if item.pose is None:
            raise UsageError(
                f"World: object {index} ({item.asset.asset_id}) is held, it has no pose"
            )
        return Body(item.asset, item.pose, item.dynamics, moves=not item.dynamics.fixed)

    def distance_to(self, index: int, x: float, y: float) -> float:
        """Return the distance from a point to an object's footprint, metres.

        An object without a footprint is measured by its bounding box.
        """
        item = self.items[index]
        if len(item.footprint):
            return axis_distance(x, y, item.footprint)
        east, _, north, _, west, _, south, _ = item.dop8
        return math.hypot(max(-west - x, 0.0, x - east), max(-south - y, 0.0, y - north))

    def near(self, dop8: Dop8, skip: int = -1) -> list[tuple[int, Body]]:
        """Return the bodies that reach into an 8-DOP, with their keys, ascending.

        The key of a movable object is its index; keys of fixed bodies follow.
        """
        bodies = [(k, self.body(k)) for k in touching(self._dop8s, dop8) if k != skip]
        first = len(self.items)
        bodies += [(first + k, self.model.fixed[k]) for k in touching(self.model.dop8s, dop8)]
        return bodies
