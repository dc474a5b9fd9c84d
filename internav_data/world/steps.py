"""What each action does to a world."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from internav_data.geometry import clearance
from internav_data.navigation import CLEARANCE_M
from internav_data.records.errors import UsageError
from internav_data.world.actions import HORIZONS_DEG, PUSH_TURNS, Action, Reason, StepResult
from internav_data.world.drop import Ground, drop
from internav_data.world.octagons import grown, square_round
from internav_data.world.push import TOUCH_M
from internav_data.world.sight import axis_distance
from internav_data.world.stage import Item

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from internav_data.geometry import Polygons
    from internav_data.records import Pose
    from internav_data.world.octagons import Octagon
    from internav_data.world.setting import Body
    from internav_data.world.world import World

GOAL_M: Final = 0.2
"""Done succeeds within this of the goal."""
REST_M: Final = 0.01
"""What begins this much above another thing's lowest point, and not above its top, rests on it."""
DROP_ROUND_M: Final = 2.5
"""No drop reaches farther: the widest gap, the largest thing that can be picked up, and room."""

_STEPPED: Final = StepResult(Action.MOVE_AHEAD, success=True)
_BLOCKED: Final = StepResult(Action.MOVE_AHEAD, success=False, reason="something is in the way")
_AHEAD: Final = ((1, 0), (0, 1), (-1, 0), (0, -1))


def act(world: World, action: int) -> StepResult:
    """Change a world by one action; where that fails, leave it as it is."""
    if action == Action.MOVE_AHEAD:
        di, dj = _AHEAD[world.quarter]
        if not world.lattice.edge_free(world.i, world.j, di, dj):
            return _BLOCKED
        world.i += di
        world.j += dj
        return _STEPPED
    known = _known(action)
    return _ACTS[known](world, known)


def _known(action: int) -> Action:
    try:
        return Action(action)
    except ValueError:
        names = ", ".join(f"{int(a)} {a.name}" for a in Action)
        raise UsageError(f"World.step: no action is called {action!r}; expected {names}") from None


def _rotate(world: World, action: Action) -> StepResult:
    turn = 1 if action == Action.ROTATE_LEFT else 3
    world.quarter = (world.quarter + turn) % 4
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
    pushed = world.pushed(target, (world.quarter + PUSH_TURNS[action]) % 4)
    if not pushed.success:
        reason: Reason = pushed.reason
        return StepResult(
            action, success=False, reason=reason, target=target, seconds=pushed.seconds
        )
    moved = tuple(sorted([(target, pushed.pose), *pushed.moved]))
    if _lies_on_agent(world, moved):
        return StepResult(
            action,
            success=False,
            reason="would come to lie on the agent",
            target=target,
            seconds=pushed.seconds,
        )
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
        axis_distance(x, y, Item.at(world.items[k].asset, pose).footprint) < CLEARANCE_M
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
    world.put([(target, None)])
    world.held = target
    return StepResult(action, success=True, target=target)


def carries(world: World, index: int) -> bool:
    """Whether another movable thing rests on a thing, and would hang in the air without it."""
    below = world.items[index]
    for key, _ in world.near(grown(below.octagon, TOUCH_M), index):
        if key >= len(world.items):
            break
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
    around = world.near(square_round(x, y, DROP_ROUND_M))
    solid: list[Polygons] = [world.stage.footprints]
    solid += [world.items[k].footprint for k, _ in around if k < len(world.items)]

    def bodies(octagon: Octagon) -> Sequence[Body]:
        return [body for _, body in world.near(octagon)]

    ground = Ground(world.stage.walls, solid, bodies)
    settled = drop(world.items[target].asset, world.position, world.quarter, ground)
    if settled is None:
        return StepResult(action, success=False, reason="no room to drop it", target=target)
    moved = ((target, settled.pose),)
    world.put(moved)
    world.held = -1
    return StepResult(action, success=True, target=target, seconds=settled.seconds, moved=moved)


def _done(world: World, action: Action) -> StepResult:
    if math.dist(world.position, world.goal_point) > GOAL_M:
        return _failed(action, "not at the goal")
    return StepResult(action, success=True)


def _wait(_: World, action: Action) -> StepResult:
    return StepResult(action, success=True)


def _failed(action: Action, reason: Reason) -> StepResult:
    return StepResult(action, success=False, reason=reason)


_ACTS: Final[dict[Action, Callable[[World, Action], StepResult]]] = {
    Action.ROTATE_LEFT: _rotate,
    Action.ROTATE_RIGHT: _rotate,
    Action.LOOK_DOWN: _look,
    Action.LOOK_UP: _look,
    **dict.fromkeys(PUSH_TURNS, _push),
    Action.PICKUP: _pick,
    Action.DROP: _drop,
    Action.DONE: _done,
    Action.WAIT: _wait,
}
