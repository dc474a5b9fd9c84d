"""Print lines of code per room, or per file of one room.

    python docs/size.py           # all rooms
    python docs/size.py camp      # files of one room

A room is the first folder below `internav_data`; `cli`, `tests` and `benchmarks` are one room each.
Docstrings, comments and blank lines do not count.
"""

from __future__ import annotations

import argparse
import ast
import sys
from collections import Counter
from pathlib import Path

from code_lines import PACKAGE, ROOT, code_lines, python_files, room_of

FOLDERS = (PACKAGE, "cli", "tests", "benchmarks")
"""Folders that are counted."""


def sizes_of(root: Path) -> dict[Path, int]:
    """Return the lines of code of every Python file in `FOLDERS` below `root`."""
    sizes = {}
    for path in python_files(root / name for name in FOLDERS if (root / name).exists()):
        source = path.read_text(encoding="utf-8")
        sizes[path] = len(code_lines(source, ast.parse(source)))
    return sizes


def room_table(sizes: dict[Path, int]) -> list[tuple[str, int, int]]:
    """Return (room, files, lines of code) of every room, largest first within package and rest."""
    files: Counter[str] = Counter()
    lines: Counter[str] = Counter()
    for path, size in sizes.items():
        files[room_of(path)] += 1
        lines[room_of(path)] += size
    rooms = sorted(lines, key=lambda room: (room in FOLDERS[1:], -lines[room], room))
    return [(room, files[room], lines[room]) for room in rooms]


def aligned(rows: list[tuple[str, ...]]) -> str:
    """Return rows as a text table: the first column to the left, others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if k else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


def report(sizes: dict[Path, int], root: Path, room: str | None = None) -> str:
    """Return the table of all rooms, or of the files of one room.

    Raises
    ------
    LookupError
        No file lies in `room`.
    """
    if room is None:
        table = room_table(sizes)
        package = [row for row in table if row[0] not in FOLDERS[1:]]
        total = (PACKAGE + " (all)", sum(row[1] for row in package), sum(row[2] for row in package))
        rows = [*package, total, *table[len(package) :]]
        texts = [(name, str(files), f"{lines:,}") for name, files, lines in rows]
        return aligned([("room", "files", "lines"), *texts])
    chosen = {path: size for path, size in sizes.items() if room_of(path) == room}
    if not chosen:
        known = ", ".join(sorted({room_of(path) for path in sizes}))
        raise LookupError(f"no room {room!r}; rooms are {known}")
    ordered = sorted(chosen.items(), key=lambda item: (-item[1], item[0]))
    texts_of_files = [(str(path.relative_to(root)), f"{size:,}") for path, size in ordered]
    return aligned(
        [
            ("file", "lines"),
            *texts_of_files,
            (f"{room} ({len(chosen)} files)", f"{sum(chosen.values()):,}"),
        ]
    )


def main() -> None:
    """Parse the command line and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("room", nargs="?", help="list the files of this room")
    parser.add_argument("--root", type=Path, default=ROOT, help="checkout to count")
    options = parser.parse_args()
    root = options.root.resolve()
    try:
        text = report(sizes_of(root), root, options.room)
    except LookupError as error:
        parser.error(str(error.args[0]))
    sys.stdout.write(text + "\n")


if __name__ == "__main__":
    main()
