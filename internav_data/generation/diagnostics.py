"""Checks of a machine before generating, for `doctor`, and the warm-up of its kernels."""

from __future__ import annotations

import os
import platform
import re
import shutil
import sys
import time
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Literal

from internav_data.core import compile_cache
from internav_data.core.extras import DISTRIBUTIONS, EXTRAS, install_command
from internav_data.core.machine import available_cores, memory_gib
from internav_data.records.version import __version__

CheckState = Literal["good", "warning", "bad"]
"""Result of a check."""

TRIED_UP_TO = (3, 14)
"""Latest version of Python for which every package is known to have wheels."""
BYTES_AN_EPISODE = 1000
PAPER_EPISODES = 595_500
GIB = 1 << 30


@dataclass(frozen=True, slots=True)
class Check:
    """Result of one check."""

    name: str
    state: CheckState
    found: str
    remedy: str
    """Advice for the user; empty when the check is good."""


def examine(out: Path) -> list[Check]:
    """Run all checks, for a dataset in the folder `out`, in a fixed order."""
    return [
        Check("internav-data", "good", __version__, ""),
        _python(),
        _platform(),
        *(_package(module, extra) for module, extra in EXTRAS.items()),
        *_engines(),
        _cores(),
        _memory(),
        _disk(out),
        _numba_cache(),
        *_result_cache(),
    ]


def _python() -> Check:
    found = platform.python_version()
    if sys.version_info[:2] <= TRIED_UP_TO:
        return Check("Python", "good", found, "")
    latest = ".".join(map(str, TRIED_UP_TO))
    remedy = f"tried up to Python {latest}: where a package has no wheel yet, use that one"
    return Check("Python", "warning", found, remedy)


def _platform() -> Check:
    system = platform.system()
    found = f"{system} {platform.machine()}"
    if system == "Linux":
        return Check("platform", "good", found, "")
    remedies = {
        "Darwin": "never tried on macOS, though all packages have wheels: tell us what fails",
        "Windows": "never tried on Windows, and one process makes all scenes there: WSL is Linux",
    }
    remedy = remedies.get(system, "tried on Linux only: use a container")
    return Check("platform", "warning", found, remedy)


_USES = {
    "bullet": "needed only for datasets of the engine bullet, and compiled for minutes where it "
    "has no wheel (all but CPython 3.11 on Linux x86-64): ",
    "meshes": "needed only for meshes of your own: ",
    "train": "needed only for environments, training and evaluation: ",
    "tensorboard": "needed only for TensorBoard's files: ",
    "ray": "needed only for `internav-gen generate --executor ray`: ",
    "hub": "needed only for `internav-gen upload`: ",
}
"""Uses of the extras that generating and validating do without."""


def _package(module: str, extra: str) -> Check:
    name, install = DISTRIBUTIONS.get(module, module), install_command(module)
    try:
        found = metadata.version(name)
    except metadata.PackageNotFoundError:
        state: CheckState = "warning" if extra in _USES else "bad"
        return Check(name, state, "missing", _USES.get(extra, "") + install)
    wanted = _wanted(name)
    if wanted and _numbers(found) < _numbers(wanted):
        return Check(name, "bad", f"{found}, older than {wanted}", f"{install} --upgrade")
    return Check(name, "good", found, "")


def _engines() -> list[Check]:
    """Check that each physics engine loads; one is enough, as any can be named."""
    from internav_data.physics.engines import DEFAULT_ENGINE, ENGINES  # noqa: PLC0415 - heavier

    builds, missing = {}, {}
    for name, load in ENGINES.items():
        try:
            builds[name] = load().build
        except ImportError as error:
            missing[name] = install_command((error.name or name).partition(".")[0])
    checks = []
    for name in ENGINES:
        label = f"engine {name}" + (" (the default)" if name == DEFAULT_ENGINE else "")
        if name in builds:
            checks.append(Check(label, "good", builds[name], ""))
            continue
        state: CheckState = "warning" if builds else "bad"
        other = f"ask for --physics {next(iter(builds))}, or: " if builds else ""
        remedy = (other if name == DEFAULT_ENGINE else "") + missing[name]
        checks.append(Check(label, state, "not installed", remedy))
    return checks


