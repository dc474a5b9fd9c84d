"""The catalogue: every asset a house or an episode may hold, as a pure function."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from internav_data.catalog.asset_types import FURNITURE, OBSTACLES
from internav_data.catalog.digest import digest_of
from internav_data.catalog.drawing import draw_type
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from internav_data.records import Asset

VERSION = 2
"""Version of the catalogue, raised with every change of an asset: datasets name it."""


@dataclass(frozen=True, slots=True, eq=False)
class Catalogue:
    """All assets of houses and episodes. Equal content has an equal digest."""

    version: int
    digest: str
    """sha256 of version and all assets."""
    assets: Mapping[str, Asset]
    """Assets by asset_id, sorted."""
    spawnable: tuple[Asset, ...]
    """Assets that episodes may spawn, a user's own among them, sorted by asset_id."""
    types: Mapping[str, tuple[Asset, ...]]
    """Assets by type, both sorted."""

    def of_type(self, type_: str) -> tuple[Asset, ...]:
        """Return all assets of a type, sorted by asset_id; () for an unknown one."""
        return self.types.get(type_, ())


@lru_cache(maxsize=1)
def generated_assets() -> tuple[Asset, ...]:
    """Draw the assets of all types in the table, the obstacles first."""
    obstacles = (asset for kind in OBSTACLES for asset in draw_type(kind, spawnable=True))
    furniture = (asset for kind in FURNITURE for asset in draw_type(kind, spawnable=False))
    return (*obstacles, *furniture)


@lru_cache(maxsize=4)
def catalogue(asset_dirs: tuple[Path, ...] = ()) -> Catalogue:
    """Return the catalogue, joined by the meshes of the user's own folders.

    Raises
    ------
    UsageError
        When a folder cannot be read as assets, or two folders hold the same asset_id.
    """
    assets = {asset.asset_id: asset for asset in generated_assets()}
    for directory in asset_dirs:
        from internav_data.catalog.user_assets import load_user_assets  # noqa: PLC0415 - trimesh

        for asset in load_user_assets(directory):
            if asset.asset_id in assets:
                raise UsageError(
                    f"{directory}: asset {asset.asset_id!r} exists already; rename its file or type"
                )
            assets[asset.asset_id] = asset
    ordered = {asset_id: assets[asset_id] for asset_id in sorted(assets)}
    types: dict[str, list[Asset]] = {}
    for asset in ordered.values():
        types.setdefault(asset.type, []).append(asset)
    return Catalogue(
        version=VERSION,
        digest=digest_of(VERSION, ordered.values()),
        assets=ordered,
        spawnable=tuple(asset for asset in ordered.values() if asset.spawnable),
        types={type_: tuple(types[type_]) for type_ in sorted(types)},
    )
