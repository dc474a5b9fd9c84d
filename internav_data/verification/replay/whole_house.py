"""Episodes in their whole houses, with every wall, every piece of furniture and every obstacle.

The generator solves its problems among the few bodies that can touch each other. What it leaves
out by mistake, or builds wrongly, shows in a house that is built otherwise and all at once, in the
dataset's engine (`bullet_house`, `mujoco_house`). That takes longer than the replay of the episode,
so it is done for a sample.

Nothing may be inside something else, and objects at rest have to stay where they are for two
seconds. Obstacles can move, and furniture that a push has moved; all else stays.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import shapely

from internav_data.verification.replay.bullet_house import BulletHouse
from internav_data.verification.replay.mujoco_house import MujocoHouse
from internav_data.verification.replay.standing import Standing
from internav_data.verification.shapes import STEP_OVER_M

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from internav_data.records import Asset, Episode, House, Outcome, Pose
    from internav_data.verification.obstacles import Expect
    from internav_data.verification.replay.standing import BuiltHouse
    from internav_data.verification.shapes import Shapes

ENGINES: Final = ("bullet", "mujoco")
"""Engines of the datasets whose houses can be built here."""
EVERY: Final = 40
"""One of so many episodes has its house built."""
HOLD_S: Final = 2.0
"""Time for which objects at rest have to stay where they are, simulated seconds."""
HOLD_M: Final = 0.005
"""Distance that a centre of mass may move meanwhile, metres."""
HOLD_DEG: Final = 1.0
"""Angle by which an object may turn meanwhile, degrees."""
INSIDE_M: Final = 0.003
"""Maximum depth of an object in another one, metres."""
TOUCH_M: Final = 0.005
"""Distance in the plane within which an obstacle may carry one that a push has moved, metres."""


class Key(NamedTuple):
    """An object of an episode: `object` and its id, or `obstacle` and its number."""

    kind: str
    number: int


def is_sampled(episode: Episode) -> bool:
    """Return whether an episode has its house built: each `EVERY`th, from another one a scene."""
    scene, _, index = episode.episode_id.removeprefix("scene-").partition("/")
    return (int(scene) + int(index)) % EVERY == 0


def check_whole_house(house: House, shapes: Shapes, episode: Episode, expect: Expect) -> None:
    """Check an episode in its house: as it starts, and after each push that succeeds.

    Its engine is one of `ENGINES`, and installed.
    """
    pushes = [
        (f"after {outcome.action} of obstacle {number}", ends, outcome.at_rest is True)
        for number, obstacle in enumerate(episode.obstacles)
        for outcome in obstacle.outcomes or ()
        if (ends := _ends(number, outcome))
    ]
    moved = {key for _, ends, _ in pushes for key in ends}
    furniture = _furniture(house, shapes)
    with _built(episode.physics.engine, house, shapes) as built:
        # Furniture that no push moves is put there once.
        built.put([one for key, one in furniture.items() if key not in moved])
        for what, ends, at_rest in [("at the start", {}, True), *pushes]:
            objects = {key: one for key, one in furniture.items() if key in moved}
            objects |= _obstacles(episode)
            built.put(_rearranged(shapes, objects, ends))
            _judge(built, what, expect, at_rest=at_rest)
            built.remove(len(objects))


@contextmanager
def _built(engine: str, house: House, shapes: Shapes) -> Iterator[BuiltHouse]:
    """Build floor and walls in an engine, which no other thread of the process uses meanwhile."""
    if engine == "bullet":
        from internav_data.physics.engines.bullet import ENGINE_LOCK  # noqa: PLC0415 - pybullet

        with ENGINE_LOCK:
            yield BulletHouse(house, shapes)
    else:
        yield MujocoHouse(house, shapes)


def _judge(built: BuiltHouse, what: str, expect: Expect, *, at_rest: bool) -> None:
    """Look for objects inside others, and for some that do not stay if all are to be at rest."""
    for one, other, depth in built.contacts():
        expect(
            depth <= INSIDE_M,
            "physics.house-inside",
            f"{one.name} {what}: at most {1e3 * INSIDE_M:g} mm inside {other}",
            f"{1e3 * depth:.1f} mm",
        )
    for one, far, turned in built.drifts(HOLD_S) if at_rest else ():
        expect(
            far <= HOLD_M and turned <= HOLD_DEG,
            "physics.house-holds",
            f"{one.name} {what}: within {1e3 * HOLD_M:g} mm and {HOLD_DEG:g}° of its pose after "
            f"{HOLD_S:g} s",
            f"{1e3 * far:.1f} mm and {turned:.2f}°",
        )


def _furniture(house: House, shapes: Shapes) -> dict[Key, Standing]:
    """Return the furniture where it stands, without rugs, which are floor."""
    out = {}
    for placed in house.objects:
        asset = shapes.assets[placed.asset_id]
        if not _is_floor(asset):
            name = f"object {placed.object_id} ({asset.asset_id})"
            own = placed.dynamics or asset.dynamics
            out[Key("object", placed.object_id)] = Standing(
                name, asset.asset_id, placed.pose, own.mass_kg, own.friction, moves=False
            )
    return out


def _obstacles(episode: Episode) -> dict[Key, Standing]:
    """Return the obstacles where they stand, with the mass and friction stored in the episode."""
    return {
        Key("obstacle", number): Standing(
            f"obstacle {number} ({o.asset_id})",
            o.asset_id,
            o.pose,
            o.mass_kg,
            o.friction,
            moves=True,
        )
        for number, o in enumerate(episode.obstacles)
    }


def _rearranged(
    shapes: Shapes, objects: Mapping[Key, Standing], ends: Mapping[Key, Pose]
) -> list[Standing]:
    """Return objects, some of which a push has moved: these can move, and obstacles they touch."""
    if not ends:
        return list(objects.values())
    moved = {k: replace(objects[k], pose=pose, moves=True) for k, pose in ends.items()}
    there = np.concatenate([_plans(shapes, one) for one in moved.values()])
    out = []
    for key, one in objects.items():
        near = one.moves and shapely.dwithin(_plans(shapes, one)[:, None], there, TOUCH_M).any()
        out.append(moved.get(key) or replace(one, moves=bool(near)))
    return out


def _plans(shapes: Shapes, one: Standing) -> NDArray[np.object_]:
    return np.array([slab.plan for slab in shapes.slabs(one.asset_id, one.pose)], dtype=object)


def _ends(number: int, outcome: Outcome) -> dict[Key, Pose]:
    """Return where a push of obstacle `number` leaves what it moves.

    Nothing if it moves nothing, or an earlier release stored no poses.
    """
    if outcome.pose is None:
        return {}
    ends = {Key("obstacle", number): outcome.pose}
    for other in outcome.moved or ():
        if other.obstacle is not None:
            ends[Key("obstacle", other.obstacle)] = other.pose
        elif other.object_id is not None:
            ends[Key("object", other.object_id)] = other.pose
    return ends


def _is_floor(asset: Asset) -> bool:
    return not asset.blocks and asset.size[2] <= STEP_OVER_M
