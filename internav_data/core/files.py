"""Small files from anywhere: read within limits, parsed strictly, refused in one line.

Every file that a user or a stranger may have written comes in here: configs, floor plans, lists of
actions, manifests, notes on meshes, the JSON of checkpoints and evaluations. Only regular files are
opened, as a pipe or a device can block or never end. Sizes, depths and numbers are bounded before
memory is taken or arithmetic is done with them.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import math
import os
import re
import stat
from collections import Counter
from dataclasses import dataclass
from datetime import date, time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from internav_data.records.errors import CorruptDataError, InternavError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping
    from typing import BinaryIO

DIGEST: Final = "sha256"
"""Key of a JSON file's digest of itself."""
_BLOCK: Final = 1 << 20
_SHOWN: Final = 40
"""Characters of a refused value that its error shows."""
_KINDS: Final = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
_OPENERS: Final = (b",", b"[", b"{", b"=")
_LONG_KEY: Final = re.compile(
    r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){33}"""
)
"""TOML's dotted keys take quadratic time in their length."""
_FLAGS: Final = (
    os.O_RDONLY
    # Absent on some systems: opening a pipe does not wait, and no terminal becomes ours.
    | getattr(os, "O_NONBLOCK", 0)
    | getattr(os, "O_NOCTTY", 0)
    | getattr(os, "O_BINARY", 0)
)


@dataclass(frozen=True, slots=True)
class FileLimits:
    """Limits of one kind of small file, and the words of its errors."""

    name: str = ""
    """Kind of file, in front of its path in errors: "config"."""
    error: type[InternavError] = CorruptDataError
    """Error to raise."""
    remedy: str = ""
    """Advice at the end of each error."""
    max_bytes: int = 1_000_000
    """Size of the file."""
    max_depth: int = 32
    """Lists and tables inside each other."""
    max_values: int = 100_000
    """Values, those in lists and tables counted each."""
    max_number: float = 2.0**64
    """Absolute value of each number."""

    def refusal(self, place: object, problem: str) -> InternavError:
        """Return the error for a file, in one line."""
        name = f"{self.name} {place}" if self.name else str(place)
        return self.error(": ".join(filter(None, (name, problem, self.remedy))))

    def unreadable(self, place: object, error: OSError) -> InternavError:
        """Return the error for a file that cannot be opened or read."""
        return self.refusal(place, f"cannot be read: {error.strerror or error}")


def open_regular(path: str | Path) -> BinaryIO:
    """Open a regular file to read bytes from it, without waiting for anybody; links are followed.

    Raises
    ------
    OSError
        Missing, unreadable, or a folder, pipe, socket or device.

    """
    try:
        _check_kind(Path(path).stat().st_mode, path)  # opening some devices has effects
        descriptor = os.open(path, _FLAGS)
    except ValueError as error:
        raise OSError(errno.EINVAL, "the path holds a NUL character", str(path)) from error
    try:
        # Another file may stand there by now: what was opened counts.
        _check_kind(os.fstat(descriptor).st_mode, path)
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def check_replaceable(path: Path) -> None:
    """Check that nothing stands at a path but a file: who writes one there would replace it.

    Raises
    ------
    OSError
        There is a folder, pipe, socket or device, or a link to one.

    """
    with contextlib.suppress(FileNotFoundError):
        _check_kind(path.stat().st_mode, path)


def size_of_regular(path: Path) -> int:
    """Return the number of bytes of a regular file; links are followed.

    Raises
    ------
    OSError
        Missing, or a folder, pipe, socket or device.

    """
    found = path.stat()
    _check_kind(found.st_mode, path)
    return found.st_size


