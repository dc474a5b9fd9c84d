"""File on disk from keys to values, both bytes, shared by all processes of a user.

Its values are solutions of physics, of which it knows nothing: keys, packing and the engine that
asks are in `cache`. It is a SQLite file in the user's cache folder, which several processes may
read and write at once. Cache errors are never raised: unreadable entries are recomputed,
unwritable ones dropped.

The file is a queue: new values go to its end, in batches, and the oldest batches leave once it is
full. A value that is read from the older half of a file that fills up goes to the end once more,
so that those leave which nobody has asked for longest.
"""

from __future__ import annotations

import atexit
import os
import sqlite3
import warnings
import zlib
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from platformdirs import user_cache_path

from internav_data.core.locks import ThreadLock, once_per_process
from internav_data.physics.result_index import PREFIX, RowIndex, prefix_of

FOLDER_VARIABLE: Final = "INTERNAV_CACHE_DIR"
"""Environment variable with a folder for the cache instead of the user's; empty for no cache."""
FILE_NAME: Final = "solutions.sqlite"
MAX_BYTES: Final = 2 << 30
"""Maximum size of the values on disk, about 500,000 pushes of one object each."""
OPENING_S: Final = 5.0
"""Time to wait for a lock while opening, long enough for a busy moment of other processes."""
WAIT_S: Final = 0.2
"""Time to wait for a lock later: solving anew takes some milliseconds."""
_BATCH: Final = 256
"""Values written in one transaction. Each one writes some ten pages besides its values."""
_MAX_VALUE_BYTES: Final = 4 << 20
"""Longer values are neither kept nor read: a push takes a thousandth of it."""
_CHECK: Final = 4
"""Length of the CRC-32 that stands before each value, bytes: of its key, then the value."""
_SLACK_BYTES: Final = 64 << 10
"""Room for what a transaction writes besides its values."""
_MAX_ROW: Final = 1 << 62
_TABLES: Final = (
    "CREATE TABLE batches (first INTEGER PRIMARY KEY, prefixes BLOB NOT NULL)",
    "CREATE TABLE solutions (id INTEGER PRIMARY KEY, value BLOB NOT NULL)",
)
"""Values by row, and for each batch the number of its first row with the prefixes of its keys."""


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
    """Mapping from keys to values, both bytes, in a file. Threads may share it.

    Parameters
    ----------
    folder
        Folder of the file, made if missing; None for a cache that keeps nothing.

    """

    def __init__(self, folder: Path | None) -> None:
        self._file: sqlite3.Connection | None = None
        self._process = os.getpid()
        self._lock = ThreadLock()
        self._new: dict[bytes, bytes] = {}
        self._index = RowIndex()
        self._useless: set[bytes] = set()
        """Keys whose row holds no value of theirs: it was deleted, or is damaged."""
        self._oldest = self._middle = 0
        if folder is not None:
            self._path = folder / FILE_NAME
            with suppress(OSError, sqlite3.Error):
                folder.mkdir(mode=0o700, parents=True, exist_ok=True)
                self._file = _opened(self._path)
                self._read_index()

    @property
    def is_open(self) -> bool:
        """Whether values can be kept: the file is usable and was opened by this process."""
        return self._file is not None and self._process == os.getpid()

    def get(self, key: bytes) -> bytes | None:
        """Return the value of a key; None if there is none or it is damaged."""
        with self._lock:
            kept = self._new.get(key)
            if kept is not None:
                return kept
            row = self._index.row(key)
            if row is None and self._read_index():
                row = self._index.row(key)
            if row is None:
                return None
            rows = self._ask("SELECT value FROM solutions WHERE id = ?", row)
            stored = rows[0][0] if rows else None
            value = stored[_CHECK:] if isinstance(stored, bytes) else b""
            if not isinstance(stored, bytes) or stored[:_CHECK] != _checked(key, value):
                self._useless.add(key)
                return None
            if row < self._middle:
                self.put(key, value)
            return value

    def put(self, key: bytes, value: bytes) -> None:
        """Keep a value if possible; it is written together with the next few."""
        with self._lock:
            if self.is_open and len(value) < _MAX_VALUE_BYTES:
                self._new[key] = value
                if len(self._new) >= _BATCH:
                    self.flush()

    def flush(self) -> None:
        """Write the values that were put since the last flush."""
        with self._lock:
            new, self._new = self._new, {}
            if not new or self._ask("BEGIN IMMEDIATE") is None:
                return
            try:
                self._read_index()
                new = {key: value for key, value in new.items() if not self._is_written(key)}
                self._useless.clear()
                if new and self._make_room(sum(map(len, new.values()))) and self._append(new):
                    self._ask("COMMIT")
            finally:
                # After an interrupt too: an open transaction would lock out all other processes.
                if self._file is not None and self._file.in_transaction:
                    self._ask("ROLLBACK")
            self._read_index()

    def drop(self, why: str) -> None:
        """Delete all values, of all processes, and warn."""
        with self._lock:
            self._new.clear()
            begun = self._ask("BEGIN IMMEDIATE") is not None
            self._read_index()  # others may have written since: no row number comes again
            self._index.clear()
            # The empty batch keeps row numbers growing, by which other processes read on.
            marker = (self._index.end, b"")
            done = (
                begun
                and self._ask("DELETE FROM solutions") is not None
                and self._ask("DELETE FROM batches") is not None
                and self._ask("INSERT INTO batches VALUES (?, ?)", *marker) is not None
                and self._ask("COMMIT") is not None
            )
            if not done:
                self._give_up()
        warnings.warn(f"{self._path}: {why}; all solutions in it are deleted", stacklevel=2)

    def count(self) -> int:
        """Return the number of values kept."""
        self.flush()
        with self._lock:
            rows = self._ask("SELECT count(*) FROM solutions")
        return int(rows[0][0]) if rows else 0

    def _is_written(self, key: bytes) -> bool:
        """Return whether another process has written a key meanwhile."""
        row = self._index.row(key)
        return row is not None and row >= self._middle and key not in self._useless

    def _append(self, new: dict[bytes, bytes]) -> bool:
        first = self._index.end
        prefixes = b"".join(map(prefix_of, new))
        if self._ask("INSERT INTO batches VALUES (?, ?)", first, prefixes) is None:
            return False
        return all(
            self._ask("INSERT INTO solutions VALUES (?, ?)", row, _checked(key, value) + value)
            is not None
            for row, (key, value) in enumerate(new.items(), first)
        )

    def _make_room(self, needed: int) -> bool:
        """Delete the oldest batches until new values fit; return whether they do."""
        # Values fill pages to three quarters.
        while self._used_bytes() + 3 * needed // 2 + _SLACK_BYTES > MAX_BYTES:
            rows = self._ask("SELECT first FROM batches ORDER BY first LIMIT 2")
            if not rows:
                return False
            end = rows[1][0] if len(rows) > 1 else self._index.end
            if (
                self._ask("DELETE FROM solutions WHERE id < ?", end) is None
                or self._ask("DELETE FROM batches WHERE first < ?", end) is None
            ):
                return False
        return True

    def _used_bytes(self) -> int:
        asked = ("PRAGMA page_count", "PRAGMA freelist_count", "PRAGMA page_size")
        found = [self._ask(question) or [(0,)] for question in asked]
        pages, free, page = (int(rows[0][0]) for rows in found)
        return (pages - free) * page

    def _find_middle(self) -> None:
        """Find the rows from which values go to the end again when they are read."""
        rows = self._ask("SELECT min(first) FROM batches")
        self._oldest = (rows[0][0] or 0) if rows else 0
        full = self._used_bytes() > MAX_BYTES // 2
        self._middle = (self._oldest + self._index.end) // 2 if full else 0

    def _read_index(self) -> bool:
        """Read the batches written since the last time; return whether there were any."""
        rows = self._ask(
            "SELECT first, prefixes FROM batches WHERE first >= ? ORDER BY first", self._index.end
        )
        if not rows:
            return False
        if not all(
            isinstance(prefixes, bytes) and len(prefixes) % PREFIX == 0 and 0 < first < _MAX_ROW
            for first, prefixes in rows
        ):
            self._give_up()
            return False
        self._index.add(rows, self._oldest)
        self._find_middle()
        return True

    def _give_up(self) -> None:
        """Close and delete the file; the next process starts an empty one."""
        file, self._file = self._file, None
        with suppress(OSError, sqlite3.Error):
            if file is not None:
                file.close()
            self._path.unlink()

    def _ask(self, question: str, *values: bytes | int) -> list[Any] | None:
        """Return the rows that a statement gives; None if it failed."""
        if self._file is None or self._process != os.getpid():  # SQLite forbids it across forks
            return None
        try:
            return self._file.execute(question, values).fetchall()
        except sqlite3.OperationalError:  # locked, full, read-only
            return None
        except (sqlite3.Error, UnicodeDecodeError):  # damaged, its error's text perhaps too
            self._give_up()
        return None


