"""Solver on a physics engine that looks solutions up, in memory and on disk, before it solves.

This module knows physics: which problems are equal, what a solution depends on besides, and how it
is packed into bytes. The file on disk that holds those bytes is `result_cache`, which knows none.

A problem is plain data and its solution depends on nothing else. Solutions recur: on free ground
an object settles and slides the same way in every house. Problems of one object are kept on disk.
Those of several recur within a process at most (generation asks none again, training with another
seed 3 to 7 %), and would be half of what is written.
"""

from __future__ import annotations

import ast
import hashlib
import math
import platform
import struct
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import metadata
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

from internav_data.core.arithmetic import plain_sum
from internav_data.core.hardware import hardware
from internav_data.core.lru import LRUCache
from internav_data.physics.scene import PhysicsScene, PushSolution, SettleSolution
from internav_data.physics.solving import RULES, solve_push, solve_settle
from internav_data.physics.sweep import PATH_POSE_BYTES
from internav_data.records import Pose

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from internav_data.physics.engines.protocol import Engine
    from internav_data.physics.result_cache import ResultCache
    from internav_data.records import Asset, PushSpec

S = TypeVar("S")

_PACKAGE: Final = "internav_data"
_SOLVERS: Final = ("internav_data.geometry", "internav_data.physics")
"""Packages that solutions come from. No cached solution is used once one of their files, or a file
that they import, has changed."""
_LIBRARIES: Final = ("numpy", "numba", "llvmlite")
"""Libraries behind the results of every engine, besides those that it names. The RECORD of an
installed library lists the digests of all its files."""
_SETTLE: Final = struct.Struct("<7d3d?")
"""Pose; seconds, penetration, reach; at rest."""
_PUSH: Final = struct.Struct("<d?H")
"""Seconds, at rest, number of moving bodies."""
_MOVER: Final = struct.Struct("<7d8dI")
"""Pose, sweep, length of the path in bytes; the paths follow after all of these."""


SAMPLE: Final = 1000
"""One of so many keys has its solution compared with a new one whenever it is read from disk."""
_LONE_BYTES: Final = 32 << 20
"""Memory for solutions of one object, about 6,000 pushes; the others are on disk."""
_CROWDED_BYTES: Final = 32 << 20
"""Memory for solutions of several objects, about 3,000 pushes, in each process."""
_OBJECT_BYTES: Final = 2048
"""Memory of a solution and its key besides the paths, for a body that moves."""


def _bytes_of(solution: SettleSolution | PushSolution) -> float:
    if isinstance(solution, SettleSolution):
        return _OBJECT_BYTES
    return _OBJECT_BYTES * len(solution.poses) + sum(map(len, solution.paths))


