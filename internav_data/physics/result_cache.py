"""File on disk from keys to values, both bytes, shared by all processes of a user.

Its values are solutions of physics, of which it knows nothing: keys, packing and the engine that
asks are in `cache`. It is a SQLite file in the user's cache folder, which several processes may
read and write at once. Cache errors are never raised: unreadable entries are recomputed,
unwritable ones dropped.
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
"""Environment variable with a folder for the cache instead of the user's; empty for no cache."""
FILE_NAME: Final = "solutions.sqlite"
MAX_BYTES: Final = 1 << 30
"""Maximum size, about 150,000 pushes. The file is emptied once it is full."""
_PAGE: Final = 4096
OPENING_S: Final = 5.0
"""Time to wait for a lock while opening, long enough for a busy moment of other processes."""
WAIT_S: Final = 0.2
"""Time to wait for a lock later: solving anew takes some milliseconds."""
_BATCH: Final = 32
"""Values written in one transaction: one by one, each would cost a tenth of what it saves."""
_MAX_VALUE_BYTES: Final = 4 << 20
"""Longer values are neither kept nor read: a push of twenty objects takes a tenth of it."""
_CHECK: Final = 4
"""Length of the CRC-32 that stands before each value, bytes."""
_TABLE: Final = "CREATE TABLE solutions (key BLOB PRIMARY KEY, value BLOB) WITHOUT ROWID"


def cache_folder() -> Path | None:
    """Return the cache's folder, which need not exist; None if nothing is cached."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    if chosen is not None:
        return Path(chosen) if chosen else None
    with suppress(RuntimeError):  # a user without a home, as in some containers
        folder = user_cache_path("internav", appauthor=False)
        return folder if folder.is_absolute() else None
    return None


class ResultCache:
    """Mapping from keys to values, both bytes, in a file.

    Parameters
    ----------
    folder
        Folder of the file, made if missing; None for a cache that keeps nothing.

    """

    def __init__(self, folder: Path | None) -> None:
        self._file: sqlite3.Connection | None = None
        self._process = os.getpid()
        self._new: dict[bytes, bytes] = {}
        if folder is not None:
            self._path = folder / FILE_NAME
            with suppress(OSError, sqlite3.Error):
                folder.mkdir(mode=0o700, parents=True, exist_ok=True)
                self._file = _opened(self._path)

    @property
    def is_open(self) -> bool:
        """Whether values can be kept: the file is usable and was opened by this process."""
        return self._file is not None and self._process == os.getpid()

    def get(self, key: bytes) -> bytes | None:
        """Return the value of a key; None if there is none or it is damaged."""
        kept = self._new.get(key)
        if kept is None:
            rows = self._ask("SELECT value FROM solutions WHERE key = ?", key)
            kept = rows[0][0] if rows else None
        if not isinstance(kept, bytes):
            return None
        check, value = kept[:_CHECK], kept[_CHECK:]
        return value if check == _checked(value) else None

    def put(self, key: bytes, value: bytes) -> None:
        """Keep a value if possible; it is written together with the next few."""
        if self.is_open and len(value) < _MAX_VALUE_BYTES:
            self._new[key] = _checked(value) + value
            if len(self._new) >= _BATCH:
                self.flush()

    def flush(self) -> None:
        """Write the values that were put since the last flush."""
        rows, self._new = self._new, {}
        if not rows or self._ask("BEGIN IMMEDIATE") is None:
            return
        try:
            for row in rows.items():
                if self._ask("INSERT OR REPLACE INTO solutions VALUES (?, ?)", *row) is None:
                    return
            self._ask("COMMIT")
        finally:
            # After an interrupt too: an open transaction would lock out all other processes.
            if self._file is not None and self._file.in_transaction:
                self._ask("ROLLBACK")

    def count(self) -> int:
        """Return the number of values kept."""
        self.flush()
        rows = self._ask("SELECT count(*) FROM solutions")
        return int(rows[0][0]) if rows else 0

    def _ask(self, question: str, *values: bytes) -> list[Any] | None:
        """Return the rows that a statement gives; None if it failed."""
        if self._file is None or self._process != os.getpid():  # SQLite forbids it across forks
            return None
        try:
            return self._file.execute(question, values).fetchall()
        except sqlite3.OperationalError as error:  # locked, full, read-only
            if error.sqlite_errorcode == sqlite3.SQLITE_FULL and question.startswith("INSERT"):
                self._ask("ROLLBACK")
                self._ask("DELETE FROM solutions")
        except sqlite3.Error:  # damaged: drop the file, the next process starts an empty one
            file, self._file = self._file, None
            with suppress(OSError, sqlite3.Error):
                file.close()
                self._path.unlink()
        return None


def _opened(path: Path) -> sqlite3.Connection:
    try:
        return _connected(path)
    except sqlite3.OperationalError:
        raise
    except sqlite3.DatabaseError:
        # No database, a damaged or another one: solving its entries again costs little.
        path.unlink()
        return _connected(path)


def _connected(path: Path) -> sqlite3.Connection:
    # Worlds may be stepped in any thread, if in one at a time.
    file = sqlite3.connect(path, timeout=OPENING_S, isolation_level=None, check_same_thread=False)
    file.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _MAX_VALUE_BYTES + _CHECK)
    file.execute("PRAGMA trusted_schema = OFF")
    # No waiting for the disk: a lost solution is solved again, and the checksums find the damage
    # of a power cut.
    file.execute("PRAGMA synchronous = OFF")
    file.execute("PRAGMA journal_mode = TRUNCATE")
    file.execute(f"PRAGMA max_page_count = {MAX_BYTES // _PAGE}")
    with suppress(sqlite3.OperationalError):
        file.execute(_TABLE)
    found = file.execute("SELECT type, sql FROM sqlite_schema").fetchall()
    if not found:
        raise sqlite3.OperationalError(
            f"{path} is locked or read-only"
        )  # in use elsewhere: keep it
    if found != [("table", _TABLE)]:
        file.close()
        raise sqlite3.DatabaseError(f"{path} holds something else: {found}")
    file.execute(f"PRAGMA busy_timeout = {round(1000 * WAIT_S)}")
    return file


def _checked(value: bytes) -> bytes:
    return zlib.crc32(value).to_bytes(_CHECK, "little")


def result_cache() -> ResultCache:
    """Return this process's result cache; a forked process opens its own."""
    return _of_process(os.getpid())


@cache  # unbounded: a forked process must not close what it inherits
def _of_process(_pid: int) -> ResultCache:
    opened = ResultCache(cache_folder())
    atexit.register(opened.flush)
    return opened
