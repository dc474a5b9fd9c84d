"""A house in MuJoCo, built by the validator's own code from the polyhedra that are stored.

It shares nothing with `internav_data.physics`. Numbers that are part of the dataset's physics are
stated again. A model cannot be added to once it is compiled: each arrangement of objects has its
own, of which MuJoCo remembers the meshes. All parts are hulls there, boxes among them.

The house stands, but for what is wrong in it. So friction is always solved together with the normal
forces, by contacts that are stiff enough, and nothing sleeps: what creeps is to be seen.
"""

from __future__ import annotations

import math
from contextlib import contextmanager
from functools import cache, lru_cache
from hashlib import sha256
from importlib import import_module
from itertools import combinations, product
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np

from internav_data.verification.replay.standing import SOLID, obj_of, turned_deg
from internav_data.verification.shapes import rotate

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from types import ModuleType

    from internav_data.core.typing import Floats
    from internav_data.records import House, Quaternion
    from internav_data.verification.replay.standing import Standing
    from internav_data.verification.shapes import Shapes, Solid

    Description: TypeAlias = Any  # MuJoCo does not describe its types
    DescribedBody: TypeAlias = Any
    CompiledHouse: TypeAlias = Any
    MotionState: TypeAlias = Any

STEP_S: Final = 1.0 / 480.0
GRAVITY: Final = 9.81
ROLLING_FRICTION: Final = 0.01
"""Torque that resists turning: this, metres, times (1 + friction) times an object's weight."""
THICKNESS_M: Final = 0.00101
"""Distance at which two objects touch, metres: objects on the floor are stored so high above it."""
STIFFNESS: Final = (0.005, 1.0)
"""Time constant, seconds, and damping ratio of contacts."""
FRICTION_IMPEDANCE: Final = 10.0
"""Impedance of friction by that of normal forces: with 1 what leans creeps."""
MEMORY_BYTES: Final = 64 << 20
"""Memory for the contacts of a house; pages that are not touched cost nothing."""
NEAR_M: Final = 0.02
"""Distance of the boxes around two objects within which their parts are paired, metres. What comes
from farther has moved by more than may be."""


@cache
def _mujoco() -> ModuleType:
    return import_module("mujoco")


@contextmanager
def _unlogged() -> Iterator[None]:
    """Keep MuJoCo from writing a file of warnings: what becomes unstable ends far away."""
    before = _mujoco().get_mju_user_warning()
    _mujoco().set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        _mujoco().set_mju_user_warning(before)


