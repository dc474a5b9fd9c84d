"""Push: where a thing and what it meets come to rest when somebody pushes it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final, Literal

from internav_data.geometry import round_m
from internav_data.physics.displacement import is_still, shift_m, tilt_deg
from internav_data.physics.frames import Frame
from internav_data.physics.kdop import grown
from internav_data.physics.narrow_phase import met_on_path, prisms_of, prisms_of_collider
from internav_data.physics.registry import engine_of_this_process
from internav_data.physics.scene import (
    AGENT_HEIGHT_M,
    AGENT_LOW_M,
    AgentCollider,
    Body,
    PhysicsScene,
    PushSpec,
)
from internav_data.physics.sweep import extent_of
from internav_data.records import Pose
from internav_data.records.agent import AGENT

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Sequence

    from internav_data.physics.kdop import Dop8
    from internav_data.physics.scene import Engine, PushSolution
    from internav_data.records import Asset, Quaternion, Vec2

    Near = Callable[[Dop8], Sequence[tuple[int, Body]]]
    """Bodies, with their keys in ascending order, that reach into an octagon of the house."""
    Movers = tuple[tuple[int, Body], ...]
    """Bodies that move besides what is pushed, with their keys."""

PushModel = Literal["force", "kick"]
PUSH_SPECS: Final[dict[PushModel, PushSpec]] = {
    "force": PushSpec(force_n=200.0, speed_m_s=2.0, seconds=0.5),
    "kick": PushSpec(force_n=math.inf, speed_m_s=2.0, seconds=0.5),
}
"""The paper's constant force, and the released code's 2 m/s for every mass."""
SUCCESS_M: Final = 0.05
"""What moved less was not pushed."""
TOPPLED_DEG: Final = 45.0
TOUCH_M: Final = 0.005
"""Bodies this near may touch: the engine's hulls are thicker by a margin of 1 mm."""
MEET_M: Final = 0.012
"""What a body's kept poses come this near of may touch it: poses lie up to 1 cm apart, so what lies
between them is missed by half of that at most."""
AGENT_M: Final = AGENT.collider_radius_m
"""Radius of the agent's column: nothing ends inside its disc of 0.2 m."""
AGENT_MIN_M: Final = 0.2005
"""What already stands nearer than the column is not pressed away by it."""
MAX_ROUNDS: Final = 8
"""What was reached though it was left out joins the next round; the last one takes all within
`FAR_M`."""
FAR_M: Final = 4.0
ON_M: Final = 0.2
"""How far round what is met more may be met: a guess of how many things will move."""
_HEIGHT_DIGITS: Final = 3
"""What settled lies 0.9 or 1.0 mm high: one solution serves both."""
_START_DIGITS: Final = 4
"""Orientations of a free push are rounded to 0.1 mrad, which moves a corner by less than the 0.1 mm
of stored positions: nearly equal ones share their solution."""

_OWN: Final = Frame(0.0, 0.0, 0)

Failure = Literal["", "too heavy", "something is in the way", "the agent is in the way"]


@dataclass(frozen=True, slots=True)
class PushResult:
    """Where everything lies after a push, rounded as it will be stored.

    It is the whole truth also where the push failed: whoever applies it decides what stays.
    """

    pose: Pose
    displacement_m: float
    """How far the thing's centre of mass moved in the plane."""
    seconds: float
    toppled: bool
    moved: tuple[tuple[int, Pose], ...]
    """Neighbours that moved: their keys, ascending, and new poses."""
    success: bool
    reason: Failure
    at_rest: bool
    """False when something still rolled after five seconds."""


def push(
    asset: Asset,
    pose: Pose,
    heading: int,
    near: Near,
    agent: Vec2 | None = None,
    *,
    agent_gap_m: float = math.inf,
    model: PushModel = "force",
) -> PushResult:
    """Push a thing along one of the house's four headings.

    Solved in its own frame: the thing at the origin, the push along +x. Where nothing reaches into
    what it sweeps on free ground, the free solution (once per asset, orientation relative to the
    push and height) is moved into place.

    Parameters
    ----------
    asset, pose
        What is pushed, and where it lies.
    heading
        0, 1, 2, 3: along +x, +y, -x, -y.
    near
        Gathers what else reaches into an octagon, without the thing itself.
    agent
        Where the agent stands; None without it.
    agent_gap_m
        Least distance from the agent's axis to anything that can move.
    model
        "force" or "kick".

    """
    spec = PUSH_SPECS[model]
    frame = Frame(pose.x, pose.y, heading)
    start = _start(frame, pose)
    solution = free = _push_alone(asset, start, spec, engine_of_this_process())
    movers: Movers = ()
    failure: Failure = "too heavy"

    def moves() -> bool:
        return shift_m(asset, pose, frame.leave(solution.poses[0])) >= SUCCESS_M

    # What is too heavy alone is not lighter among others, nor freer beside the agent.
    known = _met(frame, near, (asset,), free) if moves() else {}
    if known:
        failure = "something is in the way"
        solution, movers = _push_among(asset, start, frame, near, None, spec, known)
    collider = _collider(frame, agent, agent_gap_m)
    if collider is not None and moves() and _meets(collider, (asset, *_assets(movers)), solution):
        # Only now: what never comes near the agent is solved once, wherever it stands.
        failure = "the agent is in the way"
        solution, movers = _push_among(asset, start, frame, near, collider, spec, known)
    return _judged(asset, pose, frame, solution, movers, failure)


