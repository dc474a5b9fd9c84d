"""From a type's sheet to its assets: sizes, roles, masses, frictions, parts.

Within a type, numbers are drawn by rank: the smallest, the middle and the largest asset have the
sheet's minimum, median and maximum, and only who gets which is random.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from internav_data.catalog.designs import DESIGNS
from internav_data.catalog.sampling import UniformSampler
from internav_data.catalog.shapes import Sketch
from internav_data.records import Asset, Purpose, generator

if TYPE_CHECKING:
    from numpy.random import Generator
    from numpy.typing import NDArray

    from internav_data.catalog.sheet import Range, TypeSheet
    from internav_data.records import Vec3

SEED = 0
"""The catalogue's own seed: houses and episodes are drawn from theirs."""

_FRICTION: Range = (0.4, 0.6, 0.8)
_COARSE_M = 0.002
"""Sizes of furniture are whole multiples of this; halves then lie on the parts' grid."""
_FINE_M = 0.0004
"""The same for what is thinner than `_THIN_M`, as rugs are."""
_THIN_M = 0.05
_MASS_POWER = 0.75
"""Mass grows slower than volume: large things are hollower."""
_MASS_LIMITS = (0.5, 2.0)


def shares(ranks: NDArray[np.int64]) -> list[float]:
    """Turn ranks 0…n-1 into shares 0…1; a single asset is the median."""
    last = max(1, len(ranks) - 1)
    return [float(rank) / last if len(ranks) > 1 else 0.5 for rank in ranks]


def from_share(span: Range, share: float) -> float:
    """Value at a share of a distribution that is dense around its median, thin at its ends."""
    low, median, high = span
    t = abs(2.0 * share - 1.0)
    reach = t * (0.35 + 0.65 * t)
    return median + reach * ((high if share > 0.5 else low) - median)  # noqa: PLR2004 - the median


def _sizes(sheet: TypeSheet, rng: Generator) -> list[Vec3]:
    count = sheet.assets
    common = rng.random(count)
    axes = []
    for span in (sheet.width, sheet.depth, sheet.height):
        own = rng.random(count)
        latent = sheet.likeness * common + (1.0 - sheet.likeness) * own
        ranks = np.argsort(np.argsort(latent, kind="stable"), kind="stable")
        axes.append([_on_grid(from_share(span, share)) for share in shares(ranks)])
    return list(zip(*axes, strict=True))


def _on_grid(length: float) -> float:
    grid = _COARSE_M if length > _THIN_M else _FINE_M
    return round(round(length / grid) * grid, 4)


def _mass(sheet: TypeSheet, size: Vec3) -> float:
    median = sheet.width[1] * sheet.depth[1] * sheet.height[1]
    ratio = (size[0] * size[1] * size[2] / median) ** _MASS_POWER
    mass = sheet.mass_kg * min(_MASS_LIMITS[1], max(_MASS_LIMITS[0], ratio))
    return float(f"{mass:.3g}")


def draw_type(sheet: TypeSheet, number: int, *, spawnable: bool) -> tuple[Asset, ...]:
    """Draw all assets of one type.

    Parameters
    ----------
    sheet
        Counts, sizes and mass of the type.
    number
        Number of the type: its key of random numbers.
    spawnable
        Whether it is one of the obstacle types.
    """
    rng = generator(SEED, Purpose.CATALOG, scene=number)
    sizes = _sizes(sheet, rng)
    count = sheet.assets
    frictions = [from_share(_FRICTION, share) for share in shares(rng.permutation(count))]
    roles = rng.permutation(count).tolist()
    design = DESIGNS[sheet.type]
    assets = []
    for k, size in enumerate(sizes):
        sketch = Sketch()
        sampler = UniformSampler(generator(SEED, Purpose.CATALOG, scene=number, episode=k + 1))
        design(sketch, *size, sampler)
        assets.append(
            Asset(
                asset_id=f"{sheet.type}_{k + 1:02d}",
                type=sheet.type,
                size=size,
                mass_kg=_mass(sheet, size),
                friction=round(frictions[k], 2),
                pushable=roles[k] < sheet.pushable,
                pickable=sheet.pushable <= roles[k] < sheet.pushable + sheet.pickable,
                spawnable=spawnable,
                blocks=sheet.blocks,
                parts=sketch.fitted(size),
            )
        )
    return tuple(assets)
