"""Push: where a thing and what it meets come to rest when somebody pushes it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final, Literal

from internav_data.geometry import centre_of_mass, round_m
from internav_data.records import Pose
from internav_data.world.frames import Frame
from internav_data.world.octagons import grown, octagon_of_disc, overlap
from internav_data.world.setting import Body, Column, Setting, Shove
from internav_data.world.settle import engine_of_this_process
from internav_data.world.sweeps import extent_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from internav_data.records import Asset, Quaternion, Vec2, Vec3
    from internav_data.world.octagons import Octagon
    from internav_data.world.setting import Engine, Motion

    Near = Callable[[Octagon], Sequence[tuple[int, Body]]]
    """Bodies, with their keys in ascending order, that reach into an octagon of the house."""
    Movers = tuple[tuple[int, Body], ...]
    """Bodies that move besides what is pushed, with their keys."""

PushModel = Literal["force", "kick"]
SHOVES: Final[dict[PushModel, Shove]] = {
    "force": Shove(force_n=200.0, speed_m_s=2.0, seconds=0.5),
    "kick": Shove(force_n=math.inf, speed_m_s=2.0, seconds=0.5),
}
"""The paper's constant force, and the released code's 2 m/s for every mass."""
SUCCESS_M: Final = 0.05
"""What moved less was not pushed."""
TOPPLED_DEG: Final = 45.0
TOUCH_M: Final = 0.005
"""Bodies this near may touch: the engine's hulls are thicker by a margin of 1 mm."""
AGENT_M: Final = 0.21
"""Radius of the agent's column: nothing ends inside its disc of 0.2 m."""
AGENT_LEAST_M: Final = 0.2005
"""What already stands nearer than the column is not pressed away by it."""
AROUND_M: Final = 0.05
"""How far round the free sweep bodies are gathered at first."""
ROUNDS: Final = 8
"""What was reached though it was left out joins the next round; the last one takes all within
`FAR_M`."""
FAR_M: Final = 4.0
ON_M: Final = 0.2
"""How far round what the push may meet bodies are gathered too."""
STILL_M: Final = 0.0005
STILL_RAD: Final = 0.001
"""A neighbour that moved less has not moved: the engine's own trembling."""
_HEIGHT_DIGITS: Final = 3
"""What settled lies 0.9 or 1.0 mm high: one solution serves both."""
_START_DIGITS: Final = 4
"""Orientations of a free push are rounded to 0.1 mrad, which moves a corner by less than the 0.1 mm
of stored positions: nearly equal ones share their solution."""

Failure = Literal["", "too heavy", "something is in the way", "the agent is in the way"]


@dataclass(frozen=True, slots=True)
class Pushed:
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
) -> Pushed:
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
    shove = SHOVES[model]
    frame = Frame(pose.x, pose.y, heading)
    start = _start(frame, pose)
    motion = free = _push_alone(asset, start, shove, engine_of_this_process())
    movers: Movers = ()
    failure: Failure = "too heavy"

    def moves() -> bool:
        return _shift(asset, pose, frame.leave(motion.poses[0])) >= SUCCESS_M

    # What is too heavy alone is not lighter among others, nor freer beside the agent.
    if moves() and _reached(frame, near, free.sweeps, TOUCH_M):
        failure = "something is in the way"
        motion, movers = _push_among(asset, start, frame, near, None, shove, free.sweeps)
    column = _column(frame, agent, agent_gap_m)
    if column is not None and moves() and _meets(column, motion.sweeps):
        # Only now: what never comes near the agent is solved once, wherever it stands.
        failure = "the agent is in the way"
        motion, movers = _push_among(asset, start, frame, near, column, shove, motion.sweeps)
    return _judged(asset, pose, frame, motion, movers, failure)


def crowd(asset: Asset, pose: Pose, heading: int, near: Near, model: PushModel = "force") -> int:
    """Count the things that may be moved besides what is pushed: what a push will cost to solve.

    Parameters as in `push`.
    """
    frame = Frame(pose.x, pose.y, heading)
    free = _push_alone(asset, _start(frame, pose), SHOVES[model], engine_of_this_process())
    return sum(body.moves for body in _gathered(frame, near, free.sweeps).values())


def _start(frame: Frame, pose: Pose) -> Pose:
    return Pose(0.0, 0.0, round(pose.z, _HEIGHT_DIGITS), _coarse(frame.enter(pose).quaternion))


@lru_cache(maxsize=32768)
def _push_alone(asset: Asset, start: Pose, shove: Shove, engine: Engine) -> Motion:
    return engine.push(Setting((Body(asset, start, moves=True),)), shove)


@lru_cache(maxsize=4096)
def _push_in(setting: Setting, shove: Shove, engine: Engine) -> Motion:
    """Push in a scene; what failed changed nothing and is likely to be tried again."""
    return engine.push(setting, shove)