def count_movers(
    asset: Asset, pose: Pose, heading: int, near: Near, model: PushModel = "force"
) -> int:
    """Count the things that may be moved besides what is pushed: what a push will cost to solve.

    Parameters as in `push`.
    """
    frame = Frame(pose.x, pose.y, heading)
    free = _push_alone(asset, _start(frame, pose), PUSH_SPECS[model], engine_of_this_process())
    if shift_m(asset, pose, frame.leave(free.poses[0])) < SUCCESS_M:
        return 0

    def loose(dop8: Dop8) -> list[tuple[int, Body]]:
        return [pair for pair in near(dop8) if pair[1].moves]

    known = _met(frame, loose, (asset,), free)
    for body in list(known.values()):
        known.update(loose(grown(extent_of(body.asset, body.pose).dop8, ON_M)))
    return len(known)


def _start(frame: Frame, pose: Pose) -> Pose:
    return Pose(0.0, 0.0, round(pose.z, _HEIGHT_DIGITS), _coarse(frame.enter(pose).quaternion))


@lru_cache(maxsize=32768)
def _push_alone(asset: Asset, start: Pose, spec: PushSpec, engine: Engine) -> PushSolution:
    return engine.push(PhysicsScene((Body(asset, start, moves=True),)), spec)


@lru_cache(maxsize=4096)
def _push_in(scene: PhysicsScene, spec: PushSpec, engine: Engine) -> PushSolution:
    """Push in a scene; what failed changed nothing and is likely to be tried again."""
    return engine.push(scene, spec)


def _push_among(
    asset: Asset,
    start: Pose,
    frame: Frame,
    near: Near,
    collider: AgentCollider | None,
    spec: PushSpec,
    known: dict[int, Body],
) -> tuple[PushSolution, Movers]:
    """Push among what is touched: solved anew until nothing left out is.

    What turns out to be touched joins `known`.
    """
    engine = engine_of_this_process()
    for left in reversed(range(MAX_ROUNDS)):
        around = [(key, known[key]) for key in sorted(known)]
        movers = tuple(pair for pair in around if pair[1].moves)
        others = [pair for pair in around if not pair[1].moves]
        bodies = (
            Body(body.asset, frame.enter(body.pose), body.moves) for _, body in (*movers, *others)
        )
        scene = PhysicsScene((Body(asset, start, moves=True), *bodies), collider)
        solution = _push_in(scene, spec, engine)
        met = _met(frame, near, (asset, *_assets(movers)), solution, known)
        if not met:
            break
        known.update(met)
        if left == 1:
            for sweep in solution.sweeps:
                known.update(near(grown(frame.leave_dop8(sweep), FAR_M)))
    return solution, movers


def _assets(movers: Movers) -> tuple[Asset, ...]:
    return tuple(body.asset for _, body in movers)


def _met(
    frame: Frame,
    near: Near,
    moving: Sequence[Asset],
    solution: PushSolution,
    known: Container[int] = (),
) -> dict[int, Body]:
    """Gather what is not known yet and may be touched by what moves."""
    found: dict[int, Body] = {}
    for asset, sweep, path in zip(moving, solution.sweeps, solution.paths, strict=True):
        around = near(grown(frame.leave_dop8(sweep), MEET_M))
        asked = [pair for pair in around if pair[0] not in known and pair[0] not in found]
        prisms = [prisms_of(body.asset, body.pose) for _, body in asked]
        met = met_on_path(asset, path, frame, prisms, MEET_M)
        found.update(pair for pair, touched in zip(asked, met, strict=True) if touched)
    return found


def _judged(
    asset: Asset,
    pose: Pose,
    frame: Frame,
    solution: PushSolution,
    movers: Movers,
    failure: Failure,
) -> PushResult:
    """Move a motion from the thing's own frame into the house, round it, and judge it."""
    end = frame.leave(solution.poses[0])
    far = round_m(shift_m(asset, pose, end))
    moved = []
    for (key, body), after in zip(movers, solution.poses[1:], strict=True):
        there = frame.leave(after)
        if not is_still(body.pose, there):
            moved.append((key, there))
    success = far >= SUCCESS_M
    return PushResult(
        pose=end,
        displacement_m=far,
        seconds=round(solution.seconds, 6),
        toppled=tilt_deg(pose.quaternion, end.quaternion) > TOPPLED_DEG,
        moved=tuple(moved),
        success=success,
        reason="" if success else failure,
        at_rest=solution.at_rest,
    )


def _coarse(quaternion: Quaternion) -> Quaternion:
    x, y, z, w = (round(q, _START_DIGITS) + 0.0 for q in quaternion)
    return x, y, z, w


def _collider(frame: Frame, agent: Vec2 | None, gap: float) -> AgentCollider | None:
    if agent is None:
        return None
    x, y = frame.enter_point(agent)
    return AgentCollider(x, y, min(AGENT_M, max(AGENT_MIN_M, round_m(gap))))


def _meets(collider: AgentCollider, moving: Sequence[Asset], solution: PushSolution) -> bool:
    """Whether anything that moves comes near the agent's column."""
    agent = prisms_of_collider(
        collider.x, collider.y, collider.radius_m, AGENT_LOW_M, AGENT_HEIGHT_M
    )
    return any(
        any(met_on_path(asset, path, _OWN, [agent], MEET_M))
        for asset, path in zip(moving, solution.paths, strict=True)
    )
