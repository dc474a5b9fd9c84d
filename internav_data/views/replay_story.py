"""An episode played once, every step kept: what a replay shows, before a pixel is drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from internav_data.records.errors import UsageError
from internav_data.world import Action, World

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.records import Asset, Episode, Pose
    from internav_data.world import PushModel, Stage, StepResult

ACTIONS_AT_MOST: Final = 10_000
"""No longer list is played."""
WORDS: Final = {
    Action.MOVE_AHEAD: "move ahead",
    Action.ROTATE_LEFT: "turn left",
    Action.ROTATE_RIGHT: "turn right",
    Action.LOOK_DOWN: "look down",
    Action.LOOK_UP: "look up",
    Action.PUSH_AHEAD: "push ahead",
    Action.PUSH_BACK: "push back",
    Action.PUSH_RIGHT: "push right",
    Action.PUSH_LEFT: "push left",
    Action.PICKUP: "pick up",
    Action.DROP: "drop",
    Action.DONE: "done",
    Action.WAIT: "wait",
}
PUSHES: Final = frozenset(
    {Action.PUSH_AHEAD, Action.PUSH_BACK, Action.PUSH_RIGHT, Action.PUSH_LEFT}
)
INTERACTIONS: Final = PUSHES | {Action.PICKUP, Action.DROP}


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """An episode after so many actions.

    Attributes
    ----------
    step
        How many actions were done; 0 is the start.
    total
        How many there are.
    world
        The state. Not to be changed.
    result
        What the last action did; None at the start.
    steps
        Lattice distance from the agent to the goal, things as they lie; None when cut off.
    """

    step: int
    total: int
    world: World
    result: StepResult | None
    steps: int | None

    def pose(self, item: int) -> Pose | None:
        """Return where a thing lies; None while it is held."""
        return self.world.items[item].pose


@dataclass(frozen=True, slots=True, eq=False)
class Story:
    """An episode played: `moments[k]` is after k actions."""

    episode: Episode
    stage: Stage
    moments: tuple[Moment, ...]
    moved: tuple[int, ...]
    """Furniture (indices of the stage's items) that lies elsewhere at some time."""

    @property
    def results(self) -> list[StepResult]:
        """What each action did."""
        return [m.result for m in self.moments if m.result is not None]

    @property
    def success(self) -> bool:
        """Whether it ends with Done at the goal."""
        last = self.moments[-1].result
        return last is not None and last.action == Action.DONE and last.success

    def name(self, item: int) -> str:
        """Return a thing's type, an obstacle's with its number in the episode."""
        first = len(self.stage.items)
        kind = self.moments[0].world.items[item].asset.type
        return f"{kind} {item - first + 1}" if item >= first else kind


def played(
    stage: Stage,
    episode: Episode,
    assets: Mapping[str, Asset],
    actions: Sequence[int] | None = None,
    model: PushModel = "force",
) -> Story:
    """Play actions from an episode's start; those of its expert by default.

    Parameters
    ----------
    stage
        The episode's house.
    episode, assets
        What to play, and what its obstacles are made of, by asset_id.
    actions
        Numbers of `Action`; -1 waits, as in an environment. What follows a Done is not played.
    model
        How pushes are answered.

    Raises
    ------
    UsageError
        The house or an asset is another's, there is no expert, or no such action.
    """
    if actions is None:
        if episode.expert is None:
            raise UsageError(
                f"{episode.episode_id} has no expert; pass actions, or plan one with "
                "internav_data.episodes.expert.expert_of_episode"
            )
        actions = episode.expert.actions
    if len(actions) > ACTIONS_AT_MOST:
        raise UsageError(f"{len(actions)} actions: at most {ACTIONS_AT_MOST} are played")
    missing = [o.asset_id for o in episode.obstacles if o.asset_id not in assets]
    if missing:
        raise UsageError(
            f"{episode.episode_id}: obstacle {missing[0]}: its asset is not known; pass the "
            "dataset's assets or the catalogue that the episode was made with"
        )
    world = World.of_episode(stage, episode, assets, model)
    chosen = [Action.WAIT if action == -1 else Action(action) for action in _known(actions)]
    if Action.DONE in chosen:
        chosen = chosen[: chosen.index(Action.DONE) + 1]
    moments = [Moment(0, len(chosen), world.copy(), None, world.steps())]
    for k, action in enumerate(chosen, 1):
        result = world.step(action)
        moments.append(Moment(k, len(chosen), world.copy(), result, world.steps()))
    home = range(len(stage.items))
    moved = [k for k in home if any(m.world.items[k] is not stage.items[k] for m in moments)]
    return Story(episode, stage, tuple(moments), tuple(moved))


def _known(actions: Sequence[int]) -> Sequence[int]:
    for k, action in enumerate(actions):
        if not -1 <= action <= Action.WAIT:
            raise UsageError(
                f"action {k}: expected a number from 0 to {int(Action.WAIT)}, or -1 to wait; "
                f"got {action}"
            )
    return actions


def sentence(story: Story, moment: Moment) -> str:
    """Say in words what the last action did, or why it failed."""
    result = moment.result
    if result is None:
        return "start"
    action, words = result.action, WORDS[result.action]
    target = f" {story.name(result.target)}" if result.target >= 0 else ""
    if not result.success:
        return f"{words}{target} failed: {result.reason}"
    if action in PUSHES:
        said = f"{words}: {target.strip()} slid {result.displacement_m:.2f} m"
        if result.toppled:
            said += ", fell over"
        others = len(result.moved) - 1
        if others:
            said += f", moved {others} other thing{'s' if others > 1 else ''}"
        return said + _opened(story, moment)
    if action in INTERACTIONS:
        return f"{words}{target}{_opened(story, moment)}"
    if action == Action.DONE:
        return f"done: reached the goal in {moment.step} actions"
    return words


def _opened(story: Story, moment: Moment) -> str:
    """Say whether the last action opened or closed the way."""
    before = story.moments[moment.step - 1].steps
    if before is None and moment.steps is not None:
        return " - the way is open"
    if before is not None and moment.steps is None:
        return " - the way is cut off"
    return ""
