"""The physics engine of a process, with a memory for what things do alone.

A thing on free ground settles, and slides when pushed, the same way in every house: its solution
depends on asset, orientation and push alone, and is kept on disk (`solutions`).
"""

from __future__ import annotations

import hashlib
import platform
import struct
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import TYPE_CHECKING, Final

from internav_data.records import Pose
from internav_data.world.setting import Motion, Rest
from internav_data.world.solutions import Solutions, solutions

if TYPE_CHECKING:
    from collections.abc import Iterator

    from internav_data.records import Asset
    from internav_data.world.setting import Engine, Setting, Shove

_SOLVERS: Final = ("internav_data.geometry", "internav_data.world")
"""Packages that solutions come from: none is believed once one of their files has changed."""
_POSE: Final = struct.Struct("<7d")
_REST: Final = struct.Struct("<7d3d?")
_MOTION: Final = struct.Struct("<7d8dd?")


@dataclass(frozen=True, slots=True, eq=False)
class Remembering:
    """An engine that is asked only for what neither it nor another process has solved.

    Only lone bodies are remembered: every other setting is one of countless.
    """

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
        if not _is_lone(setting):
            return self.engine.settle(setting)
        key = self._key("settle", setting)
        known = self.solutions.get(key)
        if known is not None and len(known) == _REST.size:
            return _read_rest(known)
        rest = self.engine.settle(setting)
        self.solutions.put(key, _write_rest(rest))
        return rest

    def push(self, setting: Setting, shove: Shove) -> Motion:
        """Push the first body of the setting along +x."""
        if not _is_lone(setting):
            return self.engine.push(setting, shove)
        key = self._key("push", setting, shove)
        known = self.solutions.get(key)
        if known is not None and len(known) > _MOTION.size:
            return _read_motion(known)
        motion = self.engine.push(setting, shove)
        self.solutions.put(key, _write_motion(motion))
        return motion

    def _key(self, what: str, setting: Setting, shove: Shove | None = None) -> bytes:
        body = setting.bodies[0]
        asked = f"{what} {self.origin} {_digest(body.asset)} {body.pose!r} {shove!r}"
        return hashlib.sha256(asked.encode()).digest()


def _is_lone(setting: Setting) -> bool:
    return len(setting.bodies) == 1 and setting.bodies[0].moves and setting.column is None


@lru_cache(maxsize=8192)
def _digest(asset: Asset) -> str:
    return hashlib.sha256(repr(asset).encode()).hexdigest()


def _numbers(pose: Pose) -> tuple[float, ...]:
    return (pose.x, pose.y, pose.z, *pose.quaternion)


def _write_rest(rest: Rest) -> bytes:
    numbers = (rest.seconds, rest.penetration_m, rest.reach_m)
    return _REST.pack(*_numbers(rest.pose), *numbers, rest.at_rest)


def _read_rest(value: bytes) -> Rest:
    x, y, z, a, b, c, d, seconds, penetration_m, reach_m, at_rest = _REST.unpack(value)
    return Rest(Pose(x, y, z, (a, b, c, d)), seconds, at_rest, penetration_m, reach_m)


def _write_motion(motion: Motion) -> bytes:
    head = (*_numbers(motion.poses[0]), *motion.sweeps[0], motion.seconds, motion.at_rest)
    return _MOTION.pack(*head) + motion.paths[0]


def _read_motion(value: bytes) -> Motion:
    x, y, z, a, b, c, d, *sweep, seconds, at_rest = _MOTION.unpack_from(value)
    e, n, w, s, ne, nw, sw, se = sweep
    return Motion(
        poses=(Pose(x, y, z, (a, b, c, d)),),
        sweeps=((e, n, w, s, ne, nw, sw, se),),
        paths=(value[_MOTION.size :],),
        seconds=seconds,
        at_rest=at_rest,
    )


@lru_cache(maxsize=1)
def _origin(build: str) -> str:
    """Return what answers depend on: a processor with other instructions may round otherwise."""
    from llvmlite.binding import get_host_cpu_features, get_host_cpu_name  # noqa: PLC0415 - heavy

    code = hashlib.sha256()
    for package in _SOLVERS:
        files = [f for f in resources.files(package).iterdir() if f.name.endswith(".py")]
        for file in sorted(files, key=lambda f: f.name):
            code.update(file.read_bytes())
    libc = "-".join(platform.libc_ver())
    processor = f"{platform.machine()} {get_host_cpu_name()} {get_host_cpu_features().flatten()}"
    return f"{build}, {code.hexdigest()}, {platform.system()} {libc}, {processor}"


_asked_anew = False


@contextmanager
def solving_anew() -> Iterator[None]:
    """Ask the engine itself for everything, each time in a new world.

    What other processes left on disk is not believed, nor that history leaves no trace: the way to
    prove both.
    """
    global _asked_anew  # noqa: PLW0603 - belongs to the process, as the engine does
    before, _asked_anew = _asked_anew, True
    try:
        yield
    finally:
        _asked_anew = before


def engine_of_this_process() -> Engine:
    """Return the physics engine, connected at first use."""
    from internav_data.world.bullet import bullet  # noqa: PLC0415 - pybullet is imported when used

    if _asked_anew:
        return bullet(scenes_a_world=1)
    return _remembering(bullet(), solutions())


@lru_cache(maxsize=1)
def _remembering(engine: Engine, known: Solutions) -> Remembering:
    return Remembering(engine, known, _origin(engine.build))