def _settles() -> LRUCache[PhysicsScene, SettleSolution]:
    return LRUCache(_LONE_BYTES // 4, _bytes_of)


def _pushes(capacity: int) -> LRUCache[tuple[PushSpec, PhysicsScene], PushSolution]:
    return LRUCache(capacity, _bytes_of)


@dataclass(slots=True)
class SolverCounts:
    """Counters of a solver's pushes; one push in a house may be several problems."""

    asked: int = 0
    """Number of problems that were asked."""
    solved: int = 0
    """Number of those that were simulated, as no cache held their solution."""

    @classmethod
    def total(cls, parts: Iterable[SolverCounts]) -> SolverCounts:
        """Return the sums of several counters."""
        counts = list(parts)
        asked, solved = (each.asked for each in counts), (each.solved for each in counts)
        return cls(plain_sum(asked), plain_sum(solved))

    def new_share(self, since: SolverCounts) -> float:
        """Return the share of the problems since earlier counters that were simulated; 0 of 0."""
        return (self.solved - since.solved) / max(self.asked - since.asked, 1)


@dataclass(frozen=True, slots=True, eq=False)
class Solver:
    """Solver on one engine: it simulates only problems whose solution is not known yet.

    Its results are a pure function of the problem, in any process and after any history.
    """

    engine: Engine
    result_cache: ResultCache | None
    """Solutions on disk; None to keep those of this process alone."""
    origin: str
    """Inputs of a solution besides the problem: engine, code, libraries, machine (`origin`)."""
    _settled: LRUCache[PhysicsScene, SettleSolution] = field(default_factory=_settles)
    _lone: LRUCache[tuple[PushSpec, PhysicsScene], PushSolution] = field(
        default_factory=lambda: _pushes(_LONE_BYTES)
    )
    _crowded: LRUCache[tuple[PushSpec, PhysicsScene], PushSolution] = field(
        default_factory=lambda: _pushes(_CROWDED_BYTES)
    )
    counts: SolverCounts = field(default_factory=SolverCounts)
    """Counters of the pushes that this process asked."""

    @property
    def name(self) -> str:
        """Name of the engine."""
        return self.engine.name

    @property
    def build(self) -> str:
        """Version of the engine and number of the rules, as stored in certificates."""
        return f"{self.engine.build}, rules {RULES}"

    @property
    def contact_margin_m(self) -> float:
        """Distance at which two bodies of the engine may already touch, metres."""
        return self.engine.contact_margin_m

    @property
    def bytes_in_memory(self) -> float:
        """Bytes that the solutions in memory take, with their keys, by an estimate."""
        return self._settled.weight + self._lone.weight + self._crowded.weight

    def settle(self, scene: PhysicsScene) -> SettleSolution:
        """Let the first body of the scene fall until it rests."""

        def solve() -> SettleSolution:
            return solve_settle(self.engine, scene)

        return self._settled.get(
            scene, lambda: self._find("settle", scene, solve, pack_settle, unpack_settle)
        )

    def push(self, scene: PhysicsScene, spec: PushSpec) -> PushSolution:
        """Push the first body of the scene along +x."""

        def solve() -> PushSolution:
            self.counts.solved += 1
            return solve_push(self.engine, scene, spec)

        self.counts.asked += 1
        known = self._lone if _is_lone(scene) else self._crowded
        return known.get(
            (spec, scene), lambda: self._find(repr(spec), scene, solve, pack_push, unpack_lone_push)
        )

    def forget(self, *, lone: bool = True) -> None:
        """Drop the solutions in memory: all, or only those of several objects."""
        self._crowded.clear()
        if lone:
            self._settled.clear()
            self._lone.clear()

    def _find(
        self,
        what: str,
        scene: PhysicsScene,
        solve: Callable[[], S],
        pack: Callable[[S], bytes],
        unpack: Callable[[bytes | None], S | None],
    ) -> S:
        """Return a solution from disk, or a new one."""
        kept = self.result_cache
        if kept is None or not kept.is_open or not _is_lone(scene):
            return solve()
        key = self._key(what, scene)
        known = unpack(kept.get(key))
        if known is not None and int.from_bytes(key[-8:], "big") % SAMPLE:
            return known
        solution = solve()
        if known is None:
            kept.put(key, pack(solution))
        elif pack(solution) != pack(known):
            self.forget()
            kept.drop(
                "a solution in this cache was wrong, so data made with it may be too "
                "(`internav-gen validate` tells)"
            )
        return solution

    def _key(self, what: str, scene: PhysicsScene) -> bytes:
        # By geometry, not by asset: equal parts under another id, or with other dynamics of the
        # asset's own, are the same problem.
        bodies = (
            (_digest(b.asset), b.dynamics.mass_kg, b.dynamics.friction, b.pose, b.moves)
            for b in scene.bodies
        )
        asked = (self.origin, what, scene.agent, *bodies)
        return hashlib.sha256(repr(asked).encode()).digest()


def _is_lone(scene: PhysicsScene) -> bool:
    """Return whether an object is alone: the problems that recur in other houses."""
    return len(scene.bodies) == 1 and scene.agent is None


@lru_cache(maxsize=8192)
def _digest(asset: Asset) -> str:
    """Digest of the geometry: an engine sees nothing of an asset but its parts."""
    return hashlib.sha256(repr(asset.parts).encode()).hexdigest()


def _numbers(pose: Pose) -> tuple[float, ...]:
    return (pose.x, pose.y, pose.z, *pose.quaternion)


def pack_settle(solution: SettleSolution) -> bytes:
    """Return a solution of a settle as bytes, exact to the last bit."""
    numbers = (solution.seconds, solution.penetration_m, solution.reach_m)
    return _SETTLE.pack(*_numbers(solution.pose), *numbers, solution.at_rest)


def unpack_settle(value: bytes | None) -> SettleSolution | None:
    """Return the solution of a settle that bytes hold; None for bytes that hold none."""
    if value is None or len(value) != _SETTLE.size:
        return None
    x, y, z, a, b, c, d, *numbers, at_rest = _SETTLE.unpack(value)
    if not all(map(math.isfinite, (x, y, z, a, b, c, d, *numbers))):
        return None
    seconds, penetration_m, reach_m = numbers
    return SettleSolution(Pose(x, y, z, (a, b, c, d)), seconds, at_rest, penetration_m, reach_m)


def pack_push(solution: PushSolution) -> bytes:
    """Return a solution of a push as bytes, exact to the last bit."""
    movers = zip(solution.poses, solution.sweeps, solution.paths, strict=True)
    return b"".join((
        _PUSH.pack(solution.seconds, solution.at_rest, len(solution.poses)),
        *(_MOVER.pack(*_numbers(pose), *sweep, len(path)) for pose, sweep, path in movers),
        *solution.paths,
    ))  # fmt: skip


def unpack_lone_push(value: bytes | None) -> PushSolution | None:
    """Return the solution of a push of one object; None for bytes that hold none."""
    return unpack_push(value, 1)


def unpack_push(value: bytes | None, movers: int) -> PushSolution | None:
    """Return the solution of a push of `movers` moving bodies; None for bytes that hold none."""
    at = _PUSH.size + movers * _MOVER.size
    if value is None or len(value) < at:
        return None
    seconds, at_rest, count = _PUSH.unpack_from(value)
    rows = list(_MOVER.iter_unpack(value[_PUSH.size : at]))
    if count != movers or not all(math.isfinite(n) for n in (seconds, *chain(*rows))):
        return None
    poses, sweeps, paths = [], [], []
    for x, y, z, qx, qy, qz, qw, a, b, c, d, e, f, g, h, size in rows:
        poses.append(Pose(x, y, z, (qx, qy, qz, qw)))
        sweeps.append((a, b, c, d, e, f, g, h))
        paths.append(value[at : at + size])
        at += size
    if len(value) != at or not all(path and len(path) % PATH_POSE_BYTES == 0 for path in paths):
        return None
    return PushSolution(tuple(poses), tuple(sweeps), tuple(paths), seconds, at_rest)


def solver_modules(root: Path, start: tuple[str, ...] = _SOLVERS) -> dict[str, Path]:
    """Return the modules that solutions depend on, found by walking imports.

    Parameters
    ----------
    root : Path
        Directory that holds the package `internav_data`.
    start : tuple of str
        Packages to begin at. Result: all of their modules, and every module of `internav_data`
        that one of these imports, at its top or inside a function. Imports for type checkers do
        not count, but for those by which a package says where its lazy names are.

    Returns
    -------
    dict of str to Path
        Source file by dotted module name, ascending.
    """
    waiting = list(start)
    for package in start:
        folder = root.joinpath(*package.split("."))
        waiting += [
            ".".join(file.relative_to(root).with_suffix("").parts)
            for file in folder.rglob("*.py")
            if file.name != "__init__.py"
        ]
    found: dict[str, Path] = {}
    seen: set[str] = set()
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        file = _source_of(root, name)
        if file is None:
            waiting += _lazy_home(root, name)
            continue
        found[name] = file
        waiting += [name.rpartition(".")[0], *_imported(file)]
    return dict(sorted(found.items()))


def _source_of(root: Path, name: str) -> Path | None:
    """Return the source file of a module of this package; None for any other name."""
    if name.split(".", maxsplit=1)[0] != _PACKAGE:
        return None
    stem = root.joinpath(*name.split("."))
    files = (stem.with_suffix(".py"), stem / "__init__.py")
    return next((file for file in files if file.is_file()), None)


def _lazy_home(root: Path, name: str) -> list[str]:
    """Return the module that a package imports when one of its names is first used, if it does."""
    package, _, attribute = name.rpartition(".")
    file = _source_of(root, package)
    if file is None or file.name != "__init__.py":
        return []
    return [
        node.module
        for node in ast.walk(ast.parse(file.read_bytes()))
        if isinstance(node, ast.ImportFrom) and node.module is not None
        if any(attribute in {alias.name, alias.asname} for alias in node.names)
    ]


def _imported(file: Path) -> list[str]:
    """Return the names that a file imports when it runs: modules, and names in modules."""

    def walk(node: ast.AST) -> Iterator[str]:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            return
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        for child in ast.iter_child_nodes(node):
            yield from walk(child)

    return list(walk(ast.parse(file.read_bytes())))


def code_digest(root: Path, start: tuple[str, ...] = _SOLVERS) -> str:
    """Return the sha256 (hex) over names and sources of `solver_modules`."""
    code = hashlib.sha256()
    for name, file in solver_modules(root, start).items():
        source = file.read_bytes()
        code.update(f"{name} {len(source)} ".encode() + source)
    return code.hexdigest()


_CODE: Final = code_digest(Path(__file__).parents[2])
"""Digest of the files as they were imported: they may change while a process runs."""


@lru_cache(maxsize=8)
def origin(engine: Engine) -> str | None:
    """Return the inputs of a solution besides the problem, as text; None if they are unknown.

    Another build of a library and a processor with other instructions may round differently.
    """
    from llvmlite.binding import get_host_cpu_features, get_host_cpu_name  # noqa: PLC0415 - heavy

    named = (*engine.libraries, *_LIBRARIES)
    try:
        libraries = [metadata.distribution(name).read_text("RECORD") for name in named]
    except metadata.PackageNotFoundError:
        return None
    if None in libraries:
        return None
    records = hashlib.sha256("".join(map(str, libraries)).encode()).hexdigest()
    system = f"{platform.system()} {'-'.join(platform.libc_ver())} {platform.python_version()}"
    processor = f"{hardware()} {get_host_cpu_name()} {get_host_cpu_features().flatten()}"
    return f"{engine.name} {engine.build}, {_CODE}, {records}, {system}, {processor}"
