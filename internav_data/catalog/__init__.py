"""Assets: obstacles and furniture, drawn from a table of types, and a user's own meshes."""

from internav_data.catalog.asset_types import ASSET_TYPES, FURNITURE, OBSTACLES, AssetType
from internav_data.catalog.collection import VERSION, Catalogue, catalogue
from internav_data.catalog.meshes import asset_mesh, part_triangles
from internav_data.catalog.splits import split_of_asset
from internav_data.catalog.user_assets import load_user_assets

__all__ = [
    "ASSET_TYPES",
    "FURNITURE",
    "OBSTACLES",
    "VERSION",
    "AssetType",
    "Catalogue",
    "asset_mesh",
    "catalogue",
    "load_user_assets",
    "part_triangles",
    "split_of_asset",
]
