"""Scenes in MuJoCo: models compiled once for the shapes of a scene, filled with numbers each time.

Masses, frictions, poses and the sizes of walls are numbers that are written into a compiled model.
Compiling takes 2 ms and more, filling 0.1 ms. Parts that are no boxes are files in memory: MuJoCo
keeps what it makes of a mesh by the name and content of its file, which halves the compilation of a
model with known meshes.

A body's frame is at its centre of mass, so that MuJoCo's positions and velocities are those of the
protocol. Contacts have a margin of 1 mm, the thickness that Bullet adds to hulls: bodies rest as
high above the floor on either engine, and stored heights mean the same.

MuJoCo takes the larger friction of two bodies; here their product counts. The floor, the agent and
walls, whose coefficient is 1, have 0 in the model, so that the other body's own coefficient acts.
All other contacts are explicit pairs of parts that bring the product.
"""

from __future__ import annotations

import ctypes
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache, lru_cache
from hashlib import sha256
from importlib import import_module
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np

from internav_data.core.extras import missing
from internav_data.core.lru import LRUCache
from internav_data.geometry import (
    asset_corners,
    centre_of_mass,
    multiply,
    part_corners,
    rotation_matrix,
)
from internav_data.physics.scene import AGENT_HEIGHT_M, AGENT_LOW_M
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import ModuleType

    from numpy.typing import NDArray

    from internav_data.physics.scene import AgentCollider, Body, PhysicsScene
    from internav_data.records import Asset, Part, Quaternion, Vec3

    MjSpec: TypeAlias = Any  # MuJoCo does not describe its types
    MjsBody: TypeAlias = Any
    MjtGeom: TypeAlias = Any
    MjModel: TypeAlias = Any
    MjData: TypeAlias = Any
    ModelKey = tuple[tuple[tuple[Asset | None, bool], ...], bool]
    """Asset of each body (None for a wall) and whether it moves; whether the agent takes part."""


def _imported() -> ModuleType:
    try:
        return import_module("mujoco")
    except ModuleNotFoundError as error:
        raise missing(error.name) from error


mujoco: Any = _imported()

STEP_S: Final = 1.0 / 240.0
"""Time step of all data, seconds."""
SUBSTEPS: Final = 2
"""Number of MuJoCo's own steps in a time step. With one, things topple that stay upright in finer
steps of either engine: 66 of 181, with two 64, with four 62; Bullet's are 61 at 240 and 960 Hz."""
GRAVITY: Final = 9.81
"""Acceleration of gravity, m/s²."""
MARGIN_M: Final = 0.00101
"""Distance at which two bodies touch, metres. Settled bodies are stored 1 mm above the floor: the
hundredth more lets a contact bear them from the first step, or what is pushed would start to slide
while it falls."""
INERTIA_MARGIN_M: Final = 0.002
"""Distance by which the solid box whose inertia a body has exceeds its bounding box at each side,
metres. Bullet takes the same box: twice the margin of its hulls."""
ROLLING_FRICTION: Final = 0.01
"""Rolling and spinning friction of a body, metres. On the floor each has its own times the other's
coefficient of friction, as in Bullet: here as a torque that resists all turning."""
CONTACT_STEPS: Final = 2.0
"""Time constant of contacts, steps of MuJoCo: the shortest that is stable. They are damped
critically. At MuJoCo's default of 20 ms what hits a wall at 2 m/s sinks in by 15 mm."""
IMPEDANCE: Final = (0.95, 0.99, 0.001, 0.5, 2.0)
"""MuJoCo's `solimp` of contacts."""
FAST: Final = 0.05
"""Speed of any body, m/s or rad/s, that it has or a force gives it in the next step, from which
friction is solved after the normal forces and not with them (`set_friction_solver`). Without the
next step, what a push takes off the floor in its first step topples: 70 of 181, not 66."""
FRICTION_IMPEDANCE: Final = {True: 1e-4, False: 10.0}
"""Impedance of friction by that of normal forces where something is fast, and where nothing is."""
NO_SLIP_ITERATIONS: Final = {True: 2, False: 0}
"""Iterations of the second solver, which finds friction by given normal forces. After five the ends
of pushes are no closer to Bullet's, and a step of several bodies takes half as long again."""
CONTACT_DIMENSIONS: Final = 3
"""Contacts resist slipping. Contacts that resist rolling too took four times as long to solve: that
is a torque of each body here, for all its weight."""
ARENA_BYTES: Final = 64 << 20
"""Memory for the contacts of a scene. Most take up to 0.15 MB, a chair pushed among others some 16
MB; pages that are not touched cost nothing."""
MODELS: Final = 64
"""Number of compiled models that are kept, 0.7 MB each."""
_DISABLED: Final = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
"""What MuJoCo leaves out: a scene that becomes unstable must be noticed, not begin anew."""
_FLOOR_GEOMS: Final = 1
"""Number of the model's geoms before those of the agent and the bodies."""


