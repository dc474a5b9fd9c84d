"""Push: the poses at which an object, and the objects that it strikes, come to rest.

Only objects that are touched take part, for an engine's time grows with every body near enough to
wake. A push is solved first as if alone, which is cached by asset, dynamics and orientation; then
with the objects that its path touches, and again with those that their paths touch, until no new
one is found. 8-DOPs rule out far objects, the narrow phase decides about near ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal

from internav_data.geometry import round_m
from internav_data.physics.displacement import is_still, shift_m, tilt_deg
from internav_data.physics.engines import DEFAULT_ENGINE
from internav_data.physics.frames import Frame
from internav_data.physics.kdop import grown
from internav_data.physics.narrow_phase import met_on_path, prisms_of, prisms_of_collider
from internav_data.physics.registry import get_solver
from internav_data.physics.scene import (
    AGENT_HEIGHT_M,
    AGENT_LOW_M,
    AgentCollider,
    Body,
    PhysicsScene,
)
from internav_data.physics.sweep import extent_of
from internav_data.records import PUSH_SPECS, Pose
from internav_data.records.agent import AGENT

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Sequence

    from internav_data.physics.cache import Solver
    from internav_data.physics.kdop import Dop8
    from internav_data.physics.scene import PushSolution
    from internav_data.records import Asset, PushSpec, Quaternion, Vec2

    Near = Callable[[Dop8], Sequence[tuple[int, Body]]]
    """Function from an 8-DOP of the house to the bodies that reach into it, with their keys,
    ascending. The pushed object is not among them."""
    Box = tuple[float, float, float, float]
    """Rectangle along the axes of the house: x_min, y_min, x_max, y_max, metres."""
    Movers = tuple[tuple[int, Body], ...]
    """Bodies that move besides the pushed one, with their keys."""

SUCCESS_M: Final = 0.05
"""Minimum displacement of a successful push."""
TOPPLED_DEG: Final = 45.0
SWEEP_GAP_M: Final = 0.011
"""Margin round the recorded poses of a moving body. Poses lie up to 1 cm apart, so a body between
two of them is missed by half of this at most; the engine's contact margin comes on top."""
AGENT_M: Final = AGENT.collider_radius_m
"""Radius of the agent's collider: no object ends inside the agent's disc of 0.2 m."""
AGENT_MIN_M: Final = 0.2005
"""Minimum radius of the collider. It shrinks to the nearest movable object, so that the agent does
not press away an object that already stands closer than `AGENT_M`."""
MAX_ROUNDS: Final = 8
"""Objects hit but not simulated are added and the push is solved again, at most 8 times; the last
try includes everything within `FAR_M`."""
FAR_M: Final = 4.0
CROWD_MARGIN_M: Final = 0.2
"""Margin within which a struck object may strike another; used to estimate how many will move."""
_HEIGHT_DIGITS: Final = 3
"""Decimal places of the height of a free push, metres. Settled objects lie 0.9 or 1.0 mm above the
floor: one solution serves both."""
_START_DIGITS: Final = 4
"""Orientations of a free push are rounded to 0.1 mrad, which moves a corner by less than the 0.1 mm
of stored positions: nearly equal ones share their solution."""

ROUNDED_M: Final = 0.001
"""Bound of what rounding does to the agent's position and to a recorded path, metres."""
_OWN: Final = Frame(0.0, 0.0, 0)

Failure = Literal["", "too heavy", "something is in the way", "the agent is in the way"]


@dataclass(frozen=True, slots=True)
class PushResult:
    """Poses after a push in the house's frame, rounded as they are stored.

    A failed push may have moved objects too: the caller decides whether to apply the poses.
    """

    pose: Pose
    displacement_m: float
    """Distance that the pushed object's centre of mass moved in the plane."""
    seconds: float
    """Simulated time until all bodies were at rest."""
    toppled: bool
    moved: tuple[tuple[int, Pose], ...]
    """Neighbours that moved: their keys, ascending, and new poses."""
    success: bool
    reason: Failure
    at_rest: bool
    """False when something still moved 10 s after the release: the poses are of that moment."""
    swept: Box | None = None
    """Box in the plane of everything that the bodies that can move covered on the way, unrounded;
    None for a body that does not move."""


@dataclass(frozen=True, slots=True)
class _Problem:
    """A push in the pushed object's own frame."""

    frame: Frame
    pushed: Body
    spec: PushSpec
    near: Near
    solver: Solver

    @staticmethod
    def of(body: Body, heading: int, near: Near, spec: PushSpec, engine: str) -> _Problem:
        frame = Frame(body.pose.x, body.pose.y, heading)
        turn = _coarse(frame.enter(body.pose).quaternion)
        start = Pose(0.0, 0.0, round(body.pose.z, _HEIGHT_DIGITS), turn)
        pushed = Body(body.asset, start, body.dynamics)
        return _Problem(frame, pushed, spec, near, get_solver(engine))

    @property
    def margin_m(self) -> float:
        """Distance from recorded poses within which a body may be touched."""
        return SWEEP_GAP_M + self.solver.contact_margin_m


