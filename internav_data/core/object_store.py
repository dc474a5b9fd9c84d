"""A prefix of a bucket as a store: `s3://bucket/prefix`, by pyarrow.

An object is put in one request, or in parts that become one object at the end: it is complete or
absent, as a file that is renamed into place. A bucket has no lock that other machines see.
Credentials, region and endpoint are those that other programs take: environment variables, the
files of `~/.aws`, or the machine's role.
"""

from __future__ import annotations

import contextlib
import functools
import os
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, BinaryIO, Final, cast

from internav_data.core.ranges_file import PositionedFile
from internav_data.core.storage import StoreError, hold_lock, lock_file_for
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pyarrow import NativeFile, fs

_URL: Final = re.compile(r"s3:/{1,2}([^/]+)/+(.*[^/])/*")
"""Bucket and prefix of a URL; as a `Path`, one has a single slash at its beginning."""
_VARIABLES: Final = ("AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL", "AWS_REGION", "AWS_DEFAULT_REGION")
"""Environment variables that pyarrow leaves to its caller."""
_MAX_ATTEMPTS: Final = 8
"""Tries of a request, with longer and longer pauses: 25 s in all."""
_AWS_ERROR: Final = re.compile(r"AWS Error (\w+)(?: \(HTTP status (\d+)\))? during (\w+) operation")
_AGAIN: Final = "what is finished is kept, run the same command again"
_LATER: Final = f"{_AGAIN} later, or with fewer --workers"
_KINDS: Final = {
    "ACCESS_DENIED": ("access is denied", "give these credentials the right to do it"),
    "INVALID_ACCESS_KEY_ID": ("the access key is not valid", "name another by AWS_PROFILE"),
    "NETWORK_CONNECTION": ("the connection was lost", _AGAIN),
    "NO_SUCH_BUCKET": ("there is no such bucket", "make it first"),
    "SIGNATURE_DOES_NOT_MATCH": ("the secret key is not valid", "name another by AWS_PROFILE"),
    "SLOW_DOWN": ("requests are throttled", _LATER),
    "THROTTLING": ("requests are throttled", _LATER),
}
"""Names of the library's errors: what happened, and the remedy."""
_STATUS: Final = {"403": "ACCESS_DENIED", "429": "THROTTLING", "503": "SLOW_DOWN"}
"""Names of errors for answers without a body, as those to HEAD are."""


@dataclass(frozen=True, slots=True)
class ObjectStore:
    """A prefix of a bucket as a store: an object is a blob."""

    url: str
    """`s3://bucket/prefix`, without a slash at the end."""

    @classmethod
    def of(cls, place: str) -> ObjectStore:
        """Return the store of a URL, or of one that was a path: `s3:/bucket/prefix`.

        Raises
        ------
        UsageError
            It names no bucket, or no prefix.

        """
        found = _URL.fullmatch(place)
        if found is None:
            raise UsageError(f"{place}: expected s3://bucket/prefix")
        return cls("s3://{}/{}".format(*found.groups()))

    def at(self, name: str) -> str:
        """Return the URL of an object."""
        return f"{self.url}/{name}" if name else self.url

    def size(self, name: str) -> int:
        """Return the number of bytes of an object.

        Raises
        ------
        FileNotFoundError
            There is no such object.
        StoreError
            The bucket cannot be reached or read.

        """
        from pyarrow import fs  # noqa: PLC0415 - slow to import, and of use here alone

        with self._errors(name):
            info = self._client().get_file_info(self._key(name))
        if info.type is not fs.FileType.File:
            raise FileNotFoundError(2, "no such object", self.at(name))
        return cast("int", info.size)

    def read(self, name: str, start: int = 0, stop: int | None = None) -> bytes:
        """Return the bytes start … stop - 1 of an object; fewer where it ends earlier.

        Raises
        ------
        FileNotFoundError
            There is no such object.
        StoreError
            The bucket cannot be reached or read.

        """
        with self._errors(name), self._client().open_input_file(self._key(name)) as file:
            end = file.size() if stop is None else min(stop, file.size())
            return cast("bytes", file.read_at(end - start, start)) if start < end else b""

    def source(self, name: str) -> BinaryIO:
        """Return an object as a file that can be read and sought: a request for each read."""
        with self._errors(name):
            file = self._client().open_input_file(self._key(name))
            return cast("BinaryIO", _ObjectFile(self.at(name), file))

    def put(self, name: str, data: bytes, *, beside: str = "") -> None:
        """Store an object: readers see the old one or the new one, never a part.

        Raises
        ------
        FileNotFoundError
            There is no object `beside`.
        StoreError
            The bucket cannot be reached or written, or the connection was lost on the way.

        """
        if beside:
            self.size(beside)
        with self._errors(name):
            stream = self._client().open_output_stream(self._key(name))
            stream.write(data)
            stream.close()  # not after an error: it would complete what was sent
        if (size := self.size(name)) != len(data):
            raise StoreError(f"{self.at(name)}: {size} of {len(data)} bytes arrived: {_AGAIN}")

    def names(self, prefix: str = "") -> list[str]:
        """Return the names that begin with a prefix, sorted.

        Raises
        ------
        StoreError
            The bucket cannot be reached or listed.

        """
        from pyarrow import fs  # noqa: PLC0415 - as above

        selector = fs.FileSelector(
            self._key(prefix).rstrip("/"), allow_not_found=True, recursive=True
        )
        with self._errors(prefix):
            found = self._client().get_file_info(selector)
        skipped = len(self._key(""))
        return sorted(info.path[skipped:] for info in found if info.type is fs.FileType.File)

    def remove(self, name: str) -> None:
        """Remove an object; nothing if there is none.

        Raises
        ------
        StoreError
            The bucket cannot be reached or written.

        """
        with contextlib.suppress(FileNotFoundError), self._errors(name):
            self._client().delete_file(self._key(name))

    def prune(self, prefix: str) -> None:
        """Remove the empty objects that stand for folders below a prefix that holds nothing.

        Raises
        ------
        StoreError
            The bucket cannot be reached or written.

        """
        if not self.names(prefix):
            with contextlib.suppress(FileNotFoundError), self._errors(prefix):
                self._client().delete_dir(self._key(prefix).rstrip("/"))

    @contextlib.contextmanager
    def lock(self, busy: str) -> Iterator[None]:
        """Hold the lock that processes of this machine share; others are not kept out.

        Raises
        ------
        LockedError
            Another process holds it; `busy` says what to do, and the process is named.

        """
        with hold_lock(*lock_file_for(self.url), self.url, busy):
            yield

    def _key(self, name: str) -> str:
        return f"{self.url.removeprefix('s3://')}/{name}"

    def _client(self) -> fs.S3FileSystem:
        bucket = self.url.removeprefix("s3://").partition("/")[0]
        return _client(bucket, tuple(map(os.environ.get, _VARIABLES)), os.getpid())

    def _errors(self, name: str) -> contextlib.AbstractContextManager[None]:
        return store_errors(self.at(name))