def read_file(path: str | Path, limits: FileLimits) -> bytes:
    """Return the bytes of a regular file; links are followed.

    Raises
    ------
    InternavError
        Of the kind that the limits name: missing, unreadable, no regular file or too large.

    """
    try:
        with open_regular(path) as file:
            _check_size(os.fstat(file.fileno()).st_size, path, limits)
            blocks, total = [], 0
            while block := file.read(min(_BLOCK, limits.max_bytes + 1 - total)):
                blocks.append(block)
                total += len(block)
    except OSError as error:
        raise limits.unreadable(path, error) from error
    _check_size(total, path, limits)  # it may have grown, and files of /proc state no size
    return b"".join(blocks)


def read_text(path: str | Path, limits: FileLimits) -> str:
    """Return the text of a UTF-8 file, without its byte order mark.

    Raises
    ------
    InternavError
        See `read_file`; or the file is not UTF-8.

    """
    return _decoded(read_file(path, limits), path, limits)


def read_json(path: str | Path, limits: FileLimits) -> Any:  # noqa: ANN401 - JSON
    """Return the value of a JSON file (see `parse_json`).

    Raises
    ------
    InternavError
        See `read_file` and `parse_json`.

    """
    return parse_json(read_file(path, limits), path, limits)


def read_toml(path: str | Path, limits: FileLimits) -> dict[str, Any]:
    """Return the table of a TOML file (see `parse_toml`).

    Raises
    ------
    InternavError
        See `read_file` and `parse_toml`.

    """
    return parse_toml(read_file(path, limits), path, limits)


def parse_json(data: bytes, place: object, limits: FileLimits) -> Any:  # noqa: ANN401 - JSON
    """Return the value of strict JSON in UTF-8.

    Keys are there once, numbers finite and within the limits, texts free of NUL and of halves of
    surrogate pairs.

    Parameters
    ----------
    data
        Bytes of the file.
    place
        Its path, for errors.
    limits
        Limits, and the kind of error.

    Raises
    ------
    InternavError
        Of the kind that the limits name.

    """
    return _parsed("JSON", _json_value, data, place, limits)


def parse_toml(data: bytes, place: object, limits: FileLimits) -> dict[str, Any]:
    """Return the table of TOML in UTF-8: numbers and texts as in `parse_json`, no dates.

    Raises
    ------
    InternavError
        Of the kind that the limits name.

    """
    table: dict[str, Any] = _parsed("TOML", _toml_table, data, place, limits)
    return table


