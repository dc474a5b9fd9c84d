"""Stores: named blobs that are complete or absent, and the folder of files that is one.

Linking, renaming, locking and waiting for the disk happen here and nowhere else, so that a bucket
or a test's dictionary can stand in for a folder.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import itertools
import os
import re
import shutil
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, runtime_checkable

from internav_data.core.files import check_replaceable, open_regular, size_of_regular
from internav_data.core.holders import lock_holder
from internav_data.core.machine import WINDOWS
from internav_data.records.errors import InternavError, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager
    from typing import BinaryIO

_BLOCK = 1 << 20
_PIECE = 4 << 20
"""Bytes of a blob that are read at once: a request each, where it is in a bucket."""
_ENDING_S = 1.0
"""Seconds that the children of a killed process, which hold its lock too, may take to end."""
_POLL_S = 0.02
_EXHAUSTED = {errno.EMFILE, errno.ENFILE, errno.EAGAIN, errno.ENOMEM}
"""Errors of a system that has no more open files, processes or memory to give."""
TEMPORARY = ".tmp"
"""Suffix of unfinished files in a folder; a kill leaves one behind."""
_TEMPORARY_NAME = re.compile(rf"((?:.*/)?)\.([^/]+)\.\d+{re.escape(TEMPORARY)}")


class LockedError(InternavError):
    """Another process holds the lock of the store."""


class StoreError(InternavError):
    """A store that is far away cannot be reached, read or written; its data need not be damaged."""


class OutsideError(UsageError):
    """A folder of the store is a link out of it: nothing is written or removed through it."""


@runtime_checkable
class Store(Protocol):
    """Named blobs. Names are relative paths with forward slashes.

    A store travels pickled to worker processes. Reading what is not there raises
    FileNotFoundError, any other failure another OSError, or StoreError where that says more.
    """

    def at(self, name: str) -> str:
        """Return the place of a blob for error messages."""
        ...

    def size(self, name: str) -> int:
        """Return the number of bytes of a blob.

        Raises
        ------
        FileNotFoundError
            There is no such blob.

        """
        ...

    def read(self, name: str, start: int = 0, stop: int | None = None) -> bytes:
        """Return the bytes start … stop - 1 of a blob; fewer where it ends earlier."""
        ...

    def source(self, name: str) -> Path | BinaryIO:
        """Return a blob as a path, or as a file that can be read and sought."""
        ...

    def put(self, name: str, data: bytes, *, beside: str = "") -> None:
        """Store a blob durably: readers see the old one or the new one, never a part.

        Parameters
        ----------
        name, data
            Name and content of the blob.
        beside
            Name of a blob that must be there; with it, no removed folder is made again.

        Raises
        ------
        FileNotFoundError
            There is no blob `beside`.

        """
        ...

    def names(self, prefix: str = "") -> list[str]:
        """Return the names that begin with `prefix` (empty, or ending in a slash), sorted."""
        ...

    def remove(self, name: str) -> None:
        """Remove a blob; nothing if there is none."""
        ...

    def prune(self, prefix: str) -> None:
        """Remove the folders below a prefix that hold nothing, in a store that has folders.

        Nobody may be about to put something there.
        """
        ...

    def lock(self, busy: str) -> AbstractContextManager[None]:
        """Hold the store's only lock.

        Raises
        ------
        LockedError
            Another process holds it; `busy` says what to do.

        """
        ...


StoreLike: TypeAlias = "str | Path | Store"
"""A store; or the folder that is one, or the URL `s3://bucket/prefix`, also as a path."""


def store_of(root: StoreLike) -> Store:
    """Return a store: that of a folder where a path is given, that of a bucket for its URL.

    Raises
    ------
    UsageError
        A URL names no bucket.

    """
    if isinstance(root, Store):
        return root
    if str(root).startswith("s3:/"):
        from internav_data.core.object_store import ObjectStore  # noqa: PLC0415 - it imports us

        return ObjectStore.of(str(root))
    return FolderStore(Path(root))


def temporary_of(name: str) -> str:
    """Return the name of the unfinished file that this process writes before one of a name."""
    folder, slash, last = name.rpartition("/")
    return f"{folder}{slash}.{last}.{os.getpid()}{TEMPORARY}"


def final_of(name: str) -> str | None:
    """Return the name for which a file was being written; None if it is no temporary one."""
    found = _TEMPORARY_NAME.fullmatch(name)
    return None if found is None else "".join(found.groups())


def exists(store: Store, name: str) -> bool:
    """Return whether a store has a blob of this name."""
    try:
        store.size(name)
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True


@dataclass(frozen=True, slots=True)
class FolderStore:
    """A folder as a store: a file is a blob."""

    root: Path
    """Folder; made when something is first put into it."""

    def at(self, name: str) -> str:
        """Return the path of a file."""
        return str(self.root / name)

    def size(self, name: str) -> int:
        """Return the number of bytes of a file, or of the one that a link leads to.

        Raises
        ------
        FileNotFoundError
            There is no such file.
        OSError
            It is a folder, pipe, socket or device.

        """
        return size_of_regular(self.root / name)

    def read(self, name: str, start: int = 0, stop: int | None = None) -> bytes:
        """Return the bytes start … stop - 1 of a file; fewer where it ends earlier."""
        with open_regular(self.root / name) as stream:
            stream.seek(start)
            return stream.read(-1 if stop is None else stop - start)

    def source(self, name: str) -> Path:
        """Return the path of a file."""
        return self.root / name

    def put(self, name: str, data: bytes, *, beside: str = "") -> None:
        """Write a file durably: readers see the old one or the new one, never a part.

        It takes the place of a link, whose target stays as it is.

        Raises
        ------
        FileNotFoundError
            There is no file `beside`.
        OutsideError
            Its folder is a link out of this one.

        """
        path = self._inside(self.root / name)
        if beside:
            self.size(beside)
            _make_folders(path.parent, (self.root / beside).parent)
            _write_atomically(path, data)
        else:
            write_atomically(path, data)

    def names(self, prefix: str = "") -> list[str]:
        """Return the names of the files below a folder, links to folders too, sorted.

        Raises
        ------
        NotADirectoryError
            The store itself is a file.

        """
        if self.root.exists() and not self.root.is_dir():
            raise NotADirectoryError(f"{self.root} is a file")
        found = (self.root / prefix).rglob("*")
        files = (path for path in found if not path.is_dir() or path.is_symlink())
        return sorted(path.relative_to(self.root).as_posix() for path in files)

    def remove(self, name: str) -> None:
        """Remove a file or a link; nothing if there is none.

        Raises
        ------
        OutsideError
            Its folder is a link out of this one.

        """
        self._inside(self.root / name).unlink(missing_ok=True)

    def prune(self, prefix: str) -> None:
        """Remove the folders below a prefix that hold nothing; links are not followed.

        Raises
        ------
        OutsideError
            The prefix is a link out of this folder.

        """
        for folder, _, _ in os.walk(self._inside(self.root / prefix / "any").parent, topdown=False):
            with contextlib.suppress(OSError):  # it holds something
                Path(folder).rmdir()

    def _inside(self, path: Path) -> Path:
        """Return a path whose folder lies in the store."""
        folder = Path(os.path.realpath(path.parent))
        if not folder.is_relative_to(os.path.realpath(self.root)):
            raise OutsideError(
                f"{path.parent}: leads out of {self.root} by a link, and nothing is written or "
                "removed there: put the folder itself in the link's place"
            )
        return path

    @contextlib.contextmanager
    def lock(self, busy: str) -> Iterator[None]:
        """Hold the folder's lock, which the kernel opens when its holder dies.

        The folder is made if it is missing; nothing is written into it.

        Raises
        ------
        LockedError
            Another process holds it; `busy` says what to do, and the process is named.

        """
        _make_folders(self.root)
        with hold_lock(*_lock_file(self.root), str(self.root), busy):
            yield


@contextlib.contextmanager
def hold_lock(path: Path, flags: int, place: str, busy: str) -> Iterator[None]:
    """Hold the lock of a file, which the kernel opens when its holder dies.

    Parameters
    ----------
    path, flags
        File whose lock it is, and the flags to open it with.
    place, busy
        Place of the store, and what to do while another process holds it.

    Raises
    ------
    LockedError
        Another process holds it; it is named.

    """
    descriptor = os.open(path, flags)
    _HELD.add(descriptor)
    try:
        # Some network file systems cannot lock folders: there we trust the user.
        with contextlib.suppress(OSError):
            deadline = time.monotonic() + _ENDING_S
            while not try_lock(descriptor):
                if time.monotonic() > deadline:
                    holder = lock_holder(descriptor)
                    named = f" (held by {holder})" if holder else ""
                    raise LockedError(f"{place}: {busy}{named}")
                time.sleep(_POLL_S)
        yield
    finally:
        _HELD.discard(descriptor)
        os.close(descriptor)


@contextlib.contextmanager
def disk_errors(
    place: object, then: str = "run the same command again: finished scenes are kept"
) -> Iterator[None]:
    """Turn errors of the disk into one that says what to do.

    Parameters
    ----------
    place
        Store or folder that is named where an error names no file.
    then
        Advice for when there is room again.

    Raises
    ------
    InternavError
        The disk is full, read-only, or otherwise fails; or the system has no more files, processes
        or memory to give.

    """
    try:
        yield
    except OSError as error:
        where = error.filename or place
        reason = f"{error.strerror or error}{_free_bytes(error, place)}"
        if error.errno in _EXHAUSTED:
            raise InternavError(
                f"{where}: {reason}: ask for fewer workers, or raise the limit of the system "
                f"(ulimit -n: open files, -u: processes, -v: memory); then {then}"
            ) from error
        raise InternavError(
            f"cannot write to {where}: {reason}; make it writable or free some space, then {then}"
        ) from error


def _free_bytes(error: OSError, place: object) -> str:
    """Return how much is free at a place, for the error of a full disk; empty for any other.

    Much that is free tells that a quota, or the number of files, is what has run out.
    """
    if error.errno != errno.ENOSPC or "://" in str(place):
        return ""
    for folder in (Path(str(place)), *Path(str(place)).parents):
        with contextlib.suppress(OSError):
            return f" ({shutil.disk_usage(folder).free:,} bytes free)"
    return ""


def _lock_file(folder: Path) -> tuple[Path, int]:
    """Return the file whose lock is that of a folder, and the flags to open it with.

    It is the folder itself. Windows opens no folder: there a file of the user's temporary folder
    stands for it, and processes of other machines are not kept out.
    """
    if not WINDOWS:
        return folder, os.O_RDONLY
    return lock_file_for(os.path.realpath(folder))


def lock_file_for(place: str) -> tuple[Path, int]:
    """Return the file of the user's temporary folder whose lock is that of a place, and flags."""
    import tempfile  # noqa: PLC0415 - slow to import, and of use here alone

    name = hashlib.sha256(place.encode()).hexdigest()[:32]
    return Path(tempfile.gettempdir(), f"internav-{name}.lock"), os.O_RDWR | os.O_CREAT