@contextlib.contextmanager
def store_errors(place: str) -> Iterator[None]:
    """Turn errors of pyarrow into FileNotFoundError or one line for a user.

    Parameters
    ----------
    place
        URL of the object.

    Raises
    ------
    FileNotFoundError
        There is no such object.
    StoreError
        Anything else.

    """
    try:
        yield
    except FileNotFoundError:
        raise FileNotFoundError(2, "no such object", place) from None
    except OSError as error:
        raise StoreError(f"{place}: {_reason(error)}") from error


def _reason(error: OSError) -> str:
    text = " ".join(str(error).split())
    found = _AWS_ERROR.search(text)
    if found is None:
        return f"{text[:200]}: {_AGAIN}"
    kind, status, operation = found.groups()
    what, remedy = _KINDS.get(kind) or _KINDS.get(_STATUS.get(status, "")) or (kind, _AGAIN)
    return f"{what} ({operation}): {remedy}"


@functools.lru_cache(maxsize=16)
def _client(bucket: str, variables: tuple[str | None, ...], _process: int) -> fs.S3FileSystem:
    """Return the client of a bucket; a forked process has clients of its own.

    Raises
    ------
    UsageError
        This pyarrow was built without S3.

    """
    try:
        from pyarrow.fs import (  # noqa: PLC0415 - slow to import, and of use here alone
            AwsStandardS3RetryStrategy,
            S3FileSystem,
            resolve_s3_region,
        )
    except ImportError as error:
        raise UsageError(
            f"s3://{bucket}: this pyarrow was built without S3: install the one of the package "
            "index (`pip install --force-reinstall pyarrow`)"
        ) from error
    endpoint = variables[0] or variables[1] or ""
    scheme, _, host = endpoint.rpartition("://")
    region = variables[2] or variables[3]
    options: dict[str, Any] = {"endpoint_override": host, "scheme": scheme or "https"}
    return S3FileSystem(
        region=region or ("us-east-1" if endpoint else resolve_s3_region(bucket)),
        allow_delayed_open=True,  # what is small goes in one request
        retry_strategy=AwsStandardS3RetryStrategy(max_attempts=_MAX_ATTEMPTS),
        **(options if endpoint else {}),
    )


class _ObjectFile(PositionedFile):
    """An object that is read a range at a time; see `ObjectStore.source`."""

    def __init__(self, place: str, file: NativeFile) -> None:
        super().__init__(file.size())
        self._place, self._file = place, file

    def fetch(self, start: int, end: int) -> bytes:
        with store_errors(self._place):
            return cast("bytes", self._file.read_at(end - start, start))

    def close(self) -> None:
        self._file.close()
        super().close()
