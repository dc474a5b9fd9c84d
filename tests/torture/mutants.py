"""Mutants: one operator, constant, condition or call of a module changed; its tests must fail.

A case is a target, the number of a mutant and a digest of the module: "manifest 17 of 8f14e45f";
once the module differs, its numbers name other mutants, which are other cases. "manifest none" is
the module as it is, whose tests must pass. Mutants are drawn in an order of their own. Kernels run
without numba: it would take compiled ones of before from its cache.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import itertools
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from campaign import Row
from mutant import NOT_LOADED, ROOT, TARGETS, mutated, source_of
from strategies import rng

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from mutant import Target

LIMIT_S = 600
"""Longest time of a module's tests without a mutant."""
MIN_LIMIT_S = 120
SLOWER = 8
"""A mutant whose tests take so many times as long as without it, and `MIN_LIMIT_S`, is killed: it
waits or loops."""
MIN_KILLED = 0.85
"""Smallest share of the mutants of a target that its tests must notice."""
_BROKEN_IMPORTS = {2: "error during collection", 4: "ImportError while loading conftest"}
"""Exit codes of pytest that tests end with if they cannot import the mutant, and what it prints
then. The same codes mean other things too: an interrupt, an option that does not exist."""


@functools.cache
def drawn(name: str) -> list[int]:
    """Return the numbers of the mutants of a target that are drawn, in order."""
    target = TARGETS[name]
    _, _, count = mutated(target, None)
    return rng(0).permutation(count)[: target.drawn].tolist()


def cases() -> Iterator[str]:
    """Yield each module as it is, then its mutants; modules in turns."""
    rows = [
        [f"{name} none", *(f"{name} {number} of {digest_of(target)}" for number in drawn(name))]
        for name, target in TARGETS.items()
    ]
    for some in itertools.zip_longest(*rows):
        yield from filter(None, some)


def digest_of(target: Target) -> str:
    """Return a digest of a target's module, by which the numbers of its mutants hold."""
    text = ast.unparse(ast.parse(source_of(target).read_text()))
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def run(key: str, folder: Path) -> Mapping[str, Any]:
    """Run the tests of a target with a mutant; tell whether they fail."""
    name, number = key.split()[:2]
    limit = max(MIN_LIMIT_S, SLOWER * unmutated_seconds(name))
    if number == "none":
        return {"runs": 0}
    target = TARGETS[name]
    _, description, _ = mutated(target, int(number))
    how = how_it_ended(*tests_with(name, number, folder, limit))
    mutant = f"{target.module} {description}"
    return {"runs": 1, "killed": int(how != "survived"), "how": how, "mutant": mutant}


@functools.cache
def unmutated_seconds(name: str) -> float:
    """Return how long the tests of a target take without a mutant.

    Raises
    ------
    AssertionError
        They do not pass, so that its mutants would say nothing.

    """
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        code, text = tests_with(name, "none", Path(folder), LIMIT_S)
    assert code == 0, f"tests fail without a mutant: code {code}: {text[-1500:]}"
    return time.monotonic() - began


def how_it_ended(code: int | None, text: str) -> str:
    """Return how tests of a mutant ended, by their exit code (None if out of time) and output.

    Raises
    ------
    AssertionError
        Neither the tests nor the mutant ended them; it has the end of the output.

    """
    assert code != NOT_LOADED, f"the tests never imported the mutant: {text[-1500:]}"
    if code is None:
        return "timeout"
    if code in {0, 1}:
        return "tests failed" if code else "survived"
    reason = _BROKEN_IMPORTS.get(code)
    assert reason is not None, f"code {code}: {text[-1500:]}"
    assert reason in text, f"code {code} without {reason!r}: {text[-1500:]}"
    return reason


def tests_with(name: str, number: str, folder: Path, limit: float) -> tuple[int | None, str]:
    """Run the tests of a target in an interpreter of its own; return its exit code and output.

    The code is None if they took more than `limit` seconds.
    """
    process = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name("mutant.py")), name, number],
        env=_environment(name, folder),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        cwd=ROOT,
    )
    try:
        text, _ = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        return None, process.communicate()[0]
    return process.returncode, text


def _environment(name: str, folder: Path) -> dict[str, str]:
    paths = (str(ROOT), str(ROOT / "cli"), os.environ.get("PYTHONPATH"))
    env = os.environ | {
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
        "TMPDIR": str(folder),
        "HYPOTHESIS_STORAGE_DIRECTORY": str(folder),
    }
    if "geometry" in TARGETS[name].module:
        env["NUMBA_DISABLE_JIT"] = "1"
    return env


def shortfalls(lines: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the targets whose tests noticed too few of their mutants, each in a sentence."""
    kills = defaultdict(list)
    for line in lines:
        if line.get("runs"):
            kills[line["case"].split()[0]].append(line["killed"])
    return [
        f"{name}: {sum(each)} of {len(each)} mutants killed, {MIN_KILLED:.0%} asked"
        for name, each in kills.items()
        if sum(each) < MIN_KILLED * len(each)
    ]


ROW = Row("mutants", cases, run, shortfalls)