def try_lock(descriptor: int) -> bool:
    """Lock a file if nobody else holds its lock, and return whether nobody does."""
    if WINDOWS:
        import msvcrt  # noqa: PLC0415 - of Windows alone

        lock: Any = msvcrt
        try:
            lock.locking(descriptor, lock.LK_NBLCK, 1)
        except PermissionError:
            return False
        return True
    import fcntl  # noqa: PLC0415 - of POSIX alone; readers need no lock

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


_HELD: set[int] = set()


def held_locks() -> tuple[int, ...]:
    """Return the file descriptors of the locks that this process holds.

    A child process that inherits them keeps the folders locked for as long as it lives.
    """
    return tuple(_HELD)


@contextlib.contextmanager
def lock_folder(folder: Path, busy: str) -> Iterator[None]:
    """Hold a folder's lock, see `FolderStore.lock`; new folders that stay empty are removed.

    Raises
    ------
    LockedError
        Another process holds it; `busy` says what to do, and the process is named.

    """
    new = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        with FolderStore(folder).lock(busy):
            yield
    finally:
        with contextlib.suppress(OSError):  # something was written
            for each in new:
                each.rmdir()


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file by way of a temporary one beside it: readers see the old or the new one.

    After an error (a full disk, an interrupt) the temporary file is removed and `path` is as it
    was before. A device, pipe, socket or folder is refused.
    """
    _make_folders(path.parent)
    _write_atomically(path, data)


def _make_folders(folder: Path, top: Path | None = None) -> None:
    """Make a folder and those above it, never `top` itself, and wait until they are on the disk."""
    if folder != top and not folder.is_dir():
        _make_folders(folder.parent, top)
        folder.mkdir(exist_ok=True)
        with contextlib.suppress(PermissionError):  # one may write there, and not read
            sync(folder.parent)


def _write_atomically(path: Path, data: bytes) -> None:
    check_replaceable(path)  # /dev/null would be a plain file from then on
    temporary = _new(path, Path.touch)
    try:
        temporary.write_bytes(data)
        sync(temporary)
        temporary.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise
    sync(path.parent)


def write_folder_atomically(folder: Path, fill: Callable[[Path], object]) -> None:
    """Let `fill` write into a temporary folder beside `folder`, which must be new, then rename it.

    After an error nothing stays behind.
    """
    _make_folders(folder.parent)
    temporary = _new(folder, Path.mkdir)
    try:
        fill(temporary)
        sync(temporary)
        temporary.rename(folder)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
    sync(folder.parent)


def _new(path: Path, make: Callable[..., object]) -> Path:
    """Make a temporary file or folder beside a path, over none that is there."""
    for number in itertools.count():
        name = f"{path.name}.{number}" if number else path.name
        temporary = path.with_name(temporary_of(name))
        with contextlib.suppress(FileExistsError):
            make(temporary, exist_ok=False)
            return temporary
    raise AssertionError  # pragma: no cover - numbers do not end


def sync(path: Path) -> None:
    """Wait until a file or folder is on the disk; Windows waits for files alone."""
    if WINDOWS and path.is_dir():
        return
    descriptor = os.open(path, os.O_RDWR if WINDOWS else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def content_sha256(store: Store, name: str, size: int) -> str:
    """Return the sha256 of a blob of `size` bytes, read a few megabytes at a time."""
    digest = hashlib.sha256()
    for start in range(0, size, _PIECE):
        digest.update(store.read(name, start, min(start + _PIECE, size)))
    return digest.hexdigest()


def file_sha256(path: Path) -> str:
    """Return the sha256 of a file's bytes, 64 hexadecimal digits."""
    digest = hashlib.sha256()
    with open_regular(path) as stream:
        while block := stream.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()