def json_sha256(values: Mapping[str, Any]) -> str:
    """Return the digest of the keys and values of a JSON file, its own key `sha256` left out.

    It is the SHA-256 of them as JSON in ASCII, keys sorted, without spaces: damage to any letter
    changes it, another indentation does not.
    """
    others = {key: value for key, value in values.items() if key != DIGEST}
    text = json.dumps(others, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def with_sha256(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a JSON file as it is to be written, with their digest."""
    plain: dict[str, Any] = json.loads(json.dumps(values, allow_nan=False))
    return plain | {DIGEST: json_sha256(plain)}


def check_sha256(
    values: Mapping[str, Any], place: object, limits: FileLimits, before: Collection[str]
) -> None:
    """Compare a JSON file's values with their digest.

    Parameters
    ----------
    values
        Values that were read.
    place
        Path of the file, for errors.
    limits
        The kind of error.
    before
        Keys of files that were written before there were digests: a file without one has no
        others. Damage to the digest's own name must not make it pass for such a file.

    Raises
    ------
    InternavError
        Of the kind that the limits name.

    """
    if DIGEST in values:
        if values[DIGEST] != json_sha256(values):
            problem = f"its {DIGEST} is that of other content"
            raise limits.refusal(place, f"damaged or edited ({problem})")
    elif later := sorted(values.keys() - set(before)):
        problem = (
            f"it has a key {later[0]!r} but no {DIGEST}, which every release writes that knows"
        )
        raise limits.refusal(place, f"damaged or edited ({problem} such a key)")


class _RefusedError(Exception):
    """Value that is refused, with the path to it from the inside out."""

    def __init__(self, problem: str) -> None:
        super().__init__(problem)
        self.problem = problem
        self.steps: list[str] = []

    @property
    def text(self) -> str:
        """Place in the file and problem."""
        where = "".join(reversed(self.steps)).lstrip(".")
        return f"{where}: {self.problem}" if where else self.problem


def _check_kind(mode: int, path: str | Path) -> None:
    if not stat.S_ISREG(mode):
        kind = next((name for is_kind, name in _KINDS if is_kind(mode)), "no file")
        raise OSError(errno.EINVAL, f"{kind}, expected a regular file", str(path))


def _check_size(size: int, place: object, limits: FileLimits) -> None:
    if size > limits.max_bytes:
        raise limits.refusal(place, f"is too large, expected at most {limits.max_bytes:,} bytes")


def _decoded(data: bytes, place: object, limits: FileLimits) -> str:
    _check_size(len(data), place, limits)
    if sum(map(data.count, _OPENERS)) > limits.max_values:
        expected = f"expected at most {limits.max_values:,} values"
        raise limits.refusal(place, f"holds too much, {expected}")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise limits.refusal(place, f"not UTF-8 text (byte {error.start})") from error


def _parsed(
    kind: str, read: Callable[[str], Any], data: bytes, place: object, limits: FileLimits
) -> Any:  # noqa: ANN401 - plain values
    """Return the value that a format's reader finds in UTF-8 text, checked."""
    text = _decoded(data, place, limits)
    try:
        value = read(text)
        _check_value(value, limits, 0)
    except (ValueError, RecursionError) as error:
        raise limits.refusal(place, f"not {kind} ({_reason(error)})") from error
    except _RefusedError as error:
        raise limits.refusal(place, error.text) from None
    return value


def _json_value(text: str) -> Any:  # noqa: ANN401 - JSON
    return json.loads(text, object_pairs_hook=_object)


def _toml_table(text: str) -> dict[str, Any]:
    import tomllib  # noqa: PLC0415 - the loader of datasets needs it not

    if _LONG_KEY.search(text):
        raise ValueError("a key of more than 32 parts")
    return tomllib.loads(text)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        twice, _ = Counter(name for name, _ in pairs).most_common(1)[0]
        raise ValueError(f"the key {_shown(twice)} is there twice")
    return found


def _reason(error: Exception) -> str:
    if isinstance(error, RecursionError):
        return "nested too deeply"
    if "integer string conversion" in str(error):
        return "a whole number of thousands of digits"
    return " ".join(str(error).split())


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 1]}…"


def _check_value(value: Any, limits: FileLimits, depth: int) -> None:  # noqa: ANN401 - plain values
    kind = type(value)
    if kind is str:
        _check_text(value)
    elif kind is int or kind is float:
        _check_number(value, limits)
    elif kind is dict or kind is list:
        if depth >= limits.max_depth:
            raise _RefusedError(f"nested too deeply, expected at most {limits.max_depth} levels")
        for key, item in value.items() if kind is dict else enumerate(value):
            try:
                if kind is dict:
                    _check_text(str(key))
                _check_value(item, limits, depth + 1)
            except _RefusedError as error:
                error.steps.append(f".{_shown(key)[1:-1]}" if kind is dict else f"[{key}]")
                raise
    elif isinstance(value, date | time):
        raise _RefusedError(f"{value} is a date or time; there are none in this file")


def _check_text(text: str) -> None:
    if "\0" in text:
        raise _RefusedError(f"the text {_shown(text)} holds a NUL character")
    if not text.isascii():
        try:
            text.encode()
        except UnicodeEncodeError:
            raise _RefusedError(f"the text {_shown(text)} is no Unicode text") from None


def _check_number(value: float, limits: FileLimits) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise _RefusedError(f"{value} is no finite number")
    if abs(value) > limits.max_number:
        # Python refuses to write whole numbers of thousands of digits.
        shown = f"{value}" if isinstance(value, float) else f"a number of {value.bit_length()} bits"
        raise _RefusedError(f"{shown} is out of range, expected at most {limits.max_number:g}")
