"""Predicates of a house against the manifest's config: preset, rooms, floor plan, windows.

They find houses of another run in a dataset: each of them may be sound in itself.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from dataclasses import dataclass
from itertools import accumulate
from typing import TYPE_CHECKING, Any

from internav_data.records import ProgrammeStream, Purpose, generator
from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.records import House
    from internav_data.verification.findings import FindingCollector

SHARES = {1: 0.2184, 2: 0.1716, 3: 0.141, 4: 0.141, 5: 0.141, **dict.fromkeys(range(6, 11), 0.0374)}
"""Share of scenes by number of rooms (Table 2 of the paper)."""
GOLDEN = 0.6180339887498949
"""Step of the sequence from which numbers of rooms come: the golden ratio's fractional part."""
TIE = 1e-9
"""Distance from the border of two shares below which either number of rooms is right."""
HALL_FROM = {"paper": 7, "realistic": 5}
"""Number of rooms from which houses have a hall, unless the config says another."""

RoomPlan = tuple[tuple[str, tuple[tuple[float, float], ...]], ...]
"""Types and polygons of a house's rooms."""


@dataclass(frozen=True, slots=True)
class HouseRequest:
    """Settings of the config that every house must agree with."""

    seed: int
    preset: str
    shares: Mapping[int, float]
    """Shares of the numbers of rooms that scenes may have."""
    types: tuple[str, ...]
    """Types of the rooms of every house; empty where they are drawn."""
    hall_from: int
    """Number of rooms from which drawn rooms include a hall."""
    floor_plan: bool
    """Whether all houses have the rooms of one floor plan."""
    windows: bool
    """Whether houses may have windows."""


def house_request(seed: int, config: Mapping[str, Any]) -> HouseRequest | None:
    """Read the settings of houses from a manifest's config; None where it has none.

    Raises
    ------
    CorruptDataError
        A value that no generator writes.

    """
    houses = config.get("house")
    if not isinstance(houses, dict) or not {"preset", "rooms"} <= houses.keys():
        return None
    preset, rooms, hall_from = houses["preset"], houses["rooms"], houses.get("hall_from", 0)
    known = isinstance(preset, str) and preset in HALL_FROM
    if not known or not isinstance(rooms, str) or not isinstance(hall_from, int):
        raise CorruptDataError(
            "manifest.json: config.house: expected preset paper or realistic, rooms as text and "
            f"hall_from as a number, got {preset!r}, {rooms!r} and {hall_from!r}; generate the "
            "dataset again"
        )
    counts, types = _rooms(rooms)
    return HouseRequest(
        seed,
        preset,
        {count: SHARES[count] for count in counts},
        types,
        hall_from or HALL_FROM[preset],
        houses.get("floor_plan") is not None,
        houses.get("windows") is not False or houses.get("floor_plan") is not None,
    )


def _rooms(text: str) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Read the setting `rooms`: numbers of rooms to choose from, or the types of all rooms."""
    low, dash, high = text.strip().partition("-")
    if not low:
        return tuple(SHARES), ()
    try:
        if low.strip().isdecimal():
            counts = tuple(range(int(low), int(high if dash else low) + 1))
            if set(counts) <= SHARES.keys():
                return counts, ()
        types: list[str] = []
        for entry in text.split(","):
            name, colon, number = entry.partition(":")
            types += [name.strip()] * (int(number) if colon and len(number) <= 2 else 1)  # noqa: PLR2004
        return (), tuple(types)
    except ValueError as error:
        raise CorruptDataError(
            f"manifest.json: config.house.rooms: expected a count, range or programme, got {text!r}"
            "; generate the dataset again"
        ) from error


def room_counts(request: HouseRequest, scene: int) -> set[int]:
    """Return the number of rooms of a scene; two of them at a border of their shares."""
    turn = generator(request.seed, Purpose.PROGRAMME, episode=ProgrammeStream.COUNTS).random()
    borders = list(accumulate(share for _, share in sorted(request.shares.items())))
    counts, found = sorted(request.shares), set()
    for slip in (-TIE, TIE):
        position = ((turn + scene * GOLDEN + slip) % 1.0) * borders[-1]
        found.add(counts[min(bisect_right(borders, position), len(counts) - 1)])
    return found


def check_house_config(
    house: House, request: HouseRequest, first: RoomPlan | None, report: FindingCollector
) -> RoomPlan:
    """Check a house against the config; return its rooms.

    Parameters
    ----------
    house
        House to check.
    request
        Settings of the dataset's config.
    first
        Rooms of the first house of the dataset, None if this is the first one.
    report
        Collector of findings.

    """
    rooms: RoomPlan = tuple((room.type, room.polygon) for room in house.rooms)
    predicate = "schema.scenes.config"
    report.expect(
        house.preset == request.preset,
        f"{predicate}-preset",
        f"a house of preset {request.preset}, as in the config",
        house.preset,
    )
    report.expect(
        request.windows or not house.windows,
        f"{predicate}-windows",
        "no windows, as in the config",
        len(house.windows),
    )
    if request.floor_plan:
        report.expect(
            first in (None, rooms),
            f"{predicate}-floor-plan",
            "the rooms of the first house: the config has one floor plan for all",
            f"{len(rooms)} other rooms",
        )
    else:
        _check_types(house, request, report)
    return rooms


def _check_types(house: House, request: HouseRequest, report: FindingCollector) -> None:
    """Check number and types of rooms where no floor plan gives them."""
    types, predicate = Counter(room.type for room in house.rooms), "schema.scenes.config-rooms"
    if request.types:
        report.expect(
            types == Counter(request.types),
            predicate,
            f"{', '.join(request.types)}, as in the config",
            ", ".join(types.elements()),
        )
        return
    number, counts = len(house.rooms), sorted(room_counts(request, house.scene))
    report.expect(
        number in counts,
        predicate,
        f"{' or '.join(map(str, counts))} rooms, as this scene of the config has",
        number,
    )
    hall = number >= request.hall_from
    report.expect(
        bool(types["hall"]) == hall,
        "schema.scenes.config-hall",
        f"{'a' if hall else 'no'} hall, as the config's houses of {number} rooms",
        types["hall"],
    )
