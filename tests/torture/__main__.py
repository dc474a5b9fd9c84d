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
from campaign import (
    Standing,
    newest_code,
    run_row,
    run_rows,
    seconds_of,
    standing,
    summary,
)

ROWS = {
    module.ROW.name: module.ROW
    for module in (faults, bits, kills, states, digests, fuzz, mutants, memory)
}
"""Rows of the campaign by name, in the order in which they run."""
ASKED = {
    "faults": (
        "EIO, ENOSPC and SIGKILL at every call that changes the disk",
        "torture/test_torture.py::test_a_fault_at_a_call_loses_nothing",
    ),
    "bits": (
        "one bit of every byte, and every truncation at a page, of every kind of file",
        "torture/test_torture.py::test_a_damaged_journal_is_noticed",
        "dataset/test_checksums.py::test_no_flipped_bit_of_a_file_gives_other_rows",
    ),
    "kills": (
        "SIGKILL of group, parent and worker at 200 moments each, and at every fsync",
        "generation/test_run.py::test_finished_scenes_stay_after_a_kill",
        "torture/test_torture.py::test_a_group_killed_at_an_fsync_goes_on",
    ),
    "states": (
        "200 runs of up to 20 steps of a state machine",
        "torture/test_torture.py::test_a_folder_is_what_a_model_of_it_says",
    ),
    "digests": (
        "one digest an engine for every pair of values of nine circumstances",
        "generation/test_parts.py::test_ranges_merged_are_a_run_in_one_piece",
        "torture/test_torture.py::test_cases_of_digests_hold_every_pair_of_circumstances",
    ),
    "fuzz": (
        "10 minutes a reader: typed errors in a line, 5 s (meshes 30 s), 300 MB",
        "torture/test_torture.py::test_changed_bytes_are_read_or_refused",
        "test_hostile_files.py::test_any_value_in_any_place_of_json_is_read_or_refused",
    ),
    "mutants": (
        "85 % of the mutants of a module killed, of those that are drawn",
        "torture/test_torture.py::test_mutants_are_all_different",
    ),
    "memory": (
        "2,000 houses, 2,400 scenes, 1,000,000 steps: under 10 kB each (100 steps) in the 2nd half",
        "envs/test_environment.py::test_memory_stays_flat",
    ),
}
"""What each row asks for, and the tests that are its small version."""


def table() -> str:
    """Return what has run as a table for docs/durability.md."""
    lines = [
        "| row | promise | run | result | minutes | small version |",
        "|---|---|---|---|---|---|",
    ]
    newest = newest_code(ROWS.values())
    for name, row in ROWS.items():
        asked, *tests = ASKED[name]
        line = [f"`{name}`", asked, *cells(standing(row, newest))]
        line += [", ".join(f"`{test}`" for test in tests)]
        lines.append(f"| {' | '.join(line)} |")
    return "\n".join(lines)


def cells(state: Standing) -> list[str]:
    """Return the cells of a row that the results decide."""
    ran = f"{state.current:,} of {state.cases:,} cases"
    older = f", {state.older:,} more with older code" if state.older else ""
    result = f"{len(state.failed)} cases failed" if state.failed else "none failed"
    if "killed" in state.sums:
        result += f", {state.sums['killed']:,} of {state.runs:,} killed"
    result = "; ".join([result if state.ran else "not run", *state.shortfalls])
    return [f"{ran}{older}; {state.runs:,} runs", result, f"{state.minutes:.0f}"]


def arguments(words: list[str] | None = None) -> argparse.Namespace:
    """Return the arguments of the command line; ends the process with a line on a wrong one."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--row", choices=["", *ROWS], default="", help="all, if not given")
    parser.add_argument("--case", default="", help="key of the only case to run; needs --row")
    parser.add_argument("--budget", default="2h", help="time for all rows together")
    parser.add_argument("--summary", action="store_true", help="print what has run")
    parser.add_argument(
        "--table", action="store_true", help="print it as docs/durability.md has it"
    )
    given = parser.parse_args(words)
    try:
        given.seconds = seconds_of(given.budget)
    except ValueError as error:
        parser.error(str(error))
    if given.case and not given.row:
        parser.error("--case needs --row")
    if given.case and given.case not in (cases := list(ROWS[given.row].cases())):
        parser.error(f"row {given.row} has no case {given.case!r}; its first is {cases[0]!r}")
    return given


def main() -> int:
    """Run rows; return 1 if a case of theirs failed when it ran last, or a row falls short."""
    given = arguments()
    rows = [ROWS[given.row]] if given.row else list(ROWS.values())
    if given.table:
        print(table())  # noqa: T201 - a command
        return 0
    if given.case:
        run_row(rows[0], time.monotonic() + given.seconds, only=given.case)
    elif not given.summary:
        run_rows(rows, given.seconds)
    newest = newest_code(ROWS.values())
    standings = {row.name: standing(row, newest) for row in rows}
    for row in rows:
        print(summary(row, standings[row.name]))  # noqa: T201 - a command
    return 0 if all(state.is_good for state in standings.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
