"""Command line of the campaigns: `make torture ROW=faults BUDGET=2h`.

python tests/torture                       # all rows, two hours
python tests/torture --row bits --budget 30m
python tests/torture --row faults --case 'extend ENOSPC 40:50'
python tests/torture --summary
"""

from __future__ import annotations

import argparse
import sys
import time

import bits
import digests
import faults
import fuzz
import kills
import memory
import mutants
import states
from campaign import RESULTS, lines_of, run_row, seconds_of, summary

ROWS = {
    module.ROW.name: module.ROW
    for module in (faults, bits, kills, states, digests, fuzz, mutants, memory)
}
"""Rows of the campaign by name, in the order in which they run."""
ASKED = {
    "faults": "EIO, ENOSPC and SIGKILL at every call that changes the disk",
    "bits": "one bit of every byte, and every truncation at a page, of every kind of file",
    "kills": "SIGKILL of group, parent and worker at 200 moments each, and at every fsync",
    "states": "200 runs of 20 steps of a state machine",
    "digests": "every pair of values of nine circumstances: one digest an engine",
    "fuzz": "10 minutes a reader: typed errors, 5 s, 300 MB",
    "mutants": "85 % of the mutants that are drawn killed",
    "memory": "2,000 houses, 1,000,000 steps: under 10 kB each in the second half",
}
"""What each row asks for, for the table of docs/durability.md."""


def table() -> str:
    """Return what has run as a table for docs/durability.md."""
    lines = ["| row | asked | run | result | minutes |", "|---|---|---|---|---|"]
    for name, row in ROWS.items():
        found = lines_of(RESULTS / f"{name}.jsonl")
        failed = sum(not line["ok"] for line in found)
        cases, runs = len(list(row.cases())), sum(line.get("runs", 0) for line in found)
        minutes = sum(line["seconds"] for line in found) / 60
        result = f"{failed} cases failed" if failed else "all passed"
        if name == "mutants" and runs:
            result = f"{sum(line.get('killed', 0) for line in found)} of {runs} killed"
        ran = f"{len(found)} of {cases} cases, {runs:,} runs"
        lines.append(f"| `{name}` | {ASKED[name]} | {ran} | {result} | {minutes:.0f} |")
    return "\n".join(lines)


def main() -> int:
    """Run rows; return 1 if a case failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--row", choices=["", *ROWS], default="", help="all, if not given")
    parser.add_argument("--case", default="", help="key of the only case to run")
    parser.add_argument("--budget", default="2h", help="time for all rows together")
    parser.add_argument("--summary", action="store_true", help="print what has run")
    parser.add_argument(
        "--table", action="store_true", help="print it as docs/durability.md has it"
    )
    given = parser.parse_args()
    rows = [ROWS[given.row]] if given.row else list(ROWS.values())
    failed: list[str] = []
    if given.table:
        print(table())  # noqa: T201 - a command
        return 0
    if not given.summary:
        end = time.monotonic() + seconds_of(given.budget)
        for row in rows:
            failed += run_row(row, end, only=given.case)
    for row in rows:
        print(summary(row))  # noqa: T201 - a command
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
