"""Navigation of the agent's disc: lattice, Euclidean shortest paths, room paths, node paths."""

from internav_data.navigation.lattice import Lattice
from internav_data.navigation.rooms import PATHS_AT_MOST, node_paths, room_of, room_paths, rooms_of
from internav_data.navigation.tangent_graph.shortest_path import TangentGraph, keeps_clear
from internav_data.records.agent import CLEARANCE_M, SPACING_M

__all__ = [
    "CLEARANCE_M",
    "PATHS_AT_MOST",
    "SPACING_M",
    "Lattice",
    "TangentGraph",
    "keeps_clear",
    "node_paths",
    "room_of",
    "room_paths",
    "rooms_of",
]
