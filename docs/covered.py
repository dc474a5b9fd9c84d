"""Print the share of each room that tests run, from what `make test COVERAGE=1` has measured.

    python docs/covered.py           # all rooms
    python docs/covered.py camp      # files of one room

Lines are statements, branches both ways of a condition or loop. Numba compiles kernels, so that
coverage does not see them run: functions below `@njit` are left out (`exclude_also`), as are
imports for type checkers. Their tests compare them with slow, plain code.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

from code_lines import ROOT, room_of
from coverage import Coverage
from coverage.exceptions import NoDataError
from size import aligned

COUNTS = ("num_statements", "covered_lines", "num_branches", "covered_branches")
"""Keys of coverage's JSON, in the order of the tuples below."""
Counts = tuple[int, int, int, int]


def measured(root: Path) -> dict[Path, Counts]:
    """Return statements, those run, branches and those taken, by source file.

    Raises
    ------
    coverage.exceptions.NoDataError
        Nothing was measured: run `make test COVERAGE=1` first.
    """
    coverage = Coverage(config_file=str(root / "pyproject.toml"))
    coverage.load()
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "coverage.json"
        coverage.json_report(outfile=str(report))
        files = json.loads(report.read_text())["files"]
    return {
        Path(name): tuple(each["summary"][key] for key in COUNTS) for name, each in files.items()
    }


def table(measures: dict[str, Counts]) -> str:
    """Return one row for each name and one for the sum."""
    total = tuple(map(sum, zip(*measures.values(), strict=True)))
    rows = [*sorted(measures.items()), ("all", total)]
    return aligned(
        [
            ("room", "lines", "run", "branches", "taken"),
            *(
                (name, f"{lines:,}", share(run, lines), f"{ways:,}", share(taken, ways))
                for name, (lines, run, ways, taken) in rows
            ),
        ]
    )


def share(part: int, all_: int) -> str:
    """Return a share in percent, rounded down: 100 % means that nothing is left."""
    return f"{100 * part // all_} %" if all_ else "-"


def by_room(measures: dict[Path, Counts]) -> dict[str, Counts]:
    """Return the sums over each room."""
    rooms: dict[str, list[Counts]] = defaultdict(list)
    for path, counts in measures.items():
        rooms[room_of(path)].append(counts)
    return {room: tuple(map(sum, zip(*each, strict=True))) for room, each in rooms.items()}


def main() -> None:
    """Parse the command line and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("room", nargs="?", help="list the files of this room")
    options = parser.parse_args()
    try:
        measures = measured(ROOT)
    except NoDataError:
        parser.error("nothing has been measured: run `make test COVERAGE=1`")
    if options.room is None:
        text = table(by_room(measures))
    else:
        chosen = {str(p): counts for p, counts in measures.items() if room_of(p) == options.room}
        if not chosen:
            parser.error(f"no room {options.room!r}; rooms are {', '.join(by_room(measures))}")
        text = table(chosen)
    sys.stdout.write(text + "\n")


if __name__ == "__main__":
    main()