def push(
    body: Body,
    heading: int,
    near: Near,
    spec: PushSpec = PUSH_SPECS["force"],
    agent: Vec2 | None = None,
    *,
    agent_gap_m: float = math.inf,
    engine: str = DEFAULT_ENGINE,
) -> PushResult:
    """Push an object along one of the house's four headings.

    The problem is solved in the object's own frame: the object at the origin, the push along +x.
    Where nothing reaches into the object's sweep on free ground, the free solution (one for each
    asset, dynamics, height and orientation relative to the push) is moved into place.

    Parameters
    ----------
    body
        Object to push, at its pose in the house. One that does not move (`Body.moves`) is too
        heavy, without any simulation.
    heading
        0, 1, 2, 3: along +x, +y, -x, -y.
    near
        Gathers all other bodies that reach into an 8-DOP of the house.
    spec
        Force, speed limit and duration.
    agent
        Position of the agent, metres; None for a push without it.
    agent_gap_m
        Distance from the agent's axis to the nearest object that can move, metres.
    engine
        Name of the physics engine.

    Raises
    ------
    UsageError
        No engine has this name.

    """
    problem = _Problem.of(body, heading, near, spec, engine)
    if not body.moves:
        return _unmoved(body)
    solution = free = _push_alone(problem)
    movers: Movers = ()
    failure: Failure = "too heavy"

    # An object that is too heavy alone is not lighter among others, nor freer beside the agent.
    known = _met(problem, (body.asset,), free) if _is_moved(body, problem.frame, free) else {}
    if known:
        failure = "something is in the way"
        solution, movers = _push_among(problem, None, known)
    collider = _collider(problem.frame, agent, agent_gap_m)
    moving = (body.asset, *_assets(movers))
    if (
        collider is not None
        and _is_moved(body, problem.frame, solution)
        and _meets(problem, collider, moving, solution)
    ):
        # Only now: a push that never comes near the agent has one solution, wherever it stands.
        failure = "the agent is in the way"
        solution, movers = _push_among(problem, collider, known)
    return _judged(body, problem.frame, solution, movers, failure)


def count_movers(
    body: Body,
    heading: int,
    near: Near,
    spec: PushSpec = PUSH_SPECS["force"],
    engine: str = DEFAULT_ENGINE,
) -> int:
    """Estimate how many objects a push may move besides the pushed one: its cost to solve.

    Parameters as in `push`. Only the free push is solved; 0 where it does not move the object. No
    bound: what is met may stay, and what turns the pushed object may lead it to others.

    Raises
    ------
    UsageError
        No engine has this name.

    """
    problem = _Problem.of(body, heading, near, spec, engine)
    if not body.moves:
        return 0
    free = _push_alone(problem)
    if not _is_moved(body, problem.frame, free):
        return 0

    def loose(dop8: Dop8) -> list[tuple[int, Body]]:
        return [pair for pair in near(dop8) if pair[1].moves]

    known = _met(replace(problem, near=loose), (body.asset,), free)
    for other in list(known.values()):
        known.update(loose(grown(extent_of(other.asset, other.pose).dop8, CROWD_MARGIN_M)))
    return len(known)


def moves_alone(
    body: Body, spec: PushSpec = PUSH_SPECS["force"], engine: str = DEFAULT_ENGINE
) -> bool:
    """Return whether a push moves an object 5 cm or more on free floor, along any heading.

    False for an object that a push cannot act on. Other parameters as in `push`.

    Raises
    ------
    UsageError
        No engine has this name.

    """
    if not body.dynamics.pushable:
        return False
    for heading in range(4):
        problem = _Problem.of(body, heading, lambda _: (), spec, engine)
        if _is_moved(body, problem.frame, _push_alone(problem)):
            return True
    return False


def _push_alone(problem: _Problem) -> PushSolution:
    return problem.solver.push(PhysicsScene((problem.pushed,)), problem.spec)


def _push_among(
    problem: _Problem, collider: AgentCollider | None, known: dict[int, Body]
) -> tuple[PushSolution, Movers]:
    """Push among the bodies that are touched: solved anew until none is left out.

    Bodies that turn out to be touched join `known`.
    """
    frame = problem.frame
    for left in reversed(range(MAX_ROUNDS)):
        # In the order of their keys: the engine's result depends on the order of its bodies.
        around = [(key, known[key]) for key in sorted(known)]
        movers = tuple(pair for pair in around if pair[1].moves)
        others = [pair for pair in around if not pair[1].moves]
        bodies = (replace(body, pose=frame.enter(body.pose)) for _, body in (*movers, *others))
        scene = PhysicsScene((problem.pushed, *bodies), collider)
        solution = problem.solver.push(scene, problem.spec)
        met = _met(problem, (problem.pushed.asset, *_assets(movers)), solution, known)
        if not met:
            break
        known.update(met)
        if left == 1:
            for sweep in solution.sweeps:
                known.update(problem.near(grown(frame.leave_dop8(sweep), FAR_M)))
    return solution, movers


