"""Observation spaces, and the buffers that environments write observations into."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from gymnasium import spaces

from internav_data.envs.sensors import find_sensors
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import DTypeLike, NDArray

    from internav_data.envs.episode import EpisodeRun
    from internav_data.envs.sensors import Sensor
    from internav_data.render.camera import Camera


RENDER_SIZE: Final = 300
"""Size of the pictures that `render` returns, pixels a side: the paper's."""


def observation_space(size: int, sensors: Sequence[str | Sensor]) -> spaces.Dict:
    """Return the space of one environment's observations.

    Parameters
    ----------
    size
        Image size, pixels a side.
    sensors
        Sensors, or their names.

    Raises
    ------
    UsageError
        The size is below 1, or a sensor is unknown.
    """
    if size < 1:
        raise UsageError(f"image_size: expected at least 1 pixel a side, got {size}")
    return spaces.Dict({sensor.name: sensor.space(size) for sensor in find_sensors(sensors)})


def buffer_shapes(
    count: int, size: int, sensors: Sequence[str | Sensor]
) -> dict[str, tuple[tuple[int, ...], DTypeLike]]:
    """Return shape (count, …) and dtype of each sensor's buffer, by name.

    Raises
    ------
    UsageError
        A sensor is unknown, or its space is none of arrays.
    """
    shapes: dict[str, tuple[tuple[int, ...], DTypeLike]] = {}
    for name, space in observation_space(size, sensors).items():
        if space.shape is None or space.dtype is None:
            raise UsageError(f"sensor {name!r}: expected a space of arrays, got {space}")
        shapes[name] = ((count, *space.shape), space.dtype)
    return shapes


class ObservationBuffer:
    """Observations of n environment slots, written in place.

    Parameters
    ----------
    camera
        Camera that draws the pictures.
    sensors
        Sensors, or their names.
    buffers : dict of arrays
        One array (n, …) a sensor, as `buffer_shapes` says; shared memory will do.
    """

    def __init__(
        self,
        camera: Camera,
        sensors: Sequence[str | Sensor],
        buffers: Mapping[str, NDArray[Any]],
    ) -> None:
        self.buffers = dict(buffers)
        self._camera, self._frames = camera, camera.frames(1)
        found = find_sensors(sensors)
        self._of_picture = [sensor for sensor in found if sensor.camera]
        self._of_state = [sensor for sensor in found if not sensor.camera]

    @staticmethod
    def of(camera: Camera, count: int, sensors: Sequence[str | Sensor]) -> ObservationBuffer:
        """Make a buffer in ordinary memory."""
        shapes = buffer_shapes(count, camera.size, sensors)
        arrays = {name: np.zeros(shape, dtype) for name, (shape, dtype) in shapes.items()}
        return ObservationBuffer(camera, sensors, arrays)

    def write(self, row: int, run: EpisodeRun) -> None:
        """Write a slot's observations; pictures only if they have changed since the last time."""
        if run.stale and self._of_picture:
            self._camera.render([run.view()], self._frames)
            for sensor in self._of_picture:
                sensor.write(run, self._frames, self.buffers[sensor.name][row, ...])
        run.stale = False
        # `[row, ...]` is a view even where an observation is a scalar.
        for sensor in self._of_state:
            sensor.write(run, self._frames, self.buffers[sensor.name][row, ...])

    def copied(self) -> dict[str, NDArray[Any]]:
        """Return copies of all buffers: arrays (n, …) by sensor."""
        return {name: buffer.copy() for name, buffer in self.buffers.items()}

    def one(self, row: int = 0) -> dict[str, Any]:
        """Return a copy of a row, as one environment's observation."""
        return {name: buffer[row].copy() for name, buffer in self.buffers.items()}
