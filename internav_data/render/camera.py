"""What the agent sees: colour, depth and instance ids, by a rasteriser on the processor.

A `StaticScene` is made once for each house, `Props` say where its things and an episode's obstacles
are now, a `CameraView` adds an eye, and a `Camera` draws any number of views at once. A picture
depends on its own view alone: not on the batch, on what was drawn before, or on the process.

Instance ids (int32):

====== ==========================================================
0      nothing (never inside a closed house)
-1     floor
-2     ceiling
-3     wall: walls, lintels, breasts and the casings painted on them
-4     leaf of a closed door
-5     window
1 + k  instance k of the props: thing k of the house for k < len(house.objects), then the obstacles
====== ==========================================================
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from internav_data.geometry import rotation_matrix
from internav_data.records.agent import AGENT
from internav_data.records.errors import UsageError
from internav_data.render.asset_mesh import LIBRARY
from internav_data.render.frame import Scratch, picture
from internav_data.render.house_mesh import Structure, structure_of
from internav_data.render.shading import RECORD

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from internav_data.core.typing import Floats
    from internav_data.records import Asset, House, Pose


class Frames(NamedTuple):
    """Pictures of some views."""

    rgb: NDArray[np.uint8]
    """(n, h, w, 3)"""
    depth: NDArray[np.float32]
    """(n, h, w): metres along the optical axis; 100 where there is nothing."""
    ids: NDArray[np.int32]
    """(n, h, w): see the module's table."""


@dataclass(frozen=True, slots=True)
class StaticScene:
    """What never moves in a house: made once, shared by all views of it."""

    house: House
    structure: Structure

    @classmethod
    def of(cls, house: House) -> Self:
        """Cut a house's surfaces into rectangles: a few milliseconds."""
        return cls(house, structure_of(house))

    def props(self, obstacles: Iterable[tuple[Asset, Pose]] = ()) -> Props:
        """Return the house's things where they stand, then some obstacles."""
        assets = self.house.assets
        things = [(assets[t.asset_id], t.pose) for t in self.house.objects]
        return Props([*things, *obstacles])


class Props:
    """Where everything that stands in a house is now; cheap to change between pictures.

    Instance k is thing k of the house, or obstacle k - len(house.objects). Its id is 1 + k. The
    arrays `models` (n,), `poses` (n, 12) and `present` (n,) are what the kernels read.
    """

    def __init__(self, instances: Sequence[tuple[Asset, Pose]]) -> None:
        self.models = np.array([LIBRARY.number(a) for a, _ in instances], np.int64)
        self.poses = np.zeros((len(instances), 12))
        self.present = np.ones(len(instances), np.uint8)
        self.faces: int = sum(LIBRARY.faces(m) for m in self.models.tolist())
        """How many faces may have to be drawn."""
        for k, (_, pose) in enumerate(instances):
            self.move(k, pose)

    def __len__(self) -> int:
        return len(self.models)

    def move(self, instance: int, pose: Pose) -> None:
        """Put an instance somewhere else."""
        self.poses[instance, :9] = rotation_matrix(pose.quaternion).ravel()
        self.poses[instance, 9:] = (pose.x, pose.y, pose.z)

    def hide(self, instance: int) -> None:
        """Take an instance out of the pictures: it is held."""
        self.present[instance] = 0

    def show(self, instance: int) -> None:
        """Let a hidden instance be seen again."""
        self.present[instance] = 1

    def copy(self) -> Props:
        """Return a copy that may be changed on its own."""
        other = Props.__new__(Props)
        other.models, other.faces = self.models, self.faces
        other.poses, other.present = self.poses.copy(), self.present.copy()
        return other


@dataclass(frozen=True, slots=True)
class CameraView:
    """An eye in a house."""

    scenery: StaticScene
    props: Props
    x: float
    y: float
    """Position, metres."""
    yaw_deg: float
    """0 looks along +x, counter-clockwise."""
    horizon_deg: float
    """How far down the camera looks: the agent's -30 to 60."""
    z: float = AGENT.camera_height_m
    """Height, metres."""