class MujocoHouse:
    """Floor and walls of a house, and objects that are put there and taken away again."""

    def __init__(self, house: House, shapes: Shapes) -> None:
        self._house, self._shapes = house, shapes
        self._objects: list[Standing] = []
        self._compiled: tuple[CompiledHouse, MotionState] | None = None

    def put(self, objects: Sequence[Standing]) -> None:
        """Put objects where they stand, after those that are there."""
        self._objects += objects
        self._compiled = None

    def remove(self, count: int) -> None:
        """Take the last objects away."""
        del self._objects[len(self._objects) - count :]
        self._compiled = None

    @_unlogged()
    def contacts(self) -> list[tuple[Standing, str, float]]:
        """Return contacts now: an object that can move, the other's name, the depth in metres."""
        model, data = self._at_start()
        deepest: dict[tuple[int, int], float] = {}
        owners = [_owner(model.geom(k).name) for k in range(model.ngeom)]
        for contact in data.contact:
            pair = [owners[geom] for geom in contact.geom.tolist()]
            # One that can move goes first: the floor, walls and other fixed ones last.
            pair.sort(key=lambda k: (k < 0 or not self._objects[k].moves, k))
            one, other = pair
            depth = max(0.0, THICKNESS_M - float(contact.dist))
            deepest[one, other] = max(deepest.get((one, other), 0.0), depth)
        return [
            (self._objects[one], self._objects[other].name if other >= 0 else SOLID, depth)
            for (one, other), depth in deepest.items()
        ]

    @_unlogged()
    def drifts(self, seconds: float) -> list[tuple[Standing, float, float]]:
        """Let time pass; return how far each object that can move went, metres and degrees."""
        model, data = self._at_start()
        movers = {k: model.body(str(k)).id for k, one in enumerate(self._objects) if one.moves}
        before = {k: (data.xipos[row].copy(), data.xquat[row].copy()) for k, row in movers.items()}
        _mujoco().mj_step(model, data, round(seconds / STEP_S))
        _mujoco().mj_kinematics(model, data)
        return [
            (
                self._objects[k],
                math.dist(before[k][0], data.xipos[row]),
                turned_deg(before[k][1], data.xquat[row]),
            )
            for k, row in movers.items()
        ]

    def _at_start(self) -> tuple[CompiledHouse, MotionState]:
        """Return the model and its data, with all objects where they were put."""
        mujoco = _mujoco()
        if self._compiled is None:
            model = self._spec().compile()
            for k, one in enumerate(self._objects):
                if one.moves:
                    first = int(model.body_dofadr[model.body(str(k)).id])
                    torque = ROLLING_FRICTION * (1.0 + one.friction) * one.mass_kg * GRAVITY
                    model.dof_frictionloss[first + 3 : first + 6] = torque
            self._compiled = model, mujoco.MjData(model)
        model, data = self._compiled
        mujoco.mj_resetData(model, data)
        mujoco.mj_forward(model, data)
        return model, data

    def _spec(self) -> Description:
        """Return the description of the house with its objects as they stand."""
        mujoco = _mujoco()
        spec = mujoco.MjSpec()
        spec.compiler.usethread = 0
        spec.memory = MEMORY_BYTES
        option = spec.option
        option.timestep, option.gravity = STEP_S, (0.0, 0.0, -GRAVITY)
        option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        option.impratio = FRICTION_IMPEDANCE
        # What is unstable has to end far away, not to begin anew.
        option.disableflags = mujoco.mjtDisableBit.mjDSBL_AUTORESET
        _add_shape(spec.worldbody, type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 1.0))
        for w in self._house.walls:
            low, high = np.array((w.x_min, w.y_min, w.z_min)), np.array((w.x_max, w.y_max, w.z_max))
            half, middle = (high - low) / 2.0, (high + low) / 2.0
            _add_shape(
                spec.worldbody, type=mujoco.mjtGeom.mjGEOM_BOX, pos=middle.tolist(), size=half
            )
        files: dict[str, bytes] = {}
        for number, one in enumerate(self._objects):
            self._add(spec, number, one, files)
        spec.assets = files
        self._add_pairs(spec)
        return spec

    def _add(self, spec: Description, number: int, one: Standing, files: dict[str, bytes]) -> None:
        """Add an object: a body if it can move, parts of the world if not."""
        pose, body = one.pose, spec.worldbody
        at: dict[str, object] = {"pos": (pose.x, pose.y, pose.z), "quat": _wxyz(pose.quaternion)}
        if one.moves:
            body = spec.worldbody.add_body(name=str(number), **at)
            at = {}
            body.add_freejoint()
            body.explicitinertial = True
            body.mass = one.mass_kg
            body.ipos = self._shapes.centre_of_mass(one.asset_id)
            body.inertia = _inertia(self._shapes, one)
        for part, solid in enumerate(self._shapes.solids(one.asset_id)):
            mesh, text = _mesh_of(solid)
            if mesh not in files:
                files[mesh] = text
                convex = _mujoco().mjtMeshInertia.mjMESH_INERTIA_CONVEX
                spec.add_mesh(name=mesh, file=mesh, inertia=convex)
            _add_shape(
                body,
                name=f"{number} {part}",
                type=_mujoco().mjtGeom.mjGEOM_MESH,
                meshname=mesh,
                conaffinity=int(one.moves),
                friction=(one.friction if one.moves else 0.0, 0.0, 0.0),
                **at,
            )

    def _add_pairs(self, spec: Description) -> None:
        """Add a pair for parts of two objects that are close: their frictions are multiplied."""
        parts = [self._boxes(one) for one in self._objects]
        hulls = [(low.min(axis=0), high.max(axis=0)) for low, high in parts]
        for one, other in combinations(range(len(self._objects)), 2):
            first, second = self._objects[one], self._objects[other]
            if not (first.moves or second.moves) or not _close(hulls[one], hulls[other]):
                continue
            for here, there in product(range(len(parts[one][0])), range(len(parts[other][0]))):
                a, b = ((parts[k][0][p], parts[k][1][p]) for k, p in ((one, here), (other, there)))
                if _close(a, b):
                    rub = first.friction * second.friction
                    spec.add_pair(
                        geomname1=f"{one} {here}",
                        geomname2=f"{other} {there}",
                        condim=3,
                        margin=THICKNESS_M,
                        solref=STIFFNESS,
                        friction=(rub, rub, 0.0, 0.0, 0.0),
                    )

    def _boxes(self, one: Standing) -> tuple[Floats, Floats]:
        """Return the lowest and highest corners, (n, 3) each, of boxes around an object's parts."""
        at = (one.pose.x, one.pose.y, one.pose.z)
        placed = [
            rotate(solid.corners, one.pose.quaternion) + at
            for solid in self._shapes.solids(one.asset_id)
        ]
        low = np.array([corners.min(axis=0) for corners in placed])
        return low, np.array([corners.max(axis=0) for corners in placed])


@lru_cache(maxsize=4096)
def _mesh_of(solid: Solid) -> tuple[str, bytes]:
    """Return the name of a part's file, and its content."""
    text = obj_of([solid]).encode("ascii")
    return f"{sha256(text).hexdigest()}.obj", text


def _close(one: tuple[Floats, Floats], other: tuple[Floats, Floats]) -> bool:
    gap = np.maximum(one[0] - other[1], other[0] - one[1])
    return bool(gap.max() <= NEAR_M)


def _owner(name: str) -> int:
    """Return the number of the object whose part has a name; -1 for the floor and walls."""
    return int(name.split(maxsplit=1)[0]) if name else -1


def _add_shape(body: DescribedBody, **shape: object) -> None:
    """Add a shape to a body. Fixed ones meet those that can move, and no other fixed ones."""
    fixed = {"contype": 1, "conaffinity": 0, "friction": (0.0, 0.0, 0.0)}
    # A contact has the margins of both.
    body.add_geom(condim=3, margin=THICKNESS_M / 2.0, solref=STIFFNESS, **(fixed | shape))


def _inertia(shapes: Shapes, one: Standing) -> Floats:
    """Return the moments of inertia, kg m², of a solid box around an object."""
    corners = np.vstack([solid.corners for solid in shapes.solids(one.asset_id)])
    squares = np.square(np.ptp(corners, axis=0))
    return np.asarray(one.mass_kg / 12.0 * (squares.sum() - squares), dtype=np.float64)


def _wxyz(quaternion: Quaternion) -> Quaternion:
    x, y, z, w = quaternion
    return w, x, y, z