def _wanted(name: str) -> str:
    """Return the oldest version that our own metadata asks for, empty for any."""
    try:
        requirements = metadata.requires("internav-data") or []
    except metadata.PackageNotFoundError:
        return ""
    for requirement in requirements:
        match = re.match(r"([A-Za-z0-9_.-]+)[^;]*?>=\s*([0-9.]+)", requirement)
        if match and match[1].lower() == name:
            return match[2]
    return ""


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", version)[:3])


def _cores() -> Check:
    return Check("cores", "good", f"{available_cores()}, so many workers by default", "")


def _memory() -> Check:
    total, cores = memory_gib(), available_cores()
    if total is None:
        return Check("memory", "good", "not known on this system", "")
    if total >= cores:
        return Check("memory", "good", f"{total:.1f} GiB", "")
    remedy = f"a worker takes up to 1 GB: use --workers {max(1, int(total))}"
    return Check("memory", "warning", f"{total:.1f} GiB for {cores} cores", remedy)


def _disk(out: Path) -> Check:
    folder = out.absolute()
    while not folder.exists():
        folder = folder.parent
    free = shutil.disk_usage(folder).free
    found = f"{free / GIB:.1f} GiB free at {folder}"
    if not os.access(folder, os.W_OK):
        return Check("disk", "bad", f"{folder} cannot be written", "choose another folder")
    # Unfinished work and the shards made from it lie side by side for a while.
    if free < 2 * PAPER_EPISODES * BYTES_AN_EPISODE:
        remedy = "the paper's 12,000 scenes take about 1.2 GB while they are made"
        return Check("disk", "warning", found, remedy)
    return Check("disk", "good", found, "")


def _numba_cache() -> Check:
    name = "numba cache"
    chosen = os.environ.get(compile_cache.VARIABLE, "")
    remedy = "set NUMBA_CACHE_DIR to a folder of yours, then run `internav-gen warmup`"
    if not any(compile_cache.is_writable(each) for each in compile_cache.own_choices()):
        return Check(name, "bad", "no folder can be written: kernels cannot be compiled", remedy)
    if chosen and not compile_cache.is_writable(Path(chosen)):
        return Check(name, "warning", f"NUMBA_CACHE_DIR: {chosen} cannot be written", remedy)
    if Path(chosen).name.startswith(compile_cache.TEMPORARY_PREFIX):
        found = f"neither the package nor a home can be written: kernels are kept in {chosen}"
        return Check(name, "warning", found, remedy)
    return Check(name, "good", "writable", "")


def _result_cache() -> list[Check]:
    """Check the result cache on disk; nothing where a package is missing, as another check says."""
    try:
        from internav_data.physics import result_cache  # noqa: PLC0415 - imported when used
    except ImportError:
        return []
    name = "solved pushes"
    folder = result_cache.cache_folder()
    if folder is None:
        return [Check(name, "good", f"none kept: {result_cache.FOLDER_VARIABLE} is empty", "")]
    path = folder / result_cache.FILE_NAME
    if result_cache.ResultCache(folder).is_open:
        held, most = path.stat().st_size / 2**20, result_cache.MAX_BYTES / 2**30
        return [Check(name, "good", f"{held:.0f} MiB, at most {most:.0f} GiB, at {path}", "")]
    remedy = f"set {result_cache.FOLDER_VARIABLE} to a folder of yours, or to nothing to keep none"
    return [Check(name, "warning", f"{path} cannot be written: none are kept", remedy)]


def warm_up() -> float:
    """Build a small scene, so that every kernel is compiled and cached; return the seconds."""
    from internav_data.catalog import catalogue  # noqa: PLC0415
    from internav_data.generation.config import GenerationConfig  # noqa: PLC0415 - as above
    from internav_data.generation.scenes import build_scene  # noqa: PLC0415 - as above

    began = time.perf_counter()
    build_scene(0, GenerationConfig(), catalogue(), episodes=2)
    return time.perf_counter() - began
