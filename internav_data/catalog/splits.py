"""Split of the assets into training, validation and test, for `--unseen-assets`."""

from __future__ import annotations

from hashlib import sha256
from typing import TYPE_CHECKING

from internav_data.catalog.asset_types import ASSET_TYPES, OBSTACLES

if TYPE_CHECKING:
    from internav_data.records import Asset, Split

_CYCLE: tuple[Split, ...] = ("train", "train", "val", "train", "train", "test")
_TOO_FEW = frozenset(kind.type for kind in OBSTACLES if kind.asset_count < len(_CYCLE))
"""Obstacle types with too few assets for a full turn: dog beds."""


def split_of_asset(asset: Asset) -> Split:
    """Return the split whose episodes may spawn an asset: about 2/3, 1/6, 1/6 of each type.

    The catalogue's own assets take turns by their number, a user's by the digest of their name, so
    that one file more or less changes no other's split. Types with too few assets are spawned in
    training only. Furniture that is never spawned stands in the houses of every split and counts
    as `train`.
    """
    if asset.type in _TOO_FEW or not asset.spawnable:
        return "train"
    number = asset.asset_id.removeprefix(f"{asset.type}_")
    if asset.type in ASSET_TYPES and number.isdecimal():
        return _CYCLE[(int(number) - 1) % len(_CYCLE)]
    return _CYCLE[sha256(asset.asset_id.encode()).digest()[0] % len(_CYCLE)]