@dataclass(frozen=True, slots=True, eq=False)
class CompiledScene:
    """Compiled shapes of a scene and the data of its motion. Bodies go by their index in it."""

    model: MjModel
    data: MjData
    rows: tuple[int, ...]
    """Row of each body among the model's bodies."""
    geoms: tuple[slice, ...]
    """Rows of each body's parts among the model's geoms."""
    pairs: NDArray[np.intp]
    """Two bodies of each explicit pair of parts, (n, 2)."""
    movers: dict[int, int]
    """Number of each body that moves, in their order."""


@dataclass(slots=True, eq=False)
class ModelBuilder:
    """Builder of scenes; it keeps compiled models by the shapes of their bodies."""

    step_s: float = STEP_S
    """Time step, seconds."""
    models: LRUCache[ModelKey, CompiledScene] = field(default_factory=lambda: LRUCache(MODELS))

    def build(self, scene: PhysicsScene) -> CompiledScene:
        """Return a model with all numbers of a scene written into it, all at rest.

        The next scene of the same shapes takes the same model.

        Raises
        ------
        UsageError
            MuJoCo refuses a shape.

        """
        bodies = tuple(
            (None if _is_wall(body) else body.asset, body.moves) for body in scene.bodies
        )
        with warnings_unlogged():
            made = self.models.get(
                (bodies, scene.agent is not None), lambda: _compiled(scene, self.step_s)
            )
            _fill(made, scene)
        return made


def _clock() -> ctypes.c_void_p | None:
    """Return the pointer to MuJoCo's clock, `mjcb_time` of its interface; None where it is not."""
    for name in ("libmujoco*.so*", "libmujoco*.dylib", "mujoco.dll"):
        for file in Path(mujoco.__file__).parent.glob(name):
            with suppress(OSError, ValueError):
                return ctypes.c_void_p.in_dll(ctypes.CDLL(str(file)), "mjcb_time")
    return None


CLOCK: Final = _clock()


@contextmanager
def untimed() -> Iterator[None]:
    """Keep MuJoCo from looking at the clock 30 times a step, which takes a twentieth of it."""
    before = CLOCK.value if CLOCK is not None else None
    if CLOCK is not None:
        CLOCK.value = None
    try:
        yield
    finally:
        if CLOCK is not None:
            CLOCK.value = before


@contextmanager
def warnings_unlogged() -> Iterator[None]:
    """Keep MuJoCo from writing its warnings to a file MUJOCO_LOG.TXT in the working folder.

    Those of a motion are counted with its data, too; those of building say that things which touch
    do not sleep. The handler is the process's: MuJoCo is silent in other threads, too, meanwhile.
    """
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _is_wall(body: Body) -> bool:
    """Return whether a body is a fixed box of friction 1, of which only numbers differ."""
    parts = body.asset.parts
    single = len(parts) == 1 and parts[0].shape == "box"
    return single and not body.moves and body.dynamics.friction == 1.0


def _compiled(scene: PhysicsScene, step_s: float) -> CompiledScene:
    spec = _template().copy()
    spec.memory = ARENA_BYTES
    first = _FLOOR_GEOMS
    if scene.agent is not None:
        _add_geom(spec.worldbody.add_body(), "", mujoco.mjtGeom.mjGEOM_CYLINDER, size=(1, 1, 0))
        first += 1
    rows: list[MjsBody] = []
    geoms: list[slice] = []
    names: list[list[str]] = []
    meshes: dict[str, bytes] = {}
    for number, body in enumerate(scene.bodies):
        made = spec.worldbody.add_body(name=str(number))
        names.append(_add_parts(made, body, meshes))
        count = len(body.asset.parts)
        rows.append(made)
        geoms.append(slice(first, first + count))
        first += count
    for name in meshes:
        spec.add_mesh(name=name, file=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
    spec.assets = meshes
    pairs = np.array(list(_add_pairs(spec, scene, names)), dtype=np.intp).reshape(-1, 2)
    try:
        model = spec.compile()
    except ValueError as error:
        ids = ", ".join(dict.fromkeys(body.asset.asset_id for body in scene.bodies))
        reason = " ".join(str(error).split())
        raise UsageError(f"MuJoCo refuses a shape among {ids}: {reason}") from error
    model.opt.disableflags = _DISABLED
    model.opt.timestep = step_s / SUBSTEPS
    for stiffness in (model.geom_solref, model.pair_solref, model.dof_solref):
        stiffness[:] = (CONTACT_STEPS * step_s / SUBSTEPS, 1.0)
    moving = [k for k, body in enumerate(scene.bodies) if body.moves]
    if len(moving) == 1:
        # Nothing sleeps: the same motion without the search for what touches what.
        model.opt.enableflags = 0
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    model.tree_sleep_policy[:] = mujoco.mjtSleepPolicy.mjSLEEP_INIT
    model.tree_sleep_policy[:1] = mujoco.mjtSleepPolicy.mjSLEEP_NEVER  # what falls or is pushed
    return CompiledScene(
        model,
        mujoco.MjData(model),
        tuple(made.id for made in rows),
        tuple(geoms),
        pairs,
        {body: number for number, body in enumerate(moving)},
    )


@cache
def _template() -> MjSpec:
    """Return the specification of an empty scene: settings, defaults of shapes, and the floor."""
    spec = mujoco.MjSpec()
    spec.compiler.usethread = 0
    option = spec.option
    option.gravity = (0.0, 0.0, -GRAVITY)
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    # Asleep, a body that is not touched neither trembles nor costs time; a touch wakes it.
    option.enableflags = mujoco.mjtEnableBit.mjENBL_SLEEP
    # The compiler makes a step of its own, with all bodies at one place.
    option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT
    for shape in (spec.default.geom, spec.default.pair):
        shape.condim = CONTACT_DIMENSIONS
        shape.solimp = IMPEDANCE
    spec.default.geom.friction = (0.0, 0.0, 0.0)
    spec.default.geom.margin = MARGIN_M / 2.0  # a contact has the sum of both
    spec.default.pair.margin = MARGIN_M
    _add_geom(spec.worldbody, "", mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 1))
    return spec


