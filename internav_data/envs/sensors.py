"""Sensors: named observations, each with a space and a function that writes it.

`SENSORS` is the only table of them: spaces, observation buffers and shared memory derive from it.
An environment takes sensors by name, or a `Sensor` of one's own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from gymnasium import spaces

from internav_data.envs.house_map import CHANNELS, LAYERS, MAP_SIZE, Privilege, map_layers
from internav_data.geometry.headings import HEADINGS
from internav_data.navigation import SPACING_M
from internav_data.records.errors import UsageError
from internav_data.world.actions import HORIZONS_DEG

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from internav_data.envs.episode import EpisodeRun
    from internav_data.render.camera import Frames
    from internav_data.world import World

FAR_M: Final = 1000.0
"""Upper bound of distances and depths, m; no house is larger (the camera's background is 100)."""
MIN_INSTANCE_ID: Final = -5
"""Lower bound of instance ids: see the table of `internav_data.render.camera`."""

Observation = Literal["camera", "map"]
"""Way to observe the house: pictures, or a map."""
SpaceOfSize = Callable[[int], "spaces.Space[Any]"]
Write = Callable[["EpisodeRun", "Frames", "NDArray[Any]"], None]


@dataclass(frozen=True, slots=True)
class Sensor:
    """Named observation of one agent, as Habitat has them.

    Functions of a module can be sent to other processes; lambdas cannot.
    """

    name: str
    """Key among the observations."""
    space: SpaceOfSize
    """Space of one observation; the argument is the image size, pixels a side."""
    write: Write
    """Write the observation of a run into an array of the space's shape.

    Its arguments are the run, frames of one picture, and the array. The picture is the agent's
    view if `camera` is true, and undefined otherwise.
    """
    camera: bool = False
    """Whether it looks at the picture: then it is written only where the picture has changed."""
    unit: str = ""
    description: str = ""
    """Text for `docs/environment.md`."""


def point_goal(world: World) -> tuple[float, float]:
    """Return the point goal: straight distance, m, and bearing in (-pi, pi], left positive."""
    east, north = world.goal[0] - world.i, world.goal[1] - world.j
    # Integers: a goal straight behind has bearing pi, never -pi.
    c, s = (int(part) for part in HEADINGS[world.quarter])
    ahead, left = c * east + s * north, c * north - s * east
    return SPACING_M * math.hypot(east, north), math.atan2(left, ahead)


def _rgb_space(size: int) -> spaces.Box:
    return spaces.Box(0, 255, (size, size, 3), np.uint8)


def _depth_space(size: int) -> spaces.Box:
    return spaces.Box(0.0, FAR_M, (size, size, 1), np.float32)


def _ids_space(size: int) -> spaces.Box:
    return spaces.Box(MIN_INSTANCE_ID, 2**31 - 1, (size, size), np.int32)


def _goal_space(_: int) -> spaces.Box:
    low, high = np.array([0.0, -np.pi], np.float32), np.array([FAR_M, np.pi], np.float32)
    return spaces.Box(low, high)


def _held_space(_: int) -> spaces.Discrete:
    return spaces.Discrete(2)


def _horizon_space(_: int) -> spaces.Discrete:
    return spaces.Discrete(len(HORIZONS_DEG))


def _write_rgb(_: EpisodeRun, frames: Frames, out: NDArray[Any]) -> None:
    out[...] = frames.rgb[0]


def _write_depth(_: EpisodeRun, frames: Frames, out: NDArray[Any]) -> None:
    out[..., 0] = frames.depth[0]


def _write_ids(_: EpisodeRun, frames: Frames, out: NDArray[Any]) -> None:
    out[...] = frames.ids[0]


def _write_goal(run: EpisodeRun, _: Frames, out: NDArray[Any]) -> None:
    out[...] = point_goal(run.world)


def _write_held(run: EpisodeRun, _: Frames, out: NDArray[Any]) -> None:
    out[...] = run.world.held >= 0


def _write_horizon(run: EpisodeRun, _: Frames, out: NDArray[Any]) -> None:
    out[...] = HORIZONS_DEG.index(run.world.horizon_deg)


def _map_space(_: int, channels: int) -> spaces.Box:
    return spaces.Box(0, 255, (channels, MAP_SIZE, MAP_SIZE), np.uint8)


def _write_map(
    run: EpisodeRun, _: Frames, out: NDArray[Any], *, occlusion: bool, layers: NDArray[np.int64]
) -> None:
    run.house_map(occlusion=occlusion).write(out, layers)


def map_sensor(*, occlusion: bool = False, privileged: Sequence[Privilege] = ()) -> Sensor:
    """Return the sensor `map`: a map of the house around the agent, who looks up in it.

    An observation is (channels, 52, 52) uint8, cells of 0.125 m: row 0 lies farthest ahead, column
    0 farthest to the left, and the agent stands in the middle, on the corner of four cells. A cell
    shows a thing that blocks the agent and overlaps it; of several the one whose type can be
    handled, else the highest.

    | channel | unit | value |
    |---|---|---|
    | 0 `height` | 0.02 m | top of the thing above the floor; 255 for 5.1 m and more |
    | 1 `kind` | | 0 nothing, 1 wall, 2 furniture, 3 of a type to push, 4 of a type to pick up, \
5 not seen yet |
    | 2 `type` | | number of its type in the catalogue plus 1; 254 a user's own, 255 wall |
    | 3 `goal` | | 1 in the four cells round the goal |
    | 4 `tried` | bits | what failed with the thing since it lies there: 1, 2, 4, 8 a push ahead, \
to the left, back, to the right, as the agent looks now; 16 a pick-up; 32, round a node: there was \
nothing to act on, or no room to drop, and nothing has moved since |
    | `mass` | kg | privileged: mass of the thing; 255 for a wall and for 255 kg and more |
    | `movable` | bits | privileged: 1 it can be pushed, 2 picked up |

    Parameters
    ----------
    occlusion
        Whether it shows only what the agent has seen so far, as it was then: what lies within 90
        degrees and what is within 0.25 m, behind nothing as high as the camera. The camera's
        horizon does not count.
    privileged
        Hidden attributes to show besides, a channel each, in this order: for oracles alone.

    Raises
    ------
    UsageError
        An attribute is unknown, or given twice.
    """
    if not set(privileged) <= LAYERS.keys() or len({*privileged}) < len(privileged):
        raise UsageError(f"privileged: expected some of {list(LAYERS)}, got {list(privileged)}")
    layers = map_layers(privileged)
    words = "map of the house around the agent: see [maps](#maps)"
    if privileged:
        words += f", privileged input: {', '.join(privileged)}"
    return Sensor(
        "map",
        partial(_map_space, channels=CHANNELS + len(privileged)),
        partial(_write_map, occlusion=occlusion, layers=layers),
        description=words,
    )


SENSORS: Final = {
    sensor.name: sensor
    for sensor in (
        Sensor(
            "rgb", _rgb_space, _write_rgb, camera=True,
            description="field of view 90°, from 1.575 m above the floor",
        ),
        Sensor(
            "depth", _depth_space, _write_depth, camera=True, unit="m",
            description="distance along the optical axis; 100 where nothing is",
        ),
        Sensor(
            "goal", _goal_space, _write_goal, unit="m, rad",
            description="straight distance and bearing from the agent, left is positive",
        ),
        Sensor("held", _held_space, _write_held, description="whether the agent holds an object"),
        Sensor(
            "horizon", _horizon_space, _write_horizon,
            description="index of the camera's angle below the horizon: −30°, 0°, 30°, 60°",  # noqa: RUF001 - minus
        ),
        Sensor(
            "ids", _ids_space, _write_ids, camera=True,
            description="instance of each pixel (`internav_data.render.camera`), privileged input",
        ),
        map_sensor(),
    )
}  # fmt: skip
"""Sensors by name."""
DEFAULT_SENSORS: Final = ("rgb", "depth", "goal", "held", "horizon")
"""Sensors of an environment unless it is given others. Instance ids are privileged input."""


def observed(
    observation: Observation = "camera",
    *,
    map_occlusion: bool = False,
    privileged: Sequence[Privilege] = (),
) -> tuple[str | Sensor, ...]:
    """Return the sensors of a way to observe: pictures or a map, and what the agent feels.

    Parameters
    ----------
    observation
        "camera": `DEFAULT_SENSORS`; "map": a map in place of the pictures.
    map_occlusion, privileged
        Arguments of `map_sensor`.

    Raises
    ------
    UsageError
        There is no such way, or pictures are given arguments of a map.
    """
    if observation == "map":
        shown = map_sensor(occlusion=map_occlusion, privileged=privileged)
        return (shown, *(name for name in DEFAULT_SENSORS if not SENSORS[name].camera))
    if observation != "camera":
        raise UsageError(f"observation: expected 'camera' or 'map', got {observation!r}")
    if map_occlusion or privileged:
        raise UsageError(
            "map_occlusion and privileged: pictures have no use for them; leave them out, or set "
            "observation='map'"
        )
    return DEFAULT_SENSORS


def sensor_names(sensors: Iterable[str | Sensor]) -> set[str]:
    """Return the names of sensors, some of which may be names already."""
    return {sensor if isinstance(sensor, str) else sensor.name for sensor in sensors}


def find_sensors(chosen: Sequence[str | Sensor]) -> tuple[Sensor, ...]:
    """Return sensors by their names; those that are no names stay as they are.

    Raises
    ------
    UsageError
        A name is unknown, or two sensors share one.
    """
    unknown = [name for name in chosen if isinstance(name, str) and name not in SENSORS]
    if isinstance(chosen, str) or unknown:
        raise UsageError(f"sensors: expected some of {list(SENSORS)}, got {chosen!r}")
    found = tuple(SENSORS[each] if isinstance(each, str) else each for each in chosen)
    names = [sensor.name for sensor in found]
    if len(set(names)) < len(names):
        raise UsageError(f"sensors: expected each name once, got {names}")
    return found
