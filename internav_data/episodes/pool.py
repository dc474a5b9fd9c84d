"""Obstacle pool: the assets that obstacles are drawn from, each with its share of the draws.

Draws are uniform over the assets unless the settings weigh types. What stands in the end is not
what is drawn: small objects fit where large ones do not, and nobody moves a sofa. `balance` draws
by the weights of `balance.py`, which make up for that.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from internav_data.episodes.balance import BALANCE_WEIGHTS
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.random import Generator

    from internav_data.core.typing import Floats
    from internav_data.episodes.config import EpisodeConfig
    from internav_data.records import Asset


@dataclass(frozen=True, slots=True, eq=False)
class ObstaclePool:
    """Assets in a fixed order, and the sums of their shares up to each of them."""

    assets: tuple[Asset, ...]
    sums: Floats | None
    """(n,) float64, ascending to 1; None where all shares are equal."""

    @staticmethod
    def of(assets: Sequence[Asset], config: EpisodeConfig) -> ObstaclePool:
        """Return the pool of some assets.

        Raises
        ------
        UsageError
            All of them have weight 0.

        """
        if not config.asset_weights and not config.balance:
            return ObstaclePool(tuple(assets), None)
        balance = BALANCE_WEIGHTS if config.balance else {}
        weights = np.array(
            [config.asset_weights.get(a.type, 1.0) * balance.get(a.type, 1.0) for a in assets]
        )
        if not weights.any():
            raise UsageError(
                "episodes.asset_weights: expected a weight above 0 for one type at least, got 0 "
                "for all; other types have weight 1"
            )
        return ObstaclePool(tuple(assets), np.cumsum(weights / weights.sum()))

    def draw(self, rng: Generator) -> Asset:
        """Draw an asset; one random number is taken."""
        if self.sums is None:
            return self.assets[int(rng.integers(len(self.assets)))]
        # The last sum may lie a rounding below 1.
        number = int(np.searchsorted(self.sums, rng.random() * self.sums[-1], side="right"))
        return self.assets[number]

    def shares(self) -> dict[str, float]:
        """Return each type's share of the draws, rounded to 1e-6, by type."""
        each = np.full(len(self.assets), 1.0 / max(1, len(self.assets)))
        if self.sums is not None:
            each = np.diff(self.sums, prepend=0.0)
        shares: Counter[str] = Counter()
        for asset, share in zip(self.assets, each.tolist(), strict=True):
            shares[asset.type] += share
        return {kind: round(share, 6) for kind, share in sorted(shares.items())}