def _add_geom(body: MjsBody, name: str, kind: MjtGeom, **shape: object) -> None:
    """Add a shape to a body: named ones meet in pairs, others meet all that moves."""
    body.add_geom(
        name=name,
        type=kind,
        contype=0 if name else 1,
        conaffinity=1 if name and body.joints else 0,
        **shape,
    )


def _add_parts(made: MjsBody, body: Body, meshes: dict[str, bytes]) -> list[str]:
    """Add the parts of a body to it, its frame at the centre of mass; return their names.

    Files of the parts that are no boxes join `meshes`, by their names.
    """
    if _is_wall(body):
        _add_geom(made, "", mujoco.mjtGeom.mjGEOM_BOX, size=(1, 1, 1))
        return []
    if body.moves:
        made.add_freejoint()
        made.explicitinertial = True
        made.mass = 1.0
        made.inertia = (1.0, 1.0, 1.0)
    shapes, files = _shapes(body.asset)
    meshes.update(files)
    names = [f"{made.name} {number}" for number in range(len(shapes))]
    for name, (kind, shape) in zip(names, shapes, strict=True):
        _add_geom(made, name, kind, **shape)
    return names


@lru_cache(maxsize=4096)
def _shapes(asset: Asset) -> tuple[list[tuple[MjtGeom, dict[str, Any]]], dict[str, bytes]]:
    """Return kind and form of each part, about the centre of mass, and the files of hulls."""
    middle = centre_of_mass(asset)
    shapes: list[tuple[MjtGeom, dict[str, Any]]] = []
    files: dict[str, bytes] = {}
    for part in asset.parts:
        form: dict[str, Any] = {"pos": [p - m for p, m in zip(part.centre, middle, strict=True)]}
        if part.shape == "box":
            form["quat"] = _wxyz(part.rotation)
            form["size"] = [extent / 2.0 for extent in part.size]
            shapes.append((mujoco.mjtGeom.mjGEOM_BOX, form))
        else:
            name, text = _mesh_file(part)
            form["meshname"], files[name] = name, text
            shapes.append((mujoco.mjtGeom.mjGEOM_MESH, form))
    return shapes, files


def _mesh_file(part: Part) -> tuple[str, bytes]:
    """Return a part about its centre as a Wavefront OBJ file, and the file's name."""
    corners = (part_corners(part) - np.array(part.centre)).tolist()
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners]
    # The triangles only name the corners: MuJoCo makes the hull.
    lines += [f"f 1 {k} {k + 1}" for k in range(2, len(corners))]
    text = "\n".join(lines).encode("ascii")
    return f"{sha256(text).hexdigest()}.obj", text


def _add_pairs(
    spec: MjSpec, scene: PhysicsScene, names: list[list[str]]
) -> Iterator[tuple[int, int]]:
    """Add the pairs of parts that may touch, for each two bodies of which one moves."""
    for first, second in combinations(range(len(scene.bodies)), 2):
        if not (scene.bodies[first].moves or scene.bodies[second].moves):
            continue
        for here in names[first]:
            for there in names[second]:
                spec.add_pair(geomname1=here, geomname2=there)
                yield first, second


