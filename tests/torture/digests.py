"""One digest: real scenes under other workers, hash seeds, time zones, locales, threads, clocks,
caches and ways to share scenes out.

A case names a value of each axis; the cases together hold every pair of values of two axes.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from campaign import Row
from stub_runs import contents

from internav_data.physics.engines.installed import available_engines

if TYPE_CHECKING:
    from collections.abc import Iterator

SCENES = 3
AXES = {
    "parts": ("one", "ranges"),
    "workers": ("1", "2", "3"),
    "hash": ("0", "1", "random"),
    "zone": ("UTC", "Asia/Kolkata", "Pacific/Apia"),
    "locale": ("C", "C.UTF-8"),
    "threads": ("1", "2", "5"),
    "clock": ("now", "1970", "2040"),
    "cache": ("none", "cold", "warm"),
    "physics": available_engines(),
}
"""Values of each axis; one digest a physics engine. Ray needs a cluster, and has tests of its own
that compare its bytes with those of processes."""
_CLOCK = """
import os, time
real, began = time.time, time.time()
def shifted(): return real() - began + float(os.environ["TORTURE_CLOCK"])
time.time, time.time_ns = shifted, lambda: int(shifted() * 1e9)
localtime, gmtime, strftime = time.localtime, time.gmtime, time.strftime
time.localtime = lambda s=None: localtime(shifted() if s is None else s)
time.gmtime = lambda s=None: gmtime(shifted() if s is None else s)
"""
_CLOCKS = {"1970": "3600", "2040": "2209000000"}


PLAIN = {name: values[0] for name, values in AXES.items()}
"""The case that the others are compared with, once for each engine."""
LATE_S = 600
"""Longest time that an interpreter may take to start, as its clock tells it."""


def cases() -> Iterator[str]:
    """Yield cases until every pair of values of two axes was in one."""
    names = list(AXES)
    missing = {
        frozenset(((a, x), (b, y)))
        for a, b in itertools.combinations(names, 2)
        for x in AXES[a]
        for y in AXES[b]
    }
    while missing:
        case: dict[str, str] = {}
        for name in sorted(names, key=lambda name: -len(AXES[name])):
            gains = {
                value: sum(frozenset(((name, value), pair)) in missing for pair in case.items())
                * 100
                + sum((name, value) in pair for pair in missing)
                for value in AXES[name]
            }
            case[name] = max(gains, key=lambda value: gains[value])
        missing -= {frozenset(pair) for pair in itertools.combinations(case.items(), 2)}
        yield " ".join(f"{name}={case[name]}" for name in names)


def run(key: str, folder: Path):
    """Make a dataset under the circumstances of a case, compare it with a plain run's."""
    case = dict(item.split("=") for item in key.split())
    if case["clock"] != "now":
        check_clock(case["clock"])
    digest, wanted = digest_of(case, folder), _plain(case["physics"])
    assert digest == wanted, f"digest {digest[:16]}, of a plain run {wanted[:16]}"
    return {"runs": 1, "digest": digest}


@functools.cache
def _plain(physics: str) -> str:
    case = PLAIN | {"physics": physics}
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        return digest_of(case, Path(folder))


def digest_of(case: dict[str, str], folder: Path) -> str:
    """Return the digest of a dataset's files, made by commands in processes of their own."""
    env = _environment(case, folder)
    out = folder / "d"
    common = ["--workers", case["workers"], "--physics", case["physics"]]
    common += ["--episodes-per-scene", "1", "--rooms", "1-2"]
    if case["cache"] == "warm":
        _command(env, "generate", "--out", str(folder / "first"), "--scenes", str(SCENES), *common)
    if case["parts"] == "ranges":
        parts = [str(folder / "part-0"), str(folder / "part-1")]
        for part, span in zip(parts, ("0:1", f"1:{SCENES}"), strict=True):
            _command(env, "generate", "--out", part, "--scene-range", span, *common)
        _command(env, "merge", *parts, "--out", str(out))
    else:
        _command(env, "generate", "--out", str(out), "--scenes", str(SCENES), *common)
    digest = hashlib.sha256()
    for name, data in contents(out).items():
        digest.update(f"{name}\n".encode() + hashlib.sha256(data or b"").digest())
    return digest.hexdigest()


def _command(env: dict[str, str], *words: str) -> None:
    _python(env, "from internav_cli.main import main; main()", *words)


def _python(env: dict[str, str], code: str, *words: str) -> str:
    """Run code in an interpreter of its own; return what it printed."""
    line = [sys.executable, "-c", code, *words]
    done = subprocess.run(line, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{' '.join(words)}: {done.stderr[-2000:]}"
    return done.stdout


@functools.cache
def check_clock(clock: str) -> None:
    """Check that a clock is moved in a process that is started with it, once for each clock."""
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        env = _environment(PLAIN | {"clock": clock}, Path(folder))
        seconds = float(_python(env, "import time; print(time.time())"))
    late = seconds - float(_CLOCKS[clock])
    assert 0 <= late < LATE_S, f"the clock of {clock} is not moved: it says {seconds:.0f} s"


def _environment(case: dict[str, str], folder: Path) -> dict[str, str]:
    env = dict(os.environ)
    env |= {"PYTHONHASHSEED": case["hash"], "TZ": case["zone"], "LC_ALL": case["locale"]}
    for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        env[name] = case["threads"]
    env["INTERNAV_CACHE_DIR"] = "" if case["cache"] == "none" else str(folder / "cache")
    if case["clock"] != "now":
        site = folder / "site"
        site.mkdir()
        (site / "sitecustomize.py").write_text(_CLOCK)
        env["PYTHONPATH"] = os.pathsep.join(filter(None, (str(site), env.get("PYTHONPATH"))))
        env["TORTURE_CLOCK"] = _CLOCKS[case["clock"]]
    return env


ROW = Row("digests", cases, run)
