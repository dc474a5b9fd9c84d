"""Story of a replay: the states of an episode after each action, cut into captioned shots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from internav_data.navigation import SPACING_M
from internav_data.records.errors import UsageError
from internav_data.views.motion import eased, interpolated
from internav_data.world import ACTION_COUNT, Action, HouseModel, World
from internav_data.world.actions import INTERACTION_KINDS
from internav_data.world.config import DEFAULT_WORLD

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from internav_data.records import Asset, Episode, Pose, Vec2
    from internav_data.world import StepResult
    from internav_data.world.config import WorldConfig


MAX_ACTIONS: Final = 10_000
"""Maximum length of an action list."""


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """State of an episode after some actions.

    Attributes
    ----------
    step
        Number of actions so far; 0 is the start.
    total
        Number of all actions.
    world
        The state. Not to be changed.
    result
        Result of the last action; None at the start.
    path_steps
        Lattice distance from the agent to the goal, objects as they lie; None when cut off.
    """

    step: int
    total: int
    world: World
    result: StepResult | None
    path_steps: int | None

    def pose(self, item: int) -> Pose | None:
        """Return the pose of an item; None while it is held."""
        return self.world.items[item].pose


@dataclass(frozen=True, slots=True, eq=False)
class Story:
    """A played episode: `moments[k]` is its state after k actions."""

    episode: Episode
    model: HouseModel
    moments: tuple[Moment, ...]
    moved: tuple[int, ...]
    """Furniture (indices of the model's items) that is moved in this story."""

    @property
    def results(self) -> list[StepResult]:
        """Results of the actions, in order."""
        return [m.result for m in self.moments if m.result is not None]

    @property
    def success(self) -> bool:
        """Whether the episode ends with Done at the goal."""
        last = self.moments[-1].result
        return last is not None and last.action == Action.DONE and last.success

    def name(self, item: int) -> str:
        """Return an item's type; an obstacle's has its number in the episode."""
        first = len(self.model.items)
        kind = self.moments[0].world.items[item].asset.type
        return f"{kind} {item - first + 1}" if item >= first else kind


def play(
    model: HouseModel,
    episode: Episode,
    assets: Mapping[str, Asset],
    actions: Sequence[int] | None = None,
    config: WorldConfig = DEFAULT_WORLD,
) -> Story:
    """Play actions from an episode's start; those of its expert by default.

    Parameters
    ----------
    model
        Model of the episode's house.
    episode, assets
        The episode, and the assets of its obstacles by asset_id.
    actions
        Numbers of `Action`; -1 waits, as in an environment. Actions after a Done are ignored.
    config
        Settings of the world: those of the episode's dataset.

    Raises
    ------
    UsageError
        The house or an asset is another's, there is no expert, or no such action.
    """
    if actions is None:
        if episode.expert is None:
            raise UsageError(
                f"{episode.episode_id} has no expert; pass actions, or plan one with "
                "internav_data.planner.search.expert_of_episode"
            )
        actions = episode.expert.actions
    if len(actions) > MAX_ACTIONS:
        raise UsageError(f"{len(actions)} actions: at most {MAX_ACTIONS} are played")
    missing = [o.asset_id for o in episode.obstacles if o.asset_id not in assets]
    if missing:
        raise UsageError(
            f"{episode.episode_id}: obstacle {missing[0]}: its asset is not known; pass the "
            "dataset's assets or the catalogue that the episode was made with"
        )
    world = World.of_episode(model, episode, assets, config)
    chosen = [Action(action) for action in _checked(actions)]
    if Action.DONE in chosen:
        chosen = chosen[: chosen.index(Action.DONE) + 1]
    moments = [Moment(0, len(chosen), world.copy(), None, world.path_steps())]
    for k, action in enumerate(chosen, 1):
        result = world.step(action)
        moments.append(Moment(k, len(chosen), world.copy(), result, world.path_steps()))
    home = range(len(model.items))
    moved = [k for k in home if any(m.world.items[k] is not model.items[k] for m in moments)]
    return Story(episode, model, tuple(moments), tuple(moved))


def _checked(actions: Sequence[int]) -> Sequence[int]:
    for k, action in enumerate(actions):
        if not Action.WAIT <= action < ACTION_COUNT:
            raise UsageError(
                f"action {k}: expected a number from 0 to {ACTION_COUNT - 1}, or -1 to wait; "
                f"got {action}"
            )
    return actions


def describe(story: Story, moment: Moment) -> str:
    """Describe the effect of the last action in words, or the reason of its failure."""
    result = moment.result
    if result is None:
        return "start"
    action, words = result.action, result.action.words
    target = f" {story.name(result.target)}" if result.target >= 0 else ""
    if not result.success:
        return f"{words}{target} failed: {result.reason}"
    if action.kind == "push":
        text = f"{words}: {target.strip()} slid {result.displacement_m:.2f} m"
        if result.toppled:
            text += ", fell over"
        others = len(result.moved) - 1
        if others:
            text += f", moved {others} other object{'s' if others > 1 else ''}"
        return text + _opened(story, moment)
    if action.kind in INTERACTION_KINDS:
        return f"{words}{target}{_opened(story, moment)}"
    if action == Action.DONE:
        return f"done: reached the goal in {moment.step} actions"
    return words


def _opened(story: Story, moment: Moment) -> str:
    """Describe whether the last action opened or closed the path to the goal."""
    before = story.moments[moment.step - 1].path_steps
    if before is None and moment.path_steps is not None:
        return " - the way is open"
    if before is not None and moment.path_steps is None:
        return " - the way is cut off"
    return ""


PACE: Final = 4.0
"""Moves and turns a second."""

TITLE_S: Final = 1.5

END_S: Final = 1.5

_AIM_S: Final = 0.4
"""Duration for which the target of an interaction is highlighted beforehand."""

_SLIDE_S: Final = 0.5

_RESULT_S: Final = 0.6

_QUARTER_DEG: Final = 90.0

Mood = Literal["plain", "good", "bad"]


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """One picture: a state between two moments, with its caption.

    Attributes
    ----------
    frames
        Number of frames for which it is shown.
    moment
        The moment after the action that is being executed.
    x, y, yaw_deg, horizon_deg
        Camera pose: metres, degrees.
    poses
        Poses of the objects that move in this story, by item; None while held.
    trail
        Nodes on which the agent stood, and its position; metres.
    text, mood
        Caption, and the mood that decides its colour.
    target
        Item to highlight, or -1.
    path_steps
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
    path_steps: int | None


def shots(story: Story, fps: float) -> Iterator[Shot]:
    """Cut a story into shots for a video of `fps` frames a second.

    The first shows the title card, the last the end.
    """
    first = story.moments[0]
    title = f"{first.total} action{'' if first.total == 1 else 's'} to come"
    yield _still(story, first, _frames(TITLE_S, fps), title)
    for before, after in zip(story.moments, story.moments[1:], strict=False):
        yield from _action_shots(story, before, after, fps)
    last = story.moments[-1]
    if story.success:
        yield _still(story, last, _frames(END_S, fps), describe(story, last), "good")
    else:
        text = f"ended after {last.total} actions, not done at the goal"
        yield _still(story, last, _frames(END_S, fps), text, "bad")


def _frames(seconds: float, fps: float) -> int:
    return max(1, round(seconds * fps))


def _action_shots(story: Story, before: Moment, after: Moment, fps: float) -> Iterator[Shot]:
    result = after.result
    if result is None:
        return
    text = describe(story, after)
    if not result.success:
        frames = _frames(_RESULT_S, fps)
        yield _still(story, after, frames, text, "bad", result.target)
    elif result.action.kind in INTERACTION_KINDS:
        if result.action != Action.DROP:
            aim = f"{result.action.words}: {story.name(result.target)}"
            frames = _frames(_AIM_S, fps)
            yield _still(story, after, frames, aim, "plain", result.target, shown=before)
        if result.action.kind == "push":
            yield from _slide(story, before, after, result, fps)
        yield _still(story, after, _frames(_RESULT_S, fps), text, "plain", result.target)
    elif result.action == Action.DONE:
        return
    else:
        count = _frames(1.0 / PACE, fps)
        for k in range(1, count + 1):
            yield _in_motion(story, before, after, k / count, text)


def _still(
    story: Story,
    moment: Moment,
    frames: int,
    text: str,
    mood: Mood = "plain",
    target: int = -1,
    shown: Moment | None = None,
) -> Shot:
    """Return a shot of a moment, or of the one before while its action is announced."""
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
        path_steps=state.path_steps,
    )


def _poses(story: Story, moment: Moment) -> dict[int, Pose | None]:
    return {k: moment.pose(k) for k in (*story.moved, *moment.world.obstacles)}


def _trail(story: Story, step: int) -> tuple[Vec2, ...]:
    points: list[Vec2] = []
    for moment in story.moments[: step + 1]:
        if not points or moment.world.position != points[-1]:
            points.append(moment.world.position)
    return tuple(points)


def _in_motion(story: Story, before: Moment, after: Moment, share: float, text: str) -> Shot:
    """Return a shot within a move, a turn or a look; `share` of it is done."""
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
        path_steps=after.path_steps,
    )


def _slide(
    story: Story, before: Moment, after: Moment, result: StepResult, fps: float
) -> Iterator[Shot]:
    """Yield shots of sliding objects: straight lines, slower towards the end."""
    count = _frames(_SLIDE_S, fps)
    still = _still(story, after, 1, "", "plain", result.target, shown=before)
    text = f"{result.action.words}: {story.name(result.target)}"
    for k in range(1, count):
        share = eased(k / count)
        poses = dict(still.poses)
        for item, pose in result.moved:
            begin = poses[item]
            poses[item] = pose if begin is None else interpolated(begin, pose, share)
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
            path_steps=still.path_steps,
        )
