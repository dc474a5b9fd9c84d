"""A story cut into shots: what each picture of a replay shows, and for how many frames."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from internav_data.navigation import SPACING_M
from internav_data.records import Pose
from internav_data.views.replay_story import INTERACTIONS, PUSHES, WORDS, sentence
from internav_data.world import Action

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from internav_data.records import Quaternion, Vec2
    from internav_data.views.replay_story import Moment, Story
    from internav_data.world import StepResult

PACE: Final = 4.0
"""Moves and turns a second."""
TITLE_S: Final = 1.5
END_S: Final = 1.5
_AIM_S: Final = 0.4
"""What is about to be pushed or picked up is pointed out for so long."""
_SLIDE_S: Final = 0.5
_RESULT_S: Final = 0.6
_QUARTER_DEG: Final = 90.0

Mood = Literal["plain", "good", "bad"]


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """One picture: the state between two moments, and what is said about it.

    Attributes
    ----------
    frames
        How many frames it stays.
    moment
        The moment it belongs to: the one after the action that is being done.
    x, y, yaw_deg, horizon_deg
        The eye: metres, degrees.
    poses
        Where things lie that move in this story, by item; None while held.
    trail
        Nodes the agent stood on, and where it is; metres.
    text, mood
        What is said, and how it is coloured.
    target
        Item to point out, or -1.
    steps
        Lattice distance to the goal; None when cut off.
    """

    frames: int
    moment: Moment
    x: float
    y: float
    yaw_deg: float
    horizon_deg: float
    poses: Mapping[int, Pose | None]
    trail: tuple[Vec2, ...]
    text: str
    mood: Mood
    target: int
    steps: int | None


def shots(story: Story, fps: float) -> Iterator[Shot]:
    """Cut a story into shots at so many frames a second.

    The first is for the title, the last for the end.
    """
    first = story.moments[0]
    title = f"{first.total} action{'' if first.total == 1 else 's'} to come"
    yield _still(story, first, _frames(TITLE_S, fps), title)
    for before, after in zip(story.moments, story.moments[1:], strict=False):
        yield from _acted(story, before, after, fps)
    last = story.moments[-1]
    if story.success:
        yield _still(story, last, _frames(END_S, fps), sentence(story, last), "good")
    else:
        text = f"ended after {last.total} actions, not done at the goal"
        yield _still(story, last, _frames(END_S, fps), text, "bad")


def _frames(seconds: float, fps: float) -> int:
    return max(1, round(seconds * fps))


def _acted(story: Story, before: Moment, after: Moment, fps: float) -> Iterator[Shot]:
    result = after.result
    if result is None:
        return
    text = sentence(story, after)
    if not result.success:
        frames = _frames(_RESULT_S, fps)
        yield _still(story, after, frames, text, "bad", result.target)
    elif result.action in INTERACTIONS:
        if result.action != Action.DROP:
            aim = f"{WORDS[result.action]}: {story.name(result.target)}"
            frames = _frames(_AIM_S, fps)
            yield _still(story, after, frames, aim, "plain", result.target, shown=before)
        if result.action in PUSHES:
            yield from _slide(story, before, after, result, fps)
        yield _still(story, after, _frames(_RESULT_S, fps), text, "plain", result.target)
    elif result.action == Action.DONE:
        return
    else:
        count = _frames(1.0 / PACE, fps)
        for k in range(1, count + 1):
            yield _between(story, before, after, k / count, text)


def _still(
    story: Story,
    moment: Moment,
    frames: int,
    text: str,
    mood: Mood = "plain",
    target: int = -1,
    shown: Moment | None = None,
) -> Shot:
    """Show a moment; or, while its action is being announced, the one before."""
    state = shown or moment
    world = state.world
    return Shot(
        frames=frames,
        moment=moment,
        x=world.position[0],
        y=world.position[1],
        yaw_deg=_QUARTER_DEG * world.quarter,
        horizon_deg=float(world.horizon_deg),
        poses=_poses(story, state),
        trail=_trail(story, state.step),
        text=text,
        mood=mood,
        target=target,
        steps=state.steps,
    )


def _poses(story: Story, moment: Moment) -> dict[int, Pose | None]:
    return {k: moment.pose(k) for k in (*story.moved, *moment.world.obstacles)}


def _trail(story: Story, step: int) -> tuple[Vec2, ...]:
    points: list[Vec2] = []
    for moment in story.moments[: step + 1]:
        if not points or moment.world.position != points[-1]:
            points.append(moment.world.position)
    return tuple(points)


def _between(story: Story, before: Moment, after: Moment, share: float, text: str) -> Shot:
    """Show a move, a turn or a look under way."""
    old, new = before.world, after.world
    x = SPACING_M * (old.i + share * (new.i - old.i))
    y = SPACING_M * (old.j + share * (new.j - old.j))
    turn = (new.quarter - old.quarter + 1) % 4 - 1
    return Shot(
        frames=1,
        moment=after,
        x=x,
        y=y,
        yaw_deg=_QUARTER_DEG * (old.quarter + share * turn),
        horizon_deg=old.horizon_deg + share * (new.horizon_deg - old.horizon_deg),
        poses=_poses(story, after),
        trail=(*_trail(story, before.step), (x, y)),
        text=text,
        mood="plain",
        target=-1,
        steps=after.steps,
    )


def _slide(
    story: Story, before: Moment, after: Moment, result: StepResult, fps: float
) -> Iterator[Shot]:
    """Show things on their way; in a straight line, slower towards the end."""
    count = _frames(_SLIDE_S, fps)
    still = _still(story, after, 1, "", "plain", result.target, shown=before)
    text = f"{WORDS[result.action]}: {story.name(result.target)}"
    for k in range(1, count):
        share = 1.0 - (1.0 - k / count) ** 2
        poses = dict(still.poses)
        for item, pose in result.moved:
            begin = poses[item]
            poses[item] = pose if begin is None else _mixed(begin, pose, share)
        yield Shot(
            frames=1,
            moment=after,
            x=still.x,
            y=still.y,
            yaw_deg=still.yaw_deg,
            horizon_deg=still.horizon_deg,
            poses=poses,
            trail=still.trail,
            text=text,
            mood="plain",
            target=result.target,
            steps=still.steps,
        )


def _mixed(begin: Pose, end: Pose, share: float) -> Pose:
    """Return a pose between two, the shorter way round."""
    a, b = begin.quaternion, end.quaternion
    sign = 1.0 if sum(p * q for p, q in zip(a, b, strict=True)) >= 0.0 else -1.0
    x, y, z, w = (p + share * (sign * q - p) for p, q in zip(a, b, strict=True))
    length = math.sqrt(x * x + y * y + z * z + w * w)
    turned: Quaternion = (x / length, y / length, z / length, w / length)
    return Pose(
        begin.x + share * (end.x - begin.x),
        begin.y + share * (end.y - begin.y),
        begin.z + share * (end.z - begin.z),
        turned,
    )
