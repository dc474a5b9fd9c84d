"""What things are: the obstacles, the furniture, and a user's own meshes."""

from internav_data.catalog.collection import VERSION, Catalogue, catalogue
from internav_data.catalog.meshes import asset_mesh, part_triangles
from internav_data.catalog.sheet import FURNITURE, OBSTACLES, SHEETS, TypeSheet
from internav_data.catalog.splits import split_of_asset
from internav_data.catalog.user_assets import load_user_assets

__all__ = [
    "FURNITURE",
    "OBSTACLES",
    "SHEETS",
    "VERSION",
    "Catalogue",
    "TypeSheet",
    "asset_mesh",
    "catalogue",
    "load_user_assets",
    "part_triangles",
    "split_of_asset",
]
