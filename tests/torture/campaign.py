"""Campaigns: rows of cases whose results are lines of JSON, written as they come.

A case is a key that says all of it, so that any can be run again by itself. One that has passed
with the present code is not run again, so that a campaign goes on where it was stopped; once the
code differs, cases that never ran come first, then those that ran with other code.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

_TESTS = Path(__file__).resolve().parents[1]
_ROOT = _TESTS.parent
sys.path[:0] = [str(_TESTS), *(str(_TESTS / room) for room in ("generation", "dataset"))]
import engines  # noqa: E402, F401 - chooses the default one, as the tests do

RESULTS = Path(__file__).parent / "results"
"""Folder of the results, a file a row."""
_CODE = ("internav_data", "cli", "tests")
"""Folders whose files decide what a case finds."""
_NO_CODE = re.compile(r"tests/torture/results/|.*__pycache__/")
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
    shortfalls: Callable[[Sequence[Mapping[str, Any]]], list[str]] = lambda _: []
    """Sentences about what cases that passed fall short of together; empty if of nothing."""


@dataclass(frozen=True)
class Standing:
    """What the results say of a row, of the cases that it has today."""

    cases: int
    """Number of cases of the row."""
    current: int
    """Number of cases that passed with the newest code there are results of."""
    older: int
    """Number of cases that passed with other code, and have not run since."""
    failed: tuple[str, ...]
    """Keys of cases that failed when they ran last."""
    shortfalls: tuple[str, ...]
    """What cases that passed fall short of together, each in a sentence."""
    runs: int
    minutes: float
    sums: Mapping[str, int]
    """Sums of the figures of its cases that are whole numbers."""

    @property
    def ran(self) -> int:
        """Number of cases that have run."""
        return self.current + self.older + len(self.failed)

    @property
    def is_good(self) -> bool:
        """Whether no case failed and nothing falls short, as far as it ran."""
        return not self.failed and not self.shortfalls


def seconds_of(budget: str) -> float:
    """Return the seconds of a budget, as in "2h", "30m", "90s"."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?)([smh])", budget)
    if match is None:
        raise ValueError(f"BUDGET is {budget!r}: expected a number and s, m or h, as in 2h")
    return float(match[1]) * _UNITS[match[2]]


def run_rows(
    rows: Sequence[Row], seconds: float, *, results: Path = RESULTS, report: Any = print
) -> None:
    """Run rows, each for an equal share of the time that those before it left."""
    end = time.monotonic() + seconds
    for index, row in enumerate(rows):
        now = time.monotonic()
        share = max(0.0, end - now) / (len(rows) - index)
        run_row(row, now + share, results=results, report=report)


def run_row(
    row: Row,
    end: float,
    *,
    only: str = "",
    results: Path = RESULTS,
    report: Any = print,
    code: str = "",
) -> list[str]:
    """Run the cases that have not passed with this code until a time; return those that failed.

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
    report
        Called with a line for each case.
    code
        Digest of the code that runs; `code_digest()` if empty.

    """
    results.mkdir(exist_ok=True)
    path, code = results / f"{row.name}.jsonl", code or code_digest()
    failed = []
    for key in [only] if only else to_run(row.cases(), lines_of(path), code):
        if time.monotonic() >= end:
            report(f"{row.name}: the time is up; the same command goes on from here")
            break
        line = _result(row, key, code)
        _append(path, line)
        report(f"{row.name}: {key}: {'passed' if line['ok'] else line['error']}")
        if not line["ok"]:
            failed.append(key)
    return failed


def to_run(cases: Iterable[str], lines: Iterable[Mapping[str, Any]], code: str) -> list[str]:
    """Return the cases that have not passed with this code, in the order in which they run.

    First those that never ran, then those that ran with other code, the failed ones before the
    others, last those that failed with this code.
    """
    last = {line["case"]: line for line in lines}

    def rank(key: str) -> int:
        line = last.get(key)
        if line is None:
            return 0
        return 3 if line.get("code") == code else 2 if line["ok"] else 1

    return sorted((key for key in cases if not _passed(last.get(key), code)), key=rank)


