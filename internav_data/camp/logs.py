"""A run's log rows, read forgivingly: one JSON object a line, of numbers by name."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

BYTES_AT_MOST: Final = 256_000_000
STEPS: Final = ("step", "steps", "environment_steps")
"""Names of the horizontal axis, the first one that a row has."""
FIRST: Final = ("success", "validation", "return", "reward", "spl", "sts")
"""What is shown first: names that hold these words."""
CURVES_AT_MOST: Final = 24

Series = dict[str, list[tuple[float, float]]]


def find_log(run: Path) -> Path | None:
    """Return a run's log, a .jsonl file in its folder; None without one."""
    found = sorted(path for path in run.glob("*.jsonl") if path.is_file())
    return found[0] if found else None


def read_log(path: Path) -> Series:
    """Return each number of a log against the steps; lines that are no rows are passed over."""
    series: Series = {}
    if path.stat().st_size > BYTES_AT_MOST:
        return series
    with path.open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            row = _row(line)
            step = next((row[name] for name in STEPS if name in row), None)
            if step is None:
                continue
            for name, value in row.items():
                if name not in STEPS:
                    series.setdefault(name, []).append((step, value))
    return series


def shown_first(names: Sequence[str]) -> list[str]:
    """Return the names to show, the telling ones first."""

    def rank(name: str) -> tuple[int, str]:
        places = [k for k, word in enumerate(FIRST) if word in name.lower()]
        return (places[0] if places else len(FIRST)), name

    return sorted(names, key=rank)[:CURVES_AT_MOST]


def _row(line: str) -> Mapping[str, float]:
    try:
        said: Any = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return _numbers(said) if isinstance(said, dict) else {}


def _numbers(said: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    found: dict[str, float] = {}
    for name, value in said.items():
        if isinstance(value, dict) and not prefix:
            found |= _numbers(value, f"{name}/")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            try:
                number = float(value)
            except OverflowError:
                continue
            if math.isfinite(number):
                found[f"{prefix}{name}"] = number
    return found
