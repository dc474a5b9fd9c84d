"""Digest of a catalogue: sha256 over every field of every asset, in a canonical form."""

from __future__ import annotations

import json
from hashlib import sha256
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from internav_data.records import Asset


def digest_of(version: int, assets: Iterable[Asset]) -> str:
    """Return the sha256 of assets in the given order, as hexadecimal digits.

    JSON without spaces; numbers are stored rounded, so that their shortest decimal form is exact.
    """
    rows = [
        (
            a.asset_id,
            a.type,
            a.size,
            a.mass_kg,
            a.friction,
            a.pushable,
            a.pickable,
            a.spawnable,
            a.blocks,
            [
                (p.shape, p.centre, p.size, p.rotation, p.corners, p.colour, p.material)
                for p in a.parts
            ],
        )
        for a in assets
    ]
    text = json.dumps([version, rows], separators=(",", ":"))
    return sha256(text.encode()).hexdigest()
