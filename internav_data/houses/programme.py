"""Programme of a house: its rooms, with the area that each wants."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from internav_data.core.arithmetic import plain_sum
from internav_data.houses.quota import SHARES, room_count, size_quantile
from internav_data.houses.room_types import ROOM_TYPES, RoomStandard
from internav_data.records import ProgrammeStream, Purpose

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.random import Generator

    from internav_data.houses.config import HouseConfig
    from internav_data.records import HousePreset, SceneKey

PAPER_AREA_M2 = 25.0
"""Mean area of a room in the preset `paper`: ProcTHOR's houses have 26, 47, 67, 103 … m²."""

SIZE_SPREAD: Mapping[HousePreset, float] = {"paper": 0.45, "realistic": 0.2}
"""Standard deviation of the logarithm of a house's area, given the number of its rooms. ProcTHOR's
houses of the 95 % quantile are 2.9 to 5.2 times as large as those of the 5 % quantile."""
ONE_ROOM_SPREAD: Mapping[HousePreset, float] = {"paper": 0.65, "realistic": 0.2}
"""The same for houses of one room: what is drawn too small for a home is as small as one can be,
so that less of the spread remains."""
ROOM_SPREAD = 0.16
"""Standard deviation of the logarithm of a room's area beside the others."""


@dataclass(frozen=True, slots=True)
class RoomSpec:
    """One room of the programme."""

    type: str
    area_m2: float
    """Wanted area, between the centre lines of the walls."""
    standard: RoomStandard
    """Sizes that the room must keep."""


_HOMES: Mapping[int, tuple[tuple[float, str], ...]] = {
    1: ((1.0, "studio"),),
    2: ((1.0, "studio bathroom"),),
    3: (
        (0.60, "living bedroom bathroom"),
        (0.25, "studio kitchen bathroom"),
        (0.15, "studio bedroom bathroom"),
    ),
    4: (
        (0.60, "living kitchen bedroom bathroom"),
        (0.20, "living bedroom bedroom bathroom"),
        (0.10, "studio kitchen bedroom bathroom"),
        (0.10, "living bedroom office bathroom"),
    ),
}
"""Small homes: (share, rooms). From two rooms on there is a bathroom, and a room to reach it from
that is neither kitchen nor bedroom. A studio or living room has the kitchen where none is."""
_WITH_HALL = {
    1: "hall",
    2: "hall studio",
    3: "hall studio bathroom",
    4: "hall living bedroom bathroom",
}
"""Small homes with a hall, which `HouseConfig.hall_from` may ask for."""
_FIVE_WITH_HALL = (
    (0.5, "hall living kitchen bedroom bathroom"),
    (0.25, "hall living bedroom bedroom bathroom"),
    (0.15, "hall living bedroom office bathroom"),
    (0.1, "hall studio kitchen bedroom bathroom"),
)
"""Homes of five rooms with a hall: (share, rooms). Beside the core nothing is left to draw."""
_CORE = "living kitchen bedroom bathroom"
"""Rooms of every home of five rooms or more."""

DOUBLE_BEDROOM = RoomStandard(13.0, 11.6, 17.0, 2.76, 1.6)
"""The realistic bedroom for two."""
SINGLE_BEDROOM = RoomStandard(9.2, 6.8, 11.0, 2.2, 1.75)
"""The realistic bedroom for one."""


def _choose(rng: Generator, weighted: list[tuple[float, str]]) -> str:
    position = float(rng.random()) * plain_sum(weight for weight, _ in weighted)
    for weight, value in weighted:
        position -= weight
        if position < 0.0:
            return value
    return weighted[-1][1]


def _room_types(rng: Generator, count: int, hall_from: int) -> list[str]:
    if count in _HOMES:
        drawn = _choose(rng, list(_HOMES[count]))
        return (_WITH_HALL[count] if count >= hall_from else drawn).split()
    if count == len(_CORE.split()) + 1 >= hall_from:
        return _choose(rng, list(_FIVE_WITH_HALL)).split()
    types = _CORE.split()
    if count >= hall_from:
        types.insert(0, "hall")
    while len(types) < count:
        # A second bathroom before the third bedroom has somewhere to go looks wrong.
        bedrooms = types.count("bedroom")
        open_types = [
            (record.extra.weight, name)
            for name, record in ROOM_TYPES.items()
            if record.extra is not None
            and types.count(name) < record.extra.max_count
            and (name != "bathroom" or types.count(name) < bedrooms)
        ]
        types.append(_choose(rng, open_types))
    return types


def _standards(types: list[str], config: HouseConfig, rng: Generator) -> list[RoomStandard]:
    out: list[RoomStandard] = []
    bedrooms = 0
    for name in types:
        if config.preset == "realistic" and name == "bedroom":
            bedrooms += 1
            single = bedrooms > 1 and float(rng.random()) < 0.6  # noqa: PLR2004 - most second ones
            out.append(SINGLE_BEDROOM if single else DOUBLE_BEDROOM)
        else:
            out.append(ROOM_TYPES[name].standard(config.preset))
    return out


def _areas(
    standards: list[RoomStandard], config: HouseConfig, size: float, rng: Generator
) -> list[float]:
    """Draw the wanted areas, centre line to centre line, m².

    `size` is the house's own, a normal deviate.
    """
    # Log-normal, so that no area is negative; the paper preset then fits the house to its total.
    share = (SIZE_SPREAD if len(standards) > 1 else ONE_ROOM_SPREAD)[config.preset]
    larger = math.exp(share * size - share * share / 2.0)
    areas = [s.area_m2 * math.exp(ROOM_SPREAD * float(rng.standard_normal())) for s in standards]
    # Somewhat above the smallest allowed area, which not every candidate keeps; by how much is
    # drawn, or the smallest houses would be copies of each other.
    least = [s.low_m2 * (1.08 + 0.14 * float(rng.random())) for s in standards]
    if config.preset == "paper":
        count = len(areas)
        larger *= PAPER_AREA_M2 * count / plain_sum(areas) * config.scale_of(count) ** 2
        areas = [max(low, a * larger) for low, a in zip(least, areas, strict=True)]
    else:
        areas = [
            min(s.high_m2, max(low, a * larger))
            for s, low, a in zip(standards, least, areas, strict=True)
        ]
    # Walls take about a tenth of a real room and a twentieth of a generous one.
    return [a + 0.24 * math.sqrt(a) + 0.02 for a in areas]


def programme(key: SceneKey, config: HouseConfig) -> tuple[RoomSpec, ...]:
    """Draw the rooms of one house.

    The number of rooms is the same in every attempt: the quota must not depend on what failed.
    """
    request = config.check()
    rng = key.generator(Purpose.PROGRAMME, episode=ProgrammeStream.ROOMS)
    if request.programme:
        types = list(request.programme)
    else:
        shares = SHARES
        if request.counts:
            shares = {count: SHARES[count] for count in request.counts}
        types = _room_types(rng, room_count(key.seed, key.scene, shares), config.min_hall_rooms())
    standards = _standards(types, config, rng)
    areas = _areas(standards, config, size_quantile(key), rng)
    return tuple(
        RoomSpec(name, area, standard)
        for name, area, standard in zip(types, areas, standards, strict=True)
    )
