"""Shares of the assets for training, validation and test, as --unseen-assets wants them."""

from __future__ import annotations

from hashlib import sha256
from typing import TYPE_CHECKING

from internav_data.catalog.sheet import SHEETS

if TYPE_CHECKING:
    from internav_data.records import Asset, Split

_CYCLE: tuple[Split, ...] = ("train", "train", "val", "train", "train", "test")


def split_of_asset(asset: Asset) -> Split:
    """Return the split whose episodes may hold an asset: about 2/3, 1/6, 1/6 of each type.

    The catalogue's own assets take turns by their number, a user's by the digest of their name (so
    that a file more or less changes no other's split). Dog beds and furniture are for all: train.
    """
    if asset.type == "DogBed" or not asset.spawnable:
        return "train"
    number = asset.asset_id.removeprefix(f"{asset.type}_")
    if asset.type in SHEETS and number.isdecimal():
        return _CYCLE[(int(number) - 1) % len(_CYCLE)]
    return _CYCLE[sha256(asset.asset_id.encode()).digest()[0] % len(_CYCLE)]
