"""Pictures of a house: colour, depth and instance ids, by a rasteriser on the processor.

A `StaticScene` is made once for each house, `Props` hold the poses of its objects and of an
episode's obstacles, a `CameraView` adds the pose of a camera, and a `Camera` draws any number of
views. A picture depends on its own view alone: not on the batch, on earlier pictures, or on the
process.

Instance ids (int32):

====== ==========================================================
0      nothing (never inside a closed house)
-1     floor
-2     ceiling
-3     wall: walls, lintels, breasts and the casings painted on them
-4     leaf of a closed door
-5     window
1 + k  instance k of the props: house.objects[k], then the obstacles
====== ==========================================================
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from internav_data.core.locks import ThreadLock
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
    """Pictures of n views, h = w = the camera's size."""

    rgb: NDArray[np.uint8]
    """Colours 0 to 255, (n, h, w, 3) uint8."""
    depth: NDArray[np.float32]
    """Distances (m) along the optical axis, (n, h, w) float32; 100 where there is nothing."""
    ids: NDArray[np.int32]
    """Instance ids, (n, h, w) int32: see the module's table."""


@dataclass(frozen=True, slots=True)
class StaticScene:
    """House as the camera draws it: made once, shared by all views of it."""

    house: House
    """House whose objects `props` places."""
    structure: Structure
    """Floors, ceilings, walls, doors and windows."""

    @classmethod
    def of(cls, house: House) -> Self:
        """Build the scene of a house; takes a few milliseconds."""
        return cls(house, structure_of(house))

    def props(self, obstacles: Iterable[tuple[Asset, Pose]] = ()) -> Props:
        """Return the house's objects where they stand, then the obstacles."""
        assets = self.house.assets
        objects = [(assets[o.asset_id], o.pose) for o in self.house.objects]
        return Props([*objects, *obstacles])


class Props:
    """Poses of all objects and obstacles in a house; cheap to change between pictures.

    Instance k is house.objects[k], or obstacle k - len(house.objects). Its id is 1 + k.

    Attributes
    ----------
    models : (n,) int64
        Number of each instance's model in the library.
    poses : (n, 12) float64
        Rotation matrix by rows, then position, metres.
    present : (n,) uint8
        1 for instances that are drawn, 0 for hidden ones.
    faces : int
        Number of faces of all models: the most that a picture can show.
    """

    def __init__(self, instances: Sequence[tuple[Asset, Pose]]) -> None:
        self.models = np.array([LIBRARY.number(a) for a, _ in instances], np.int64)
        self.poses = np.zeros((len(instances), 12))
        self.present = np.ones(len(instances), np.uint8)
        self.faces: int = sum(LIBRARY.faces(m) for m in self.models.tolist())
        for k, (_, pose) in enumerate(instances):
            self.move(k, pose)

    def __len__(self) -> int:
        return len(self.models)

    def move(self, instance: int, pose: Pose) -> None:
        """Set the pose of an instance."""
        self.poses[instance, :9] = rotation_matrix(pose.quaternion).ravel()
        self.poses[instance, 9:] = (pose.x, pose.y, pose.z)

    def hide(self, instance: int) -> None:
        """Leave an instance out of the pictures, as an object in the agent's hand."""
        self.present[instance] = 0

    def show(self, instance: int) -> None:
        """Draw a hidden instance again."""
        self.present[instance] = 1

    def copy(self) -> Props:
        """Return a copy with poses of its own; the models are shared."""
        other = Props.__new__(Props)
        other.models, other.faces = self.models, self.faces
        other.poses, other.present = self.poses.copy(), self.present.copy()
        return other


@dataclass(frozen=True, slots=True)
class CameraView:
    """Scene, poses of its objects and pose of the camera: all that one picture depends on."""

    scene: StaticScene
    """House to draw."""
    props: Props
    """Poses of its objects and obstacles."""
    x: float
    """Position, metres."""
    y: float
    """Position, metres."""
    yaw_deg: float
    """Heading: 0 looks along +x, counter-clockwise."""
    horizon_deg: float
    """Angle below the horizon; the agent's are -30 to 60."""
    z: float = AGENT.camera_height_m
    """Height above the floor, metres."""


class Camera:
    """Camera that draws square pictures of field of view 90 degrees; threads take turns.

    Parameters
    ----------
    size
        Pixels a side.
    portals
        Whether rooms that no open door shows are skipped; the pictures are the same either way.

    Raises
    ------
    UsageError
        The size is below 1.
    """

    def __init__(self, size: int, *, portals: bool = True) -> None:
        if size < 1:
            raise UsageError(
                f"a camera's size is its pixels a side: expected at least 1, got {size}"
            )
        self.size = size
        self._portals = portals
        self._scratch: Scratch | None = None
        self._lock = ThreadLock()

    def frames(self, count: int) -> Frames:
        """Return buffers for `count` pictures, to be passed to `render`."""
        shape = (count, self.size, self.size)
        return Frames(
            np.zeros((*shape, 3), np.uint8), np.zeros(shape, np.float32), np.zeros(shape, np.int32)
        )

    def render(self, views: Sequence[CameraView], out: Frames | None = None) -> Frames:
        """Draw views into `out` (its first len(views) pictures) or into new arrays; return them.

        Raises
        ------
        UsageError
            `out` holds fewer pictures than there are views, or pictures of another size.
        """
        target = self.frames(len(views)) if out is None else out
        shape = (self.size, self.size)
        if len(target.rgb) < len(views) or target.ids.shape[1:] != shape:
            raise UsageError(
                f"buffers for {len(views)} pictures of {self.size} pixels a side expected, "
                f"got rgb of shape {target.rgb.shape}: make them with Camera.frames"
            )
        # The kernels run while other threads do: two of them must not draw into one scratch.
        with self._lock:
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
        structure, props, library = view.scene.structure, view.props, LIBRARY.mesh
        scratch = self._buffers(structure, props)
        eye = np.array((view.x, view.y, view.z))
        axes = camera_axes(view.yaw_deg, view.horizon_deg)
        drawn: int = picture(
            structure.mesh, structure.rooms, library, props.models, props.poses, props.present,
            axes, eye, self._portals, scratch, rgb, depth, ids,
        )  # fmt: skip
        return drawn

    def _buffers(self, structure: Structure, props: Props) -> Scratch:
        """Return buffers large enough for a scene; they only ever grow.

        A picture shows at most the faces of all props and of the house. The room to spare (factor
        2) keeps a camera that serves many houses from growing its buffers at each.
        """
        faces = props.faces + len(structure.mesh.planes)
        vertices, corners = LIBRARY.max_vertices, LIBRARY.max_corners + 2
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
    """Return the camera's right, down and forward as rows (3, 3) float64, in the house's frame."""
    yaw, pitch = math.radians(yaw_deg), math.radians(horizon_deg)
    c, s = math.cos(yaw), math.sin(yaw)
    if yaw_deg % 90.0 == 0.0:
        # Quarter turns look exactly along an axis, not 6e-17 beside it.
        c, s = float(round(c)), float(round(s))
    level, down = math.cos(pitch), math.sin(pitch)
    axes = np.array([[s, -c, 0.0], [-c * down, -s * down, -level], [c * level, s * level, -down]])
    # Cached: all callers share the array.
    axes.flags.writeable = False
    return axes