def _opened(path: Path) -> sqlite3.Connection:
    try:
        return _connected(path)
    except sqlite3.OperationalError:
        raise
    except (sqlite3.DatabaseError, UnicodeDecodeError):
        # No database, a damaged or another one: solving its entries again costs little. SQLite's
        # errors quote what is damaged, which need not be text.
        path.unlink()
        return _connected(path)


def _connected(path: Path) -> sqlite3.Connection:
    # In any thread: `ResultCache` lets in one at a time.
    file = sqlite3.connect(path, timeout=OPENING_S, isolation_level=None, check_same_thread=False)
    file.text_factory = bytes  # the schema's text, too, may be damaged
    file.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _MAX_VALUE_BYTES + _CHECK)
    file.execute("PRAGMA trusted_schema = OFF")
    # No waiting for the disk: a lost solution is solved again, and the checksums find the damage
    # of a power cut.
    file.execute("PRAGMA synchronous = OFF")
    file.execute("PRAGMA journal_mode = TRUNCATE")
    # A freed page need not be overwritten: it would be written once more.
    file.execute("PRAGMA secure_delete = OFF")
    schema = "SELECT type, sql FROM sqlite_schema ORDER BY name"
    if not file.execute(schema).fetchall():
        with suppress(sqlite3.OperationalError):
            file.executescript(f"BEGIN IMMEDIATE; {'; '.join(_TABLES)}; COMMIT")
        if file.in_transaction:  # another process made the tables first: let it write
            file.execute("ROLLBACK")
    found = file.execute(schema).fetchall()
    if not found:
        raise sqlite3.OperationalError(
            f"{path} is locked or read-only"
        )  # in use elsewhere: keep it
    if found != [(b"table", table.encode()) for table in _TABLES]:
        file.close()
        raise sqlite3.DatabaseError(f"{path} holds something else: {found}")
    file.execute(f"PRAGMA busy_timeout = {round(1000 * WAIT_S)}")
    return file


def _checked(key: bytes, value: bytes) -> bytes:
    return zlib.crc32(value, zlib.crc32(key)).to_bytes(_CHECK, "little")


@once_per_process
def result_cache() -> ResultCache:
    """Return this process's result cache; a forked process opens its own."""
    opened = ResultCache(cache_folder())
    atexit.register(opened.flush)
    return opened
