"""Settings of houses, and the reader of the option `rooms`."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from typing import Annotated

from internav_data.core.config import Bounds, check_bounds
from internav_data.houses.room_types import ROOM_TYPES
from internav_data.houses.standards import MAX_ROOMS
from internav_data.records import HousePreset  # noqa: TC001 - fields' types are read at run time
from internav_data.records.errors import UsageError

COUNT_HELP = "a count (4), a range (2-5) or a programme (kitchen,living,bedroom:2)"


@dataclass(frozen=True, slots=True)
class RoomsRequest:
    """Request of the option `rooms`: counts to choose from, a programme, or neither."""

    counts: tuple[int, ...] = ()
    programme: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class HouseConfig:
    """Settings of house generation."""

    preset: HousePreset = "paper"
    """`paper`: generous rooms of about 24 m², calibrated to the paper's Table 2; `realistic`:
    areas, widths and doors of real homes."""
    rooms: str = ""
    """Empty: the paper's mix of 1 to 10 rooms. Else a count (4), a range (2-5) or a programme
    (kitchen,living,bedroom:2)."""
    floor_plan: str | None = None
    """Path of a floor plan of your own (TOML or JSON); its rooms are furnished anew each scene."""
    scale: Annotated[float, Bounds(0.7, 2.0)] = 1.0
    """Lengths of rooms times this; 1.1 makes houses 21 % larger. `paper` only."""
    scale_small: Annotated[float, Bounds(0.7, 2.0)] = 0.93
    """Further factor for houses of 1-2 rooms."""
    scale_medium: Annotated[float, Bounds(0.7, 2.0)] = 0.95
    """Further factor for houses of 3-5 rooms."""
    scale_large: Annotated[float, Bounds(0.7, 2.0)] = 0.985
    """Further factor for houses of 6-10 rooms."""
    furnishing: Annotated[float, Bounds(0.0, 2.0)] = 1.0
    """Amount of furniture beyond the indispensable: 0 bare, 1 lived in, 2 crowded."""
    clutter: Annotated[float, Bounds(0.0, 1.0)] = 0.0
    """Small things on surfaces and floors beyond the furniture: 0 none; at 1 a room of `paper` has
    about as many things as ProcTHOR's, 22, the smaller ones of `realistic` 17."""
    loops: Annotated[float, Bounds(0.0, 1.0)] = 0.95
    """Share of the sensible further doors that are built, so that paths have alternatives."""
    wide_openings: Annotated[float, Bounds(0.0, 1.0)] = 0.95
    """Share of wide, double and open doorways where they make sense. `paper` only."""
    wings: Annotated[float, Bounds(0.0, 1.0)] = 1.0
    """Share of drawn plans whose living room leads to rooms of its own: longer room paths."""
    rooms_on_path_medium: Annotated[float, Bounds(2.0, 5.0)] = 2.7
    """Mean number of rooms on a path, at which plans of 3-5 rooms aim. `paper` only."""
    rooms_on_path_large: Annotated[float, Bounds(2.0, 6.0)] = 4.2
    """The same for 6-10 rooms. Doors of loops shorten paths again."""
    hall_from: Annotated[int, Bounds(0, 11)] = 0
    """Houses of this many rooms and more have a hall; 0 for the preset's own: 7 in `paper`, as
    suits Table 2, 5 in `realistic`."""
    candidates: Annotated[int, Bounds(1, 200)] = 24
    """Floor plans drawn for each house; the most homelike one is taken."""
    windows: bool = True
    """Windows in outer walls."""

    def check(self) -> RoomsRequest:
        """Check all values and return the request that `rooms` makes.

        Raises
        ------
        UsageError
            A value is out of its bounds, `rooms` cannot be read, or settings exclude each other.

        """
        if self.preset not in {"paper", "realistic"}:
            raise UsageError(f"house.preset: expected paper or realistic, got {self.preset!r}")
        check_bounds(self, "{key}: expected {expected}, got {value}", "house.")
        if self.floor_plan is not None and self.rooms:
            raise UsageError("rooms and floor_plan exclude each other: leave one of them out")
        return parse_rooms(self.rooms)

    def min_hall_rooms(self) -> int:
        """Return the number of rooms from which houses have a hall."""
        return self.hall_from or (7 if self.preset == "paper" else 5)

    def scale_of(self, rooms: int) -> float:
        """Return the factor on lengths for a house of so many rooms."""
        if self.preset != "paper":
            return 1.0
        medium, large = 3, 6
        by_size = self.scale_small
        if rooms >= medium:
            by_size = self.scale_medium
        if rooms >= large:
            by_size = self.scale_large
        return self.scale * by_size

    def rooms_on_path(self, rooms: int) -> float | None:
        """Return the mean number of rooms on a path that a house of so many aims at; None: any."""
        medium, large = 3, 6
        if self.preset != "paper" or rooms < medium:
            return None
        return self.rooms_on_path_large if rooms >= large else self.rooms_on_path_medium


def parse_rooms(text: str) -> RoomsRequest:
    """Read the `rooms` option.

    Raises
    ------
    UsageError
        For text that is no count, range or programme, or one that no house of 1 to 10 rooms has.
    """
    text = text.strip()
    if not text:
        return RoomsRequest()
    low, dash, high = text.partition("-")
    if _is_integer(text):
        return RoomsRequest(counts=(_count(text, text),))
    if dash and _is_integer(low) and _is_integer(high):
        first, last = _count(low, text), _count(high, text)
        if first > last:
            raise UsageError(f"rooms '{text}': the range runs backwards, write {last}-{first}")
        return RoomsRequest(counts=tuple(range(first, last + 1)))
    return RoomsRequest(programme=_programme(text))


def _is_integer(text: str) -> bool:
    body = text.strip()
    return body.removeprefix("-").removeprefix("+").isdecimal()


def _count(text: str, option: str) -> int:
    value = int(text)
    if not 1 <= value <= MAX_ROOMS:
        raise UsageError(
            f"rooms '{option}': a house has 1 to {MAX_ROOMS} rooms, got {value}; give {COUNT_HELP}"
        )
    return value


def _programme(text: str) -> tuple[str, ...]:
    rooms: list[str] = []
    for entry in text.split(","):
        name, colon, number = (piece.strip() for piece in entry.partition(":"))
        if name not in ROOM_TYPES:
            near = get_close_matches(name, sorted(ROOM_TYPES), 1)
            hint = (
                f"did you mean '{near[0]}'?" if near else f"types: {', '.join(sorted(ROOM_TYPES))}"
            )
            raise UsageError(f"rooms '{text}': no room type '{name}'; {hint} Give {COUNT_HELP}")
        count = 1
        if colon:
            if not number.isdecimal() or int(number) < 1:
                raise UsageError(
                    f"rooms '{text}': '{entry.strip()}' needs a count of 1 or more after the colon"
                )
            count = int(number)
        if len(rooms) + count > MAX_ROOMS:
            raise UsageError(
                f"rooms '{text}': more than {MAX_ROOMS} rooms, ask for {MAX_ROOMS} at most"
            )
        rooms += [name] * count
    return tuple(rooms)
