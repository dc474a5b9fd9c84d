"""What is observed: spaces, and the buffers that worlds write into."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from gymnasium import spaces

from internav_data.records.errors import UsageError
from internav_data.render.camera import Frames
from internav_data.world.actions import HORIZONS_DEG

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.envs.episode import EpisodeRun
    from internav_data.render.camera import Camera

FAR_M: Final = 1000.0
"""Bound of distances and depths; no house is larger (the camera says 100 where nothing is)."""


IDS: Final = (-5, 2**31 - 1)
"""Least and most of instance ids: see `internav_data.render.camera`."""


def observation_space(size: int, *, ids: bool = False) -> spaces.Dict:
    """Return the space of one environment's observations, with instance ids where asked for."""
    if size < 1:
        raise UsageError(f"image_size: expected at least 1 pixel a side, got {size}")
    more = {"ids": spaces.Box(*IDS, (size, size), np.int32)} if ids else {}
    return spaces.Dict(
        {
            **more,
            "rgb": spaces.Box(0, 255, (size, size, 3), np.uint8),
            "depth": spaces.Box(0.0, FAR_M, (size, size, 1), np.float32),
            "goal": spaces.Box(
                np.array([0.0, -np.pi], np.float32), np.array([FAR_M, np.pi], np.float32)
            ),
            "held": spaces.Discrete(2),
            "horizon": spaces.Discrete(len(HORIZONS_DEG)),
        }
    )


def layout(count: int, size: int, *, ids: bool = False) -> dict[str, tuple[tuple[int, ...], Any]]:
    """Return shape and dtype of each buffer of a batch."""
    more = {"ids": ((count, size, size), np.int32)} if ids else {}
    return {
        **more,
        "rgb": ((count, size, size, 3), np.uint8),
        "depth": ((count, size, size, 1), np.float32),
        "goal": ((count, 2), np.float32),
        "held": ((count,), np.int64),
        "horizon": ((count,), np.int64),
    }


class ObservationBuffer:
    """Observations of a batch, written in place.

    Parameters
    ----------
    camera
        Draws the pictures.
    buffers : dict of arrays
        Shaped as `layout` says; shared memory will do.
    """

    def __init__(self, camera: Camera, buffers: dict[str, NDArray[Any]]) -> None:
        self.buffers = buffers
        self._camera = camera
        count, size = len(buffers["rgb"]), camera.size
        depth = buffers["depth"].reshape(count, size, size)
        ids = buffers.get("ids", np.zeros((count, size, size), np.int32))
        self._frames = Frames(buffers["rgb"], depth, ids)

    @staticmethod
    def of(camera: Camera, count: int, *, ids: bool = False) -> ObservationBuffer:
        """Make a board in ordinary memory."""
        sizes = layout(count, camera.size, ids=ids)
        return ObservationBuffer(
            camera, {name: np.zeros(*described) for name, described in sizes.items()}
        )

    def write(self, row: int, run: EpisodeRun) -> None:
        """Write what a world's agent sees; nothing is drawn where it sees what it saw before."""
        world, buffers = run.world, self.buffers
        if run.stale:
            own = slice(row, row + 1)
            rgb, depth, ids = self._frames
            there = Frames(rgb[own], depth[own], ids[own])
            self._camera.render([run.view()], there)
            buffers["held"][row] = world.held >= 0
            buffers["horizon"][row] = HORIZONS_DEG.index(world.horizon_deg)
            buffers["goal"][row] = run.point_goal()
            run.stale = False

    def copied(self) -> dict[str, NDArray[Any]]:
        """Return observations that nobody will write into."""
        return {name: buffer.copy() for name, buffer in self.buffers.items()}

    def one(self) -> dict[str, Any]:
        """Return the first row as one environment's observation."""
        buffers = self.buffers
        more = {"ids": buffers["ids"][0].copy()} if "ids" in buffers else {}
        return {
            **more,
            "rgb": buffers["rgb"][0].copy(),
            "depth": buffers["depth"][0].copy(),
            "goal": buffers["goal"][0].copy(),
            "held": np.int64(buffers["held"][0]),
            "horizon": np.int64(buffers["horizon"][0]),
        }