def _passed(line: Mapping[str, Any] | None, code: str) -> bool:
    return line is not None and line["ok"] and line.get("code") == code


def lines_of(path: Path) -> list[dict[str, Any]]:
    """Return the results of a file, the last one of each case, in the order of their running.

    A last line without an end was cut by a kill and is no result.
    """
    if not path.exists():
        return []
    whole, _, _ = path.read_text().rpartition("\n")
    last: dict[str, dict[str, Any]] = {}
    for line in map(json.loads, whole.splitlines()):
        last.pop(line["case"], None)
        last[line["case"]] = line
    return list(last.values())


def _append(path: Path, line: Mapping[str, Any]) -> None:
    with path.open("ab+") as file:
        file.seek(0)
        file.truncate(file.read().rfind(b"\n") + 1)  # what a kill left of a line
        file.write(f"{json.dumps(line)}\n".encode())


def newest_code(rows: Iterable[Row], results: Path = RESULTS) -> str:
    """Return the digest of the code that ran last; empty if none is known."""
    lines = [line for row in rows for line in lines_of(results / f"{row.name}.jsonl")]
    return max(lines, key=lambda line: line.get("at", ""), default={}).get("code", "")


def standing(row: Row, newest: str, results: Path = RESULTS) -> Standing:
    """Return what the results say of a row; `newest` is the digest of the code that counts."""
    cases = set(row.cases())
    lines = [line for line in lines_of(results / f"{row.name}.jsonl") if line["case"] in cases]
    passed = [line for line in lines if line["ok"]]
    current = sum(_passed(line, newest) for line in lines)
    sums = Counter[str]()
    for line in lines:
        sums.update({name: value for name, value in line.items() if type(value) is int})
    return Standing(
        cases=len(cases),
        current=current,
        older=len(passed) - current,
        failed=tuple(line["case"] for line in lines if not line["ok"]),
        shortfalls=tuple(row.shortfalls(passed)),
        runs=sums["runs"],
        minutes=sum(line["seconds"] for line in lines) / 60,
        sums=sums,
    )


def summary(row: Row, state: Standing) -> str:
    """Return how much of a row has run, in a line and one more for each shortfall."""
    line = (
        f"{row.name}: {state.ran} of {state.cases} cases ({state.older} with older code), "
        f"{state.runs} runs, {len(state.failed)} cases failed"
    )
    failed = f": {', '.join(state.failed)}" if state.failed else ""
    return "\n".join([f"{line}{failed}; {state.minutes:.1f} min", *state.shortfalls])


def _result(row: Row, key: str, code: str) -> dict[str, Any]:
    began = time.monotonic()
    line: dict[str, Any] = {"case": key, "ok": True}
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        try:
            line |= row.run(key, Path(folder))
        except Exception as error:  # noqa: BLE001 - whatever it is, it is the result
            where = traceback.extract_tb(error.__traceback__)[-1]
            text = " ".join(f"{type(error).__name__}: {error}".split())[:1000]
            text = text.replace(tempfile.gettempdir(), "TMPDIR")
            line |= {"ok": False, "error": f"{Path(where.filename).name}:{where.lineno}: {text}"}
    line["seconds"] = round(time.monotonic() - began, 2)
    line["of"], line["code"] = _commit(), code
    line["at"] = datetime.now(UTC).isoformat(timespec="seconds")
    line["machine"] = (
        f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}"
    )
    return line


@functools.cache
def code_digest(root: Path = _ROOT) -> str:
    """Return a digest of the files of the package, its commands and tests, but for results.

    It is worked out once: a campaign is of the code that it began with.
    """
    digest = hashlib.sha256()
    for folder in _CODE:
        for path in sorted((root / folder).rglob("*")):
            name = path.relative_to(root).as_posix()
            if _NO_CODE.match(name) or not path.is_file():
                continue
            digest.update(f"{name}\n".encode() + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]


@functools.cache
def _commit() -> str:
    """Return the commit that runs, with a plus if files differ from it."""
    done = subprocess.run(
        ["git", "describe", "--always", "--dirty=+", "--exclude=*"],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout.strip()