def _fill(made: CompiledScene, scene: PhysicsScene) -> None:
    """Write a scene's masses, frictions, sizes and poses into its model; all is at rest."""
    model, data = made.model, made.data
    if scene.agent is not None:
        _set_agent(model, scene.agent)
    for number, body in enumerate(scene.bodies):
        row, geoms = made.rows[number], made.geoms[number]
        if body.moves:
            _set_dynamics(model, row, made.movers[number], body)
            model.geom_friction[geoms, 0] = body.dynamics.friction
            at = 7 * made.movers[number]
            model.qpos0[at : at + 3], model.qpos0[at + 3 : at + 7] = _placement(body)
        elif _is_wall(body):
            _set_wall(model, row, geoms.start, body)
        else:
            model.body_pos[row], model.body_quat[row] = _placement(body)
    frictions = np.array([body.dynamics.friction for body in scene.bodies])
    model.pair_friction[:, :2] = frictions[made.pairs].prod(axis=1, keepdims=True)
    mujoco.mj_setConst(model, data)
    mujoco.mj_resetData(model, data)


def _set_dynamics(model: MjModel, row: int, mover: int, body: Body) -> None:
    mass_kg, friction = body.dynamics.mass_kg, body.dynamics.friction
    model.body_mass[row] = mass_kg
    model.body_inertia[row] = _inertia(body.asset, mass_kg)
    spin = slice(6 * mover + 3, 6 * mover + 6)
    model.dof_frictionloss[spin] = ROLLING_FRICTION * (1.0 + friction) * mass_kg * GRAVITY
    model.dof_solimp[spin] = IMPEDANCE


def set_friction_solver(model: MjModel, *, fast: bool) -> None:
    """Choose how friction is solved in the next steps: by whether something is fast (`FAST`).

    MuJoCo solves normal forces and friction as one convex problem. It is exact for what stands, but
    what slides is lifted by friction times its speed: at 1 m/s a crate hops 1 cm high, a chair
    turns. Friction of next to no impedance does not lift; a second solver then finds friction by
    the normal forces, as other engines do. Of what is pushed and stands that one lets parts slip.
    """
    model.opt.impratio = FRICTION_IMPEDANCE[fast]
    model.opt.noslip_iterations = NO_SLIP_ITERATIONS[fast]


def _set_agent(model: MjModel, agent: AgentCollider) -> None:
    radius, half = agent.radius_m, (AGENT_HEIGHT_M - AGENT_LOW_M) / 2.0
    model.body_pos[1] = (agent.x, agent.y, AGENT_LOW_M + half)
    model.geom_size[_FLOOR_GEOMS] = (radius, half, 0.0)
    _set_bounds(model, 1, _FLOOR_GEOMS, (radius, radius, half))


def _set_wall(model: MjModel, row: int, geom: int, body: Body) -> None:
    part, pose = body.asset.parts[0], body.pose
    half = [extent / 2.0 for extent in part.size]
    offset = rotation_matrix(pose.quaternion) @ np.array(part.centre)
    model.body_pos[row] = np.array((pose.x, pose.y, pose.z)) + offset
    model.body_quat[row] = _wxyz(multiply(pose.quaternion, part.rotation))
    model.geom_size[geom] = half
    _set_bounds(model, row, geom, half)


def _set_bounds(model: MjModel, row: int, geom: int, half: list[float] | Vec3) -> None:
    """Write the half extents of a body's only shape where MuJoCo looks for what may touch."""
    model.geom_rbound[geom] = np.linalg.norm(half)
    model.geom_aabb[geom, 3:] = half
    model.bvh_aabb[model.body_bvhadr[row], 3:] = half


def _placement(body: Body) -> tuple[Vec3, Quaternion]:
    """Return a body's centre of mass, metres, and its orientation as w, x, y, z."""
    pose = body.pose
    x, y, z = (rotation_matrix(pose.quaternion) @ np.array(centre_of_mass(body.asset))).tolist()
    return (pose.x + x, pose.y + y, pose.z + z), _wxyz(pose.quaternion)


@lru_cache(maxsize=4096)
def _squares(asset: Asset) -> tuple[float, float, float]:
    """Return the squares of the sides of the box whose inertia an asset has, m²."""
    corners, _ = asset_corners(asset)
    sides = corners.max(axis=0) - corners.min(axis=0) + 2.0 * INERTIA_MARGIN_M
    x, y, z = (sides**2).tolist()
    return x, y, z


def _inertia(asset: Asset, mass_kg: float) -> Vec3:
    """Return the moments of inertia about the centre of mass, kg m²: those of a solid box."""
    x, y, z = _squares(asset)
    part = mass_kg / 12.0
    return part * (y + z), part * (x + z), part * (x + y)


def _wxyz(quaternion: Quaternion) -> Quaternion:
    x, y, z, w = quaternion
    return w, x, y, z
