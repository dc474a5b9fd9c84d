"""Number of rooms and size of each scene: low-discrepancy sequences, so that any prefix keeps them.

Source of the shares: Table 2 of the paper (1-2, 3-5 and 6-10 rooms); inside 1-2 rooms 56 % to 44 %.
"""

from __future__ import annotations

from statistics import NormalDist
from typing import TYPE_CHECKING

from internav_data.core.arithmetic import plain_sum
from internav_data.records import ProgrammeStream, Purpose, SceneKey, generator

if TYPE_CHECKING:
    from collections.abc import Mapping

SHARES: Mapping[int, float] = {
    1: 0.2184,
    2: 0.1716,
    3: 0.141,
    4: 0.141,
    5: 0.141,
    **dict.fromkeys(range(6, 11), 0.187 / 5),
}
"""Share of scenes by room count; sums to 1."""

SILVER = 0.41421356237309515
"""The square root of 2 less one: a second such sequence, independent of the first."""
GOLDEN = 0.6180339887498949
"""The golden ratio's fractional part: its multiples modulo 1 are a Kronecker sequence of lowest
discrepancy (additive recurrence; Niederreiter 1992)."""


def room_count(seed: int, scene: int, shares: Mapping[int, float] = SHARES) -> int:
    """Return the number of rooms of one scene; over scenes it keeps the shares at any prefix.

    Parameters
    ----------
    seed
        Shifts the sequence, so that seeds differ in their first scenes.
    scene
        Index of the scene, 0 and up.
    shares
        Share by room count; they need not sum to one.
    """
    # The golden-ratio sequence, shifted by a random offset and mapped through the inverse
    # cumulative distribution of the shares.
    turn = float(generator(seed, Purpose.PROGRAMME, episode=ProgrammeStream.COUNTS).random())
    position = (turn + scene * GOLDEN) % 1.0 * plain_sum(shares.values())
    for count in sorted(shares):
        position -= shares[count]
        if position < 0.0:
            return count
    return max(shares)


def size_quantile(key: SceneKey) -> float:
    """Return how large a scene's house is among those of its programme: a normal deviate.

    Its mean is 0 and its deviation nearly 1, over scenes of any number of rooms; it lies within
    the central 96 %, so that no house is a freak. Other attempts have other sizes.
    """
    turn = float(generator(key.seed, Purpose.PROGRAMME, episode=ProgrammeStream.SIZES).random())
    share = (turn + key.scene * SILVER + key.attempt * GOLDEN) % 1.0
    return NormalDist().inv_cdf(0.02 + 0.96 * share)
