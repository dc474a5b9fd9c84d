"""Campaigns: rows of cases whose results are lines of JSON, written as they come.

A case is a key that says all of it, so that any can be run again by itself; one that has passed is
not run again, so that a campaign goes on where it was stopped.
"""

from __future__ import annotations

import json
import os
import platform
import re
import subprocess
import sys
import tempfile
import time
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

_TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(_TESTS), *(str(_TESTS / room) for room in ("generation", "dataset"))]
import engines  # noqa: E402, F401 - chooses the default one, as the tests do

RESULTS = Path(__file__).parent / "results"
"""Folder of the results, a file a row."""
_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0}


@dataclass(frozen=True)
class Row:
    """A promise put to the test in very many ways."""

    name: str
    """Name on the command line, and of the file of results."""
    cases: Callable[[], Iterable[str]]
    """Keys of all cases, those first that find most."""
    run: Callable[[str, Path], Mapping[str, Any]]
    """Runs a case in an empty folder; returns figures, `runs` among them; asserts."""


def seconds_of(budget: str) -> float:
    """Return the seconds of a budget, as in "2h", "30m", "90s"."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?)([smh])", budget)
    if found is None:
        raise ValueError(f"BUDGET is {budget!r}: expected a number and s, m or h, as in 2h")
    return float(found[1]) * _UNITS[found[2]]


def run_row(
    row: Row, end: float, *, only: str = "", results: Path = RESULTS, say: Any = print
) -> list[str]:
    """Run the cases that have not passed yet until a time; return the keys of those that failed.

    Parameters
    ----------
    row
        Row to run.
    end
        Time (`time.monotonic`) after which no case begins.
    only
        Key of the only case to run, whether it has passed or not; empty for all.
    results
        Folder of the results.
    say
        Called with a line for each case.

    """
    results.mkdir(exist_ok=True)
    path = results / f"{row.name}.jsonl"
    passed = {line["case"] for line in lines_of(path) if line["ok"]}
    failed = []
    for key in [only] if only else row.cases():
        if key in passed and not only:
            continue
        if time.monotonic() >= end:
            say(f"{row.name}: the time is up; the same command goes on from here")
            break
        line = _result(row, key)
        with path.open("a") as file:
            file.write(json.dumps(line) + "\n")
        say(f"{row.name}: {key}: {'passed' if line['ok'] else line['error']}")
        if not line["ok"]:
            failed.append(key)
    return failed


def lines_of(path: Path) -> list[dict[str, Any]]:
    """Return the results of a file, the last one of each case."""
    if not path.exists():
        return []
    found = map(json.loads, path.read_text().splitlines())
    return list({line["case"]: line for line in found}.values())


def summary(row: Row, results: Path = RESULTS) -> str:
    """Return how much of a row has run, in a line."""
    lines = lines_of(results / f"{row.name}.jsonl")
    failed = [line["case"] for line in lines if not line["ok"]]
    runs = sum(line.get("runs", 0) for line in lines)
    minutes = sum(line["seconds"] for line in lines) / 60
    return (
        f"{row.name}: {len(lines)} cases, {runs} runs, {len(failed)} cases failed "
        f"{failed or ''}, {minutes:.1f} min"
    )


def _result(row: Row, key: str) -> dict[str, Any]:
    began = time.monotonic()
    line: dict[str, Any] = {"case": key, "ok": True}
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        try:
            line |= row.run(key, Path(folder))
        except Exception as error:  # noqa: BLE001 - whatever it is, it is the result
            where = traceback.extract_tb(error.__traceback__)[-1]
            said = " ".join(f"{type(error).__name__}: {error}".split())[:1000]
            said = said.replace(tempfile.gettempdir(), "TMPDIR")
            line |= {"ok": False, "error": f"{Path(where.filename).name}:{where.lineno}: {said}"}
    line["seconds"] = round(time.monotonic() - began, 2)
    line["of"] = _code()
    line["machine"] = (
        f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}"
    )
    return line


def _code() -> str:
    """Return the commit that ran, with a plus if files differ from it."""
    done = subprocess.run(
        ["git", "describe", "--always", "--dirty=+", "--exclude=*"],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout.strip()
