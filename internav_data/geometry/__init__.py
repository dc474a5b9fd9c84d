"""Poses, polyhedra, footprints and distances in the plane."""

from internav_data.core.extras import missing

try:  # nearly every room stands on this one
    from internav_data.geometry.footprints import (
        HIGHEST_M,
        LOWEST_M,
        Polygons,
        clearance,
        footprint,
        house_footprints,
        wall_footprints,
    )
    from internav_data.geometry.poses import (
        multiply,
        rotation_matrix,
        round_m,
        round_quaternion,
        transform,
        yaw_quaternion,
    )
    from internav_data.geometry.solids import asset_corners, centre_of_mass, part_corners
except ModuleNotFoundError as error:
    raise missing(error.name) from error

__all__ = [
    "HIGHEST_M",
    "LOWEST_M",
    "Polygons",
    "asset_corners",
    "centre_of_mass",
    "clearance",
    "footprint",
    "house_footprints",
    "multiply",
    "part_corners",
    "rotation_matrix",
    "round_m",
    "round_quaternion",
    "transform",
    "wall_footprints",
    "yaw_quaternion",
]
