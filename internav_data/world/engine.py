"""The physics engine of a process, with a memory that all processes of a user share.

What it is asked about is plain data, and the answer depends on that alone: it is kept on disk
(`solutions`). On free ground a thing settles and slides the same way in every house; and training
asks again what generating has asked before.
"""

from __future__ import annotations

import hashlib
import math
import platform
import struct
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from importlib import metadata, resources
from itertools import chain
from typing import TYPE_CHECKING, Final

from internav_data.records import Pose
from internav_data.world.setting import Motion, Rest
from internav_data.world.solutions import Solutions, solutions
from internav_data.world.sweeps import PATH_POSE_BYTES

if TYPE_CHECKING:
    from collections.abc import Iterator

    from internav_data.records import Asset
    from internav_data.world.setting import Engine, Setting, Shove

_SOLVERS: Final = ("internav_data.geometry", "internav_data.world")
"""Packages that solutions come from: none is believed once one of their files has changed."""
_LIBRARIES: Final = ("pybullet", "numpy", "numba", "llvmlite")
"""Libraries that they come from; an installed one's RECORD holds the digests of all its files."""
_REST: Final = struct.Struct("<7d3d?")
"""Pose; seconds, penetration, reach; at rest."""
_MOTION: Final = struct.Struct("<d?H")
"""Seconds, at rest, how many bodies move."""
_MOVER: Final = struct.Struct("<7d8dI")
"""Pose, sweep, bytes of the path; the paths themselves follow."""


@dataclass(frozen=True, slots=True, eq=False)
class Remembering:
    """An engine that is asked only what neither this process nor another one has had solved."""

    engine: Engine
    solutions: Solutions
    origin: str
    """What the answers depend on besides the question: engine, rules, machine."""

    @property
    def name(self) -> str:
        """Name of the engine."""
        return self.engine.name

    @property
    def build(self) -> str:
        """Version and build of the engine."""
        return self.engine.build

    def settle(self, setting: Setting) -> Rest:
        """Let the first body of the setting fall until it rests."""
        if not self.solutions.is_open:
            return self.engine.settle(setting)
        key = self._key("settle", setting)
        known = _read_rest(self.solutions.get(key))
        if known is None:
            known = self.engine.settle(setting)
            self.solutions.put(key, _write_rest(known))
        return known

    def push(self, setting: Setting, shove: Shove) -> Motion:
        """Push the first body of the setting along +x."""
        if not self.solutions.is_open:
            return self.engine.push(setting, shove)
        key = self._key(repr(shove), setting)
        known = _read_motion(self.solutions.get(key), sum(b.moves for b in setting.bodies))
        if known is None:
            known = self.engine.push(setting, shove)
            self.solutions.put(key, _write_motion(known))
        return known

    def _key(self, what: str, setting: Setting) -> bytes:
        bodies = ((_digest(b.asset), b.pose, b.moves) for b in setting.bodies)
        asked = (self.origin, what, setting.column, *bodies)
        return hashlib.sha256(repr(asked).encode()).digest()


@lru_cache(maxsize=8192)
def _digest(asset: Asset) -> str:
    return hashlib.sha256(repr(asset).encode()).hexdigest()


def _numbers(pose: Pose) -> tuple[float, ...]:
    return (pose.x, pose.y, pose.z, *pose.quaternion)


def _write_rest(rest: Rest) -> bytes:
    numbers = (rest.seconds, rest.penetration_m, rest.reach_m)
    return _REST.pack(*_numbers(rest.pose), *numbers, rest.at_rest)


def _read_rest(value: bytes | None) -> Rest | None:
    if value is None or len(value) != _REST.size:
        return None
    x, y, z, a, b, c, d, *numbers, at_rest = _REST.unpack(value)
    if not all(map(math.isfinite, (x, y, z, a, b, c, d, *numbers))):
        return None
    seconds, penetration_m, reach_m = numbers
    return Rest(Pose(x, y, z, (a, b, c, d)), seconds, at_rest, penetration_m, reach_m)


def _write_motion(motion: Motion) -> bytes:
    movers = zip(motion.poses, motion.sweeps, motion.paths, strict=True)
    return b"".join((
        _MOTION.pack(motion.seconds, motion.at_rest, len(motion.poses)),
        *(_MOVER.pack(*_numbers(pose), *sweep, len(path)) for pose, sweep, path in movers),
        *motion.paths,
    ))  # fmt: skip


def _read_motion(value: bytes | None, movers: int) -> Motion | None:
    """Read a motion of so many bodies; None where it is none."""
    at = _MOTION.size + movers * _MOVER.size
    if value is None or len(value) < at:
        return None
    seconds, at_rest, count = _MOTION.unpack_from(value)
    rows = list(_MOVER.iter_unpack(value[_MOTION.size : at]))
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
    return Motion(tuple(poses), tuple(sweeps), tuple(paths), seconds, at_rest)


def _code() -> str:
    """Digest of the code that solves."""
    code = hashlib.sha256()
    for package in _SOLVERS:
        files = [f for f in resources.files(package).iterdir() if f.name.endswith(".py")]
        for file in sorted(files, key=lambda f: f.name):
            code.update(file.read_bytes())
    return code.hexdigest()


_CODE: Final = _code()
"""Of the files as they were imported: they may change while a process lives."""


@lru_cache(maxsize=1)
def origin(build: str) -> str | None:
    """Return what answers depend on besides the question; None where that cannot be told.

    Another build of a library, and a processor with other instructions, may round otherwise.
    """
    from llvmlite.binding import get_host_cpu_features, get_host_cpu_name  # noqa: PLC0415 - heavy

    try:
        libraries = [metadata.distribution(name).read_text("RECORD") for name in _LIBRARIES]
    except metadata.PackageNotFoundError:
        return None
    if None in libraries:
        return None
    records = hashlib.sha256("".join(map(str, libraries)).encode()).hexdigest()
    system = f"{platform.system()} {'-'.join(platform.libc_ver())} {platform.python_version()}"
    processor = f"{platform.machine()} {get_host_cpu_name()} {get_host_cpu_features().flatten()}"
    return f"{build}, {_CODE}, {records}, {system}, {processor}"


_asked_anew = False


@contextmanager
def solving_anew() -> Iterator[None]:
    """Ask the engine itself for everything: what other processes left on disk is not believed."""
    global _asked_anew  # noqa: PLW0603 - belongs to the process, as the engine does
    before, _asked_anew = _asked_anew, True
    try:
        yield
    finally:
        _asked_anew = before


def engine_of_this_process() -> Engine:
    """Return the physics engine, connected at first use."""
    from internav_data.world.bullet import bullet  # noqa: PLC0415 - pybullet is imported when used

    engine = bullet()
    return engine if _asked_anew else _remembering(engine, solutions())


@lru_cache(maxsize=1)
def _remembering(engine: Engine, known: Solutions) -> Engine:
    where = origin(engine.build)
    return engine if where is None else Remembering(engine, known, where)