def _is_moved(body: Body, frame: Frame, solution: PushSolution) -> bool:
    """Return whether a solution moves the pushed object far enough for a success."""
    return shift_m(body.asset, body.pose, frame.leave(solution.poses[0])) >= SUCCESS_M


def _assets(movers: Movers) -> tuple[Asset, ...]:
    return tuple(body.asset for _, body in movers)


def _met(
    problem: _Problem,
    moving: Sequence[Asset],
    solution: PushSolution,
    known: Container[int] = (),
) -> dict[int, Body]:
    """Gather the bodies that moving assets may touch and that are not known yet."""
    found: dict[int, Body] = {}
    frame, margin = problem.frame, problem.margin_m
    for asset, sweep, path in zip(moving, solution.sweeps, solution.paths, strict=True):
        # 8-DOPs first: they leave out most of the house.
        around = problem.near(grown(frame.leave_dop8(sweep), margin))
        asked = [pair for pair in around if pair[0] not in known and pair[0] not in found]
        prisms = [prisms_of(body.asset, body.pose) for _, body in asked]
        met = met_on_path(asset, path, frame, prisms, margin)
        found.update(pair for pair, touched in zip(asked, met, strict=True) if touched)
    return found


def _unmoved(body: Body) -> PushResult:
    """Return the result of a push at a body that stays, as one of infinite mass would."""
    return PushResult(
        pose=body.pose,
        displacement_m=0.0,
        seconds=0.0,
        toppled=False,
        moved=(),
        success=False,
        reason="too heavy",
        at_rest=True,
    )


def _judged(
    body: Body, frame: Frame, solution: PushSolution, movers: Movers, failure: Failure
) -> PushResult:
    """Move a solution from the object's own frame into the house, round it, and judge it."""
    end = frame.leave(solution.poses[0])
    far = round_m(shift_m(body.asset, body.pose, end))
    moved = []
    for (key, other), after in zip(movers, solution.poses[1:], strict=True):
        there = frame.leave(after)
        if not is_still(other.pose, there):
            moved.append((key, there))
    success = far >= SUCCESS_M
    return PushResult(
        pose=end,
        displacement_m=far,
        seconds=round(solution.seconds, 6),
        toppled=tilt_deg(body.pose.quaternion, end.quaternion) > TOPPLED_DEG,
        moved=tuple(moved),
        success=success,
        reason="" if success else failure,
        at_rest=solution.at_rest,
        swept=_swept(frame, solution),
    )


def _swept(frame: Frame, solution: PushSolution) -> Box:
    """Return the box around all sweeps of a solution, in the house."""
    sweeps = [frame.leave_dop8(sweep) for sweep in solution.sweeps]
    east, north = max(sweep[0] for sweep in sweeps), max(sweep[2] for sweep in sweeps)
    west, south = max(sweep[4] for sweep in sweeps), max(sweep[6] for sweep in sweeps)
    return -west, -south, east, north


def stays_clear(swept: Box, agent: Vec2, engine: str = DEFAULT_ENGINE) -> bool:
    """Return whether a push that covers a box is the same with an agent as without.

    False where it may not be.

    Parameters
    ----------
    swept
        Box of everything that the push covers without the agent.
    agent
        Position of the agent, metres.
    engine
        Name of the physics engine.

    Raises
    ------
    UsageError
        No engine has this name.

    """
    # `_meets` asks boxes first, that of the agent's collider and those of a body on its way.
    keep = AGENT_M + SWEEP_GAP_M + get_solver(engine).contact_margin_m + ROUNDED_M
    (x, y), (x_min, y_min, x_max, y_max) = agent, swept
    return max(x_min - x, x - x_max, y_min - y, y - y_max) > keep


def _coarse(quaternion: Quaternion) -> Quaternion:
    # Adding zero turns -0.0 into 0.0: equal orientations are equal keys of caches.
    x, y, z, w = (round(q, _START_DIGITS) + 0.0 for q in quaternion)
    return x, y, z, w


def _collider(frame: Frame, agent: Vec2 | None, gap: float) -> AgentCollider | None:
    if agent is None:
        return None
    x, y = frame.enter_point(agent)
    return AgentCollider(x, y, min(AGENT_M, max(AGENT_MIN_M, round_m(gap))))


def _meets(
    problem: _Problem, collider: AgentCollider, moving: Sequence[Asset], solution: PushSolution
) -> bool:
    """Return whether a moving object comes near the agent's collider."""
    x, y, radius_m = collider.x, collider.y, collider.radius_m
    agent = prisms_of_collider(x, y, radius_m, AGENT_LOW_M, AGENT_HEIGHT_M)
    return any(
        any(met_on_path(asset, path, _OWN, [agent], problem.margin_m))
        for asset, path in zip(moving, solution.paths, strict=True)
    )
