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
import mutants
import states
from campaign import run_row, seconds_of, summary

ROWS = {
    module.ROW.name: module.ROW for module in (faults, bits, kills, states, digests, fuzz, mutants)
}
"""Rows of the campaign by name, in the order in which they run."""


def main() -> int:
    """Run rows; return 1 if a case failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--row", choices=["", *ROWS], default="", help="all, if not given")
    parser.add_argument("--case", default="", help="key of the only case to run")
    parser.add_argument("--budget", default="2h", help="time for all rows together")
    parser.add_argument("--summary", action="store_true", help="print what has run")
    given = parser.parse_args()
    rows = [ROWS[given.row]] if given.row else list(ROWS.values())
    failed: list[str] = []
    if not given.summary:
        end = time.monotonic() + seconds_of(given.budget)
        for row in rows:
            failed += run_row(row, end, only=given.case)
    for row in rows:
        print(summary(row))  # noqa: T201 - a command
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