class Camera:
    """Draws square pictures of field of view 90 degrees, one thread at a time.

    Parameters
    ----------
    size
        Pixels a side.
    portals
        Leave out rooms that no door shows; the pictures are the same without.

    """

    def __init__(self, size: int, *, portals: bool = True) -> None:
        if size < 1:
            raise UsageError(
                f"a camera's size is its pixels a side: expected at least 1, got {size}"
            )
        self.size = size
        self._portals = portals
        self._scratch: Scratch | None = None

    def frames(self, count: int) -> Frames:
        """Return buffers for some pictures, to be given to `render`."""
        shape = (count, self.size, self.size)
        return Frames(
            np.zeros((*shape, 3), np.uint8), np.zeros(shape, np.float32), np.zeros(shape, np.int32)
        )

    def render(self, views: Sequence[CameraView], out: Frames | None = None) -> Frames:
        """Draw views into `out` (its first len(views) pictures) or into new arrays."""
        target = self.frames(len(views)) if out is None else out
        shape = (self.size, self.size)
        if len(target.rgb) < len(views) or target.ids.shape[1:] != shape:
            raise UsageError(
                f"buffers for {len(views)} pictures of {self.size} pixels a side expected, "
                f"got rgb of shape {target.rgb.shape}: make them with Camera.frames"
            )
        for k, view in enumerate(views):
            self._draw(view, target.rgb[k], target.depth[k], target.ids[k])
        return target

    def _draw(
        self,
        view: CameraView,
        rgb: NDArray[np.uint8],
        depth: NDArray[np.float32],
        ids: NDArray[np.int32],
    ) -> int:
        structure, props, library = view.scenery.structure, view.props, LIBRARY.mesh
        scratch = self._buffers(structure, props)
        eye = np.array((view.x, view.y, view.z))
        axes = camera_axes(view.yaw_deg, view.horizon_deg)
        drawn: int = picture(
            structure.mesh, structure.rooms, library, props.models, props.poses, props.present,
            axes, eye, self._portals, scratch, rgb, depth, ids,
        )  # fmt: skip
        return drawn

    def _buffers(self, structure: Structure, props: Props) -> Scratch:
        """Return buffers large enough for a scene; they only ever grow."""
        faces = props.faces + len(structure.mesh.planes)
        vertices, corners = LIBRARY.most_vertices, LIBRARY.most_corners + 2
        old = self._scratch
        if (
            old is not None
            and len(old.drawn) >= faces
            and len(old.frames) > len(props)
            and len(old.points) >= vertices
            and old.outline.shape[1] >= corners
        ):
            return old
        size = self.size
        most, frames = 2 * faces, 2 * len(props) + 1
        self._scratch = Scratch(
            np.empty((size, size), np.float32),
            np.empty((size, size), np.int32),
            np.empty((most, 2), np.int32),
            np.empty(most, np.uint8),
            np.empty((most, RECORD), np.float32),
            np.empty((frames, 15)),
            np.empty((vertices, 5)),
            np.empty((2, corners)),
            np.empty((2, size), np.int32),
            np.empty(frames, np.int32),
            np.empty((size, size), np.float32),
        )
        return self._scratch


@lru_cache(maxsize=256)
def camera_axes(yaw_deg: float, horizon_deg: float) -> Floats:
    """Right, down and forward of a camera as rows (3, 3), the house's frame."""
    yaw, pitch = math.radians(yaw_deg), math.radians(horizon_deg)
    c, s = math.cos(yaw), math.sin(yaw)
    if yaw_deg % 90.0 == 0.0:
        # Quarter turns look exactly along an axis.
        c, s = float(round(c)), float(round(s))
    level, down = math.cos(pitch), math.sin(pitch)
    axes = np.array([[s, -c, 0.0], [-c * down, -s * down, -level], [c * level, s * level, -down]])
    # Shared by all who ask again.
    axes.flags.writeable = False
    return axes
