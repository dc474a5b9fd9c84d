"""Navigation of the agent's disc: lattice, Euclidean shortest paths, room paths, node paths."""

from internav_data.navigation.lattice import Lattice
from internav_data.navigation.rooms import PATHS_AT_MOST, node_paths, room_of, room_paths, rooms_of
from internav_data.navigation.tangent_graph.shortest_path import TangentGraph, keeps_clear
from internav_data.records.agent import CLEARANCE_M, RADIUS_M, SPACING_M, TOLERANCE_M

__all__ = [
    "CLEARANCE_M",
    "PATHS_AT_MOST",
    "RADIUS_M",
    "SPACING_M",
    "TOLERANCE_M",
    "Lattice",
    "TangentGraph",
    "keeps_clear",
    "node_paths",
    "room_of",
    "room_paths",
    "rooms_of",
]