def _push_among(
    asset: Asset,
    start: Pose,
    frame: Frame,
    near: Near,
    column: Column | None,
    shove: Shove,
    sweeps: Sequence[Octagon],
) -> tuple[Motion, Movers]:
    """Push among what can be touched: gathered anew until nothing left out was reached."""
    engine = engine_of_this_process()
    known = _gathered(frame, near, sweeps)
    for left in reversed(range(ROUNDS)):
        around = [(key, known[key]) for key in sorted(known)]
        movers = tuple(pair for pair in around if pair[1].moves)
        others = [pair for pair in around if not pair[1].moves]
        bodies = (
            Body(body.asset, frame.enter(body.pose), body.moves) for _, body in (*movers, *others)
        )
        setting = Setting((Body(asset, start, moves=True), *bodies), column)
        motion = _push_in(setting, shove, engine)
        reached = _reached(frame, near, motion.sweeps, TOUCH_M)
        if reached.keys() <= known.keys():
            break
        known.update(reached)
        if left == 1:
            known.update(_reached(frame, near, sweeps, FAR_M))
    return motion, movers


def _gathered(frame: Frame, near: Near, sweeps: Sequence[Octagon]) -> dict[int, Body]:
    """Gather what a push may meet, and what that may be driven on to."""
    known = _reached(frame, near, sweeps, AROUND_M)
    for body in [body for body in known.values() if body.moves]:
        known.update(near(grown(extent_of(body.asset, body.pose).octagon, ON_M)))
    return known


def _reached(frame: Frame, near: Near, sweeps: Iterable[Octagon], margin: float) -> dict[int, Body]:
    """Gather what lies within a margin of what was swept."""
    found: dict[int, Body] = {}
    for sweep in sweeps:
        found.update(near(grown(frame.leave_octagon(sweep), margin)))
    return found


def _judged(
    asset: Asset,
    pose: Pose,
    frame: Frame,
    motion: Motion,
    movers: Movers,
    failure: Failure,
) -> Pushed:
    """Move a motion from the thing's own frame into the house, round it, and judge it."""
    end = frame.leave(motion.poses[0])
    far = round_m(_shift(asset, pose, end))
    moved = []
    for (key, body), after in zip(movers, motion.poses[1:], strict=True):
        there = frame.leave(after)
        if not _still(body, there):
            moved.append((key, there))
    success = far >= SUCCESS_M
    return Pushed(
        pose=end,
        displacement_m=far,
        seconds=round(motion.seconds, 6),
        toppled=_tilt_deg(pose.quaternion, end.quaternion) > TOPPLED_DEG,
        moved=tuple(moved),
        success=success,
        reason="" if success else failure,
        at_rest=motion.at_rest,
    )


def _coarse(quaternion: Quaternion) -> Quaternion:
    x, y, z, w = (round(q, _START_DIGITS) + 0.0 for q in quaternion)
    return x, y, z, w


def _column(frame: Frame, agent: Vec2 | None, gap: float) -> Column | None:
    if agent is None:
        return None
    x, y = frame.enter_point(agent)
    return Column(x, y, min(AGENT_M, max(AGENT_LEAST_M, round_m(gap))))


def _meets(column: Column, sweeps: Iterable[Octagon]) -> bool:
    """Whether anything swept comes near the agent's column."""
    disc = octagon_of_disc(column.x, column.y, column.radius_m + TOUCH_M)
    return any(overlap(disc, sweep) for sweep in sweeps)


def _rotated(quaternion: Quaternion, vector: Vec3) -> Vec3:
    """Turn a vector; plain floats, since arrays of three cost more than they save."""
    x, y, z, w = quaternion
    u, v, t = vector
    s = 2.0 / (x * x + y * y + z * z + w * w)
    # Twice the cross product with the axis, then once more (Rodrigues).
    a, b, c = y * t - z * v, z * u - x * t, x * v - y * u
    return (
        u + s * (w * a + y * c - z * b),
        v + s * (w * b + z * a - x * c),
        t + s * (w * c + x * b - y * a),
    )


def _shift(asset: Asset, before: Pose, after: Pose) -> float:
    """How far the centre of mass moved in the plane."""
    middle = centre_of_mass(asset)
    ax, ay, _ = _rotated(before.quaternion, middle)
    bx, by, _ = _rotated(after.quaternion, middle)
    return math.hypot(after.x + bx - before.x - ax, after.y + by - before.y - ay)


def _tilt_deg(before: Quaternion, after: Quaternion) -> float:
    """Angle between a thing's own upward axis before and after."""
    a, b = _rotated(before, (0.0, 0.0, 1.0)), _rotated(after, (0.0, 0.0, 1.0))
    return math.degrees(math.acos(max(-1.0, min(1.0, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]))))


def _still(body: Body, there: Pose) -> bool:
    here = body.pose
    near = math.dist((here.x, here.y, here.z), (there.x, there.y, there.z)) < STILL_M
    turn = abs(sum(p * q for p, q in zip(here.quaternion, there.quaternion, strict=True)))
    return near and 2.0 * math.acos(min(1.0, turn)) < STILL_RAD
