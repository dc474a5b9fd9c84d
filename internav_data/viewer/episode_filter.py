"""Conditions of a gallery: read from a query, as the page's address holds them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, Self, cast, get_args

from internav_data.records import Mode, Split
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping

SPLITS: Final[tuple[str, ...]] = get_args(Split)
"""Splits in the order of their numbers."""
MODES: Final[tuple[str, ...]] = get_args(Mode)
"""Modes in the order of their numbers."""
Order = Literal["stored", "longest", "obstacles"]
"""Order of a gallery: as stored, or the longest paths or most obstacles first."""
PAGE: Final = 24
"""Episodes on a page unless a query names another number."""
MAX_PAGE: Final = 96
"""Largest number of episodes on a page."""
_MAX_WORDS: Final = 200
"""Largest number of values of a condition."""
_MAX_NUMBER: Final = 1e9
_KEYS: Final = (
    *("rooms", "mode", "sealed", "split", "obstacles", "distance", "types"),
    *("order", "offset", "limit"),
)


@dataclass(frozen=True, slots=True)
class EpisodeFilter:
    """Conditions that all must hold; one that is empty or None always does."""

    rooms: frozenset[int] = frozenset()
    """Numbers of rooms."""
    modes: frozenset[str] = frozenset()
    """Modes, of `MODES`."""
    sealed: bool | None = None
    """Whether the disc has no path on or off the lattice."""
    splits: frozenset[str] = frozenset()
    """Splits, of `SPLITS`."""
    obstacles: tuple[float, float] | None = None
    """Least and greatest number of obstacles."""
    distance: tuple[float, float] | None = None
    """Least and greatest `shortest_path_m`, metres."""
    types: frozenset[str] = frozenset()
    """Types of obstacles, one of which must be there."""
    order: Order = "stored"

    @property
    def empty(self) -> bool:
        """Whether it keeps every episode, as stored."""
        return self == EpisodeFilter()

    @classmethod
    def of_query(cls, query: Mapping[str, str]) -> Self:
        """Read the conditions of a query, as in `rooms=1,2&mode=blocked&distance=3-9.5`.

        Raises
        ------
        UsageError
            An unknown key, or a value that its condition cannot have.
        """
        for key in query:
            if key not in _KEYS:
                raise UsageError(f"filter {key!r}: expected one of {', '.join(_KEYS)}")
        sealed = query.get("sealed")
        order = query.get("order", "stored")
        if order not in get_args(Order):
            raise _wrong("order", order, f"one of {', '.join(get_args(Order))}")
        return cls(
            rooms=frozenset(int(_number("rooms", word)) for word in _words(query, "rooms")),
            modes=_known("mode", _words(query, "mode"), MODES),
            sealed=None if not sealed else "yes" in _known("sealed", [sealed], ("yes", "no")),
            splits=_known("split", _words(query, "split"), SPLITS),
            obstacles=_range(query, "obstacles"),
            distance=_range(query, "distance"),
            types=frozenset(_words(query, "types")),
            order=cast("Order", order),
        )


def page_of_query(query: Mapping[str, str]) -> tuple[int, int]:
    """Return the first place and the number of the episodes that a query asks for.

    Raises
    ------
    UsageError
        They are no numbers, or out of bounds.
    """
    offset = int(_number("offset", query.get("offset", "0")))
    limit = int(_number("limit", query.get("limit", str(PAGE))))
    if not 1 <= limit <= MAX_PAGE:
        raise _wrong("limit", str(limit), f"1 to {MAX_PAGE}")
    return offset, limit


def _words(query: Mapping[str, str], key: str) -> list[str]:
    words = [word for word in query.get(key, "").split(",") if word]
    if len(words) > _MAX_WORDS:
        raise _wrong(key, f"{len(words)} values", f"at most {_MAX_WORDS}")
    return words


def _known(key: str, words: list[str], known: tuple[str, ...]) -> frozenset[str]:
    for word in words:
        if word not in known:
            raise _wrong(key, word, f"some of {', '.join(known)}")
    return frozenset(words)


def _number(key: str, word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = -1.0
    if not 0.0 <= value < _MAX_NUMBER:  # nor NaN
        raise _wrong(key, word, "a number from 0")
    return value


def _range(query: Mapping[str, str], key: str) -> tuple[float, float] | None:
    """Return both ends of `3-9`; one that is missing, as in `3-`, is open."""
    text = query.get(key, "")
    if not text:
        return None
    low, dash, high = text.partition("-")
    least = _number(key, low) if low else 0.0
    greatest = (_number(key, high) if high else float("inf")) if dash else least
    return least, greatest


def _wrong(key: str, got: str, expected: str) -> UsageError:
    return UsageError(f"filter {key}: expected {expected}, got {got[:60]!r}")
