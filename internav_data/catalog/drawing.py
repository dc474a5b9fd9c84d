"""Assets of one type: sizes, roles, masses, frictions, parts.

Within a type, sizes are drawn by rank: the smallest, the middle and the largest asset have the
table's minimum, median and maximum; random is only which asset gets which rank.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from internav_data.catalog.sampling import UniformSampler
from internav_data.catalog.shapes import Sketch
from internav_data.records import Asset, Purpose, generator

if TYPE_CHECKING:
    from numpy.random import Generator
    from numpy.typing import NDArray

    from internav_data.catalog.asset_types import AssetType, Range
    from internav_data.records import Vec3

SEED = 0
"""The catalogue's own seed: houses and episodes are drawn from theirs."""

_FRICTION: Range = (0.4, 0.6, 0.8)
_COARSE_M = 0.002
"""Sizes are integer multiples of this, so that their halves lie on the parts' grid."""
_FINE_M = 0.0004
"""The same for lengths below `_THIN_M`, as the height of rugs."""
_THIN_M = 0.05
_MASS_POWER = 0.75
"""Exponent of mass over volume: large assets are hollower."""
_MASS_LIMITS = (0.5, 2.0)
"""Smallest and largest ratio of an asset's mass to its type's."""


def shares(ranks: NDArray[np.int64]) -> list[float]:
    """Turn ranks (n,), 0 to n - 1, into shares 0 to 1; a single asset is the median, 0.5."""
    last = max(1, len(ranks) - 1)
    return [float(rank) / last if len(ranks) > 1 else 0.5 for rank in ranks]


def from_share(span: Range, share: float) -> float:
    """Return the quantile of a distribution that is dense around its median, thin at its ends.

    `span` is minimum, median and maximum; shares 0, 0.5 and 1 give exactly these.
    """
    low, median, high = span
    t = abs(2.0 * share - 1.0)
    reach = t * (0.35 + 0.65 * t)
    return median + reach * ((high if share > 0.5 else low) - median)  # noqa: PLR2004 - the median


def _sizes(asset_type: AssetType, rng: Generator) -> list[Vec3]:
    count = asset_type.asset_count
    common = rng.random(count)
    axes = []
    for span in (asset_type.width, asset_type.depth, asset_type.height):
        # A common and an own part: `likeness` mixes them, and only the ranks of the mix count.
        own = rng.random(count)
        latent = asset_type.likeness * common + (1.0 - asset_type.likeness) * own
        ranks = np.argsort(np.argsort(latent, kind="stable"), kind="stable")
        axes.append([_on_grid(from_share(span, share)) for share in shares(ranks)])
    return list(zip(*axes, strict=True))


def _on_grid(length: float) -> float:
    grid = _COARSE_M if length > _THIN_M else _FINE_M
    return round(round(length / grid) * grid, 4)


def _mass(asset_type: AssetType, size: Vec3) -> float:
    median = asset_type.width[1] * asset_type.depth[1] * asset_type.height[1]
    ratio = (size[0] * size[1] * size[2] / median) ** _MASS_POWER
    mass = asset_type.mass_kg * min(_MASS_LIMITS[1], max(_MASS_LIMITS[0], ratio))
    return float(f"{mass:.3g}")


def draw_type(asset_type: AssetType, *, spawnable: bool) -> tuple[Asset, ...]:
    """Draw all assets of one type.

    Parameters
    ----------
    asset_type
        Number, design, counts, sizes and mass of the type.
    spawnable
        Whether it is one of the obstacle types.
    """
    rng = generator(SEED, Purpose.CATALOG, scene=asset_type.number)
    sizes = _sizes(asset_type, rng)
    count = asset_type.asset_count
    frictions = [from_share(_FRICTION, share) for share in shares(rng.permutation(count))]
    roles = rng.permutation(count).tolist()
    assets = []
    for k, size in enumerate(sizes):
        sketch = Sketch()
        rng = generator(SEED, Purpose.CATALOG, scene=asset_type.number, episode=k + 1)
        asset_type.design(sketch, *size, UniformSampler(rng))
        assets.append(
            Asset(
                asset_id=f"{asset_type.type}_{k + 1:02d}",
                type=asset_type.type,
                size=size,
                mass_kg=_mass(asset_type, size),
                friction=round(frictions[k], 2),
                pushable=roles[k] < asset_type.pushable,
                pickable=asset_type.pushable
                <= roles[k]
                < asset_type.pushable + asset_type.pickable,
                spawnable=spawnable,
                blocks=asset_type.blocks,
                parts=sketch.fitted(size),
            )
        )
    return tuple(assets)
