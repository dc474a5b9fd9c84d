"""Solutions kept on disk: what was solved once is known to all processes of a user, and later ones.

A SQLite file in the user's cache folder: several processes may read and write it, and none of them
ever fails for it. What cannot be read is solved anew, what cannot be written is forgotten.
"""

from __future__ import annotations

import atexit
import os
import sqlite3
import zlib
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Final

from platformdirs import user_cache_path

FOLDER_VARIABLE: Final = "INTERNAV_CACHE_DIR"
"""A folder to keep solutions in rather than the user's cache folder; empty: keep none."""
FILE_NAME: Final = "solutions.sqlite"
BYTES_AT_MOST: Final = 1 << 30
"""About 150,000 pushes. A file that has filled up is begun anew by the next process."""
_PAGE: Final = 4096
_WAIT_S: Final = 0.2
"""How long another process's writing is waited for: a solution takes some milliseconds."""
_AT_ONCE: Final = 32
"""Values written down together: one by one each would cost a tenth of what it saves."""
_VALUE_AT_MOST: Final = 4 << 20
"""Longer values are neither kept nor read: a push of twenty things takes a tenth of it."""
_CHECK: Final = 4
"""Bytes of a value's CRC-32, before the value itself."""


def cache_folder() -> Path | None:
    """Return the folder for solutions, whether it exists or not; None where none are kept."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    if chosen is None:
        return user_cache_path("internav", appauthor=False)
    return Path(chosen) if chosen else None


class Solutions:
    """Values under keys, both bytes; kept for as long as the file is.

    Parameters
    ----------
    folder
        Where the file is, or will be; None: nothing is kept.
    """

    def __init__(self, folder: Path | None) -> None:
        self._file: sqlite3.Connection | None = None
        self._process = os.getpid()
        self._new: list[tuple[bytes, bytes]] = []
        if folder is not None:
            with suppress(OSError, sqlite3.Error):
                folder.mkdir(mode=0o700, parents=True, exist_ok=True)
                self._file = _opened(folder / FILE_NAME)

    def get(self, key: bytes) -> bytes | None:
        """Return what was kept under a key; None where nothing was, or it is damaged."""
        rows = self._ask("SELECT value FROM solutions WHERE key = ?", key)
        if not rows or not isinstance(rows[0][0], bytes):
            return None
        check, value = rows[0][0][:_CHECK], rows[0][0][_CHECK:]
        return value if check == _checked(value) else None

    def put(self, key: bytes, value: bytes) -> None:
        """Keep a value, if that is possible: written down with the next few."""
        if self._file is not None and len(value) < _VALUE_AT_MOST:
            self._new.append((key, _checked(value) + value))
            if len(self._new) >= _AT_ONCE:
                self.flush()

    def flush(self) -> None:
        """Write down what was put."""
        rows, self._new = self._new, []
        if rows and self._ask("BEGIN IMMEDIATE") is not None:
            for row in rows:
                self._ask("INSERT OR REPLACE INTO solutions VALUES (?, ?)", *row)
            self._ask("COMMIT")

    def count(self) -> int:
        """Count what is kept."""
        self.flush()
        rows = self._ask("SELECT count(*) FROM solutions")
        return int(rows[0][0]) if rows else 0

    def _ask(self, question: str, *values: bytes) -> list[Any] | None:
        """Return the rows of an answer; None where the file is of no use."""
        if self._file is None or self._process != os.getpid():  # SQLite forbids it across forks
            return None
        try:
            return self._file.execute(question, values).fetchall()
        except sqlite3.OperationalError:  # locked, full, read-only
            return None
        except sqlite3.DatabaseError:  # damaged: the next process finds that too, and begins anew
            self._file = None
            return None


def _opened(path: Path) -> sqlite3.Connection:
    if path.exists() and path.stat().st_size > BYTES_AT_MOST - (1 << 20):
        path.unlink()
    try:
        return _connected(path)
    except sqlite3.OperationalError:
        raise
    except sqlite3.DatabaseError:
        # No database, or a damaged one: nothing in it is worth more than its making.
        path.unlink()
        return _connected(path)


def _connected(path: Path) -> sqlite3.Connection:
    # Worlds may be stepped in any thread, if in one at a time.
    file = sqlite3.connect(path, timeout=_WAIT_S, isolation_level=None, check_same_thread=False)
    file.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _VALUE_AT_MOST + _CHECK)
    file.execute("PRAGMA trusted_schema = OFF")
    # Nothing is waited for until it lies on the disk: a solution lost is solved again, and a power
    # cut's damage is told by the check sums.
    file.execute("PRAGMA synchronous = OFF")
    file.execute("PRAGMA journal_mode = TRUNCATE")
    file.execute(f"PRAGMA max_page_count = {BYTES_AT_MOST // _PAGE}")
    file.execute(
        "CREATE TABLE IF NOT EXISTS solutions (key BLOB PRIMARY KEY, value BLOB) WITHOUT ROWID"
    )
    file.execute("SELECT key, value FROM solutions LIMIT 1").fetchone()
    return file


def _checked(value: bytes) -> bytes:
    return zlib.crc32(value).to_bytes(_CHECK, "little")


def solutions() -> Solutions:
    """Return this process's view of the solutions; a forked process opens its own."""
    return _of_process(os.getpid())


@cache  # not the last one only: what a forked process inherits must not be closed in it
def _of_process(_pid: int) -> Solutions:
    opened = Solutions(cache_folder())
    atexit.register(opened.flush)
    return opened
