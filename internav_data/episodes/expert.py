"""The expert: actions that reach the goal in the true world, cheap in steps.

It gives imitation data and every metric's ceiling. No expert is returned that was not replayed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from internav_data.episodes.expert_search import plan
from internav_data.navigation import SPACING_M
from internav_data.records import Expert
from internav_data.world import Action, World

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from internav_data.records import Asset, Episode, Pose
    from internav_data.world import PushModel, Stage

STEPS_AT_MOST: Final = 500
"""An episode ends after this many actions."""


def solve(world: World, limit: int = STEPS_AT_MOST) -> Expert | None:
    """Plan from a world as it stands, and replay the plan in a world in the same state.

    Parameters
    ----------
    world
        Where to begin; it is not changed.
    limit
        Most actions, Done included.

    Returns
    -------
    Expert or None
        None where no plan was found within the search's bounds: nothing that blocks the way can
        be moved, or moving it does not help.

    """
    actions = plan(world, limit)
    return None if actions is None else replay(world.copy(), actions)


def expert_of(
    stage: Stage,
    obstacles: Iterable[tuple[Asset, Pose]],
    start: tuple[int, int, int],
    goal: tuple[int, int],
    model: PushModel = "force",
    limit: int = STEPS_AT_MOST,
) -> Expert | None:
    """Solve an episode from its parts, and replay the plan in a fresh world.

    Parameters
    ----------
    stage
        The house, once for all of its episodes.
    obstacles
        Settled, rounded poses, in the episode's order.
    start
        Node i, j and quarter turn.
    goal
        Node i, j.
    model, limit
        As in `World`, as in `solve`.

    """
    things = tuple(obstacles)
    actions = plan(World(stage, things, start, goal, model), limit)
    return None if actions is None else replay(World(stage, things, start, goal, model), actions)


def expert_of_episode(
    stage: Stage, episode: Episode, assets: Mapping[str, Asset], model: PushModel = "force"
) -> Expert | None:
    """Solve an episode.

    Raises
    ------
    UsageError
        The stage is of another house.

    """
    actions = plan(World.of_episode(stage, episode, assets, model), STEPS_AT_MOST)
    if actions is None:
        return None
    return replay(World.of_episode(stage, episode, assets, model), actions)


def replay(world: World, actions: Sequence[int]) -> Expert | None:
    """Act, and count; None unless every action succeeds and the last one is Done at the goal.

    The world is changed.
    """
    counts = [0] * len(Action)
    for action in actions:
        if not world.step(action).success:
            return None
        counts[action] += 1
    if not actions or actions[-1] != Action.DONE:
        return None
    pushes = range(Action.PUSH_AHEAD, Action.PUSH_LEFT + 1)
    return Expert(
        actions=tuple(int(action) for action in actions),
        steps=len(actions),
        pushes=sum(counts[push] for push in pushes),
        picks=counts[Action.PICKUP],
        path_m=SPACING_M * counts[Action.MOVE_AHEAD],
    )
